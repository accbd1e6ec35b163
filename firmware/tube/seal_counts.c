/* What seals refused, and numbers of sessions, see seal_counts.h. */
#include "seal_counts.h"

#include <stddef.h>

#include "little_endian.h"
#include "seal.h"

#define TELL_EVERY_MS 60000u

uint64_t lots_draw(struct seal_lots *lots)
{
    uint8_t drawn[12], tag[SEAL_BLOCK];
    struct seal_key key;
    lots->drawn++;
    put_little_endian(&drawn[0], lots->boots, 4u);
    put_little_endian(&drawn[4], lots->nonce, 4u);
    put_little_endian(&drawn[8], lots->drawn, 4u);
    seal_set_key(&key, keys_find(&lots->ring, keys_newest(&lots->ring), KEY_END, 0u));
    seal_tag(&key, drawn, sizeof drawn, tag);
    return little_endian(tag, 8u);
}

const char *seal_counts_due(struct seal_counts *counts, uint32_t now_ms, uint32_t *refused)
{
    static const char *const names[SEAL_FAILURES] = {"unsealed", "wrong_tag", "wrong_joint", "repeated", "old_session",
        "end_unsealed", "end_wrong_tag", "end_old_session", "end_old_order", "measurement_unsealed",
        "measurement_wrong_tag", "measurement_repeated"};
    uint32_t k, most = SEAL_FAILURES;
    if (counts->is_told && now_ms - counts->told_at_ms < TELL_EVERY_MS) {
        return NULL;
    }
    for (k = 0u; k < SEAL_FAILURES; k++) {
        if (counts->count[k] > counts->told[k] && (most == SEAL_FAILURES || counts->count[k] > counts->count[most])) {
            most = k;
        }
    }
    if (most == SEAL_FAILURES) {
        return NULL;
    }
    counts->is_told = true;
    counts->told_at_ms = now_ms;
    *refused = 0u;
    for (k = 0u; k < SEAL_FAILURES; k++) {
        counts->told[k] = counts->count[k];
        *refused += counts->told[k];
    }
    return names[most];
}
