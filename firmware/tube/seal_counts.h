/* What seals refused, by reason, and the random numbers of their sessions. */
#ifndef BORECHAIN_SEAL_COUNTS_H
#define BORECHAIN_SEAL_COUNTS_H

#include <stdbool.h>
#include <stdint.h>

#include "key_page.h"

enum seal_reason {
    SEAL_UNSEALED = 0,
    SEAL_WRONG_TAG,
    SEAL_WRONG_JOINT,
    SEAL_REPEATED,
    SEAL_OLD_SESSION,
    SEAL_END_UNSEALED,
    SEAL_END_WRONG_TAG,
    SEAL_END_OLD_SESSION,
    SEAL_END_OLD_ORDER,
    SEAL_MEASUREMENT_UNSEALED,
    SEAL_MEASUREMENT_WRONG_TAG,
    SEAL_MEASUREMENT_REPEATED,
    SEAL_DUPLICATE, /* this and what follows happen whenever a joint is made up, and are not told */
    SEAL_LATE,
    SEAL_BEFORE_JOINED,
    SEAL_REASONS
};
#define SEAL_FAILURES 12u /* the reasons that are told */

/* Of one process; it begins as zeros. */
struct seal_counts {
    uint32_t count[SEAL_REASONS];
    uint32_t told[SEAL_FAILURES];
    uint32_t told_at_ms;
    bool is_told;
};

/* Numbers that nobody can foretell and that never come again: tags of how often a process started and drew. */
struct seal_lots {
    struct key_ring ring;
    uint32_t boots;
    uint32_t nonce; /* of the board; a flash that is worn does not count starts */
    uint32_t drawn;
};

uint64_t lots_draw(struct seal_lots *lots);
/* The reason to tell of, once a minute, and how often frames were refused in all; NULL where nothing is to be told. */
const char *seal_counts_due(struct seal_counts *counts, uint32_t now_ms, uint32_t *refused);

#endif
