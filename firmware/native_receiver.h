/* Cyclic messages out of CAN frames: parts of one message are put together, and none waits for a header of the link.
 *
 * Signals say who sends, not in which boot or session; that comes with the link's header, by ISO-TP. What signals carry
 * may be lost and is never numbered, so they are heard from the first frame on.
 */
#ifndef BORECHAIN_NATIVE_RECEIVER_H
#define BORECHAIN_NATIVE_RECEIVER_H

#include "borechain_native.h"

#define NATIVE_KINDS 5u

enum native_answer {
    NATIVE_NOTHING = 0,             /* parts are missing; above 0 the type of the message that is whole */
    NATIVE_UNKNOWN_IDENTIFIER = -1, /* no message has this type, or this part */
    NATIVE_BAD_LENGTH = -2,
    NATIVE_OUT_OF_RANGE = -3        /* a member is outside the schema: `refused` is its number */
};

union native_message {
    struct borechain_native_aiding aiding;
    struct borechain_native_hello hello;
    struct borechain_native_time_request time_request;
    struct borechain_native_time_reply time_reply;
    struct borechain_native_node_state node_state;
};

/* Parts of one message on classic CAN. */
struct native_parts {
    uint8_t data[BORECHAIN_NATIVE_MOST_PARTS][8];
    uint8_t lengths[BORECHAIN_NATIVE_MOST_PARTS];
    uint16_t present; /* bit k: part k is there */
    uint8_t count;
};

/* One end of a joint; it begins as zeros. */
struct native_receiver {
    struct native_parts parts[NATIVE_KINDS];
    uint32_t number; /* frames of the link that the other end has sent, as far as it was heard */
    uint8_t source;
    int refused;
};

/* A frame of 29 bits and its data; the answer is a type of message, which lies in `heard`, or a `native_answer`. */
int native_hear(
    struct native_receiver *receiver,
    uint32_t identifier,
    const uint8_t *data,
    size_t length,
    union native_message *heard);

#endif
