/* Big-endian numbers from the front of bytes, as msgpack has them. */
#ifndef BORECHAIN_BIG_ENDIAN_H
#define BORECHAIN_BIG_ENDIAN_H

#include <stdbool.h>
#include <stdint.h>

/* Takes a number of so many bytes; false, and nothing is taken, where fewer are left. */
static inline bool take_big_endian(const uint8_t **at, uint32_t *left, uint32_t bytes, uint64_t *value)
{
    uint32_t k;
    if (*left < bytes) {
        return false;
    }
    *value = 0u;
    for (k = 0u; k < bytes; k++) {
        *value = *value << 8 | (*at)[k];
    }
    *at += bytes;
    *left -= bytes;
    return true;
}

#endif
