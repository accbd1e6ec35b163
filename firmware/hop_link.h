/* One joint's link: frames in, payloads out, acknowledgement and repetition, as a pure state machine.
 *
 * A frame is CRC-32, little-endian, then msgpack [1, sender, epoch, number, epoch of the peer, acknowledged, mask,
 * entries]; an entry is [number, payload], 0 for what may be lost. The epoch names the sender, its boot and its session.
 * Times are of a counter of milliseconds that may run over.
 */
#ifndef BORECHAIN_HOP_LINK_H
#define BORECHAIN_HOP_LINK_H

#include <stdbool.h>
#include <stdint.h>

#define LINK_LARGEST 49152u /* bytes of a frame */
#define LINK_SLOTS 8u       /* payloads that wait for their acknowledgement */
#define LINK_WINDOW 64u
#define LINK_SILENCE_MS 3500u /* after which the other end is taken for gone */

struct link_header {
    uint64_t sender;
    uint64_t epoch;
    uint64_t number;
    uint64_t peer_epoch;
    uint64_t acknowledged;
    uint64_t mask; /* bit k: acknowledged + 1 + k has come too */
};

#define LINK_HEAD 27u /* bytes of a payload's own head */

struct link_entry {
    uint64_t number;
    const uint8_t *payload;
    uint32_t length;
    uint32_t head_length; /* what is written before the payload and belongs to it: a seal */
    uint8_t head[LINK_HEAD];
};

/* Head of a payload as it leaves; its length, 0 for none. */
typedef uint32_t (*link_close)(void *own, const uint8_t *payload, uint32_t length, uint8_t head[LINK_HEAD]);

/* Where the next entry of a frame begins, and how many are left. */
struct link_entries {
    const uint8_t *at;
    uint32_t left;  /* bytes */
    uint32_t count; /* entries */
};

struct link_slot {
    const uint8_t *payload; /* the caller's, until it is acknowledged */
    uint32_t length;
    uint32_t send_at_ms;
    uint32_t timeout_ms;
    uint64_t number; /* 0: not sent yet */
};

struct hop_link {
    uint64_t epoch;
    uint64_t peer_epoch;
    uint64_t peer_sender;
    uint64_t received; /* every number up to this one */
    uint64_t received_mask;
    uint64_t frames;
    uint64_t next_number;
    uint32_t boot_count;
    uint32_t last_heard_ms;
    uint32_t ack_due_ms;
    uint32_t count; /* of slots in use, the oldest first */
    uint16_t session;
    uint8_t address;
    bool has_peer;
    bool was_heard;
    bool is_ack_due;
    struct link_slot slots[LINK_SLOTS];
    link_close close; /* NULL: payloads leave as they are */
    void *close_own;
};

enum link_answer {
    LINK_TAKEN = 0,
    LINK_NO_FRAME = -1,   /* garbage, or cut */
    LINK_OLD_SESSION = -2 /* a late frame of a session that the peer has ended */
};

/* What came for the first time. Without it a frame acknowledges what was sent, and what it brings is to come again. */
typedef void (*link_deliver)(void *own, const struct link_entry *entry);

/* False for anything but a frame; else its header, and the entries for link_next_entry. */
bool link_parse(const uint8_t *frame, uint32_t length, struct link_header *header, struct link_entries *entries);
bool link_next_entry(struct link_entries *entries, struct link_entry *entry);
/* Bytes of a frame, 0 where the room is too small. */
uint32_t link_pack(
    const struct link_header *header,
    const struct link_entry *entries,
    uint32_t count,
    uint8_t *room,
    uint32_t size);

void link_begin(struct hop_link *link, uint8_t address, uint32_t boot_count);
bool link_is_up(const struct hop_link *link, uint32_t now_ms);
/* Signals were heard, which have no header. */
void link_hear_signals(struct hop_link *link, uint32_t now_ms);
/* A payload that must arrive; false where no slot is free. One that waits already is not taken again. */
bool link_send(struct hop_link *link, const uint8_t *payload, uint32_t length);
/* Whether a payload still waits: its bytes must stay. */
bool link_holds(const struct hop_link *link, const uint8_t *payload);
enum link_answer link_receive(
    struct hop_link *link,
    const uint8_t *frame,
    uint32_t length,
    uint32_t now_ms,
    link_deliver deliver,
    void *own);

/* The next frame that is due, its bytes; 0 where there is none. In this order: what must arrive, what may be lost, and
 * the acknowledgement alone where neither took it along. */
uint32_t link_next_numbered(struct hop_link *link, uint32_t now_ms, uint8_t *room, uint32_t size);
uint32_t link_best_effort(struct hop_link *link, const uint8_t *payload, uint32_t length, uint8_t *room, uint32_t size);
uint32_t link_acknowledgement(struct hop_link *link, uint32_t now_ms, uint8_t *room, uint32_t size);
/* The header alone: signals have none, and the other end numbers nothing for one that it does not know. */
uint32_t link_tell(struct hop_link *link, uint8_t *room, uint32_t size);

#endif
