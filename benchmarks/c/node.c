/* The node's execution cycle: modes, relay and the whole; see node.h. */
#include "fixed_lag.h"
#include "node.h"

#include <math.h>

enum { STATIC_BIAS = 1, TRACKING = 3, STILL = 4, SURVEY = 5, HELD = 6 };

static const double UNBIASED_STILL_RATE = 0.0087; /* rad/s */

/* Modes. */

static int64_t is_quiet(const State *state, const Config *config, const double rate[3])
{
    for (int k = 0; k < 3; k++) {
        if (state->mode == STATIC_BIAS) {
            if (!(fabs(rate[k]) < UNBIASED_STILL_RATE))
                return 0;
        } else {
            double limit = k == 2 ? config->still_rate : 2.0 * config->still_rate;
            if (fabs(rate[k] - state->static_bias[k] - state->bias[k]) > limit)
                return 0;
        }
    }
    return 1;
}

static int64_t learn_static_bias(State *state, const Config *config, const double rate[3], double dt, int64_t quiet)
{
    if (!quiet) {
        state->bias_count = 0;
        for (int k = 0; k < 3; k++)
            state->bias_sum[k] = 0.0;
        return 0;
    }
    state->bias_count++;
    for (int k = 0; k < 3; k++)
        state->bias_sum[k] += rate[k];
    if (state->bias_count < config->static_cycles)
        return 0;
    double total = (double)state->bias_count * dt;
    for (int k = 0; k < 3; k++) {
        state->static_bias[k] = state->bias_sum[k] / (double)state->bias_count;
        double correlated = 2.0 * square(config->bias_std[k]) * config->bias_tau[k] / total;
        state->static_bias_var[k] = square(config->gyro_noise[k]) / total + correlated;
        state->bias[k] = 0.0;
        isolate(state->P, BX + k, square(config->bias_std[k]) + state->static_bias_var[k]);
    }
    state->mode = TRACKING;
    return BIAS_KNOWN;
}

static int64_t guard_rate(State *state, const Config *config, double rate_z)
{
    if (fabs(rate_z) >= config->rate_limit) {
        int first = state->rate_exceeded == 0;
        state->rate_exceeded = 1;
        state->yaw_known = 0;
        isolate(state->P, PSI, UNKNOWN_YAW_VAR);
        return first ? RATE_EXCEEDED : 0;
    }
    if (state->rate_exceeded) {
        state->rate_exceeded = 0;
        return RATE_RECOVERED;
    }
    return 0;
}

static void average_force(State *state, int64_t samples)
{
    double *mean = state->survey_force, n = (double)samples;
    for (int i = 0; i < 3; i++) {
        mean[i] = 0.0;
        for (int64_t k = 0; k < samples; k++)
            mean[i] += state->ring_force[(state->cycles - 1 - k) % RING][i];
        mean[i] /= n;
    }
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++) {
            double total = 0.0;
            for (int64_t k = 0; k < samples; k++) {
                const double *force = state->ring_force[(state->cycles - 1 - k) % RING];
                total += (force[i] - mean[i]) * (force[j] - mean[j]);
            }
            state->survey_force_cov[i][j] = state->survey_force_cov[j][i] = total / (n * (n - 1.0));
        }
}

static int64_t step_modes(State *state, const Config *config, int64_t quiet, int64_t joined, double end)
{
    int64_t status = state->mode == HELD && (joined == 1 || !quiet) ? JOINT_CLOSED : 0;
    if (!quiet) {
        if (state->still_cycles > 0)
            status |= STARTED;
        state->still_cycles = 0;
        state->surveyed = 0;
        if (state->mode != STATIC_BIAS)
            state->mode = TRACKING;
        return status;
    }
    if (state->still_cycles == 0) {
        state->stopped_at = end;
        status |= STOPPED;
    }
    state->still_cycles++;
    if (state->mode == STATIC_BIAS)
        return status;
    if (joined == 0 && state->mode != HELD)
        status |= JOINT_OPENED;
    state->mode = joined == 1 ? STILL : HELD;
    if (!state->surveyed && joined == 1 && state->still_cycles >= config->settle_cycles) {
        average_force(state, config->survey_samples);
        state->surveyed = 1;
        state->mode = SURVEY;
        status |= SURVEY_READY;
    }
    return status;
}

/* Relay. */

static int64_t change_reference(State *state, const Config *config, const Input *in)
{
    int first = state->reference_hops < 0;
    double step_var = state->systematic_var + in->systematic_var;
    state->reference_hops = in->hops;
    state->reference_offset = in->offset;
    state->systematic_var = in->systematic_var;
    state->pending = 0;
    if (first || !state->yaw_known)
        return 0;
    isolate(state->P, PSI, state->P[PSI][PSI] + step_var);
    if (config->stamp_std > 0.0)
        isolate(state->P, STAMP, state->P[STAMP][STAMP] + square(config->stamp_std));
    return REFERENCE_CHANGED;
}

static int64_t offer_aiding(State *state, const Config *config, const Input *in)
{
    int64_t status = 0;
    if (in->hops != state->reference_hops || fabs(wrap(in->offset - state->reference_offset)) > 1e-9) {
        status = change_reference(state, config, in);
    } else if (in->sequence == state->last_sequence) {
        if (state->pending > 0)
            return status;
        if (state->yaw_known) {
            state->last_aided = larger(state->last_aided, in->valid_at);
            return status;
        }
    }
    if (state->pending == PENDING)
        return status;
    int64_t slot = state->pending;
    for (; slot > 0 && state->pending_at[slot - 1] > in->valid_at; slot--)
        move_pending(state, slot, slot - 1);
    state->pending_at[slot] = in->valid_at;
    state->pending_yaw[slot] = wrap_positive(in->yaw + in->offset);
    state->pending_var[slot] = in->yaw_var + config->aiding_floor_var;
    state->pending_sequence[slot] = in->sequence;
    state->pending++;
    state->last_sequence = in->sequence;
    state->systematic_var = in->systematic_var;
    return status;
}

/* The cycle. */

static int64_t run_cycle(State *state, const Config *config, const Input *in)
{
    for (int k = 0; k < 3; k++)
        if (!(isfinite(in->rate[k]) && isfinite(in->force[k])))
            return BAD_SAMPLE;
    int64_t quiet = is_quiet(state, config, in->rate);
    int64_t status = guard_rate(state, config, in->rate[2]);
    push(state, in->start, in->end, in->rate, in->force, quiet);
    if (state->mode == STATIC_BIAS)
        status |= learn_static_bias(state, config, in->rate, in->end - in->start, quiet);
    status |= consume(state, config);
    predict_to_now(state, config);
    status |= step_modes(state, config, quiet, in->joined, in->end);
    for (int i = 0; i < STATES; i++)
        if (!(state->P[i][i] >= 0.0 && isfinite(state->P[i][i])))
            return status | FILTER_FAULT;
    return status;
}

void node_run(const State *begin, State *state, const Config *config, const Input *inputs, int64_t count,
              Output *outputs, int64_t passes)
{
    for (int64_t pass = 0; pass < passes; pass++) {
        *state = *begin;
        for (int64_t k = 0; k < count; k++) {
            int64_t status = inputs[k].aided ? offer_aiding(state, config, &inputs[k]) : 0;
            outputs[k].status = status | run_cycle(state, config, &inputs[k]);
            outputs[k].yaw = state->now_yaw;
            for (int i = 0; i < STATES; i++)
                outputs[k].var[i] = state->now_P[i][i];
        }
    }
}

size_t node_size(int which)
{
    const size_t sizes[] = {sizeof(State), sizeof(Config), sizeof(Input), sizeof(Output)};
    return sizes[which];
}

size_t node_end(int which)
{
    const size_t ends[] = {offsetof(State, gain), offsetof(Config, static_cycles), offsetof(Input, hops),
                           offsetof(Output, var)};
    return ends[which];
}
