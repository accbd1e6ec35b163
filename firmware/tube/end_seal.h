/* Seals between a tube and the base, and of the encoder's measurement, as Python has them
 * (telemetry/application/end_seal.py and measurement_seal.py).
 */
#ifndef BORECHAIN_END_SEAL_H
#define BORECHAIN_END_SEAL_H

#include "seal.h"
#include "seal_counts.h"

#define END_OVERHEAD (19u + SEAL_TAG_SIZE) /* mark, generation, newest, sessions of tube and base; the tag */
#define MEASUREMENT_SEAL (1u + SEAL_TAG_SIZE)

struct end_seal {
    struct seal_lots *lots;
    struct seal_counts *counts;
    uint64_t session;      /* of the tube */
    uint64_t base;         /* of the base; 0: it is not known */
    uint64_t before;       /* of the tube, until the newest offer */
    uint32_t began_ms;
    uint8_t tube;
    uint8_t bases_newest;
    bool knows_base;       /* its newest generation */
    bool has_before;
    uint32_t epoch;        /* of the newest measurement that was believed, and its number */
    uint64_t measurement;
    bool has_measurement;
};

/* An encoder's measurement as its message has it: the bits of float64 numbers, and the seal. */
struct measured {
    uint64_t yaw, yaw_var, rate, valid_at, sequence, torque;
    uint32_t epoch;
    bool is_under_torque;
    uint8_t seal[MEASUREMENT_SEAL];
    uint8_t seal_length;
};

void end_begin(struct end_seal *end, uint8_t tube, struct seal_lots *lots, struct seal_counts *counts);
/* Whether a payload has the form of a sealed one. */
bool end_is_sealed(const uint8_t *payload, uint32_t length);
/* Head of a payload for the base; its length, 0 where there is no key. */
uint32_t end_close(const struct end_seal *end, const uint8_t *content, uint32_t length, uint8_t head[END_OVERHEAD]);
/* Whether a payload from the base is believed; an offer begins a session. */
bool end_open(struct end_seal *end, const uint8_t *payload, uint32_t length, bool is_offer, uint32_t now_ms);
/* Whether a measurement is believed at a rig time (us) of an epoch; `valid_us` is its own. */
bool end_admits(struct end_seal *end, const struct measured *told, int64_t valid_us, uint32_t epoch, int64_t rig_us);

#endif
