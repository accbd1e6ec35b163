/* What a chip and its neighbours say by words instead of signals: all of it where joints are sealed, and what has an epoch
 * that no signal can say. It is made when the joint takes it, so that times are those of its leaving.
 */
#ifndef BORECHAIN_CHIP_SAID_H
#define BORECHAIN_CHIP_SAID_H

#include "hop_words.h"

#define SAID_HIGHEST_EPOCH 65535u /* of a signal */

struct chip_node;

/* What is due; it begins as zeros. */
struct chip_said {
    struct hop_aiding aiding; /* onward */
    uint64_t asked_at;        /* of the request that is to be answered */
    int64_t received_us;
    int64_t asked_us;         /* own request, of which a reply is awaited; 0: none */
    bool is_aiding_due;
    bool is_reply_due;
    bool is_request_due;
    bool is_state_due;
    bool is_hello_due[2];
};

/* Whether words are to stand for signals: under seals, or of this epoch. */
bool said_by_words(const struct chip_node *node, uint32_t epoch);
/* A payload from a neighbour, of a kind for one hop. */
void said_hear(struct chip_node *node, uint32_t side, int64_t kind, const uint8_t *payload, uint32_t length);
/* Time was asked for below, by a request with these bits. */
void said_asked(struct chip_node *node, uint64_t asked_at);
/* The next that is due at a side; its length, 0 where nothing is. */
uint32_t said_next(struct chip_node *node, uint32_t side, uint8_t *room, uint32_t size);

#endif
