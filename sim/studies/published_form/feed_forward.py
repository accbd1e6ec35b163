"""One execution cycle of the published, feed-forward form, behind the interface of the default kernel.

The integrator runs by itself (``down``, ``yaw``). Six error states are estimated beside it and taken off at the output
(``now_down``, ``now_yaw``), never fed back; what the two differ by is the estimate. No scale factor, no time stamp, no
zero-rate update, no gate, no lag: an aiding is taken when the next cycle begins. Source: thesis 3.5.
"""

from __future__ import annotations

import math
from typing import Any

from node.kernels.arithmetic.angles import advance_binary, from_binary, wrap_angle
from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.filter.covariance import isolate_state
from node.kernels.filter.float64.fixed_lag import AIDED, YAW_RESET, reset_yaw
from node.kernels.filter.float64.propagation import BX, PSI, TX, TY
from node.kernels.filter.float64.update import clear_row, innovation_var, joseph_update
from node.kernels.filter.modes import STATIC_BIAS, SURVEY_READY, guard_rate, is_quiet, learn_static_bias, step_modes
from node.kernels.filter.moving_average import average_force
from node.kernels.record.filter_record import STATES, UNKNOWN_YAW_VAR, CycleStatus
from node.kernels.record.ring import drop_first_pending, push_increments
from node.kernels.string import relay
from sim.studies.published_form.euler_angles import (
    ATTITUDE,
    error_rates,
    euler_rates,
    geometry_of,
    point_down,
    propagate_covariance,
    tilt_of,
)

BAD_SAMPLE, FILTER_FAULT = int(CycleStatus.BAD_SAMPLE), int(CycleStatus.FILTER_FAULT)
STEEPEST = math.pi / 3.0  # rad, of phi and theta, beyond which the tilt has diverged
UNKNOWN_TILT_VAR = 0.25  # rad^2


@kernel
def run_cycle(state: Any, config: Any, rate: Array, force: Array, start: float, end: float, joined: int) -> int:
    """One execution cycle as ``node.kernels.filter.float64.cycle.run_cycle``.

    A tilt that diverged starts upright again and the yaw is unknown until the next aiding, which resets it.
    """
    for k in range(3):
        if not (math.isfinite(rate[k]) and math.isfinite(force[k])):
            return BAD_SAMPLE
    quiet = is_quiet(state, config, rate)
    status = guard_rate(state, config, rate[2])
    push_increments(state, start, end, rate, force, quiet)
    state.consumed = state.cycles
    if state.mode == STATIC_BIAS:
        status |= learn_static_bias(state, config, rate, end - start, quiet)
    settle_tilt(state, config, force, quiet)
    status |= take_aiding(state, config)
    step_integrator(state, config, rate, end)
    status |= step_modes(state, config, quiet, joined, end)
    if status & SURVEY_READY:
        average_force(state, config.survey_samples)
    for i in range(STATES):
        for j in range(STATES):
            state.now_P[i, j] = state.P[i, j]
        if not (state.P[i, i] >= 0.0 and math.isfinite(state.P[i, i])):
            status |= FILTER_FAULT
    return status


@kernel
def offer_aiding(
    state: Any,
    config: Any,
    yaw: float,
    yaw_var: float,
    systematic_var: float,
    offset: float,
    valid_at: float,
    sequence: int,
    hops: int,
) -> int:
    """Queue one aiding as ``node.kernels.string.relay.offer_aiding``; a repetition is a measurement like any other."""
    state.last_sequence = -1
    return relay.offer_aiding(state, config, yaw, yaw_var, systematic_var, offset, valid_at, sequence, hops)


@kernel
def settle_tilt(state: Any, config: Any, force: Array, quiet: int) -> None:
    """Align a tilt that is not known from the specific force (3, m/s^2) of a ``quiet`` cycle; else hold its variance.

    Explicit steps let the variance of the tilt grow without end while the string turns.
    """
    if state.P[TX, TX] < UNKNOWN_TILT_VAR and state.P[TY, TY] < UNKNOWN_TILT_VAR:
        return
    weight = math.sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2)
    variance = UNKNOWN_TILT_VAR
    if quiet == 1 and weight > 0.5 * config.gravity:
        variance = (config.force_std / config.gravity) ** 2
        for k in range(3):
            state.down[k] = -force[k] / weight
    isolate_state(state.P, TX, variance)
    isolate_state(state.P, TY, variance)
    for k in range(3):
        state.now_down[k] = state.down[k]


@kernel
def take_aiding(state: Any, config: Any) -> int:
    """Update by every waiting aiding, moved from its time of validity by the last rate; returns ``CycleStatus`` bits.

    Source: thesis eq. 3.29. An aiding that is dated by its arrival is thereby not compensated.
    """
    status = 0
    while state.pending > 0:
        at = state.pending_at[0]
        status |= apply_aiding(
            state, config, state.pending_yaw[0] + state.now_rate * (state.epoch - at), state.pending_var[0]
        )
        state.last_aided = at
        drop_first_pending(state)
    return status


@kernel
def apply_aiding(state: Any, config: Any, yaw: float, r_var: float) -> int:
    """Update the error states with z = psi (rad) at the epoch; returns ``CycleStatus`` bits."""
    if state.yaw_known == 0:
        reset_yaw(state, config, yaw, r_var)
        state.now_yaw = state.yaw
        return AIDED | YAW_RESET
    clear_row(state.h)
    state.h[PSI] = 1.0
    s = innovation_var(state.P, state.h, r_var, state.ph)
    residual = wrap_angle(yaw - from_binary(state.now_yaw))
    state.innovation = residual
    state.innovation_var = s
    joseph_update(state.P, state.ph, s, state.gain)
    phi, theta = tilt_of(state.now_down)
    point_down(state.now_down, phi + state.gain[TX] * residual, theta + state.gain[TY] * residual)
    state.now_yaw = advance_binary(state.now_yaw, state.gain[PSI] * residual)
    for k in range(ATTITUDE):
        state.bias[k] += state.gain[BX + k] * residual
    return AIDED


@kernel
def step_integrator(state: Any, config: Any, rate: Array, until: float) -> None:
    """Step the integrator and the errors beside it to ``until`` (s) by the mean ``rate`` (3, rad/s)."""
    dt = until - state.epoch
    if dt <= 0.0:
        return
    wx, wy, wz = rate[0] - state.static_bias[0], rate[1] - state.static_bias[1], rate[2] - state.static_bias[2]
    phi, theta = tilt_of(state.down)
    phi_hat, theta_hat = tilt_of(state.now_down)
    psi_error = wrap_angle(from_binary(state.now_yaw) - from_binary(state.yaw))
    at = geometry_of(phi, theta, wy, wz)
    turning = euler_rates(wx, at)
    drift = error_rates(wrap_angle(phi_hat - phi), theta_hat - theta, state.bias[0], state.bias[1], state.bias[2], at)
    phi, theta = phi + dt * turning[0], theta + dt * turning[1]
    phi_hat, theta_hat = phi_hat + dt * (turning[0] + drift[0]), theta_hat + dt * (turning[1] + drift[1])
    if max(abs(phi), abs(theta)) < STEEPEST and max(abs(phi_hat), abs(theta_hat)) < STEEPEST:
        point_down(state.down, phi, theta)
        point_down(state.now_down, phi_hat, theta_hat)
        state.yaw = advance_binary(state.yaw, dt * turning[2])
        state.now_yaw = advance_binary(state.yaw, psi_error + dt * drift[2])
        state.now_rate = turning[2] + drift[2]
        propagate_covariance(state.P, dt, at, config)
    else:
        state.now_rate = wz - state.bias[2]
        start_upright(state, dt)
    for k in range(ATTITUDE):
        state.bias[k] *= math.exp(-dt / config.bias_tau[k])
    state.epoch = until
    state.now = until


@kernel
def start_upright(state: Any, dt: float) -> None:
    """Begin the tilt anew; the yaw turns on for ``dt`` (s) by the z gyroscope and waits for the next aiding."""
    point_down(state.down, 0.0, 0.0)
    point_down(state.now_down, 0.0, 0.0)
    isolate_state(state.P, TX, UNKNOWN_TILT_VAR)
    isolate_state(state.P, TY, UNKNOWN_TILT_VAR)
    isolate_state(state.P, PSI, UNKNOWN_YAW_VAR)
    state.yaw_known = 0
    state.yaw = advance_binary(state.now_yaw, dt * state.now_rate)
    state.now_yaw = state.yaw
