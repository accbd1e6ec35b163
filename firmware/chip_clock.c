/* Rig time on a chip, see chip_clock.h. */
#include "chip_clock.h"

#define JITTER_US 400
#define LONGEST_TRIP_US 2000000
#define PLAUSIBLE_TRIP_US 20000
#define VAR_Q 20
#define DRIFT_STD 50         /* us/s, between two crystals never compared before */
#define OFFSET_WALK2 4       /* us^2/s, 2e-6 s/sqrt(s) squared */
#define DRIFT_WALK2_Q20 1    /* (us/s)^2/s: (1e-9/sqrt(s))^2 */
#define AGE_Q 6              /* s */
#define LONGEST_AGE 4096     /* s, over which a drift is followed */
#define LARGEST_VAR (INT64_C(1000000000000) << VAR_Q) /* us^2, (1 s)^2 */
#define GATE2 36
#define RESET_AFTER 3u
#define LARGEST_RESIDUAL_US 1000000000 /* whose square fits */

static int64_t root_of(int64_t square)
{
    int64_t root = 0, bit = INT64_C(1) << 31;
    while (bit > 0) {
        if ((root + bit) * (root + bit) <= square) {
            root += bit;
        }
        bit >>= 1;
    }
    return root;
}

static int64_t offset_at(const struct chip_clock *clock, int64_t local_us)
{
    return clock->offset_us + (local_us - clock->at_us) / 1000 * clock->drift / (CLOCK_RATE_ONE / 1000);
}

/* Variances at a local time, in the units of the clock's. */
static void predict(const struct chip_clock *clock, int64_t local_us, int64_t *var, int64_t *with, int64_t *drift)
{
    const int64_t dt_us = local_us - clock->at_us, whole = (dt_us < 0 ? -dt_us : dt_us) / 15625;
    const int64_t age = whole < LONGEST_AGE << AGE_Q ? whole : LONGEST_AGE << AGE_Q; /* Q6 */
    const int64_t dt = dt_us < 0 ? -age : age;
    const int64_t turned = clock->drift_var / 64 * dt;
    const int64_t moved = (clock->with_drift / 32 + turned / 64) * dt;
    const int64_t grown = clock->var + moved + (age * OFFSET_WALK2 << (VAR_Q - AGE_Q));
    *var = grown < LARGEST_VAR ? grown : LARGEST_VAR;
    *with = clock->with_drift + turned;
    *drift = clock->drift_var + (age * DRIFT_WALK2_Q20 >> AGE_Q);
}

static int64_t var_at(const struct chip_clock *clock, int64_t local_us)
{
    int64_t var, with, drift;
    predict(clock, local_us, &var, &with, &drift);
    return (var >> VAR_Q) + 1;
}

int64_t clock_drift_std(const struct chip_clock *clock)
{
    return root_of((clock->drift_var >> 4) * 1000000 >> (VAR_Q - 4));
}

int64_t clock_rig_from_local(const struct chip_clock *clock, int64_t local_us)
{
    const int64_t since = local_us + offset_at(clock, local_us) - clock->told.replied_us;
    return clock->told.rig_us + since +
           since / 1000 * (clock->told.rig_rate - CLOCK_RATE_ONE) / (CLOCK_RATE_ONE / 1000);
}

int64_t clock_local_from_rig(const struct chip_clock *clock, int64_t rig_us)
{
    int64_t local = clock->at_us;
    uint32_t k;
    for (k = 0u; k < 3u; k++) {
        local += rig_us - clock_rig_from_local(clock, local);
    }
    return local;
}

int64_t clock_variance(const struct chip_clock *clock, int64_t local_us)
{
    return clock->exchanges == 0u ? CLOCK_UNKNOWN : var_at(clock, local_us) + clock->told.rig_var;
}

int64_t clock_rig_rate(const struct chip_clock *clock)
{
    return clock->told.rig_rate + clock->drift;
}

int64_t clock_take_step(struct chip_clock *clock)
{
    const int64_t stepped = clock->stepped_us;
    clock->stepped_us = 0;
    return stepped;
}

void clock_doubt(struct chip_clock *clock)
{
    clock->exchanges = 0u;
    clock->stepped_us = CLOCK_UNKNOWN;
}

static void begin(struct chip_clock *clock, int64_t local_us, int64_t measured, int64_t var)
{
    clock->at_us = local_us;
    clock->offset_us = measured;
    clock->drift = 0;
    clock->var = var << VAR_Q;
    clock->with_drift = 0;
    clock->drift_var = (int64_t)DRIFT_STD * DRIFT_STD << VAR_Q;
    clock->exchanges = 1u;
    clock->disagreed = 0u;
}

/* False where it disagrees with what is known. */
static bool update(struct chip_clock *clock, int64_t local_us, int64_t measured, int64_t noise)
{
    const int64_t known = offset_at(clock, local_us);
    const int64_t residual = measured - known, size = residual < 0 ? -residual : residual;
    int64_t var, with, drift, gain, drift_gain, sum;
    predict(clock, local_us, &var, &with, &drift);
    sum = (var >> VAR_Q) + noise; /* us^2 */
    if (size > LARGEST_RESIDUAL_US || size * size / GATE2 > sum) {
        clock->disagreed++;
        if (clock->disagreed < RESET_AFTER) {
            return false;
        }
        begin(clock, local_us, measured, noise);
        return true;
    }
    gain = var / sum;                  /* Q20 */
    drift_gain = with * 1024 / sum;    /* 1/s, Q30 */
    clock->disagreed = 0u;
    clock->at_us = local_us;
    clock->offset_us = known + residual * gain / (1 << VAR_Q);
    clock->drift += residual * drift_gain / (1 << 20) * 1000 / 1024;
    clock->var = var - (var >> VAR_Q) * gain;
    clock->with_drift = with - with / 1024 * gain / 1024;
    clock->drift_var = drift - with / 1024 * drift_gain / (1 << 20);
    clock->drift_var = clock->drift_var > 1 ? clock->drift_var : 1;
    clock->exchanges++;
    return true;
}

void clock_exchange(struct chip_clock *clock, const struct clock_reply *reply, int64_t back_us)
{
    const int64_t trip = back_us - reply->asked_us - (reply->replied_us - reply->received_us);
    const int64_t measured = (reply->received_us - reply->asked_us + reply->replied_us - back_us) / 2;
    const int64_t middle = reply->asked_us + (back_us - reply->asked_us) / 2;
    const bool is_first = clock->exchanges == 0u;
    const bool continues = !is_first && reply->epoch == clock->told.epoch;
    int64_t wait, before;
    if (trip < 0 || trip > LONGEST_TRIP_US) {
        return;
    }
    if (is_first || trip < clock->least_trip_us) {
        clock->least_trip_us = trip;
    }
    wait = (trip - clock->least_trip_us) / 2;
    if (clock->least_trip_us > PLAUSIBLE_TRIP_US) {
        wait += (clock->least_trip_us - PLAUSIBLE_TRIP_US) / 2;
    }
    before = is_first ? 0 : clock_rig_from_local(clock, back_us);
    if (is_first) {
        begin(clock, middle, measured, JITTER_US * JITTER_US + wait * wait);
    } else if (!update(clock, middle, measured, JITTER_US * JITTER_US + wait * wait)) {
        return;
    }
    clock->told = *reply;
    if (!continues) {
        clock->stepped_us = CLOCK_UNKNOWN;
    } else if (clock->stepped_us != CLOCK_UNKNOWN) {
        clock->stepped_us += before - clock_rig_from_local(clock, back_us);
    }
}
