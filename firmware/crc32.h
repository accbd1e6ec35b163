/* CRC-32 of IEEE 802.3, goes on from another one; begins with 0. */
#ifndef BORECHAIN_CRC32_H
#define BORECHAIN_CRC32_H

#include <stdint.h>

uint32_t crc32_of(uint32_t crc, const uint8_t *data, uint32_t length);

#endif
