/* Cyclic messages out of CAN frames, see native_receiver.h. */
#include "native_receiver.h"

#include <stdbool.h>
#include <string.h>

#define HALF 128u

static unsigned parts_of(unsigned type)
{
    switch (type) {
    case BORECHAIN_NATIVE_AIDING_TYPE:
        return BORECHAIN_NATIVE_AIDING_PARTS;
    case BORECHAIN_NATIVE_HELLO_TYPE:
        return BORECHAIN_NATIVE_HELLO_PARTS;
    case BORECHAIN_NATIVE_TIME_REQUEST_TYPE:
        return BORECHAIN_NATIVE_TIME_REQUEST_PARTS;
    case BORECHAIN_NATIVE_TIME_REPLY_TYPE:
        return BORECHAIN_NATIVE_TIME_REPLY_PARTS;
    case BORECHAIN_NATIVE_NODE_STATE_TYPE:
        return BORECHAIN_NATIVE_NODE_STATE_PARTS;
    default:
        return 0u;
    }
}

/* Takes a part; true once all are there. Those of another count are forgotten. */
static bool collect(struct native_parts *parts, unsigned part, unsigned needed, const uint8_t *data, size_t length)
{
    if (parts->present != 0u && parts->count != data[0]) {
        parts->present = 0u;
    }
    parts->count = data[0];
    parts->lengths[part] = (uint8_t)(length < 255u ? length : 255u);
    memcpy(parts->data[part], data, length < 8u ? length : 8u);
    parts->present = (uint16_t)(parts->present | 1u << part);
    if (parts->present != (1u << needed) - 1u) {
        return false;
    }
    parts->present = 0u;
    return true;
}

static int unpack_whole(unsigned type, const uint8_t *data, size_t length, union native_message *heard)
{
    switch (type) {
    case BORECHAIN_NATIVE_AIDING_TYPE:
        return borechain_native_unpack_aiding(data, length, &heard->aiding);
    case BORECHAIN_NATIVE_HELLO_TYPE:
        return borechain_native_unpack_hello(data, length, &heard->hello);
    case BORECHAIN_NATIVE_TIME_REQUEST_TYPE:
        return borechain_native_unpack_time_request(data, length, &heard->time_request);
    case BORECHAIN_NATIVE_TIME_REPLY_TYPE:
        return borechain_native_unpack_time_reply(data, length, &heard->time_reply);
    default:
        return borechain_native_unpack_node_state(data, length, &heard->node_state);
    }
}

static int unpack_parts(unsigned type, struct native_parts *parts, union native_message *heard)
{
    switch (type) {
    case BORECHAIN_NATIVE_AIDING_TYPE:
        return borechain_native_unpack_aiding_classic(parts->data, parts->lengths, &heard->aiding);
    case BORECHAIN_NATIVE_HELLO_TYPE:
        return borechain_native_unpack_hello_classic(parts->data, parts->lengths, &heard->hello);
    case BORECHAIN_NATIVE_TIME_REQUEST_TYPE:
        return borechain_native_unpack_time_request_classic(parts->data, parts->lengths, &heard->time_request);
    case BORECHAIN_NATIVE_TIME_REPLY_TYPE:
        return borechain_native_unpack_time_reply_classic(parts->data, parts->lengths, &heard->time_reply);
    default:
        return borechain_native_unpack_node_state_classic(parts->data, parts->lengths, &heard->node_state);
    }
}

/* The frame's number of its count: urgent frames come before older ones. */
static void follow_number(struct native_receiver *receiver, uint8_t source, uint8_t count)
{
    uint32_t number;
    if (source != receiver->source) {
        receiver->source = source;
        receiver->number = 0u;
    }
    number = receiver->number + ((count - receiver->number + HALF) & 0xFFu);
    if (number > receiver->number + HALF) {
        receiver->number = number - HALF;
    }
}

int native_hear(
    struct native_receiver *receiver,
    uint32_t identifier,
    const uint8_t *data,
    size_t length,
    union native_message *heard)
{
    const unsigned type = identifier >> 21 & 0x1Fu;
    const unsigned part = identifier & 0x1Fu;
    const unsigned needed = parts_of(type);
    const bool is_whole = part == BORECHAIN_NATIVE_FD_PART;
    int answer;
    if (needed == 0u) {
        return NATIVE_UNKNOWN_IDENTIFIER;
    }
    if (length == 0u) {
        return NATIVE_BAD_LENGTH;
    }
    if (!is_whole && part >= needed) {
        return NATIVE_UNKNOWN_IDENTIFIER;
    }
    if (is_whole) {
        answer = unpack_whole(type, data, length, heard);
    } else if (collect(&receiver->parts[type - 1u], part, needed, data, length)) {
        answer = unpack_parts(type, &receiver->parts[type - 1u], heard);
    } else {
        return NATIVE_NOTHING;
    }
    if (answer == BORECHAIN_NATIVE_BAD_LENGTH) {
        return NATIVE_BAD_LENGTH;
    }
    if (answer != BORECHAIN_NATIVE_TAKEN) {
        receiver->refused = answer;
        return NATIVE_OUT_OF_RANGE;
    }
    follow_number(receiver, (uint8_t)(identifier >> 13 & 0xFFu), data[0]);
    return (int)type;
}
