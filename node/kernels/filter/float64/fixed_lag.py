"""The filter at the epoch of its measurements: integrate up to the time of validity, update, predict to now.

Delay compensation (thesis eq. 3.29): an aiding is for its time of validity, not for its arrival. The increments of
the last cycles lie in a ring; the filter stays a cycle behind, passes each measurement at its own time and predicts a
copy of itself to the present. Staying behind also tells from the next cycle whether the string really stood still.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.angles import advance_binary, from_binary, to_binary, wrap_angle
from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.filter.covariance import COARSE, isolate_state, set_apart
from node.kernels.filter.float64.propagation import propagate_covariance
from node.kernels.filter.float64.strapdown import rotate_down, yaw_rate
from node.kernels.filter.float64.update import (
    clear_row,
    correct_states,
    innovation_var,
    intersect_covariance,
    level_by_force,
    zero_rate,
)
from node.kernels.filter.increments import bend_at, bent_angle, mean_excess_rate
from node.kernels.filter.smoothing import propagate_survey_covariance
from node.kernels.record.filter_record import CLOCK_SLACK, INVERTED, RING, STATES, UNKNOWN_YAW_VAR, CycleStatus, Err
from node.kernels.record.ring import drop_first_pending, drop_repetitions, is_split, stood_still

PSI, BZ, D = kernel_constant(Err.YAW), kernel_constant(Err.BIAS_Z), kernel_constant(Err.STAMP)
AIDED, REJECTED, YAW_RESET = int(CycleStatus.AIDED), int(CycleStatus.REJECTED), int(CycleStatus.YAW_RESET)
LATE_DROPPED = int(CycleStatus.LATE_DROPPED)
BX = kernel_constant(Err.BIAS_X)
MISSED_GAP: Final = 1e-3  # s, between two cycles of which none was lost


@kernel
def spin_slope(state: Any, cycle: int) -> float:
    """Change of the spin inside ``cycle`` (rad/s^2), from its neighbours' means; 0 while one of them is missing."""
    if cycle == 0 or cycle + 1 >= state.cycles:
        return 0.0
    before, after = (cycle - 1) % RING, (cycle + 1) % RING
    apart = 0.5 * (state.ring_start[after] + state.ring_end[after] - state.ring_start[before] - state.ring_end[before])
    return float((state.ring_rate[after, 2] - state.ring_rate[before, 2]) / apart)


@kernel
def mean_spin(state: Any, cycle: int, begin: float, end: float) -> float:
    """Mean spin (rad/s) from ``begin`` to ``end`` (s) inside ``cycle``: that of its parts, or linear about its mean."""
    slot = cycle % RING
    if stood_still(state, cycle):
        return 0.0
    inside = max(begin, state.ring_start[slot])  # the rest are cycles that were lost
    if is_split(state, cycle):
        beyond = mean_excess_rate(state, cycle, inside, end)
    else:
        beyond = spin_slope(state, cycle) * 0.5 * (inside + end - state.ring_start[slot] - state.ring_end[slot])
    measured = state.ring_rate[slot, 2] + beyond
    return float((measured - state.static_bias[2] - state.bias[2]) / (1.0 + state.scale))


@kernel
def integrate_cycle(
    state: Any, config: Any, cycle: int, begin: float, end: float, yaw: int, down: Array, P: Array
) -> int:
    """Integrate ``cycle`` from ``begin`` to ``end`` (s) into ``down`` and ``P``; returns the binary yaw.

    Still means no turn at all.

    Near the inverted axis a cycle cannot resolve the yaw, whose kinematics are singular there: it is what the aiding
    says, and its innovations teach nothing about the gyroscope.
    """
    slot, dt = cycle % RING, end - begin
    if stood_still(state, cycle):
        propagate_covariance(P, 0.0, dt, 0.0, config)
        return yaw
    wx = state.ring_rate[slot, 0] - state.static_bias[0] - state.bias[0]
    wy = state.ring_rate[slot, 1] - state.static_bias[1] - state.bias[1]
    wz = mean_spin(state, cycle, begin, end)
    rotate_down(down, wx, wy, wz, 0.5 * dt)
    turned = yaw_rate(down, wx, wy, wz) * dt
    rotate_down(down, wx, wy, wz, 0.5 * dt)
    propagate_covariance(P, wz, dt, 1.0, config)
    if down[2] < INVERTED:
        isolate_state(P, PSI, UNKNOWN_YAW_VAR)
    return advance_binary(yaw, turned)


@kernel
def advance_epoch(state: Any, config: Any, cycle: int, until: float) -> None:
    """Move the filter's epoch to ``until`` (s), inside ``cycle`` or at its end."""
    dt = until - state.epoch
    if dt <= 0.0:
        return
    gap = state.ring_start[cycle % RING] - state.epoch
    if state.smoothing == 1:
        turning = 0.0 if stood_still(state, cycle) else 1.0
        propagate_survey_covariance(state, mean_spin(state, cycle, state.epoch, until), dt, turning, config)
    state.yaw = integrate_cycle(state, config, cycle, state.epoch, until, state.yaw, state.down, state.P)
    if state.smoothing == 1 and state.down[2] < INVERTED:
        state.surveyed_with[PSI] = 0.0
    if gap > MISSED_GAP:
        state.P[PSI, PSI] += missed_var(state, cycle, gap)
    for k in range(3):
        state.bias[k] *= 2.718281828459045 ** (-dt / config.bias_tau[k])
    state.epoch = until


@kernel
def missed_var(state: Any, cycle: int, gap: float) -> float:
    """Variance (rad^2) of the yaw by a ``gap`` (s) of cycles that were lost before ``cycle``.

    The rate on one side of the gap stands for what it hides, and is not trusted further than the larger of the two: a
    drive that starts or stops inside the gap shows on one side alone.
    """
    fastest = abs(state.ring_rate[cycle % RING, 2])
    if cycle > 0:
        fastest = max(fastest, abs(state.ring_rate[(cycle - 1) % RING, 2]))
    return float((fastest * gap) ** 2)


@kernel
def interpolation_var(state: Any, cycle: int, at: float) -> float:
    """Variance (rad^2) of taking the spin as linear inside ``cycle``, from how its neighbours' means bend.

    Where the drive starts or ends a ramp the spin at the edge of a cycle is wrong by up to a quarter of the bend, and
    so are the angle from the edge to ``at`` (s) and the effect of the time stamp's error d. On a ramp of slope a that
    effect is w d + a d^2 / 2, of which the filter takes the first term: E[(a d^2 / 2)^2] = 3/4 a^2 P_dd^2. Where the
    parts of the cycle are known the bend is that of its parts.
    """
    slot = cycle % RING
    inside = min(at - state.ring_start[slot], state.ring_end[slot] - at)
    if cycle == 0:
        return 0.0
    if is_split(state, cycle):
        curved = spin_slope(state, cycle) * state.P[D, D]
        beside = (0.25 * bend_at(state, cycle, at)) ** 2 * state.P[D, D]
        return float(bent_angle(state, cycle, at) ** 2 + beside + 0.75 * curved * curved)
    bend = 2.0 * (state.ring_rate[slot, 2] - state.ring_rate[(cycle - 1) % RING, 2])
    if cycle + 1 < state.cycles:
        bend = 0.5 * bend - (state.ring_rate[(cycle + 1) % RING, 2] - state.ring_rate[slot, 2])
    curved = spin_slope(state, cycle) * state.P[D, D]
    return float((0.25 * bend) ** 2 * (inside * inside + state.P[D, D]) + 0.75 * curved * curved)


@kernel
def reset_yaw(state: Any, config: Any, yaw: float, var: float) -> None:
    """Take the yaw from the aiding; the bias is re-inflated and no cross term is kept, for they are stale."""
    state.yaw = to_binary(yaw)
    set_apart(state, PSI, var)
    prior = config.bias_std[2] ** 2 + state.static_bias_var[2]
    set_apart(state, BZ, max(prior, state.P[BZ, BZ]))
    state.bias[2] = 0.0
    state.yaw_known = 1
    state.rejected = 0


@kernel
def apply_aiding(state: Any, config: Any, yaw: float, r_var: float, rate: float, at: float) -> int:
    """Update with a yaw at the filter's epoch, where the spin is ``rate`` (rad/s); returns ``CycleStatus`` bits.

    The epoch is that of the measurement by the present time-stamp offset, of which an error d adds rate d to z.
    r = wrap(z - psi), gated at ``config.gate`` sigmas; after ``reject_limit`` rejections in a row the filter
    says that it was wrong and starts again from the aiding.
    """
    if state.yaw_known == 0:
        reset_yaw(state, config, yaw, r_var + (rate * config.stamp_std) ** 2)
        state.last_aided = at
        return AIDED | YAW_RESET
    clear_row(state.h)
    state.h[PSI] = 1.0
    if config.stamp_std > 0.0:
        state.h[D] = rate
    if config.intersection == 1:
        weight = intersect_covariance(state.P, state.h, r_var, state.ph)
        if weight == 1.0:
            state.last_aided = at
            return AIDED
        r_var /= 1.0 - weight
    s = innovation_var(state.P, state.h, r_var, state.ph)
    residual = wrap_angle(yaw - from_binary(state.yaw))
    state.innovation = residual
    state.innovation_var = s
    if residual * residual > config.gate * config.gate * s:
        state.rejected += 1
        state.last_sequence = -1  # it was not used: its repetition at rest is to be judged again
        if state.rejected < config.reject_limit:
            return REJECTED
        reset_yaw(state, config, yaw, r_var + (rate * config.stamp_std) ** 2)
        set_apart(state, D, config.stamp_std**2)
        state.stamp = 0.0
        state.last_aided = at
        return REJECTED | AIDED | YAW_RESET
    correct_states(state, s, residual)
    state.rejected = 0
    state.last_aided = at
    return AIDED


@kernel
def take_pending(state: Any, config: Any, cycle: int, until: float) -> int:
    """Pass every waiting measurement valid up to ``until`` (s), oldest first; returns ``CycleStatus`` bits.

    One that the error of the clock puts just beyond ``until`` is not kept waiting: it is brought back by the spin.
    """
    status = 0
    while state.pending > 0 and state.pending_at[0] <= until + CLOCK_SLACK:
        at = state.pending_at[0] + state.stamp
        yaw, var = state.pending_yaw[0], state.pending_var[0]
        held = min(at, until)
        if held >= state.epoch:
            advance_epoch(state, config, cycle, held)
            within = cycle + 1 if at > until and is_split(state, cycle + 1) else cycle
            yaw -= mean_spin(state, within, held, at) * (at - held)
            spread, own = interpolation_var(state, within, at), var
            used = apply_aiding(state, config, yaw, var + spread, mean_spin(state, cycle, held, held), at)
            status |= used
            if spread > COARSE * own:
                state.last_sequence = -1  # a repetition at rest is better timed
            elif used == AIDED:
                drop_repetitions(state)  # they wait behind it and say nothing more
        else:
            status |= aid_late(state, config, yaw, var, at)
        drop_first_pending(state)
    return status


@kernel
def aid_late(state: Any, config: Any, yaw: float, var: float, at: float) -> int:
    """A measurement older than the filter's epoch: carried forward by the increments since, their noise added."""
    moved, rate = yaw, 0.0
    earliest = state.epoch
    cycle = state.consumed
    while cycle >= 0 and cycle > state.cycles - RING and earliest > at:
        slot = cycle % RING
        begin = max(state.ring_start[slot], at)
        if begin < earliest:
            moved += mean_spin(state, cycle, begin, earliest) * (earliest - begin)
            rate = mean_spin(state, cycle, begin, begin)
            earliest = begin
        cycle -= 1
    if earliest > at + 1e-3:
        state.last_sequence = -1  # it was not used either
        return LATE_DROPPED
    lag = state.epoch - at
    var += interpolation_var(state, cycle + 1, at)
    noise = config.gyro_noise[2] ** 2 * lag + state.P[BZ, BZ] * lag * lag
    return apply_aiding(state, config, moved, var + noise, rate, at)


@kernel
def filter_due_cycles(state: Any, config: Any) -> int:
    """Filter every cycle that is old enough; returns ``CycleStatus`` bits."""
    status = 0
    while state.consumed < state.cycles - config.lag_cycles:
        cycle = state.consumed
        slot = cycle % RING
        end = state.ring_end[slot]
        status |= take_pending(state, config, cycle, end)
        advance_epoch(state, config, cycle, end)
        if stood_still(state, cycle):
            dt = end - state.ring_start[slot]
            zero_rate(state, state.ring_rate[slot], dt, config)
            level_by_force(state, state.ring_force[slot], config)
        state.consumed += 1
    return status


@kernel
def predict_to_now(state: Any, config: Any) -> None:
    """Copy the filter and integrate the cycles it has not consumed yet: the yaw and covariance at the present."""
    for i in range(STATES):
        for j in range(STATES):
            state.now_P[i, j] = state.P[i, j]
    for k in range(3):
        state.now_down[k] = state.down[k]
    state.now_yaw = state.yaw
    state.now = state.epoch
    for cycle in range(state.consumed, state.cycles):
        slot = cycle % RING
        end = state.ring_end[slot]
        if end > state.now:
            gap = state.ring_start[slot] - state.now
            state.now_yaw = integrate_cycle(
                state, config, cycle, state.now, end, state.now_yaw, state.now_down, state.now_P
            )
            if gap > MISSED_GAP:
                state.now_P[PSI, PSI] += missed_var(state, cycle, gap)
            state.now = end
    newest = (state.cycles - 1) % RING
    state.now_rate = (state.ring_rate[newest, 2] - state.static_bias[2] - state.bias[2]) / (1.0 + state.scale)
