/* AES-128 CMAC and the window against repeated frames, see seal.h. */
#include "seal.h"

#include <string.h>

#define LAST_ROUND 10u

static const uint8_t BOX[256] = {
    0x63u, 0x7Cu, 0x77u, 0x7Bu, 0xF2u, 0x6Bu, 0x6Fu, 0xC5u, 0x30u, 0x01u, 0x67u, 0x2Bu,
    0xFEu, 0xD7u, 0xABu, 0x76u, 0xCAu, 0x82u, 0xC9u, 0x7Du, 0xFAu, 0x59u, 0x47u, 0xF0u,
    0xADu, 0xD4u, 0xA2u, 0xAFu, 0x9Cu, 0xA4u, 0x72u, 0xC0u, 0xB7u, 0xFDu, 0x93u, 0x26u,
    0x36u, 0x3Fu, 0xF7u, 0xCCu, 0x34u, 0xA5u, 0xE5u, 0xF1u, 0x71u, 0xD8u, 0x31u, 0x15u,
    0x04u, 0xC7u, 0x23u, 0xC3u, 0x18u, 0x96u, 0x05u, 0x9Au, 0x07u, 0x12u, 0x80u, 0xE2u,
    0xEBu, 0x27u, 0xB2u, 0x75u, 0x09u, 0x83u, 0x2Cu, 0x1Au, 0x1Bu, 0x6Eu, 0x5Au, 0xA0u,
    0x52u, 0x3Bu, 0xD6u, 0xB3u, 0x29u, 0xE3u, 0x2Fu, 0x84u, 0x53u, 0xD1u, 0x00u, 0xEDu,
    0x20u, 0xFCu, 0xB1u, 0x5Bu, 0x6Au, 0xCBu, 0xBEu, 0x39u, 0x4Au, 0x4Cu, 0x58u, 0xCFu,
    0xD0u, 0xEFu, 0xAAu, 0xFBu, 0x43u, 0x4Du, 0x33u, 0x85u, 0x45u, 0xF9u, 0x02u, 0x7Fu,
    0x50u, 0x3Cu, 0x9Fu, 0xA8u, 0x51u, 0xA3u, 0x40u, 0x8Fu, 0x92u, 0x9Du, 0x38u, 0xF5u,
    0xBCu, 0xB6u, 0xDAu, 0x21u, 0x10u, 0xFFu, 0xF3u, 0xD2u, 0xCDu, 0x0Cu, 0x13u, 0xECu,
    0x5Fu, 0x97u, 0x44u, 0x17u, 0xC4u, 0xA7u, 0x7Eu, 0x3Du, 0x64u, 0x5Du, 0x19u, 0x73u,
    0x60u, 0x81u, 0x4Fu, 0xDCu, 0x22u, 0x2Au, 0x90u, 0x88u, 0x46u, 0xEEu, 0xB8u, 0x14u,
    0xDEu, 0x5Eu, 0x0Bu, 0xDBu, 0xE0u, 0x32u, 0x3Au, 0x0Au, 0x49u, 0x06u, 0x24u, 0x5Cu,
    0xC2u, 0xD3u, 0xACu, 0x62u, 0x91u, 0x95u, 0xE4u, 0x79u, 0xE7u, 0xC8u, 0x37u, 0x6Du,
    0x8Du, 0xD5u, 0x4Eu, 0xA9u, 0x6Cu, 0x56u, 0xF4u, 0xEAu, 0x65u, 0x7Au, 0xAEu, 0x08u,
    0xBAu, 0x78u, 0x25u, 0x2Eu, 0x1Cu, 0xA6u, 0xB4u, 0xC6u, 0xE8u, 0xDDu, 0x74u, 0x1Fu,
    0x4Bu, 0xBDu, 0x8Bu, 0x8Au, 0x70u, 0x3Eu, 0xB5u, 0x66u, 0x48u, 0x03u, 0xF6u, 0x0Eu,
    0x61u, 0x35u, 0x57u, 0xB9u, 0x86u, 0xC1u, 0x1Du, 0x9Eu, 0xE1u, 0xF8u, 0x98u, 0x11u,
    0x69u, 0xD9u, 0x8Eu, 0x94u, 0x9Bu, 0x1Eu, 0x87u, 0xE9u, 0xCEu, 0x55u, 0x28u, 0xDFu,
    0x8Cu, 0xA1u, 0x89u, 0x0Du, 0xBFu, 0xE6u, 0x42u, 0x68u, 0x41u, 0x99u, 0x2Du, 0x0Fu,
    0xB0u, 0x54u, 0xBBu, 0x16u
};

/* A byte times x in the field of AES. */
static uint8_t times_x(uint8_t byte)
{
    return (uint8_t)((unsigned)byte << 1 ^ ((unsigned)byte >> 7) * 0x1Bu);
}

static void mix_in(uint8_t state[SEAL_BLOCK], const uint8_t other[SEAL_BLOCK])
{
    unsigned k;
    for (k = 0u; k < SEAL_BLOCK; k++) {
        state[k] ^= other[k];
    }
}

/* Bytes through the box, their rows turned; the state is by columns. */
static void substitute_and_shift(uint8_t state[SEAL_BLOCK])
{
    uint8_t before[SEAL_BLOCK];
    unsigned k;
    memcpy(before, state, SEAL_BLOCK);
    for (k = 0u; k < SEAL_BLOCK; k++) {
        state[k] = BOX[before[(k + 4u * (k & 3u)) & 15u]];
    }
}

static void mix_columns(uint8_t state[SEAL_BLOCK])
{
    unsigned column;
    for (column = 0u; column < SEAL_BLOCK; column += 4u) {
        uint8_t *a = &state[column];
        const uint8_t first = a[0];
        const uint8_t all = (uint8_t)(a[0] ^ a[1] ^ a[2] ^ a[3]);
        a[0] = (uint8_t)(a[0] ^ all ^ times_x((uint8_t)(a[0] ^ a[1])));
        a[1] = (uint8_t)(a[1] ^ all ^ times_x((uint8_t)(a[1] ^ a[2])));
        a[2] = (uint8_t)(a[2] ^ all ^ times_x((uint8_t)(a[2] ^ a[3])));
        a[3] = (uint8_t)(a[3] ^ all ^ times_x((uint8_t)(a[3] ^ first)));
    }
}

static void encrypt(const struct seal_key *key, uint8_t state[SEAL_BLOCK])
{
    unsigned round;
    mix_in(state, key->rounds[0]);
    for (round = 1u; round <= LAST_ROUND; round++) {
        substitute_and_shift(state);
        if (round < LAST_ROUND) {
            mix_columns(state);
        }
        mix_in(state, key->rounds[round]);
    }
}

static void expand_key(struct seal_key *key, const uint8_t secret[SEAL_KEY_SIZE])
{
    uint8_t constant = 1u;
    unsigned round;
    unsigned k;
    memcpy(key->rounds[0], secret, SEAL_KEY_SIZE);
    for (round = 1u; round <= LAST_ROUND; round++) {
        const uint8_t *before = key->rounds[round - 1u];
        uint8_t *now = key->rounds[round];
        for (k = 0u; k < 4u; k++) {
            now[k] = (uint8_t)(before[k] ^ BOX[before[12u + ((k + 1u) & 3u)]]);
        }
        now[0] ^= constant;
        constant = times_x(constant);
        for (k = 4u; k < SEAL_BLOCK; k++) {
            now[k] = (uint8_t)(before[k] ^ now[k - 4u]);
        }
    }
}

/* A block times x in the field of CMAC; the first byte is the highest. */
static void double_block(const uint8_t block[SEAL_BLOCK], uint8_t doubled[SEAL_BLOCK])
{
    const unsigned carry = (unsigned)block[0] >> 7;
    unsigned k;
    for (k = 0u; k + 1u < SEAL_BLOCK; k++) {
        doubled[k] = (uint8_t)((unsigned)block[k] << 1 | (unsigned)block[k + 1u] >> 7);
    }
    doubled[SEAL_BLOCK - 1u] = (uint8_t)((unsigned)block[SEAL_BLOCK - 1u] << 1 ^ carry * 0x87u);
}

void seal_set_key(struct seal_key *key, const uint8_t secret[SEAL_KEY_SIZE])
{
    uint8_t zero[SEAL_BLOCK] = {0u};
    expand_key(key, secret);
    encrypt(key, zero);
    double_block(zero, key->whole_last);
    double_block(key->whole_last, key->cut_last);
}

void seal_add(const struct seal_key *key, struct seal_run *run, const uint8_t *part, size_t length)
{
    size_t k;
    for (k = 0u; k < length; k++) {
        if (run->held == SEAL_BLOCK) {
            mix_in(run->tag, run->last);
            encrypt(key, run->tag);
            run->held = 0u;
        }
        run->last[run->held] = part[k];
        run->held++;
    }
}

void seal_end(const struct seal_key *key, struct seal_run *run, uint8_t tag[SEAL_BLOCK])
{
    const bool is_cut = run->held < SEAL_BLOCK;
    if (is_cut) {
        memset(&run->last[run->held], 0, SEAL_BLOCK - run->held);
        run->last[run->held] = 0x80u;
    }
    mix_in(run->last, is_cut ? key->cut_last : key->whole_last);
    mix_in(run->tag, run->last);
    encrypt(key, run->tag);
    memcpy(tag, run->tag, SEAL_BLOCK);
}

void seal_tag(const struct seal_key *key, const uint8_t *message, size_t length, uint8_t tag[SEAL_BLOCK])
{
    struct seal_run run;
    memset(&run, 0, sizeof run);
    seal_add(key, &run, message, length);
    seal_end(key, &run, tag);
}

bool seal_is_same(const uint8_t *tag, const uint8_t *other)
{
    unsigned apart = 0u;
    unsigned k;
    for (k = 0u; k < SEAL_TAG_SIZE; k++) {
        apart |= (unsigned)tag[k] ^ other[k];
    }
    return apart == 0u;
}

bool seal_fits(const struct seal_key *key, const uint8_t *message, size_t length, const uint8_t tag[SEAL_TAG_SIZE])
{
    uint8_t own[SEAL_BLOCK];
    seal_tag(key, message, length, own);
    return seal_is_same(own, tag);
}

bool seal_admit(struct seal_window *window, uint32_t number)
{
    uint32_t behind;
    if (window->seen == 0u || number > window->largest) {
        const uint32_t ahead = window->seen == 0u ? SEAL_WINDOW : number - window->largest;
        window->seen = ahead < SEAL_WINDOW ? window->seen << ahead | 1u : 1u;
        window->largest = number;
        return true;
    }
    behind = window->largest - number;
    if (behind >= SEAL_WINDOW || (window->seen >> behind & 1u) != 0u) {
        return false;
    }
    window->seen |= UINT64_C(1) << behind;
    return true;
}
