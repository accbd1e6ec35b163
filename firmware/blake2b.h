/* BLAKE2b (RFC 7693) of a payload in one piece, without a key: by it a receipt names what the ground station stored. */
#ifndef BORECHAIN_BLAKE2B_H
#define BORECHAIN_BLAKE2B_H

#include <stdint.h>

/* `size` bytes of hash, 1 to 64. */
void blake2b_hash(const uint8_t *content, uint32_t length, uint8_t *hash, uint32_t size);

#endif
