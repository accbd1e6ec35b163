/* The filter's part of a survey, for the tests of a chip's payloads. */
#include <string.h>

#include "chip_words.h"

static struct borechain_state filter;

uint32_t shim_survey(
    const struct word_origin *origin,
    const struct word_survey *survey,
    const int64_t force[3],
    const int64_t cov[9],
    uint8_t *room,
    uint32_t size)
{
    memcpy(filter.survey_force, force, sizeof filter.survey_force);
    memcpy(filter.survey_force_cov, cov, sizeof filter.survey_force_cov);
    return word_survey(origin, survey, &filter, room, size);
}
