"""Conversion at the edge of the integer loop: configuration, state, readings and aiding, SI floats and Q formats.

Here alone a float becomes an integer and an integer a float, beside the loop and never inside it: readings once a
cycle, configuration and state when they were changed from outside. What does not fit is held at the end of its range
and counted in ``overflows``. Nothing allocates: integers go into records that are given.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from node.kernels.arithmetic.formats import (
    ANGLE_Q,
    CEILING,
    FACTOR_Q,
    FASTEST,
    FORCE_Q,
    LEVEL_Q,
    NEVER,
    RATE_Q,
    STRONGEST,
    TAU_Q,
    TIME_Q,
    UNIT,
    VAR_Q,
    VECTOR_Q,
    Array,
)
from node.kernels.arithmetic.jit import kernel
from node.kernels.record.filter_record import STATES, Err
from node.kernels.record.integer_filter import FIXED_CONFIG, FIXED_STATE

LARGEST: Final = 1 << 61
YAW: Final = int(Err.YAW)
LIMIT: Final = 2.0**61  # the same, which a float holds exactly
HIGHEST: Final = float(CEILING)
LOG2_E: Final = math.log2(math.e)
UNITS: Final = np.array([0] * int(Err.BIAS_X) + [UNIT] * (len(Err) - int(Err.BIAS_X)))
COVARIANCE: Final = np.exp2(VAR_Q + UNITS[:, None] + UNITS[None, :])
COUNT: Final = 1.0 / COVARIANCE  # powers of two: nothing is lost
TURN: Final = 2.0 * math.pi


@kernel
def to_fixed(record: Any, value: float, q: int, limit: int) -> int:
    """``value`` in Q``q``, held within -limit..limit and then counted."""
    scaled = np.floor(value * 2.0**q + 0.5)  # a float: beyond 64 bits an integer would be of either sign
    if not abs(scaled) <= limit:
        record.overflows += 1
        return -limit if scaled < 0.0 else limit
    return int(scaled)


@kernel
def take_reading(fixed: Any, rate: Array, force: Array, gravity: float, fixed_rate: Array, fixed_force: Array) -> None:
    """Mean rate (3, rad/s) and specific force (3, m/s^2) of a cycle as Q46 rad/s and Q26 g."""
    for k in range(3):
        fixed_rate[k] = to_fixed(fixed, rate[k], RATE_Q, FASTEST)
        fixed_force[k] = to_fixed(fixed, force[k] / gravity, FORCE_Q, STRONGEST)


@kernel
def show_cycle(fixed: Any, state: Any, gravity: float) -> None:
    """Write what one cycle may have changed into the float64 record ``state``, but for covariances and the queue."""
    slot = (fixed.cycles - 1) % fixed.ring_start.shape[0]
    rate, time, vector = 2.0**-RATE_Q, 2.0**-TIME_Q, 2.0**-VECTOR_Q
    state.ring_start[slot], state.ring_end[slot] = fixed.ring_start[slot] * time, fixed.ring_end[slot] * time
    state.ring_quiet[slot] = fixed.ring_quiet[slot]
    for cycle in range(max(fixed.cycles - 2, 0), fixed.cycles):  # a late window puts the cycle before right
        recent, before = cycle % fixed.ring_split.shape[0], cycle % fixed.ring_start.shape[0]
        state.ring_split[recent] = fixed.ring_split[recent]
        state.ring_rate[before, 2] = fixed.ring_rate[before, 2] * rate
        for j in range(fixed.ring_parts.shape[1]):
            state.ring_parts[recent, j] = fixed.ring_parts[recent, j] * rate
    for k in range(3):
        state.ring_rate[slot, k] = fixed.ring_rate[slot, k] * rate
        state.ring_force[slot, k] = fixed.ring_force[slot, k] * (2.0**-FORCE_Q * gravity)
        state.down[k], state.now_down[k] = fixed.down[k] * vector, fixed.now_down[k] * vector
        state.static_bias[k], state.bias[k] = fixed.static_bias[k] * rate, fixed.bias[k] * rate
        state.static_bias_var[k] = fixed.static_bias_var[k] * 2.0 ** -(VAR_Q + 2 * UNIT)
        state.bias_sum[k] = fixed.bias_sum[k] * rate
    state.epoch, state.now = fixed.epoch * time, fixed.now * time
    state.yaw, state.now_yaw, state.yaw_known = fixed.yaw, fixed.now_yaw, fixed.yaw_known
    state.scale, state.stamp, state.now_rate = fixed.scale * rate, fixed.stamp * rate, fixed.now_rate * rate
    state.innovation, state.innovation_var = fixed.innovation * 2.0**-ANGLE_Q, fixed.innovation_var * 2.0**-VAR_Q
    state.rejected, state.cycles, state.consumed = fixed.rejected, fixed.cycles, fixed.consumed
    state.mode, state.still_cycles, state.surveyed = fixed.mode, fixed.still_cycles, fixed.surveyed
    state.rate_exceeded, state.bias_count = fixed.rate_exceeded, fixed.bias_count
    state.smoothing, state.surveyed_yaw = fixed.smoothing, fixed.surveyed_yaw
    state.stopped_at = fixed.stopped_at * time if fixed.stopped_at != NEVER else math.nan


@kernel
def show_ring(fixed: Any, state: Any, gravity: float) -> None:
    """Write the readings of all last cycles into the float64 record: they turned with the frame."""
    for slot in range(fixed.ring_start.shape[0]):
        for k in range(3):
            state.ring_rate[slot, k] = fixed.ring_rate[slot, k] * 2.0**-RATE_Q
            state.ring_force[slot, k] = fixed.ring_force[slot, k] * (2.0**-FORCE_Q * gravity)


@kernel
def show_covariance(fixed: Any, state: Any) -> None:
    """Write the covariances into the float64 record."""
    for i in range(STATES):
        for j in range(STATES):
            state.P[i, j] = fixed.P[i, j] * COUNT[i, j]
            state.now_P[i, j] = fixed.now_P[i, j] * COUNT[i, j]
    state.surveyed_var = fixed.surveyed_var * COUNT[YAW, YAW]
    for j in range(STATES):
        state.surveyed_with[j] = fixed.surveyed_with[j] * COUNT[YAW, j]


@kernel
def show_survey(fixed: Any, state: Any, gravity: float) -> None:
    """Write the last survey (g) into the float64 record (m/s^2)."""
    unit = gravity * 2.0**-FORCE_Q
    for i in range(3):
        state.survey_force[i] = fixed.survey_force[i] * unit
        for j in range(3):
            state.survey_force_cov[i, j] = fixed.survey_force_cov[i, j] * unit * unit


@kernel
def show_aiding(fixed: Any, state: Any) -> None:
    """Write the reference, its age and the queue of measurements into the float64 record."""
    angle = 2.0 * math.pi / 4294967296.0
    state.reference_hops, state.reference_offset = fixed.reference_hops, fixed.reference_offset * angle
    state.systematic_var = fixed.systematic_var * 2.0**-VAR_Q
    state.last_sequence, state.pending = fixed.last_sequence, fixed.pending
    state.last_aided = fixed.last_aided * 2.0**-TIME_Q if fixed.last_aided != NEVER else -math.inf
    for k in range(fixed.pending):
        state.pending_at[k] = fixed.pending_at[k] * 2.0**-TIME_Q
        state.pending_yaw[k] = fixed.pending_yaw[k] * angle
        state.pending_var[k] = fixed.pending_var[k] * 2.0**-VAR_Q
        state.pending_sequence[k] = fixed.pending_sequence[k]


@kernel
def saturated_integer(record: Any, value: float) -> int:
    """Nearest integer of ``value``, ties to even, held within its range and then counted; NaN is 0 and counted."""
    nearest = np.rint(value)
    if abs(nearest) <= LIMIT:
        return int(nearest)
    record.overflows += 1
    if nearest > LIMIT:
        return LARGEST
    return -LARGEST if nearest < -LIMIT else 0


@kernel
def hold_vector(record: Any, made: Array, given: Array, scale: float) -> None:
    """Integers ``made`` (n,) of ``given`` (n,) times ``scale``, a power of two."""
    for k in range(made.shape[0]):
        made[k] = saturated_integer(record, given[k] * scale)


@kernel
def hold_forces(record: Any, made: Array, given: Array, gravity: float) -> None:
    """Forces ``made`` (3, g, Q26) of ``given`` (3, m/s^2)."""
    for k in range(3):
        made[k] = saturated_integer(record, given[k] / gravity * 2.0**FORCE_Q)


@kernel
def whole_yaw(angle: float) -> int:
    """Binary angle of ``angle`` (rad) of any size, 2^32 a turn; 0 if it is not finite."""
    if not math.isfinite(angle):
        return 0
    return math.floor(angle % TURN / TURN * 4294967296.0 + 0.5) & 0xFFFFFFFF


@kernel
def time_or_never(record: Any, time: float) -> int:
    """A time (s) in Q28, ``NEVER`` of one that is not finite."""
    return saturated_integer(record, time * 2.0**TIME_Q) if math.isfinite(time) else NEVER


@kernel
def ceiling_factor(variance: float) -> float:
    """Factor of a row and a column by which ``variance`` (Q56) comes down to its ceiling; 1 where it is not above."""
    return math.sqrt(HIGHEST / variance) if variance > HIGHEST else 1.0


@kernel
def hold_covariance(record: Any, made: Array, given: Array, scale: Array) -> None:
    """A covariance whose variances are held at their ceiling, by scaling rows and columns: it stays positive.

    Parameters
    ----------
    made, given : (8, 8) in Q56 and in SI units
    scale : (8, 8) the value of 1
    """
    for i in range(made.shape[0]):
        row = ceiling_factor(given[i, i] * scale[i, i])
        if row < 1.0:
            record.overflows += 1
        for j in range(made.shape[1]):
            made[i, j] = saturated_integer(
                record, given[i, j] * scale[i, j] * row * ceiling_factor(given[j, j] * scale[j, j])
            )


@kernel
def learn_state(fixed: Any, state: Any, gravity: float) -> None:
    """Fill the integers ``fixed`` from a whole float64 ``state``; what does not fit adds to ``fixed.overflows``.

    Parameters
    ----------
    fixed, state : records of dtype ``FIXED_STATE`` and ``STATE``
    gravity : m/s^2
    """
    learn_filter(fixed, state)
    learn_aiding(fixed, state)
    learn_ring(fixed, state, gravity)
    learn_modes(fixed, state)
    hold_forces(fixed, fixed.survey_force, state.survey_force, gravity)
    for i in range(3):
        for j in range(3):
            share = state.survey_force_cov[i, j] / (gravity * gravity)
            fixed.survey_force_cov[i, j] = saturated_integer(fixed, share * 4.0**FORCE_Q)
    fixed.smoothing, fixed.surveyed_yaw = state.smoothing, state.surveyed_yaw
    fixed.surveyed_var = saturated_integer(fixed, state.surveyed_var * COVARIANCE[YAW, YAW])
    for j in range(STATES):
        fixed.surveyed_with[j] = saturated_integer(fixed, state.surveyed_with[j] * COVARIANCE[YAW, j])
    fixed.gain_q = 0
    for k in range(fixed.gain.shape[0]):
        fixed.ph[k] = fixed.rest[k] = fixed.gain[k] = 0
    for k in range(3):
        fixed.decay[k] = 0


@kernel
def learn_filter(fixed: Any, state: Any) -> None:
    """Read the filter, at its own epoch and predicted to now."""
    rate, vector = 2.0**RATE_Q, 2.0**VECTOR_Q
    fixed.epoch, fixed.now = (
        saturated_integer(fixed, state.epoch * 2.0**TIME_Q),
        saturated_integer(fixed, state.now * 2.0**TIME_Q),
    )
    fixed.yaw, fixed.now_yaw, fixed.yaw_known = state.yaw, state.now_yaw, state.yaw_known
    hold_vector(fixed, fixed.down, state.down, vector)
    hold_vector(fixed, fixed.now_down, state.now_down, vector)
    hold_vector(fixed, fixed.static_bias, state.static_bias, rate)
    hold_vector(fixed, fixed.static_bias_var, state.static_bias_var, 2.0 ** (VAR_Q + 2 * UNIT))
    hold_vector(fixed, fixed.bias, state.bias, rate)
    fixed.scale, fixed.stamp = (
        saturated_integer(fixed, state.scale * rate),
        saturated_integer(fixed, state.stamp * rate),
    )
    fixed.now_rate = saturated_integer(fixed, state.now_rate * rate)
    hold_covariance(fixed, fixed.P, state.P, COVARIANCE)
    hold_covariance(fixed, fixed.now_P, state.now_P, COVARIANCE)


@kernel
def learn_aiding(fixed: Any, state: Any) -> None:
    """Read the reference, its age and the queue of measurements."""
    fixed.reference_hops, fixed.reference_offset = state.reference_hops, whole_yaw(state.reference_offset)
    fixed.systematic_var = saturated_integer(fixed, state.systematic_var * 2.0**VAR_Q)
    fixed.last_sequence, fixed.last_aided = state.last_sequence, time_or_never(fixed, state.last_aided)
    fixed.innovation = saturated_integer(fixed, state.innovation * 2.0**ANGLE_Q)
    fixed.innovation_var = saturated_integer(fixed, state.innovation_var * 2.0**VAR_Q)
    fixed.rejected, fixed.pending = state.rejected, state.pending
    hold_vector(fixed, fixed.pending_at, state.pending_at, 2.0**TIME_Q)
    hold_vector(fixed, fixed.pending_var, state.pending_var, 2.0**VAR_Q)
    for k in range(fixed.pending_at.shape[0]):
        fixed.pending_yaw[k] = whole_yaw(state.pending_yaw[k])
        fixed.pending_sequence[k] = state.pending_sequence[k]


@kernel
def learn_ring(fixed: Any, state: Any, gravity: float) -> None:
    """Read the increments of the last cycles."""
    fixed.cycles, fixed.consumed = state.cycles, state.consumed
    hold_vector(fixed, fixed.ring_start, state.ring_start, 2.0**TIME_Q)
    hold_vector(fixed, fixed.ring_end, state.ring_end, 2.0**TIME_Q)
    for k in range(fixed.ring_quiet.shape[0]):
        hold_vector(fixed, fixed.ring_rate[k], state.ring_rate[k], 2.0**RATE_Q)
        hold_forces(fixed, fixed.ring_force[k], state.ring_force[k], gravity)
        fixed.ring_quiet[k] = state.ring_quiet[k]
    for k in range(fixed.ring_split.shape[0]):
        fixed.ring_split[k] = state.ring_split[k]
        hold_vector(fixed, fixed.ring_parts[k], state.ring_parts[k], 2.0**RATE_Q)


@kernel
def learn_modes(fixed: Any, state: Any) -> None:
    """Read the state machine and the averages that it keeps."""
    fixed.mode, fixed.still_cycles, fixed.surveyed = state.mode, state.still_cycles, state.surveyed
    fixed.stopped_at = time_or_never(fixed, state.stopped_at)
    fixed.rate_exceeded, fixed.bias_count = state.rate_exceeded, state.bias_count
    hold_vector(fixed, fixed.bias_sum, state.bias_sum, 2.0**RATE_Q)


@kernel
def learn_config(fixed: Any, config: Any, counter: Any) -> None:
    """Fill the integers ``fixed`` from a configuration; what does not fit adds to ``counter.overflows``.

    Parameters
    ----------
    fixed, config : records of dtype ``FIXED_CONFIG`` and ``CONFIG``
    counter : record of dtype ``FIXED_STATE``
    """
    one, unit2 = 2.0**VAR_Q, 4.0**UNIT
    fixed.changes = 0
    fixed.attitude_var = saturated_integer(counter, squared_float(config.attitude_factor) * 2.0**FACTOR_Q)
    fixed.bias_factor_var = saturated_integer(counter, squared_float(config.bias_factor) * 2.0**FACTOR_Q)
    fixed.boot_bias_var = saturated_integer(counter, squared_float(config.boot_bias_std) * unit2 * one)
    fixed.scale_var = saturated_integer(counter, squared_float(config.scale_std) * unit2 * one)
    fixed.stamp_std, fixed.gravity = saturated_integer(counter, config.stamp_std * 2.0**TIME_Q), 1 << FORCE_Q
    for k in range(3):
        noise, bias, tau = squared_float(config.gyro_noise[k]), squared_float(config.bias_std[k]), config.bias_tau[k]
        walk = noise * squared_float(config.attitude_factor)
        fixed.rate_noise[k] = saturated_integer(counter, noise * unit2 * one)
        fixed.twice_tau[k] = saturated_integer(counter, 2.0 * tau * 2.0**TAU_Q)
        fixed.walk[k] = saturated_integer(counter, walk * one)
        fixed.rate_walk[k] = saturated_integer(counter, walk * unit2 * one)
        fixed.noise_var[k] = saturated_integer(counter, noise * one)
        fixed.bias_var[k] = saturated_integer(counter, bias * unit2 * one)
        fixed.bias_drive[k] = saturated_integer(counter, bias * squared_float(config.bias_factor) * unit2 * one)
        fixed.bias_area[k] = saturated_integer(counter, (noise + 2.0 * bias * tau) * unit2 * one)
        fixed.bias_decay[k] = saturated_integer(counter, LOG2_E / tau * 2.0**42)
    fixed.still_walk_var = saturated_integer(counter, squared_float(config.still_walk) * one)
    fixed.stamp_on = 1 if config.stamp_std > 0.0 else 0
    fixed.stamp_var = saturated_integer(counter, squared_float(config.stamp_std) * unit2 * one)
    fixed.stamp_walk_var = saturated_integer(counter, squared_float(config.stamp_walk) * unit2 * one)
    fixed.aiding_floor_var = saturated_integer(counter, config.aiding_floor_var * one)
    fixed.force_var = saturated_integer(counter, squared_float(config.force_std / config.gravity) * one)
    fixed.gate_inverse = int(np.rint(2.0**LEVEL_Q / squared_float(max(config.gate, 1.0))))
    fixed.rate_limit = saturated_integer(counter, config.rate_limit * 2.0**RATE_Q)
    fixed.still_rate = saturated_integer(counter, config.still_rate * 2.0**RATE_Q)
    fixed.reject_limit, fixed.lag_cycles = config.reject_limit, config.lag_cycles
    fixed.survey_samples, fixed.settle_cycles = config.survey_samples, config.settle_cycles
    fixed.static_cycles = config.static_cycles


@kernel
def squared_float(value: float) -> float:
    """Value times itself."""
    return value * value


def state_in_integers(state: Any, gravity: float) -> Array:
    """One record of dtype ``FIXED_STATE``, made of a float64 ``state`` with ``gravity`` (m/s^2)."""
    made = np.zeros(1, FIXED_STATE)
    learn_state(made[0], state, gravity)
    return made


def config_in_integers(config: Any) -> tuple[Array, int]:
    """One record of dtype ``FIXED_CONFIG``, made of a configuration, and how many of its numbers did not fit."""
    made, counter = np.zeros(1, FIXED_CONFIG), np.zeros(1, FIXED_STATE)
    learn_config(made[0], config, counter[0])
    return made, int(counter[0]["overflows"])
