/* What neighbours say to each other, as payloads: where no signal can say it, or a seal is around it.
 *
 * Of an aiding the encoder's measurement stays the very bits that came, for its seal is over them.
 */
#ifndef BORECHAIN_HOP_WORDS_H
#define BORECHAIN_HOP_WORDS_H

#include "borechain_native.h"
#include "chip_clock.h"
#include "end_seal.h"

#define HOP_AIDING 1
#define HOP_HELLO 2
#define HOP_TIME_REQUEST 3
#define HOP_TIME_REPLY 4
#define HOP_STATE 5

struct hop_aiding {
    struct measured told;
    int64_t systematic_var; /* rad^2, Q56 */
    int64_t torsion_var;    /* likewise */
    int64_t offset;         /* rad, Q40 */
    int64_t hops;
};

struct hop_hello {
    int64_t tube;
    int64_t boots;
    int64_t hops;
    int64_t mode;
};

/* A reply as it is said; `asked_at` has the bits of the request. */
struct hop_reply {
    uint64_t asked_at;
    int64_t received_us, replied_us, rig_us;
    int64_t rig_rate; /* steps of 1e-9 */
    int64_t rig_var;  /* s^2, Q56 */
    uint32_t epoch;
};

/* us of a float64 of seconds, to the nearest. */
int64_t us_of_bits(uint64_t bits);

/* Lengths of payloads, 0 where the room is too small. */
uint32_t word_hello(const struct hop_hello *hello, uint8_t *room, uint32_t size);
uint32_t word_time_request(int64_t asked_us, uint8_t *room, uint32_t size);
uint32_t word_time_reply(const struct hop_reply *reply, uint8_t *room, uint32_t size);
uint32_t word_aiding(const struct hop_aiding *aiding, uint8_t *room, uint32_t size);
/* A state in the steps of its signals, of an epoch that may be beyond them. */
uint32_t word_state(const struct borechain_native_node_state *state, uint32_t epoch, uint8_t *room, uint32_t size);

/* False for what is none, or lacks something. */
bool read_hello(const uint8_t *payload, uint32_t length, struct hop_hello *hello);
bool read_time_request(const uint8_t *payload, uint32_t length, uint64_t *asked_at);
bool read_time_reply(const uint8_t *payload, uint32_t length, struct clock_reply *reply);
bool read_aiding(const uint8_t *payload, uint32_t length, struct hop_aiding *aiding);

#endif
