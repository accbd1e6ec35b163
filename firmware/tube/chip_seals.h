/* All seals of a chip's node; one without keys believes everybody. */
#ifndef BORECHAIN_CHIP_SEALS_H
#define BORECHAIN_CHIP_SEALS_H

#include <stdbool.h>
#include <stdint.h>

#include "chip_end.h"
#include "end_seal.h"
#include "joint_seal.h"

struct chip_node;

struct chip_seals {
    struct seal_lots lots;
    struct seal_counts counts;
    struct joint_seal joints[2];
    struct end_seal end;
    int64_t too_old;        /* number of an order from which on down none of the session is obeyed */
    uint32_t answered;      /* orders of the session with the base */
};

/* False where there is a page and it has no keys of this tube. */
bool seals_begin(struct chip_node *node, const uint8_t *page, uint32_t size, uint32_t nonce);
bool seals_are_used(const struct chip_node *node);
/* Gives the ends what they call. */
void seals_join(struct chip_node *node, uint32_t side, struct chip_end_calls *calls);
/* Content of a payload without a look at its seal; a relay needs no more. */
const uint8_t *seals_content(const struct chip_node *node, const uint8_t *payload, uint32_t *length);
/* Whether a payload from the base for this tube is believed. */
bool seals_hear(struct chip_node *node, const uint8_t *payload, uint32_t length, bool is_offer);
bool seals_admit(struct chip_node *node, const struct measured *told, int64_t valid_us);
/* Whether an order is newer than all whose answers are forgotten. */
bool seals_obey(struct chip_node *node, int64_t order);
/* An order was answered, in the place of the answer to another one. */
void seals_answered(struct chip_node *node, int64_t forgotten);
/* Tells, once a minute, of what was refused. */
void seals_tell(struct chip_node *node);

#endif
