/* SHA-256 and HMAC, see sha256.h. */
#include "sha256.h"

#include <string.h>

#define ROUNDS 64u
#define LENGTH_AT 56u /* of a block, where the number of bits stands in the last one */
#define INNER 0x36u
#define OUTER 0x5Cu

static const uint32_t round_constants[ROUNDS] = {
    0x428A2F98u, 0x71374491u, 0xB5C0FBCFu, 0xE9B5DBA5u, 0x3956C25Bu, 0x59F111F1u, 0x923F82A4u, 0xAB1C5ED5u,
    0xD807AA98u, 0x12835B01u, 0x243185BEu, 0x550C7DC3u, 0x72BE5D74u, 0x80DEB1FEu, 0x9BDC06A7u, 0xC19BF174u,
    0xE49B69C1u, 0xEFBE4786u, 0x0FC19DC6u, 0x240CA1CCu, 0x2DE92C6Fu, 0x4A7484AAu, 0x5CB0A9DCu, 0x76F988DAu,
    0x983E5152u, 0xA831C66Du, 0xB00327C8u, 0xBF597FC7u, 0xC6E00BF3u, 0xD5A79147u, 0x06CA6351u, 0x14292967u,
    0x27B70A85u, 0x2E1B2138u, 0x4D2C6DFCu, 0x53380D13u, 0x650A7354u, 0x766A0ABBu, 0x81C2C92Eu, 0x92722C85u,
    0xA2BFE8A1u, 0xA81A664Bu, 0xC24B8B70u, 0xC76C51A3u, 0xD192E819u, 0xD6990624u, 0xF40E3585u, 0x106AA070u,
    0x19A4C116u, 0x1E376C08u, 0x2748774Cu, 0x34B0BCB5u, 0x391C0CB3u, 0x4ED8AA4Au, 0x5B9CCA4Fu, 0x682E6FF3u,
    0x748F82EEu, 0x78A5636Fu, 0x84C87814u, 0x8CC70208u, 0x90BEFFFAu, 0xA4506CEBu, 0xBEF9A3F7u, 0xC67178F2u};

static uint32_t rotated(uint32_t word, uint32_t places)
{
    return word >> places | word << (32u - places);
}

static uint32_t word_at(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | (uint32_t)bytes[3];
}

static void put_word(uint8_t *bytes, uint32_t word)
{
    bytes[0] = (uint8_t)(word >> 24);
    bytes[1] = (uint8_t)(word >> 16 & 0xFFu);
    bytes[2] = (uint8_t)(word >> 8 & 0xFFu);
    bytes[3] = (uint8_t)(word & 0xFFu);
}

/* The word of the schedule that is due: the first 16 are the block's, each later one takes the place of the 16th before. */
static uint32_t scheduled(uint32_t schedule[16], uint32_t round)
{
    const uint32_t early = schedule[(round + 1u) & 15u], late = schedule[(round + 14u) & 15u];
    uint32_t *const word = &schedule[round & 15u];
    if (round >= 16u) {
        *word += (rotated(early, 7u) ^ rotated(early, 18u) ^ early >> 3) + schedule[(round + 9u) & 15u] +
                 (rotated(late, 17u) ^ rotated(late, 19u) ^ late >> 10);
    }
    return *word;
}

static void take_block(uint32_t state[8], const uint8_t block[SHA256_BLOCK])
{
    uint32_t schedule[16], v[8], round, k;
    for (k = 0u; k < 16u; k++) {
        schedule[k] = word_at(&block[4u * k]);
    }
    memcpy(v, state, sizeof v);
    for (round = 0u; round < ROUNDS; round++) {
        const uint32_t chosen = (v[4] & v[5]) ^ (~v[4] & v[6]);
        const uint32_t majority = (v[0] & v[1]) ^ (v[0] & v[2]) ^ (v[1] & v[2]);
        const uint32_t added = v[7] + (rotated(v[4], 6u) ^ rotated(v[4], 11u) ^ rotated(v[4], 25u)) + chosen +
                               round_constants[round] + scheduled(schedule, round);
        const uint32_t first = added + (rotated(v[0], 2u) ^ rotated(v[0], 13u) ^ rotated(v[0], 22u)) + majority;
        memmove(&v[1], &v[0], 7u * sizeof v[0]);
        v[4] += added;
        v[0] = first;
    }
    for (k = 0u; k < 8u; k++) {
        state[k] += v[k];
    }
}

void sha256_begin(struct sha256 *hash)
{
    static const uint32_t start[8] = {
        0x6A09E667u, 0xBB67AE85u, 0x3C6EF372u, 0xA54FF53Au, 0x510E527Fu, 0x9B05688Cu, 0x1F83D9ABu, 0x5BE0CD19u};
    memcpy(hash->state, start, sizeof start);
    hash->count = 0u;
}

void sha256_add(struct sha256 *hash, const uint8_t *bytes, uint32_t length)
{
    uint32_t k;
    for (k = 0u; k < length; k++) {
        hash->block[hash->count % SHA256_BLOCK] = bytes[k];
        hash->count++;
        if (hash->count % SHA256_BLOCK == 0u) {
            take_block(hash->state, hash->block);
        }
    }
}

void sha256_end(struct sha256 *hash, uint8_t digest[SHA256_SIZE])
{
    static const uint8_t one = 0x80u, none = 0u;
    const uint32_t count = hash->count;
    uint8_t bits[8] = {0u};
    uint32_t k;
    put_word(&bits[0], count >> 29);
    put_word(&bits[4], count << 3);
    sha256_add(hash, &one, 1u);
    while (hash->count % SHA256_BLOCK != LENGTH_AT) {
        sha256_add(hash, &none, 1u);
    }
    sha256_add(hash, bits, sizeof bits);
    for (k = 0u; k < 8u; k++) {
        put_word(&digest[4u * k], hash->state[k]);
    }
}

static void add_pad(struct sha256 *hash, const uint8_t key[SHA256_BLOCK], uint8_t pad)
{
    uint32_t k;
    sha256_begin(hash);
    for (k = 0u; k < SHA256_BLOCK; k++) {
        const uint8_t byte = (uint8_t)(key[k] ^ pad);
        sha256_add(hash, &byte, 1u);
    }
}

void hmac_begin(struct hmac_sha256 *hmac, const uint8_t *key, uint32_t length)
{
    memset(hmac->key, 0, sizeof hmac->key);
    if (length > SHA256_BLOCK) {
        sha256_begin(&hmac->inner);
        sha256_add(&hmac->inner, key, length);
        sha256_end(&hmac->inner, hmac->key);
    } else {
        memcpy(hmac->key, key, length);
    }
    add_pad(&hmac->inner, hmac->key, INNER);
}

void hmac_add(struct hmac_sha256 *hmac, const uint8_t *bytes, uint32_t length)
{
    sha256_add(&hmac->inner, bytes, length);
}

void hmac_end(struct hmac_sha256 *hmac, uint8_t tag[SHA256_SIZE])
{
    uint8_t of_inner[SHA256_SIZE];
    sha256_end(&hmac->inner, of_inner);
    add_pad(&hmac->inner, hmac->key, OUTER);
    sha256_add(&hmac->inner, of_inner, sizeof of_inner);
    sha256_end(&hmac->inner, tag);
}

bool digests_agree(const uint8_t one[SHA256_SIZE], const uint8_t other[SHA256_SIZE])
{
    unsigned apart = 0u;
    uint32_t k;
    for (k = 0u; k < SHA256_SIZE; k++) {
        apart |= (unsigned)one[k] ^ other[k];
    }
    return apart == 0u;
}
