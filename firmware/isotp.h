/* ISO-TP (ISO 15765-2): payloads in CAN frames of 8 or 64 bytes, as pure state machines without a heap.
 *
 * A sender hands out one frame at a time, so that its caller can let an urgent frame go between two of a long payload.
 * Normal addressing: the identifier says whose transfer it is. One departure: a single frame may be empty.
 * Times are of a counter of milliseconds that may run over.
 */
#ifndef BORECHAIN_ISOTP_H
#define BORECHAIN_ISOTP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define ISOTP_CLASSIC 8u       /* bytes of data in a frame of classic CAN */
#define ISOTP_FD 64u           /* and in one of CAN FD */
#define ISOTP_SINGLE_MOST 62u  /* longest payload of a single frame; a receiver has room for it at least */
#define ISOTP_BLOCK 32u        /* frames that a receiver takes before it is asked again */
#define ISOTP_LIMIT_MS 1000u   /* that a receiver may take to answer, and a sender between two frames (N_Bs, N_Cr) */
#define ISOTP_FLOW_LENGTH 3u

/* What came of a call; below zero something failed, and the caller counts it. */
enum isotp_answer {
    ISOTP_NOTHING = 0,
    ISOTP_WHOLE = 1,              /* a payload is complete */
    ISOTP_BAD_LENGTH = -1,        /* the frame is too short for what it says */
    ISOTP_BAD_TYPE = -2,          /* the frame is none of a sender's */
    ISOTP_UNEXPECTED = -3,        /* it belongs to no payload that has begun */
    ISOTP_OUT_OF_ORDER = -4,      /* a frame before it is missing; the payload is given up */
    ISOTP_TOO_LONG = -5,          /* there is no room for the payload; its sender is told */
    ISOTP_INTERRUPTED = -6,       /* the payload before was not completed */
    ISOTP_BAD_FLOW_CONTROL = -7,  /* the receiver's answer is none; the payload is given up */
    ISOTP_REFUSED = -8,           /* the receiver has no room; the payload is given up */
    ISOTP_NO_FLOW_CONTROL = -9    /* the receiver did not answer in time; the payload is given up */
};

/* One payload on its way out; the bytes stay the caller's until it is done. */
struct isotp_sender {
    const uint8_t *payload;
    uint32_t length;
    uint32_t sent;
    uint32_t moved_at_ms;
    uint8_t largest;  /* ISOTP_CLASSIC or ISOTP_FD */
    uint8_t sequence;
    uint8_t allowed;  /* frames until the receiver is waited for */
    bool is_unlimited;
    bool is_open;
};

/* One payload on its way in, of one sender, into room of the caller's. */
struct isotp_receiver {
    uint8_t *room;
    uint32_t limit;   /* bytes of it, ISOTP_SINGLE_MOST at least */
    uint32_t length;  /* of the payload that has begun, or of the one that is whole */
    uint32_t taken;
    uint32_t moved_at_ms;
    uint8_t sequence;
    uint8_t until_flow;
    bool is_open;
    bool has_flow;    /* `flow` is to be sent; the caller takes it away */
    uint8_t flow[ISOTP_FLOW_LENGTH];
};

void isotp_begin(struct isotp_sender *sender, const uint8_t *payload, uint32_t length, uint8_t largest, uint32_t now_ms);
bool isotp_awaits_flow(const struct isotp_sender *sender);
/* Data of the next frame; its length, 0 while the sender awaits flow control or has nothing more to send. */
uint8_t isotp_next_frame(struct isotp_sender *sender, uint8_t data[ISOTP_FD], uint32_t now_ms);
enum isotp_answer isotp_on_flow(struct isotp_sender *sender, const uint8_t *data, size_t length, uint32_t now_ms);
enum isotp_answer isotp_advance_sender(struct isotp_sender *sender, uint32_t now_ms);

/* False, and nothing is done, where the room is too small. */
bool isotp_listen(struct isotp_receiver *receiver, uint8_t *room, uint32_t limit);
/* ISOTP_WHOLE: the first `length` bytes of the room are a payload, until the next frame comes. */
enum isotp_answer isotp_on_frame(
    struct isotp_receiver *receiver,
    const uint8_t *data,
    size_t length,
    uint32_t now_ms);
enum isotp_answer isotp_advance_receiver(struct isotp_receiver *receiver, uint32_t now_ms);

/* The next length that a frame of CAN FD has. */
uint8_t isotp_fd_length(uint8_t length);

#endif
