/* Seals between a tube and the base, and of measurements, see end_seal.h. */
#include "end_seal.h"

#include <stddef.h>
#include <string.h>

#include "little_endian.h"

#define MARK 0xC1u /* never begins a msgpack value */
#define HEAD 19u
#define LATE_WITHIN_MS 10000u
#define OLDEST_US 5000000 /* after which a measurement counts as a recording */
#define FIELDS 53u        /* bytes of a measurement */

void end_begin(struct end_seal *end, uint8_t tube, struct seal_lots *lots, struct seal_counts *counts)
{
    memset(end, 0, sizeof *end);
    end->tube = tube;
    end->lots = lots;
    end->counts = counts;
    end->session = lots_draw(lots);
}

bool end_is_sealed(const uint8_t *payload, uint32_t length)
{
    return length > END_OVERHEAD && payload[0] == MARK;
}

/* Tag of the way, the tube's number, the head and the content. */
static void tag_of(
    const struct end_seal *end,
    const uint8_t *secret,
    const char *way,
    const uint8_t *head,
    const uint8_t *content,
    uint32_t length,
    uint8_t tag[SEAL_BLOCK])
{
    struct seal_key key;
    struct seal_run run;
    memset(&run, 0, sizeof run);
    seal_set_key(&key, secret);
    seal_add(&key, &run, (const uint8_t *)way, strlen(way));
    seal_add(&key, &run, &end->tube, 1u);
    seal_add(&key, &run, head, HEAD);
    seal_add(&key, &run, content, length);
    seal_end(&key, &run, tag);
}

uint32_t end_close(const struct end_seal *end, const uint8_t *content, uint32_t length, uint8_t head[END_OVERHEAD])
{
    const struct key_ring *const ring = &end->lots->ring;
    const uint8_t generation = end->knows_base ? keys_common(ring, end->bases_newest) : keys_oldest(ring);
    const uint8_t *const secret = keys_find(ring, generation, KEY_END, 0u);
    uint8_t tag[SEAL_BLOCK];
    if (secret == NULL) {
        return 0u;
    }
    head[0] = MARK;
    head[1] = generation;
    head[2] = keys_newest(ring);
    put_little_endian(&head[3], end->session, 8u);
    put_little_endian(&head[11], end->base, 8u);
    tag_of(end, secret, "up", head, content, length, tag);
    memcpy(&head[HEAD], tag, SEAL_TAG_SIZE);
    return END_OVERHEAD;
}

bool end_open(struct end_seal *end, const uint8_t *payload, uint32_t length, bool is_offer, uint32_t now_ms)
{
    const uint8_t *secret;
    uint8_t tag[SEAL_BLOCK];
    uint64_t of_tube, of_base;
    if (!end_is_sealed(payload, length)) {
        end->counts->count[SEAL_END_UNSEALED]++;
        return false;
    }
    secret = keys_find(&end->lots->ring, payload[1], KEY_END, 0u);
    if (secret != NULL) {
        tag_of(end, secret, "down", payload, &payload[END_OVERHEAD], length - END_OVERHEAD, tag);
    }
    if (secret == NULL || !seal_is_same(tag, &payload[HEAD])) {
        end->counts->count[SEAL_END_WRONG_TAG]++;
        return false;
    }
    of_tube = little_endian(&payload[3], 8u);
    of_base = little_endian(&payload[11], 8u);
    if (of_tube != end->session || (of_base != end->base) != is_offer) {
        const bool is_late = end->has_before && of_tube == end->before && now_ms - end->began_ms < LATE_WITHIN_MS;
        end->counts->count[is_late ? SEAL_LATE : SEAL_END_OLD_SESSION]++;
        return false;
    }
    end->knows_base = true;
    end->bases_newest = payload[2];
    if (is_offer) {
        end->has_before = true;
        end->before = end->session;
        end->began_ms = now_ms;
        end->session = lots_draw(end->lots);
        end->base = of_base;
    }
    return true;
}

static void measurement_tag(const uint8_t *secret, const struct measured *told, uint8_t tag[SEAL_BLOCK])
{
    const uint64_t numbers[] = {told->yaw, told->yaw_var, told->rate, told->valid_at, told->sequence, told->torque};
    uint8_t said[1u + FIELDS];
    struct seal_key key;
    uint32_t k;
    said[0] = told->seal[0];
    for (k = 0u; k < 6u; k++) {
        put_little_endian(&said[1u + 8u * k], numbers[k], 8u);
    }
    said[49] = told->is_under_torque ? 1u : 0u;
    put_little_endian(&said[50], told->epoch, 4u);
    seal_set_key(&key, secret);
    seal_tag(&key, said, sizeof said, tag);
}

bool end_admits(struct end_seal *end, const struct measured *told, int64_t valid_us, uint32_t epoch, int64_t rig_us)
{
    const uint8_t *secret;
    uint8_t tag[SEAL_BLOCK];
    if (told->seal_length != MEASUREMENT_SEAL) {
        end->counts->count[SEAL_MEASUREMENT_UNSEALED]++;
        return false;
    }
    secret = keys_find(&end->lots->ring, told->seal[0], KEY_MEASUREMENT, 0u);
    if (secret != NULL) {
        measurement_tag(secret, told, tag);
    }
    if (secret == NULL || !seal_is_same(tag, &told->seal[1])) {
        end->counts->count[SEAL_MEASUREMENT_WRONG_TAG]++;
        return false;
    }
    if (told->epoch != epoch) {
        return true; /* the node drops it */
    }
    if ((end->has_measurement && told->epoch == end->epoch && told->sequence < end->measurement) ||
        valid_us < rig_us - OLDEST_US) {
        end->counts->count[SEAL_MEASUREMENT_REPEATED]++;
        return false;
    }
    end->has_measurement = true;
    end->epoch = told->epoch;
    end->measurement = told->sequence;
    return true;
}
