/* Between the numbers of native messages and those of the step, see node_signals.h. */
#include "node_signals.h"

#include <string.h>

#include "levels.h"

#define ANGLE_TURN_RIGHT 20
#define ANGLE_OF_COUNT INT64_C(431777206545) /* 2 pi / 2^24 in Q60 */
#define COUNT_MASK 0xFFFFFFu
#define RATE_OF_STEP INT64_C(703687442)      /* 1e-5 rad/s in Q46 */
#define TORQUE_Q 20
#define NEVER (-(INT64_C(1) << 62))
#define UNTOLD (INT64_C(1) << 56)            /* rad^2, 1: a joint that may be any */
#define YAW_VAR_FLOOR INT64_C(21949998)      /* (0.001 deg)^2 in Q56 */
#define LARGEST_CLOCK_VAR INT64_C(100000000000000) /* us^2, 1e2 s^2 */
#define HIGHEST_ANGLE_LEVEL 255u
#define HIGHEST_TIME_LEVEL 511u
#define STATIC_BIAS 1
#define MODE_FAULT 7u
#define MODE_ALIGNMENT 2u
#define LARGEST_BIAS 8000000
#define LARGEST_SCALE 1000000

enum flag {
    YAW_UNTRUSTED = 1, AIDING_OLD = 2, INNOVATION_REJECTED = 4, RATE_EXCEEDED = 8, RESTORED = 16,
    CLOCK_UNSYNCHRONISED = 32, BIAS_UNKNOWN = 64, SENSOR_FAULT = 128, NOT_SAVED = 256, DRIVE_UNTOLD = 512,
    LOWER_UNTOLD = 1024
};

static int64_t held(int64_t value, int64_t limit)
{
    return value > limit ? limit : value < -limit ? -limit : value;
}

int64_t q28_of_us(int64_t us)
{
    const int64_t whole = us / 1000000, part = us % 1000000;
    return whole * (INT64_C(1) << 28) + part * (INT64_C(1) << 28) / 1000000;
}

int64_t node_yaw_var(int64_t var)
{
    return var > YAW_VAR_FLOOR ? var : YAW_VAR_FLOOR;
}

int64_t node_var_q56(int64_t var_us2)
{
    const int64_t bounded = var_us2 < LARGEST_CLOCK_VAR / 10 ? var_us2 : LARGEST_CLOCK_VAR / 10;
    return bounded * 72057 + bounded * 594 / 1000;
}

int64_t us2_of_level(uint32_t level)
{
    const int64_t var = variance_of_level(level, LEVELS_OF_TIMES);
    return (var + 72057) / 72058; /* 1e-12 s^2 in Q56, rounded up */
}

uint16_t node_flags(const struct chip_node *node, int64_t now_q28, bool is_dated)
{
    const struct borechain_node *const record = &node->record;
    unsigned flags = 0u;
    if (record->guard.gyro.fault != 0) {
        flags |= SENSOR_FAULT | YAW_UNTRUSTED;
    }
    if (record->guard.force.fault != 0) {
        flags |= SENSOR_FAULT;
    }
    if (record->guard.ratio.told != 0 || record->filter.yaw_known == 0) {
        flags |= YAW_UNTRUSTED;
    }
    if (record->filter.last_aided == NEVER || now_q28 - record->filter.last_aided > node->settings.aiding_old_after) {
        flags |= AIDING_OLD;
    }
    flags |= record->filter.rejected != 0 ? INNOVATION_REJECTED : 0u;
    flags |= record->filter.rate_exceeded != 0 ? RATE_EXCEEDED : 0u;
    flags |= node->worth >= 0 ? RESTORED : 0u;
    flags |= !is_dated ? CLOCK_UNSYNCHRONISED : 0u;
    flags |= record->filter.mode == STATIC_BIAS ? BIAS_UNKNOWN : 0u;
    flags |= node->refused != 0u ? NOT_SAVED : 0u;
    flags |= node->kept.hops == 1 && node->settings.drive_var > UNTOLD ? DRIVE_UNTOLD : 0u;
    flags |= node->identity.tube > 1u && node->settings.lower_var > UNTOLD ? LOWER_UNTOLD : 0u;
    return (uint16_t)flags;
}

/* Q40 of 2^-24 of a turn, and back to the nearest. */
static int64_t angle_of_counts(int64_t counts)
{
    return counts * ANGLE_OF_COUNT / (INT64_C(1) << ANGLE_TURN_RIGHT);
}

static int32_t counts_of_angle(int64_t angle)
{
    const int64_t guess = angle / (ANGLE_OF_COUNT >> ANGLE_TURN_RIGHT);
    const int64_t left = angle - angle_of_counts(guess);
    return (int32_t)(guess + (left + (left < 0 ? -1 : 1) * (ANGLE_OF_COUNT >> (ANGLE_TURN_RIGHT + 1))) /
                                 (ANGLE_OF_COUNT >> ANGLE_TURN_RIGHT));
}

static int32_t signed_counts(int64_t angle)
{
    const uint32_t wrapped = (uint32_t)counts_of_angle(angle) & COUNT_MASK;
    return wrapped > COUNT_MASK / 2u ? (int32_t)wrapped - (int32_t)(COUNT_MASK + 1u) : (int32_t)wrapped;
}

static uint8_t level_of(int64_t variance)
{
    return (uint8_t)level_of_variance(variance, LEVELS_OF_ANGLES, HIGHEST_ANGLE_LEVEL);
}

void aiding_for_step(
    const struct borechain_native_aiding *heard,
    int64_t valid_us,
    int64_t clock_var_us2,
    int64_t aiding[12])
{
    aiding[0] = angle_of_counts(heard->yaw);
    aiding[1] = variance_of_level(heard->yaw_var, LEVELS_OF_ANGLES);
    aiding[2] = variance_of_level(heard->systematic_var, LEVELS_OF_ANGLES);
    aiding[3] = angle_of_counts(heard->offset);
    aiding[4] = heard->rate * RATE_OF_STEP;
    aiding[5] = q28_of_us(valid_us);
    aiding[6] = (int64_t)heard->sequence;
    aiding[7] = heard->hops;
    aiding[8] = (int64_t)heard->torque * (INT64_C(1) << TORQUE_Q);
    aiding[9] = variance_of_level(heard->torsion_var, LEVELS_OF_ANGLES);
    aiding[10] = heard->under_torque;
    aiding[11] = node_var_q56(clock_var_us2);
}

void aiding_for_below(
    const struct borechain_native_aiding *heard,
    const struct borechain_node *record,
    struct borechain_native_aiding *said)
{
    *said = *heard;
    said->offset = signed_counts(record->down_offset);
    said->systematic_var = level_of(record->down_systematic);
    said->torsion_var = level_of(record->down_torsion);
    said->hops = (int16_t)(heard->hops + 1);
}

/* Steps of 1e-7 of a number in Q46, and of 1e-6 in Q30 and Q40. */
static int32_t steps_of_rate(int64_t rate)
{
    return (int32_t)held((held(rate, INT64_C(1) << 45) >> 16) * 10000000 / (INT64_C(1) << 30), LARGEST_BIAS);
}

static uint8_t mode_of(const struct borechain_node *record)
{
    if (record->guard.gyro.fault != 0 || record->guard.force.fault != 0) {
        return MODE_FAULT;
    }
    return record->mount.aligning != 0 ? MODE_ALIGNMENT : (uint8_t)record->filter.mode;
}

static int32_t age_of(int64_t now_q28, int64_t at)
{
    const int64_t age = at == NEVER ? INT64_MAX : (now_q28 - at) * 100 >> 28;
    return age < BORECHAIN_NATIVE_NODE_STATE_INFINITE_AIDING_AGE ? (int32_t)age
                                                                 : BORECHAIN_NATIVE_NODE_STATE_INFINITE_AIDING_AGE;
}

static uint32_t first_bytes(const uint8_t *hash)
{
    return (uint32_t)hash[0] << 24 | (uint32_t)hash[1] << 16 | (uint32_t)hash[2] << 8 | (uint32_t)hash[3];
}

void state_of_node(const struct chip_node *node, int64_t now_us, struct borechain_native_node_state *state)
{
    const struct borechain_node *const record = &node->record;
    const struct borechain_state *const filter = &record->filter;
    const int64_t now_q28 = q28_of_us(now_us), var = clock_variance(&node->clock, now_us);
    const bool is_dated = var < INT64_C(2500000000); /* (0.05 s)^2 */
    memset(state, 0, sizeof *state);
    state->tube = node->identity.tube;
    state->at = clock_rig_from_local(&node->clock, now_us) / 10;
    state->hops = (int16_t)(node->is_told_hops ? node->kept.hops : -1);
    state->mode = mode_of(record);
    state->yaw = ((filter->now_yaw >> 8) + (filter->now_yaw >> 7 & 1u)) & COUNT_MASK;
    state->yaw_var = level_of(node_yaw_var(filter->now_P[2][2]));
    state->systematic_var = level_of(filter->systematic_var + node->identity.mount_var);
    state->gyro_bias_x = steps_of_rate(filter->static_bias[0] + filter->bias[0]);
    state->gyro_bias_y = steps_of_rate(filter->static_bias[1] + filter->bias[1]);
    state->gyro_bias_z = steps_of_rate(filter->static_bias[2] + filter->bias[2]);
    state->scale_factor = (int32_t)held((filter->scale >> 16) * 1000000 / (INT64_C(1) << 30), LARGEST_SCALE);
    state->innovation = signed_counts(filter->innovation);
    state->innovation_var = level_of(filter->innovation_var);
    state->aiding_age = age_of(now_q28, filter->last_aided);
    state->clock_var = (uint16_t)level_of_variance(
        node_var_q56(var < LARGEST_CLOCK_VAR ? var : LARGEST_CLOCK_VAR), LEVELS_OF_TIMES, HIGHEST_TIME_LEVEL);
    state->flags = node_flags(node, now_q28, is_dated);
    state->cycles = (uint32_t)record->cycles;
    state->overruns = (uint8_t)(record->overruns < 255 ? record->overruns : 255);
    state->parameters_version = (uint16_t)node->kept.block.version;
    state->parameters_hash_1 = first_bytes(&node->kept.block.in_use[0]);
    state->parameters_hash_2 = first_bytes(&node->kept.block.in_use[4]);
    state->alignment_x = record->mount.method == 0 ? 0 : (int32_t)(record->mount.axis[0][0] * 1000000 >> 30);
    state->alignment_y = record->mount.method == 0 ? 0 : (int32_t)(record->mount.axis[0][1] * 1000000 >> 30);
    state->alignment_z = record->mount.method == 0 ? 0 : (int32_t)(record->mount.std[0][0] * 1000000 >> 40);
    state->epoch = (uint16_t)node->clock.told.epoch;
    state->numbered = (uint32_t)(node->kept.mail.next_number - 1);
}
