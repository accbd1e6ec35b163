/* One end of a joint on a chip: signals and ISO-TP in CAN frames, one frame with the controller at a time.
 *
 * The end is told of every frame, acknowledgement and time, and asked for the next frame. What must arrive goes by
 * the link, one payload a frame of ISO-TP; signals go as they are.
 */
#ifndef BORECHAIN_CHIP_END_H
#define BORECHAIN_CHIP_END_H

#include "hop_link.h"
#include "isotp.h"
#include "native_receiver.h"

#ifndef CHIP_END_ROOM
#define CHIP_END_ROOM 640u /* bytes of the largest frame of the link, each way */
#endif
#define CHIP_END_URGENT 232u /* an aiding as words */
#define CHIP_END_SIGNALS 64u
#define CHIP_END_WAITING 8u /* messages of signals that wait for the controller */
#define CHIP_END_NOTHING 255u

/* The seal of a joint: its frames have a head and a tag around those of the link. */
#define CHIP_END_SEAL_HEAD 25u
#define CHIP_END_WORD 384u /* bytes of a payload that may be lost */

struct chip_end_seal {
    /* length of the content, which begins behind the head; 0: it takes no effect */
    uint32_t (*open)(void *joint, const uint8_t *frame, uint32_t length, uint32_t now_ms);
    /* seals the content that lies behind the head; length of the frame */
    uint32_t (*close)(void *joint, uint8_t *room, uint32_t length, uint32_t size);
    /* what the seal itself has to say; 0 for nothing */
    uint32_t (*own_frame)(void *joint, uint8_t *room, uint32_t size, uint32_t now_ms);
    bool (*is_proven)(const void *joint);
};

/* Of a node, what the end calls. */
struct chip_end_calls {
    void *own;
    void (*on_payload)(void *own, const uint8_t *payload, uint32_t length);          /* by the link, once */
    void (*on_signals)(void *own, int type, const union native_message *heard);
    bool (*has_room)(void *own); /* for a payload; NULL: always. One for which there is none comes again */
    /* The next payload that may be lost and is no signal; NULL: there are none */
    uint32_t (*next_word)(void *own, uint8_t *room, uint32_t size);
    link_close close_payload;         /* of payloads, by the link; NULL: there is none */
    const struct chip_end_seal *seal; /* NULL: frames go as they are, and signals are believed */
    void *joint;                      /* of the seal */
};

/* Signals that wait: a newer message of the same topic takes their place. */
struct chip_end_signals {
    uint32_t identifier;
    uint8_t topic;
    uint8_t length; /* 0: free */
    uint8_t data[CHIP_END_SIGNALS];
};

struct chip_end {
    struct hop_link link;
    struct native_receiver native;
    struct isotp_sender sender;
    struct isotp_receiver receivers[2]; /* of urgent payloads, which are short, and of all others */
    struct chip_end_calls calls;
    uint8_t outgoing[CHIP_END_ROOM];
    uint8_t incoming[CHIP_END_ROOM];
    uint8_t urgent[CHIP_END_URGENT];
    struct chip_end_signals signals[CHIP_END_WAITING];
    uint32_t shown_at_ms;   /* the last sign of life */
    uint32_t told_at_ms;    /* the last header of the link */
    uint32_t begun_ms;
    uint32_t nonce;
    uint32_t wrong;         /* frames of no effect */
    uint8_t priorities[2];  /* of the payloads that come in */
    uint8_t address;
    uint8_t largest;
    bool is_in_flight;
};

void chip_end_begin(
    struct chip_end *end,
    const struct chip_end_calls *calls,
    uint8_t address,
    uint32_t boot_count,
    uint8_t largest,
    uint32_t nonce,
    uint32_t now_ms);
/* Signals to go, the most urgent first; they take the place of those that wait of the same identifier and topic, such as
 * the tube whose state they are. Where none is free they take that of the least urgent, or are dropped. */
void chip_end_say(
    struct chip_end *end,
    uint32_t identifier,
    uint8_t topic,
    const uint8_t *data,
    uint8_t length);
void chip_end_on_frame(struct chip_end *end, uint32_t identifier, const uint8_t *data, uint8_t length, uint32_t now_ms);
void chip_end_on_acknowledged(struct chip_end *end);
/* Length of the next frame, CHIP_END_NOTHING where none is due. */
uint8_t chip_end_next_frame(struct chip_end *end, uint32_t *identifier, uint8_t data[ISOTP_FD], uint32_t now_ms);

#endif
