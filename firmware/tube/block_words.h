/* Payloads of parameter blocks: segments that come, the answer to them, events of a block. */
#ifndef BORECHAIN_BLOCK_WORDS_H
#define BORECHAIN_BLOCK_WORDS_H

#include "chip_block.h"
#include "chip_words.h"

enum block_phase { BLOCK_PARTIAL = 0, BLOCK_WAITING = 1, BLOCK_APPLIED = 2, BLOCK_REFUSED = 3, BLOCK_UNTRUSTED = 4 };

struct word_segment {
    int64_t upload;
    int64_t version;
    int64_t count;
    int64_t index;
    const uint8_t *digest;
    const uint8_t *data;
    const uint8_t *tag;
    uint32_t length; /* of the data */
};

/* A segment; false where something is missing or beyond its range. */
bool word_segment(const uint8_t *payload, uint32_t length, struct word_segment *segment);
uint32_t word_status(
    uint8_t tube,
    const struct block_answer *answer,
    uint32_t received,
    const struct block_kept *kept,
    uint8_t *room,
    uint32_t size);
/* That another block than that of a version is in use. */
uint32_t word_applied(
    const struct word_origin *origin,
    const struct block_kept *kept,
    uint32_t before,
    uint8_t *room,
    uint32_t size);
uint32_t word_refused(
    const struct word_origin *origin,
    int64_t version,
    const char *reason,
    uint32_t in_use,
    uint8_t *room,
    uint32_t size);
uint32_t word_untrusted(
    const struct word_origin *origin,
    int64_t version,
    const char *reason,
    uint32_t segments,
    uint8_t *room,
    uint32_t size);

#endif
