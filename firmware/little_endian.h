/* Little-endian numbers in bytes, as the heads of seals have them. */
#ifndef BORECHAIN_LITTLE_ENDIAN_H
#define BORECHAIN_LITTLE_ENDIAN_H

#include <stdint.h>

static inline void put_little_endian(uint8_t *at, uint64_t value, uint32_t bytes)
{
    uint32_t k;
    for (k = 0u; k < bytes; k++) {
        at[k] = (uint8_t)(value >> (8u * k) & 0xFFu);
    }
}

static inline uint64_t little_endian(const uint8_t *at, uint32_t bytes)
{
    uint64_t value = 0u;
    while (bytes > 0u) {
        bytes--;
        value = value << 8 | at[bytes];
    }
    return value;
}

#endif
