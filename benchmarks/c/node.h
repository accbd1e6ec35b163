/* Memory of one node, as node/kernels/record/filter_record.py declares it, and the recording that drives it.
 *
 * A second implementation of the node's cycle, in plain C: a yardstick for the speed of the compiled Python and a
 * check of its results. Written from the equations in docs/equations.md; SI units and radians. */
#ifndef BORECHAIN_NODE_H
#define BORECHAIN_NODE_H

#include <stddef.h>
#include <stdint.h>

enum { STATES = 8, RING = 64, PENDING = 4, PARTS = 8, RECENT = 8 };
#define UNKNOWN_YAW_VAR 3.29 /* rad^2 */
#define CLOCK_SLACK 0.05 /* s */
#define COARSE 4.0 /* times its own variance, from where an aiding is worth less for its time than for itself */
#define INVERTED (-0.9848077530122081) /* downward part of the axis at 170 deg of inclination */
enum { TX, TY, PSI, BX, BY, BZ, SCALE, STAMP }; /* error states */

typedef struct {
    /* the filter, at its own epoch */
    double epoch;
    uint32_t yaw; /* 2^32 is one turn */
    int64_t yaw_known;
    double down[3], static_bias[3], static_bias_var[3], bias[3];
    double scale, stamp;
    double P[STATES][STATES];
    /* predicted to the end of the newest cycle */
    double now;
    uint32_t now_yaw;
    double now_down[3], now_rate;
    double now_P[STATES][STATES];
    /* aiding */
    int64_t reference_hops;
    double reference_offset, systematic_var;
    int64_t last_sequence;
    double last_aided, innovation, innovation_var;
    int64_t rejected, pending;
    double pending_at[PENDING], pending_yaw[PENDING], pending_var[PENDING];
    int64_t pending_sequence[PENDING];
    /* increments of the last cycles */
    int64_t cycles, consumed;
    double ring_start[RING], ring_end[RING], ring_rate[RING][3], ring_force[RING][3];
    int64_t ring_quiet[RING];
    int64_t ring_split[RECENT]; /* 0: its readings are means of cycles alone */
    double ring_parts[RECENT][PARTS];
    /* modes */
    int64_t mode, still_cycles;
    double stopped_at;
    int64_t surveyed, rate_exceeded, bias_count;
    double bias_sum[3];
    /* the last survey */
    double survey_force[3], survey_force_cov[3][3];
    int64_t smoothing;
    uint32_t surveyed_yaw;
    double surveyed_var, surveyed_with[STATES];
    /* work space of the updates */
    double h[STATES], ph[STATES], gain[STATES];
} State;

typedef struct {
    double gyro_noise[3], bias_std[3], bias_tau[3];
    double boot_bias_std, attitude_factor, bias_factor, scale_std, stamp_std, stamp_walk, still_walk;
    double aiding_floor_var, force_std, gravity, gate;
    int64_t intersection, reject_limit;
    double rate_limit, still_rate;
    int64_t lag_cycles, survey_samples, settle_cycles, static_cycles;
} Config;

/* What a cycle did. */
enum {
    STOPPED = 1,
    STARTED = 2,
    SURVEY_READY = 4,
    BIAS_KNOWN = 8,
    AIDED = 16,
    REJECTED = 32,
    YAW_RESET = 64,
    RATE_EXCEEDED = 128,
    RATE_RECOVERED = 256,
    REFERENCE_CHANGED = 512,
    BAD_SAMPLE = 1024,
    LATE_DROPPED = 2048,
    FILTER_FAULT = 4096,
    JOINT_OPENED = 8192,
    JOINT_CLOSED = 16384
};

/* What one cycle takes in: the IMU's means, and an aiding where ``aided`` says that one came before it. */
typedef struct {
    double rate[3], force[3], start, end;
    int64_t joined, aided;
    double yaw, yaw_var, systematic_var, offset, turn_rate, valid_at;
    int64_t sequence, hops;
} Input;

/* What it leaves: status bits, yaw and the variances of the eight error states, at the cycle's end. */
typedef struct {
    int64_t status;
    uint32_t yaw;
    double var[STATES];
} Output;

size_t node_size(int which); /* of State, Config, Input, Output */
size_t node_end(int which);  /* where the last field of each starts */
/* Take all inputs, ``passes`` times, each time from the state ``begin``; the last one stays in ``state``. */
void node_run(const State *begin, State *state, const Config *config, const Input *inputs, int64_t count,
              Output *outputs, int64_t passes);

#endif
