/* Rig time on a chip, from two-way exchanges with the neighbour that is nearer to the encoder.
 *
 * Own and the neighbour's crystal are compared, two free-running clocks: offset and drift are the states of the filter
 * that Python has (telemetry/application/clock.py), here in integers. Rig time is the neighbour's account of it, carried
 * over that comparison.
 */
#ifndef BORECHAIN_CHIP_CLOCK_H
#define BORECHAIN_CHIP_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#define CLOCK_UNKNOWN INT64_MAX /* of a variance, and of a step */
#define CLOCK_RATE_ONE 1000000000 /* rig seconds per second of a clock are told in steps of 1e-9 */

/* A reply to a request, times in microseconds. */
struct clock_reply {
    int64_t asked_us;    /* own clock */
    int64_t received_us; /* the neighbour's */
    int64_t replied_us;  /* likewise */
    int64_t rig_us;      /* rig time at replied_us */
    int64_t rig_var;     /* us^2, of that */
    int64_t rig_rate;    /* of the neighbour's clock, steps of 1e-9 */
    uint32_t epoch;
};

/* It begins as zeros. */
struct chip_clock {
    struct clock_reply told;
    int64_t at_us;          /* own clock, of the offset */
    int64_t offset_us;      /* the neighbour's clock less the own */
    int64_t drift;          /* of the neighbour's clock against the own, steps of 1e-9 */
    int64_t var;            /* us^2, Q20, of the offset */
    int64_t with_drift;     /* us^2/s, Q20, of both */
    int64_t drift_var;      /* (us/s)^2, Q20 */
    int64_t least_trip_us;
    int64_t stepped_us;     /* by which it dates later since it was last asked; CLOCK_UNKNOWN: that is not known */
    uint32_t exchanges;
    uint32_t disagreed;
};

void clock_exchange(struct chip_clock *clock, const struct clock_reply *reply, int64_t back_us);
/* The own clock may have jumped, or the neighbour is another one: the next exchange begins anew. */
void clock_doubt(struct chip_clock *clock);
int64_t clock_rig_from_local(const struct chip_clock *clock, int64_t local_us);
int64_t clock_local_from_rig(const struct chip_clock *clock, int64_t rig_us);
/* us^2, of rig time at a local time; CLOCK_UNKNOWN before the first exchange. */
int64_t clock_variance(const struct chip_clock *clock, int64_t local_us);
/* Standard deviation of the drift, steps of 1e-9. */
int64_t clock_drift_std(const struct chip_clock *clock);
int64_t clock_rig_rate(const struct chip_clock *clock);
int64_t clock_take_step(struct chip_clock *clock);

#endif
