/* Variances as native messages say them: a level of 0.5 dB, 0 for none, n for first + n steps. */
#ifndef BORECHAIN_LEVELS_H
#define BORECHAIN_LEVELS_H

#include <stdint.h>

#define LEVELS_OF_ANGLES (-215) /* rad^2, levels of 8 bits */
#define LEVELS_OF_TIMES (-331)  /* s^2, of 16 bits of which 9 are in use */
#define LEVEL_CEILING (INT64_C(1) << 61) /* Q56: 32; a larger variance is said and read as this one */

/* The variance in Q56 of a level. */
int64_t variance_of_level(uint32_t level, int32_t first);
/* The least level of at least a variance in Q56, up to the highest. */
uint32_t level_of_variance(int64_t variance, int32_t first, uint32_t highest);

#endif
