/* Variances as levels of 0.5 dB, see levels.h. */
#include "levels.h"

#define STEPS 20 /* levels of a power of ten */
#define LARGEST_POWER 1

/* 10^(k/20) in Q28. */
static const uint32_t parts[STEPS] = {
    268435456u, 301189535u, 337940217u, 379175160u, 425441527u, 477353244u, 535599149u, 600952130u,
    674279380u, 756553907u, 848867446u, 952444939u, 1068660799u, 1199057137u, 1345364236u, 1509523501u,
    1693713225u, 1900377495u, 2132258619u, 2392433520u};

/* 10^power in Q56, of -17 to LARGEST_POWER. */
static int64_t power_of_ten(int32_t power)
{
    int64_t made = INT64_C(1) << 56;
    while (power > 0) {
        made *= 10;
        power--;
    }
    while (power < 0) {
        made = (made + 5) / 10;
        power++;
    }
    return made;
}

int64_t variance_of_level(uint32_t level, int32_t first)
{
    const int32_t half_decibels = first + (int32_t)level;
    const int32_t power = half_decibels >= 0 ? half_decibels / STEPS : -((STEPS - 1 - half_decibels) / STEPS);
    const uint64_t part = parts[half_decibels - power * STEPS];
    uint64_t whole;
    if (level == 0u) {
        return 0;
    }
    if (power > LARGEST_POWER) {
        return LEVEL_CEILING;
    }
    whole = (uint64_t)power_of_ten(power);
    whole = (whole >> 28) * part + ((whole & 0xFFFFFFFu) * part >> 28);
    return whole < (uint64_t)LEVEL_CEILING ? (int64_t)whole : LEVEL_CEILING;
}

uint32_t level_of_variance(int64_t variance, int32_t first, uint32_t highest)
{
    uint32_t low = 0u, high = highest;
    if (variance <= 0) {
        return 0u;
    }
    while (low < high) {
        const uint32_t middle = (low + high) / 2u;
        if (variance_of_level(middle, first) >= variance) {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return low;
}
