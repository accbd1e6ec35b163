/* A node's parameter block on a chip: its segments are gathered, checked, tried at rest, taken and kept.
 *
 * What a block changes is saved with it, in one piece: a start has either the block before and what was learnt under it,
 * or the new one and nothing.
 */
#ifndef BORECHAIN_CHIP_BLOCK_H
#define BORECHAIN_CHIP_BLOCK_H

#include <stdbool.h>
#include <stdint.h>

#include "sha256.h"

#define BLOCK_SIZE 796u         /* bytes of a block: head of 12, 49 float64 of each sensor */
#define BLOCK_PART 192u
#define BLOCK_PARTS 5u           /* segments of a block */
#define BLOCK_KEY_SIZE 32u
#define BLOCK_STATUS_ROOM 224u

struct chip_node;

/* Kept over a power cut, with the corrections that the block in use is. */
struct block_kept {
    uint8_t in_use[SHA256_SIZE]; /* hash of the block in use */
    uint8_t digest[SHA256_SIZE]; /* of the one that comes */
    uint32_t version;            /* of the block in use; 0: the identity */
    uint32_t coming;             /* version of the one that comes; 0: none does */
    uint32_t received;           /* bit k: segment k has come */
    uint8_t bytes[BLOCK_SIZE];
};

/* Answer to a segment: of which upload, and how far that has come. */
struct block_answer {
    int64_t upload;
    const char *detail;
    uint8_t digest[SHA256_SIZE];
    uint8_t phase;
    bool is_due;
};

struct block_update {
    struct block_answer answer;
    const char *reason;          /* why the last was refused; NULL: none was */
    int64_t upload;              /* of the newest segment that was believed */
    int64_t refused_upload;
    uint8_t refused[SHA256_SIZE];
    uint32_t untrusted;          /* segments */
    uint32_t untrusted_at_ms;
    uint8_t agreed;              /* cycles in a row that a block fits */
    uint8_t differed;
    bool is_checked;             /* the block is whole, and waits for a rest */
    bool is_untrusted_told;
    uint8_t room[BLOCK_STATUS_ROOM]; /* the answer under way */
};

/* The identity that a node has before any block. */
void block_begin(struct chip_node *node);
/* A segment for this node, as a payload. */
void block_on_segment(struct chip_node *node, const uint8_t *payload, uint32_t length);
/* A cycle has ended: a block that waits is tried on its raw reading. */
void block_on_cycle(struct chip_node *node);
/* What is checked and answered without either. */
void block_advance(struct chip_node *node);

#endif
