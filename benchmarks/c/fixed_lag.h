/* The filter at the epoch of its measurements, a copy of it predicted to now; static, to be included once. */
#ifndef BORECHAIN_FIXED_LAG_H
#define BORECHAIN_FIXED_LAG_H

#include "filter.h"

#include <string.h>

static void push(State *state, double start, double end, const double rate[3], const double force[3], int64_t quiet)
{
    int64_t slot = state->cycles % RING;
    state->ring_start[slot] = start;
    state->ring_end[slot] = end;
    state->ring_quiet[slot] = quiet;
    for (int k = 0; k < 3; k++) {
        state->ring_rate[slot][k] = rate[k];
        state->ring_force[slot][k] = force[k];
    }
    state->cycles++;
    if (state->cycles == 1)
        state->epoch = start;
}

static int stood_still(const State *state, int64_t cycle)
{
    if (state->ring_quiet[cycle % RING] == 0 || cycle == 0 || state->ring_quiet[(cycle - 1) % RING] == 0)
        return 0;
    return cycle + 1 >= state->cycles || state->ring_quiet[(cycle + 1) % RING] != 0;
}

static double true_rate_z(const State *state, double measured)
{
    return (measured - state->static_bias[2] - state->bias[2]) / (1.0 + state->scale);
}

static double slope(const State *state, int64_t cycle)
{
    if (cycle == 0 || cycle + 1 >= state->cycles)
        return 0.0;
    int64_t before = (cycle - 1) % RING, after = (cycle + 1) % RING;
    double apart = 0.5 * (state->ring_start[after] + state->ring_end[after] - state->ring_start[before] -
                          state->ring_end[before]);
    return (state->ring_rate[after][2] - state->ring_rate[before][2]) / apart;
}

/* mean spin from begin to end inside a cycle: it changes linearly about the cycle's mean */
static double spin(const State *state, int64_t cycle, double begin, double end)
{
    if (stood_still(state, cycle))
        return 0.0;
    int64_t slot = cycle % RING;
    double inside = larger(begin, state->ring_start[slot]);
    double off_centre = 0.5 * (inside + end - state->ring_start[slot] - state->ring_end[slot]);
    return true_rate_z(state, state->ring_rate[slot][2] + slope(state, cycle) * off_centre);
}

static uint32_t turn(const State *state, const Config *config, int64_t cycle, double begin, double end, uint32_t yaw,
                     double down[3], Matrix P)
{
    int64_t slot = cycle % RING;
    double dt = end - begin;
    if (stood_still(state, cycle)) {
        propagate(P, 0.0, dt, 0.0, config);
        return yaw;
    }
    double wx = state->ring_rate[slot][0] - state->static_bias[0] - state->bias[0];
    double wy = state->ring_rate[slot][1] - state->static_bias[1] - state->bias[1];
    double wz = spin(state, cycle, begin, end);
    rotate_down(down, wx, wy, wz, 0.5 * dt);
    double turned = yaw_rate(down, wx, wy, wz) * dt;
    rotate_down(down, wx, wy, wz, 0.5 * dt);
    propagate(P, wz, dt, 1.0, config);
    if (down[2] < INVERTED)
        isolate(P, PSI, UNKNOWN_YAW_VAR);
    return advance_binary(yaw, turned);
}

/* Variance of the yaw by a gap (s) of lost cycles before a cycle: the faster rate of its two sides, as large as itself. */
static double missed_var(const State *state, int64_t cycle, double gap)
{
    double fastest = fabs(state->ring_rate[cycle % RING][2]);
    if (cycle > 0)
        fastest = larger(fastest, fabs(state->ring_rate[(cycle - 1) % RING][2]));
    return square(fastest * gap);
}

static void advance(State *state, const Config *config, int64_t cycle, double until)
{
    double dt = until - state->epoch;
    if (dt <= 0.0)
        return;
    double gap = state->ring_start[cycle % RING] - state->epoch;
    state->yaw = turn(state, config, cycle, state->epoch, until, state->yaw, state->down, state->P);
    if (gap > 1e-3)
        state->P[PSI][PSI] += missed_var(state, cycle, gap);
    for (int k = 0; k < 3; k++)
        state->bias[k] *= exp(-dt / config->bias_tau[k]);
    state->epoch = until;
}

static double interpolation_var(const State *state, int64_t cycle, double at)
{
    int64_t slot = cycle % RING;
    if (cycle == 0)
        return 0.0;
    double inside = smaller(at - state->ring_start[slot], state->ring_end[slot] - at);
    double bend = 2.0 * (state->ring_rate[slot][2] - state->ring_rate[(cycle - 1) % RING][2]);
    if (cycle + 1 < state->cycles)
        bend = 0.5 * bend - (state->ring_rate[(cycle + 1) % RING][2] - state->ring_rate[slot][2]);
    double curved = slope(state, cycle) * state->P[STAMP][STAMP];
    return square(0.25 * bend) * (square(inside) + state->P[STAMP][STAMP]) + 0.75 * curved * curved;
}

static void reset_yaw(State *state, const Config *config, double yaw, double var)
{
    state->yaw = to_binary(yaw);
    isolate(state->P, PSI, var);
    isolate(state->P, BZ, larger(square(config->bias_std[2]) + state->static_bias_var[2], state->P[BZ][BZ]));
    state->bias[2] = 0.0;
    state->yaw_known = 1;
    state->rejected = 0;
}

static int64_t aid(State *state, const Config *config, double yaw, double r_var, double rate, double at)
{
    if (!state->yaw_known) {
        reset_yaw(state, config, yaw, r_var + square(rate * config->stamp_std));
        state->last_aided = at;
        return AIDED | YAW_RESET;
    }
    clear(state->h);
    state->h[PSI] = 1.0;
    if (config->stamp_std > 0.0)
        state->h[STAMP] = rate;
    double s = innovation_var(state->P, state->h, r_var, state->ph);
    double residual = wrap(yaw - from_binary(state->yaw));
    state->innovation = residual;
    state->innovation_var = s;
    if (residual * residual > config->gate * config->gate * s) {
        state->rejected++;
        state->last_sequence = -1;
        if (state->rejected < config->reject_limit)
            return REJECTED;
        reset_yaw(state, config, yaw, r_var + square(rate * config->stamp_std));
        isolate(state->P, STAMP, square(config->stamp_std));
        state->stamp = 0.0;
        state->last_aided = at;
        return REJECTED | AIDED | YAW_RESET;
    }
    joseph(state->P, state->ph, s, state->gain);
    feed_back(state, residual);
    state->rejected = 0;
    state->last_aided = at;
    return AIDED;
}

static int64_t aid_late(State *state, const Config *config, double yaw, double var, double at)
{
    double moved = yaw, rate = 0.0, earliest = state->epoch;
    int64_t cycle = state->consumed;
    for (; cycle >= 0 && cycle > state->cycles - RING && earliest > at; cycle--) {
        int64_t slot = cycle % RING;
        double begin = larger(state->ring_start[slot], at);
        if (begin < earliest) {
            moved += spin(state, cycle, begin, earliest) * (earliest - begin);
            rate = spin(state, cycle, begin, begin);
            earliest = begin;
        }
    }
    if (earliest > at + 1e-3)
        return LATE_DROPPED;
    double lag = state->epoch - at;
    var += interpolation_var(state, cycle + 1, at);
    double noise = square(config->gyro_noise[2]) * lag + state->P[BZ][BZ] * lag * lag;
    return aid(state, config, moved, var + noise, rate, at);
}

static void move_pending(State *state, int64_t to, int64_t from)
{
    state->pending_at[to] = state->pending_at[from];
    state->pending_yaw[to] = state->pending_yaw[from];
    state->pending_var[to] = state->pending_var[from];
    state->pending_sequence[to] = state->pending_sequence[from];
}

static void drop_first_pending(State *state)
{
    state->pending--;
    for (int64_t k = 0; k < state->pending; k++)
        move_pending(state, k, k + 1);
}

static void drop_repetitions(State *state)
{
    while (state->pending > 1 && state->pending_sequence[1] == state->pending_sequence[0]
           && state->pending_yaw[1] == state->pending_yaw[0])
        drop_first_pending(state);
}

static int64_t take_pending(State *state, const Config *config, int64_t cycle, double until)
{
    int64_t status = 0;
    while (state->pending > 0 && state->pending_at[0] <= until + CLOCK_SLACK) {
        double at = state->pending_at[0] + state->stamp, yaw = state->pending_yaw[0], var = state->pending_var[0];
        double held = smaller(at, until);
        if (held >= state->epoch) {
            advance(state, config, cycle, held);
            yaw -= spin(state, cycle, held, at) * (at - held);
            double spread = interpolation_var(state, cycle, at);
            int64_t used = aid(state, config, yaw, var + spread, spin(state, cycle, held, held), at);
            status |= used;
            if (spread > COARSE * var)
                state->last_sequence = -1;
            else if (used == AIDED)
                drop_repetitions(state);
        } else {
            status |= aid_late(state, config, yaw, var, at);
        }
        drop_first_pending(state);
    }
    return status;
}

static int64_t consume(State *state, const Config *config)
{
    int64_t status = 0;
    while (state->consumed < state->cycles - config->lag_cycles) {
        int64_t cycle = state->consumed, slot = cycle % RING;
        double end = state->ring_end[slot];
        status |= take_pending(state, config, cycle, end);
        advance(state, config, cycle, end);
        if (stood_still(state, cycle)) {
            zero_rate(state, state->ring_rate[slot], end - state->ring_start[slot], config);
            level(state, state->ring_force[slot], config);
        }
        state->consumed++;
    }
    return status;
}

static void predict_to_now(State *state, const Config *config)
{
    memcpy(state->now_P, state->P, sizeof state->P);
    memcpy(state->now_down, state->down, sizeof state->down);
    state->now_yaw = state->yaw;
    state->now = state->epoch;
    for (int64_t cycle = state->consumed; cycle < state->cycles; cycle++) {
        double end = state->ring_end[cycle % RING];
        if (end > state->now) {
            double gap = state->ring_start[cycle % RING] - state->now;
            state->now_yaw = turn(state, config, cycle, state->now, end, state->now_yaw, state->now_down, state->now_P);
            if (gap > 1e-3)
                state->now_P[PSI][PSI] += missed_var(state, cycle, gap);
            state->now = end;
        }
    }
    state->now_rate = true_rate_z(state, state->ring_rate[(state->cycles - 1) % RING][2]);
}

#endif
