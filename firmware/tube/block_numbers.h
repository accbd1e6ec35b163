/* The bytes of a parameter block as numbers of the step, and back to its hash. */
#ifndef BORECHAIN_BLOCK_NUMBERS_H
#define BORECHAIN_BLOCK_NUMBERS_H

#include "borechain_step.h"
#include "chip_block.h"

enum block_fault { BLOCK_WHOLE = 0, BLOCK_OTHER_FORMAT = 1, BLOCK_NOT_FINITE = 2 };

/* The identity of a tube, as the bytes that are hashed. */
void block_identity(uint8_t tube, uint8_t bytes[BLOCK_SIZE]);
void block_hash(const uint8_t bytes[BLOCK_SIZE], uint8_t digest[SHA256_SIZE]);
uint32_t block_tube(const uint8_t bytes[BLOCK_SIZE]);
uint32_t block_version(const uint8_t bytes[BLOCK_SIZE]);
/* Whether it is one; a negative zero becomes zero, as it is hashed. */
enum block_fault block_check(uint8_t bytes[BLOCK_SIZE]);
/* Its corrections; forces are counted in standard gravity. */
void block_corrections(const uint8_t bytes[BLOCK_SIZE], struct borechain_parameters *corrections);
/* Which sensors two blocks correct in other ways: bits of borechain_changed. */
int64_t block_changes(const struct borechain_parameters *before, const struct borechain_parameters *after);

#endif
