/* Angles, strapdown, error model and scalar updates of the node's filter; static, to be included once. */
#ifndef BORECHAIN_FILTER_H
#define BORECHAIN_FILTER_H

#include "node.h"

#include <math.h>

#define PI 3.14159265358979323846
#define TURN (2.0 * PI)
#define COUNTS 4294967296.0

typedef double Matrix[STATES][STATES];

static double square(double x) { return x * x; }
static double larger(double a, double b) { return a > b ? a : b; }
static double smaller(double a, double b) { return a < b ? a : b; }

/* Angles. */

static double modulo(double a, double b) /* in [0, b) for b > 0 */
{
    double rest = fmod(a, b);
    return rest < 0.0 ? rest + b : rest;
}

static double wrap(double angle) { return PI - modulo(PI - angle, TURN); }

static double wrap_positive(double angle)
{
    double wrapped = modulo(angle, TURN);
    return wrapped < TURN ? wrapped : 0.0;
}

static uint32_t to_binary(double angle) { return (uint32_t)(int64_t)floor(angle / TURN * COUNTS + 0.5); }
static uint32_t advance_binary(uint32_t binary, double increment) { return binary + to_binary(increment); }
static double from_binary(uint32_t binary) { return (double)binary * (TURN / COUNTS); }

/* Strapdown: gravity's direction by Rodrigues' formula, the rate of the yaw about the tube axis. */

static void rotate_down(double down[3], double wx, double wy, double wz, double dt)
{
    double rate = sqrt(wx * wx + wy * wy + wz * wz), angle = rate * dt;
    if (angle < 1e-12)
        return;
    double ax = wx / rate, ay = wy / rate, az = wz / rate;
    double c = cos(angle), s = sin(angle);
    double ux = down[0], uy = down[1], uz = down[2];
    double along = (ax * ux + ay * uy + az * uz) * (1.0 - c);
    double x = c * ux - s * (ay * uz - az * uy) + along * ax;
    double y = c * uy - s * (az * ux - ax * uz) + along * ay;
    double z = c * uz - s * (ax * uy - ay * ux) + along * az;
    double norm = sqrt(x * x + y * y + z * z);
    down[0] = x / norm;
    down[1] = y / norm;
    down[2] = z / norm;
}

static double yaw_rate(const double down[3], double wx, double wy, double wz)
{
    return wz + (wx * down[0] + wy * down[1]) / larger(1.0 + down[2], 1e-3);
}

/* Error model: P- = F P F^T + G Q G^T. */

static void propagate(double (*restrict P)[STATES], double wz, double dt, double turning,
                      const Config *restrict config)
{
    double c = cos(wz * dt * turning), s = sin(wz * dt * turning), step = dt * turning;
    double fade[3];
    for (int k = 0; k < 3; k++)
        fade[k] = exp(-dt / config->bias_tau[k]);
    for (int j = 0; j < STATES; j++) {
        double tx = P[TX][j], ty = P[TY][j];
        P[TX][j] = c * tx + s * ty - step * P[BX][j];
        P[TY][j] = -s * tx + c * ty - step * P[BY][j];
        P[PSI][j] -= step * (P[BZ][j] + wz * P[SCALE][j]);
        P[BX][j] *= fade[0];
        P[BY][j] *= fade[1];
        P[BZ][j] *= fade[2];
    }
    for (int i = 0; i < STATES; i++) {
        double tx = P[i][TX], ty = P[i][TY];
        P[i][TX] = c * tx + s * ty - step * P[i][BX];
        P[i][TY] = -s * tx + c * ty - step * P[i][BY];
        P[i][PSI] -= step * (P[i][BZ] + wz * P[i][SCALE]);
        P[i][BX] *= fade[0];
        P[i][BY] *= fade[1];
        P[i][BZ] *= fade[2];
    }
    double still = (1.0 - turning) * config->still_walk * config->still_walk * dt;
    double a = config->attitude_factor * config->attitude_factor * dt * turning;
    double b = config->bias_factor * config->bias_factor;
    for (int k = 0; k < 3; k++) {
        P[TX + k][TX + k] += a * square(config->gyro_noise[k]) + still;
        P[BX + k][BX + k] += b * (1.0 - fade[k] * fade[k]) * square(config->bias_std[k]);
    }
    if (config->stamp_std > 0.0)
        P[STAMP][STAMP] += config->stamp_walk * config->stamp_walk * dt;
    for (int i = 0; i < STATES; i++)
        for (int j = 0; j < i; j++)
            P[i][j] = P[j][i] = 0.5 * (P[i][j] + P[j][i]);
}

static void isolate(Matrix P, int state, double variance)
{
    for (int j = 0; j < STATES; j++)
        P[state][j] = P[j][state] = 0.0;
    P[state][state] = variance;
}

/* Scalar updates in Joseph form. */

static void clear(double h[STATES])
{
    for (int i = 0; i < STATES; i++)
        h[i] = 0.0;
}

static double innovation_var(Matrix P, const double h[STATES], double r_var, double ph[STATES])
{
    double s = r_var;
    for (int i = 0; i < STATES; i++) {
        double total = 0.0;
        for (int j = 0; j < STATES; j++)
            total += P[i][j] * h[j];
        ph[i] = total;
    }
    for (int i = 0; i < STATES; i++)
        s += h[i] * ph[i];
    return s;
}

static void joseph(double (*restrict P)[STATES], const double *restrict ph, double s, double *restrict gain)
{
    for (int i = 0; i < STATES; i++)
        gain[i] = ph[i] / s;
    for (int i = 0; i < STATES; i++)
        for (int j = i; j < STATES; j++)
            P[i][j] = P[j][i] = P[i][j] - gain[i] * ph[j] - ph[i] * gain[j] + gain[i] * s * gain[j];
}

static void feed_back(State *state, double residual)
{
    const double *gain = state->gain;
    double ex = gain[TX] * residual, ey = gain[TY] * residual;
    double ux = state->down[0], uy = state->down[1], uz = state->down[2];
    double x = ux - uz * ey, y = uy + uz * ex, z = uz + ux * ey - uy * ex;
    double norm = sqrt(x * x + y * y + z * z);
    state->down[0] = x / norm;
    state->down[1] = y / norm;
    state->down[2] = z / norm;
    for (int k = 0; k < 3; k++)
        state->bias[k] += gain[BX + k] * residual;
    state->yaw = advance_binary(state->yaw, gain[PSI] * residual);
    state->scale += gain[SCALE] * residual;
    state->stamp += gain[STAMP] * residual;
}

static void zero_rate(State *state, const double rate[3], double dt, const Config *config)
{
    for (int k = 0; k < 3; k++) {
        clear(state->h);
        state->h[BX + k] = 1.0;
        double noise = config->attitude_factor * config->gyro_noise[k];
        double s = innovation_var(state->P, state->h, noise * noise / dt, state->ph);
        joseph(state->P, state->ph, s, state->gain);
        feed_back(state, rate[k] - state->static_bias[k] - state->bias[k]);
    }
}

static void level(State *state, const double force[3], const Config *config)
{
    double r_var = square(config->force_std / config->gravity);
    for (int k = 0; k < 3; k++) {
        clear(state->h);
        if (k == 0) {
            state->h[TY] = state->down[2];
        } else if (k == 1) {
            state->h[TX] = -state->down[2];
        } else {
            state->h[TY] = -state->down[0];
            state->h[TX] = state->down[1];
        }
        double s = innovation_var(state->P, state->h, r_var, state->ph);
        double residual = force[k] / config->gravity + state->down[k];
        joseph(state->P, state->ph, s, state->gain);
        feed_back(state, residual);
    }
}

#endif
