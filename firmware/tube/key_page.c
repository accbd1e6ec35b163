/* Keys of a tube in a page of flash, see key_page.h. */
#include "key_page.h"

#include <stddef.h>
#include <string.h>

#include "crc32.h"
#include "little_endian.h"

#define FORMAT 1u
#define JOINTS_AT 8u
#define KEYS_AT 40u
#define KEY_SIZE 16u

bool keys_open(struct key_ring *ring, const uint8_t *page, uint32_t size, uint8_t tube)
{
    uint32_t length;
    if (size < KEY_PAGE_HEAD || memcmp(page, "BCKY", 4u) != 0 || page[4] != FORMAT || page[5] != tube ||
        page[6] == 0u || page[6] > KEY_PAGE_GENERATIONS) {
        return false;
    }
    length = KEY_PAGE_HEAD + page[6] * KEY_PAGE_GENERATION;
    if (size < length + 4u || crc32_of(0u, page, length) != little_endian(&page[length], 4u)) {
        return false;
    }
    ring->page = page;
    ring->count = page[6];
    return true;
}

static const uint8_t *generation_at(const struct key_ring *ring, uint32_t k)
{
    return &ring->page[KEY_PAGE_HEAD + k * KEY_PAGE_GENERATION];
}

uint8_t keys_oldest(const struct key_ring *ring)
{
    return generation_at(ring, 0u)[0];
}

uint8_t keys_newest(const struct key_ring *ring)
{
    return generation_at(ring, ring->count - 1u)[0];
}

uint8_t keys_common(const struct key_ring *ring, uint8_t others_newest)
{
    uint32_t k = ring->count;
    while (k > 0u) {
        k--;
        if (generation_at(ring, k)[0] <= others_newest) {
            return generation_at(ring, k)[0];
        }
    }
    return keys_oldest(ring);
}

const uint8_t *keys_find(const struct key_ring *ring, uint8_t generation, enum key_purpose purpose, uint8_t other)
{
    uint32_t k;
    for (k = 0u; k < ring->count; k++) {
        const uint8_t *const at = generation_at(ring, k);
        if (at[0] != generation) {
            continue;
        }
        if (purpose != KEY_JOINT) {
            return &at[KEYS_AT + KEY_SIZE * (uint32_t)purpose];
        }
        return other < KEY_PAGE_ADDRESSES && ((uint32_t)at[JOINTS_AT + other / 8u] >> (other & 7u) & 1u) != 0u
                   ? &at[KEYS_AT + KEY_SIZE * ((uint32_t)KEY_JOINT + other)]
                   : NULL;
    }
    return NULL;
}
