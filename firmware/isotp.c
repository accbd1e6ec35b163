/* ISO-TP, see isotp.h. */
#include "isotp.h"

#include <string.h>

#define SINGLE 0u
#define FIRST 1u
#define CONSECUTIVE 2u
#define FLOW 3u
#define CONTINUE 0u
#define OVERFLOW 2u
#define SHORT_LIMIT 4095u /* longest payload whose length fits the short first frame */
#define PADDING 0xCCu

/* Whether a transfer has stood still for too long. A time a little before it moved last is none: a caller may have taken
 * it before the frame came. */
static bool is_late(uint32_t moved_at_ms, uint32_t now_ms)
{
    const uint32_t since = now_ms - moved_at_ms;
    return since > ISOTP_LIMIT_MS && since < UINT32_C(0x80000000);
}

uint8_t isotp_fd_length(uint8_t length)
{
    static const uint8_t lengths[] = {8u, 12u, 16u, 20u, 24u, 32u, 48u, 64u};
    unsigned k = 0u;
    if (length <= lengths[0]) {
        return length;
    }
    while (lengths[k] < length) {
        k++;
    }
    return lengths[k];
}

void isotp_begin(struct isotp_sender *sender, const uint8_t *payload, uint32_t length, uint8_t largest, uint32_t now_ms)
{
    sender->payload = payload;
    sender->length = length;
    sender->sent = 0u;
    sender->moved_at_ms = now_ms;
    sender->largest = largest;
    sender->sequence = 0u;
    sender->allowed = 1u;
    sender->is_unlimited = false;
    sender->is_open = true;
}

bool isotp_awaits_flow(const struct isotp_sender *sender)
{
    return sender->is_open && !sender->is_unlimited && sender->allowed == 0u;
}

/* Part of the payload behind a head of so many bytes. */
static uint8_t put_part(struct isotp_sender *sender, uint8_t *data, uint8_t head)
{
    const uint32_t left = sender->length - sender->sent;
    const uint32_t room = (uint32_t)sender->largest - head;
    const uint32_t part = left < room ? left : room;
    if (part > 0u) {
        memcpy(&data[head], &sender->payload[sender->sent], part);
    }
    sender->sent += part;
    return (uint8_t)(head + part);
}

static uint8_t put_first(struct isotp_sender *sender, uint8_t *data)
{
    const uint32_t length = sender->length;
    if (length < ISOTP_CLASSIC) {
        data[0] = (uint8_t)(SINGLE << 4 | length);
        return put_part(sender, data, 1u);
    }
    if (sender->largest > ISOTP_CLASSIC && length <= ISOTP_SINGLE_MOST) {
        data[0] = SINGLE << 4;
        data[1] = (uint8_t)length;
        return put_part(sender, data, 2u);
    }
    if (length <= SHORT_LIMIT) {
        data[0] = (uint8_t)(FIRST << 4 | length >> 8);
        data[1] = (uint8_t)(length & 0xFFu);
        return put_part(sender, data, 2u);
    }
    data[0] = FIRST << 4;
    data[1] = 0u;
    data[2] = (uint8_t)(length >> 24);
    data[3] = (uint8_t)(length >> 16 & 0xFFu);
    data[4] = (uint8_t)(length >> 8 & 0xFFu);
    data[5] = (uint8_t)(length & 0xFFu);
    return put_part(sender, data, 6u);
}

uint8_t isotp_next_frame(struct isotp_sender *sender, uint8_t data[ISOTP_FD], uint32_t now_ms)
{
    uint8_t filled;
    uint8_t length;
    if (!sender->is_open || isotp_awaits_flow(sender)) {
        return 0u;
    }
    if (sender->sent == 0u) {
        filled = put_first(sender, data);
    } else {
        sender->sequence = (sender->sequence + 1u) & 0x0Fu;
        data[0] = (uint8_t)(CONSECUTIVE << 4 | sender->sequence);
        filled = put_part(sender, data, 1u);
    }
    if (!sender->is_unlimited) {
        sender->allowed--;
    }
    sender->is_open = sender->sent < sender->length;
    sender->moved_at_ms = now_ms;
    length = sender->largest > ISOTP_CLASSIC ? isotp_fd_length(filled) : filled;
    memset(&data[filled], (int)PADDING, (size_t)length - filled);
    return length;
}

enum isotp_answer isotp_on_flow(struct isotp_sender *sender, const uint8_t *data, size_t length, uint32_t now_ms)
{
    unsigned status;
    if (!sender->is_open || length == 0u || data[0] >> 4 != FLOW) {
        return ISOTP_BAD_FLOW_CONTROL; /* of no payload under way, which goes on */
    }
    sender->moved_at_ms = now_ms;
    status = data[0] & 0x0Fu;
    if (length < ISOTP_FLOW_LENGTH || status > OVERFLOW) {
        sender->is_open = false;
        return ISOTP_BAD_FLOW_CONTROL;
    }
    if (status == OVERFLOW) {
        sender->is_open = false;
        return ISOTP_REFUSED;
    }
    if (status == CONTINUE && isotp_awaits_flow(sender)) {
        sender->allowed = data[1];
        sender->is_unlimited = data[1] == 0u;
    }
    return ISOTP_NOTHING;
}

enum isotp_answer isotp_advance_sender(struct isotp_sender *sender, uint32_t now_ms)
{
    if (!isotp_awaits_flow(sender) || !is_late(sender->moved_at_ms, now_ms)) {
        return ISOTP_NOTHING;
    }
    sender->is_open = false;
    return ISOTP_NO_FLOW_CONTROL;
}

bool isotp_listen(struct isotp_receiver *receiver, uint8_t *room, uint32_t limit)
{
    if (limit < ISOTP_SINGLE_MOST) {
        return false;
    }
    memset(receiver, 0, sizeof *receiver);
    receiver->room = room;
    receiver->limit = limit;
    return true;
}

static void ask(struct isotp_receiver *receiver, unsigned status, uint8_t block)
{
    receiver->flow[0] = (uint8_t)(FLOW << 4 | status);
    receiver->flow[1] = block;
    receiver->flow[2] = 0u;
    receiver->has_flow = true;
    receiver->until_flow = block;
}

static enum isotp_answer on_single(struct isotp_receiver *receiver, const uint8_t *data, size_t length)
{
    size_t begin = 1u;
    size_t own = data[0] & 0x0Fu;
    receiver->is_open = false;
    if (own == 0u && length > 1u) {
        own = data[1];
        begin = 2u;
    }
    if (own > length - begin) {
        return ISOTP_BAD_LENGTH;
    }
    if (own > 0u) {
        memcpy(receiver->room, &data[begin], own);
    }
    receiver->length = (uint32_t)own;
    return ISOTP_WHOLE;
}

static enum isotp_answer on_first(struct isotp_receiver *receiver, const uint8_t *data, size_t length)
{
    const bool was_open = receiver->is_open;
    size_t begin = 2u;
    uint32_t own;
    receiver->is_open = false;
    if (length < ISOTP_CLASSIC) {
        return ISOTP_BAD_LENGTH;
    }
    own = ((uint32_t)data[0] & 0x0Fu) << 8 | data[1];
    if (own == 0u) {
        own = (uint32_t)data[2] << 24 | (uint32_t)data[3] << 16 | (uint32_t)data[4] << 8 | data[5];
        begin = 6u;
    }
    if (own <= length - begin) {
        return ISOTP_BAD_LENGTH;
    }
    if (own > receiver->limit) {
        ask(receiver, OVERFLOW, 0u);
        return ISOTP_TOO_LONG;
    }
    memcpy(receiver->room, &data[begin], length - begin);
    receiver->length = own;
    receiver->taken = (uint32_t)(length - begin);
    receiver->sequence = 0u;
    receiver->is_open = true;
    ask(receiver, CONTINUE, ISOTP_BLOCK);
    return was_open ? ISOTP_INTERRUPTED : ISOTP_NOTHING;
}

static enum isotp_answer on_consecutive(struct isotp_receiver *receiver, const uint8_t *data, size_t length)
{
    uint32_t part;
    if (!receiver->is_open) {
        return ISOTP_UNEXPECTED;
    }
    receiver->sequence = (receiver->sequence + 1u) & 0x0Fu;
    receiver->is_open = false; /* unless all is well */
    if ((data[0] & 0x0Fu) != receiver->sequence) {
        return ISOTP_OUT_OF_ORDER;
    }
    if (length < 2u) {
        return ISOTP_BAD_LENGTH;
    }
    part = receiver->length - receiver->taken;
    if (part > length - 1u) {
        part = (uint32_t)(length - 1u);
    }
    memcpy(&receiver->room[receiver->taken], &data[1], part);
    receiver->taken += part;
    if (receiver->taken == receiver->length) {
        return ISOTP_WHOLE;
    }
    receiver->is_open = true;
    receiver->until_flow--;
    if (receiver->until_flow == 0u) {
        ask(receiver, CONTINUE, ISOTP_BLOCK);
    }
    return ISOTP_NOTHING;
}

enum isotp_answer isotp_on_frame(
    struct isotp_receiver *receiver,
    const uint8_t *data,
    size_t length,
    uint32_t now_ms)
{
    receiver->moved_at_ms = now_ms;
    if (length == 0u) {
        return ISOTP_BAD_LENGTH;
    }
    switch (data[0] >> 4) {
    case SINGLE:
        return on_single(receiver, data, length);
    case FIRST:
        return on_first(receiver, data, length);
    case CONSECUTIVE:
        return on_consecutive(receiver, data, length);
    default:
        return ISOTP_BAD_TYPE;
    }
}

enum isotp_answer isotp_advance_receiver(struct isotp_receiver *receiver, uint32_t now_ms)
{
    if (!receiver->is_open || !is_late(receiver->moved_at_ms, now_ms)) {
        return ISOTP_NOTHING;
    }
    receiver->is_open = false;
    receiver->has_flow = false;
    return ISOTP_INTERRUPTED;
}
