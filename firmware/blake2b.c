/* BLAKE2b of a payload in one piece, see blake2b.h. */
#include "blake2b.h"

#include <stdbool.h>
#include <string.h>

#define BLOCK 128u
#define ROUNDS 12u

static const uint64_t start[8] = {
    UINT64_C(0x6A09E667F3BCC908), UINT64_C(0xBB67AE8584CAA73B), UINT64_C(0x3C6EF372FE94F82B),
    UINT64_C(0xA54FF53A5F1D36F1), UINT64_C(0x510E527FADE682D1), UINT64_C(0x9B05688C2B3E6C1F),
    UINT64_C(0x1F83D9ABFB41BD6B), UINT64_C(0x5BE0CD19137E2179)};

static const uint8_t order[10][16] = {
    {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}, {14, 10, 4, 8, 9, 15, 13, 6, 1, 12, 0, 2, 11, 7, 5, 3},
    {11, 8, 12, 0, 5, 2, 15, 13, 10, 14, 3, 6, 7, 1, 9, 4}, {7, 9, 3, 1, 13, 12, 11, 14, 2, 6, 5, 10, 4, 0, 15, 8},
    {9, 0, 5, 7, 2, 4, 10, 15, 14, 1, 11, 12, 6, 8, 3, 13}, {2, 12, 6, 10, 0, 11, 8, 3, 4, 13, 7, 5, 15, 14, 1, 9},
    {12, 5, 1, 15, 14, 13, 4, 10, 0, 7, 6, 3, 9, 2, 8, 11}, {13, 11, 7, 14, 12, 1, 3, 9, 5, 0, 15, 4, 8, 6, 2, 10},
    {6, 15, 14, 9, 11, 3, 0, 8, 12, 2, 13, 7, 1, 4, 10, 5}, {10, 2, 8, 4, 7, 6, 1, 5, 15, 11, 9, 14, 3, 12, 13, 0}};

static uint64_t rotated(uint64_t word, uint32_t places)
{
    return word >> places | word << (64u - places);
}

static void mix(uint64_t *v, const uint8_t at[4], uint64_t x, uint64_t y)
{
    uint64_t *const a = &v[at[0]], *const b = &v[at[1]], *const c = &v[at[2]], *const d = &v[at[3]];
    *a += *b + x;
    *d = rotated(*d ^ *a, 32u);
    *c += *d;
    *b = rotated(*b ^ *c, 24u);
    *a += *b + y;
    *d = rotated(*d ^ *a, 16u);
    *c += *d;
    *b = rotated(*b ^ *c, 63u);
}

static void take_block(uint64_t state[8], const uint8_t block[BLOCK], uint64_t count, bool is_last)
{
    static const uint8_t places[8][4] = {{0, 4, 8, 12}, {1, 5, 9, 13}, {2, 6, 10, 14}, {3, 7, 11, 15},
                                         {0, 5, 10, 15}, {1, 6, 11, 12}, {2, 7, 8, 13}, {3, 4, 9, 14}};
    uint64_t v[16], words[16];
    uint32_t k, round;
    for (k = 0u; k < 16u; k++) {
        uint32_t byte;
        words[k] = 0u;
        for (byte = 8u; byte > 0u; byte--) {
            words[k] = words[k] << 8 | block[8u * k + byte - 1u];
        }
        v[k] = k < 8u ? state[k] : start[k - 8u];
    }
    v[12] ^= count;
    if (is_last) {
        v[14] = ~v[14];
    }
    for (round = 0u; round < ROUNDS; round++) {
        const uint8_t *const row = order[round % 10u];
        for (k = 0u; k < 8u; k++) {
            mix(v, places[k], words[row[2u * k]], words[row[2u * k + 1u]]);
        }
    }
    for (k = 0u; k < 8u; k++) {
        state[k] ^= v[k] ^ v[k + 8u];
    }
}

void blake2b_hash(const uint8_t *content, uint32_t length, uint8_t *hash, uint32_t size)
{
    uint64_t state[8];
    uint8_t last[BLOCK] = {0};
    uint32_t at = 0u, k;
    memcpy(state, start, sizeof state);
    state[0] ^= UINT64_C(0x01010000) ^ size;
    while (length - at > BLOCK) {
        take_block(state, &content[at], at + BLOCK, false);
        at += BLOCK;
    }
    memcpy(last, &content[at], length - at);
    take_block(state, last, length, true);
    for (k = 0u; k < size; k++) {
        hash[k] = (uint8_t)(state[k / 8u] >> (8u * (k % 8u)) & 0xFFu);
    }
}
