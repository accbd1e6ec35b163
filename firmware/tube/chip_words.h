/* Payloads of a chip's surveys, events and replies, and what it reads of those from the base: envelope and orders. */
#ifndef BORECHAIN_CHIP_WORDS_H
#define BORECHAIN_CHIP_WORDS_H

#include <stdbool.h>
#include <stdint.h>

#include "borechain_step.h"

#define WORDS_RECEIPT 7
#define WORDS_COMMAND 8
#define WORDS_EVENT_NUMBERS 10u

/* Where, when and in which series something is said. */
struct word_origin {
    int64_t number;
    int64_t rig_at;     /* s, Q28 */
    uint32_t epoch;     /* 0: unknown */
    uint8_t tube;
};

/* A survey beside what the record has of it. */
struct word_survey {
    int64_t yaw_var;        /* rad^2, Q56 */
    int64_t systematic_var; /* likewise */
    int64_t settle_time;    /* s, Q28 */
    int64_t samples;
    uint32_t yaw;           /* binary angle */
    int32_t hops;
    uint16_t flags;
};

/* What came from the base. */
struct word_order {
    int64_t kind;
    int64_t target;
    int64_t number;
    const uint8_t *name;     /* of a command */
    const uint8_t *content;  /* of a receipt */
    const uint8_t *method;   /* arguments of a command, where there are any */
    int64_t turns;           /* Q24 */
    int64_t seconds;         /* Q28 */
    uint32_t name_length;
    uint32_t content_length;
    uint32_t method_length;
};

/* Lengths of payloads, 0 where the room is too small. */
uint32_t word_survey(
    const struct word_origin *origin,
    const struct word_survey *survey,
    const struct borechain_state *filter,
    uint8_t *room,
    uint32_t size);
/* An event of the step by its code and its numbers in Q24; what no table knows has length 0. */
uint32_t word_event(
    const struct word_origin *origin,
    int64_t code,
    const int64_t numbers[WORDS_EVENT_NUMBERS],
    uint8_t *room,
    uint32_t size);
bool word_event_is_error(int64_t code);
/* That the node started; `worth` (s, Q28) is of a saved yaw, negative where it started anew. */
uint32_t word_start(const struct word_origin *origin, uint32_t yaw, int64_t worth, uint8_t *room, uint32_t size);
uint32_t word_reply(
    uint8_t tube,
    int64_t order,
    bool is_done,
    const char *detail,
    uint8_t *room,
    uint32_t size);
/* Kind and addressee of a payload, which all that relay it need; false for what is none. */
bool word_open(const uint8_t *payload, uint32_t length, int64_t *kind, int64_t *target);
/* An order or a receipt; false where something is missing. */
bool word_read(const uint8_t *payload, uint32_t length, struct word_order *order);

#endif
