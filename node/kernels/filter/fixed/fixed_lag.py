"""The filter at the epoch of its measurements, in integers: beside ``float64.fixed_lag``."""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import (
    FAST,
    LONGEST_GAP,
    LONGEST_STEP,
    ONE_SECOND,
    RATE_Q,
    STEP_Q,
    TIME_Q,
    UNIT,
    VAR_Q,
    VECTOR_Q,
    Array,
)
from node.kernels.arithmetic.integers import multiply_q31, quotient_q30, rounded_shift
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import angular_square
from node.kernels.arithmetic.trigonometry import TURN, radians_to_counts
from node.kernels.filter.covariance import COARSE, isolate_state
from node.kernels.filter.fixed.aiding import RATE_RIGHT, apply_aiding
from node.kernels.filter.fixed.propagation import (
    propagate_covariance,
    propagate_survey_covariance,
    update_bias_decays,
    widen_variance,
)
from node.kernels.filter.fixed.strapdown import half_turn, rotate_down, yaw_rate
from node.kernels.filter.fixed.update import level_by_force, zero_rate
from node.kernels.filter.increments import bend_at, bent_angle, mean_excess_rate
from node.kernels.record.filter_record import CLOCK_SLACK, INVERTED, RING, STATES, CycleStatus, Err
from node.kernels.record.integer_filter import UNKNOWN_VAR
from node.kernels.record.ring import drop_first_pending, drop_repetitions, is_split, stood_still

PSI, BZ, D = kernel_constant(Err.YAW), kernel_constant(Err.BIAS_Z), kernel_constant(Err.STAMP)
AIDED, LATE_DROPPED = int(CycleStatus.AIDED), int(CycleStatus.LATE_DROPPED)
UNITY_SCALE: Final = 1 << 30
SCALE_RIGHT: Final = RATE_Q - 30
SQUARE_Q: Final = VAR_Q // 2  # of an angle whose square is a variance
LARGEST_SQUARED: Final = 4 << SQUARE_Q  # rad
GAP_RIGHT: Final = 10  # a gap of 2^12 s is a factor of 31 bits
MISSED_GAP: Final = ONE_SECOND // 1000
INVERTED_DOWN: Final = round(INVERTED * 2.0**VECTOR_Q)
ALL: Final = (1 << 31) - 1  # of a factor in Q31
STAMP_RIGHT: Final = RATE_Q - TIME_Q
SLACK: Final = round(CLOCK_SLACK * 2.0**TIME_Q)
SLOT: Final = RING - 1  # RING is a power of two


@kernel
def true_rate_z(state: Any, measured: int) -> int:
    """(w_z - b_z) / (1 + s), rad/s in Q46."""
    one = UNITY_SCALE + rounded_shift(state.scale, SCALE_RIGHT)
    return quotient_q30(measured - state.static_bias[2] - state.bias[2], max(one, UNITY_SCALE >> 4))


@kernel
def mean_spin(state: Any, cycle: int, begin: int, end: int) -> int:
    """Mean spin (rad/s, Q46) from ``begin`` to ``end`` (s, Q28) inside ``cycle``: of its parts, or linear."""
    if stood_still(state, cycle):
        return 0
    slot = cycle & SLOT
    measured = state.ring_rate[slot, 2]
    if is_split(state, cycle):
        measured += mean_excess_rate(state, cycle, max(begin, state.ring_start[slot]), end)
    elif cycle > 0 and cycle + 1 < state.cycles:
        before, after = (cycle - 1) & SLOT, (cycle + 1) & SLOT
        inside = max(begin, state.ring_start[slot])  # the rest are cycles that were lost
        off = inside + end - state.ring_start[slot] - state.ring_end[slot]
        apart = state.ring_start[after] + state.ring_end[after] - state.ring_start[before] - state.ring_end[before]
        part = max(-ALL, min(quotient_q30(off << 1, max(apart, 1)), ALL)) if abs(off) < LONGEST_STEP else 0
        measured += multiply_q31(state.ring_rate[after, 2] - state.ring_rate[before, 2], part)
    return true_rate_z(state, measured)


@kernel
def integrate_cycle(state: Any, config: Any, cycle: int, begin: int, end: int, yaw: int, down: Array, P: Array) -> int:
    """Integrate ``cycle`` from ``begin`` to ``end`` (s, Q28) into ``down`` and ``P``; returns the binary yaw.

    Still means no turn.
    """
    slot = cycle & SLOT
    still = stood_still(state, cycle)
    wx = state.ring_rate[slot, 0] - state.static_bias[0] - state.bias[0]
    wy = state.ring_rate[slot, 1] - state.static_bias[1] - state.bias[1]
    wz = mean_spin(state, cycle, begin, end)
    dt = end - begin
    longest = LONGEST_STEP if abs(wz) < FAST else ONE_SECOND
    while dt > 0:
        piece = min(dt, longest)
        dt -= piece
        if still:
            propagate_covariance(state, P, 0, piece, 0, config)
            continue
        ax, ay, az, s, c = half_turn(wx, wy, wz, piece)
        rotate_down(down, ax, ay, az, s, c)
        yaw = (yaw + radians_to_counts(multiply_q31(yaw_rate(down, wx, wy, wz), piece), STEP_Q)) & TURN
        rotate_down(down, ax, ay, az, s, c)
        propagate_covariance(state, P, wz, piece, 1, config)
    if not still and down[2] < INVERTED_DOWN:
        isolate_state(P, PSI, UNKNOWN_VAR)
    return yaw


@kernel
def gap_held(state: Any, dt: int) -> int:
    """``dt`` (s, Q28), not longer than what is integrated of cycles that were lost."""
    if dt > LONGEST_GAP:
        state.overflows += 1
        return LONGEST_GAP
    return dt


@kernel
def advance_epoch(state: Any, config: Any, cycle: int, until: int) -> None:
    """Move the filter's epoch to ``until`` (s, Q28), inside ``cycle`` or at its end."""
    dt = gap_held(state, until - state.epoch)
    if dt <= 0:
        return
    gap = state.ring_start[cycle & SLOT] - state.epoch
    if state.smoothing == 1:
        carry_survey(state, config, cycle, until - dt, until)
    state.yaw = integrate_cycle(state, config, cycle, until - dt, until, int(state.yaw), state.down, state.P)
    if state.smoothing == 1 and state.down[2] < INVERTED_DOWN:
        state.surveyed_with[PSI] = 0
    if gap > MISSED_GAP:
        widen_variance(state, state.P, PSI, missed_var(state, cycle, gap))
    while dt > 0:
        piece = min(dt, LONGEST_STEP)
        dt -= piece
        update_bias_decays(state, config, piece)
        for k in range(3):
            state.bias[k] = multiply_q31(state.bias[k], state.decay[k])
    state.epoch = until


@kernel
def missed_var(state: Any, cycle: int, gap: int) -> int:
    """Variance (rad^2, Q56) of the yaw by a ``gap`` (s, Q28) of cycles lost before ``cycle``: of the faster side."""
    fastest = abs(state.ring_rate[cycle & SLOT, 2])
    if cycle > 0:
        fastest = max(fastest, abs(state.ring_rate[(cycle - 1) & SLOT, 2]))
    missed = gap_angle(fastest, gap_held(state, gap))
    return int(missed * missed)


@kernel
def carry_survey(state: Any, config: Any, cycle: int, begin: int, end: int) -> None:
    """Carry the yaw at the last survey along from ``begin`` to ``end`` (s, Q28), by the pieces of a cycle."""
    wz, dt = mean_spin(state, cycle, begin, end), end - begin
    turning = 0 if stood_still(state, cycle) else 1
    longest = LONGEST_STEP if abs(wz) < FAST else ONE_SECOND
    while dt > 0:
        piece = min(dt, longest)
        dt -= piece
        propagate_survey_covariance(state, wz, piece, turning, config)


@kernel
def gap_angle(rate: int, gap: int) -> int:
    """Size of ``rate`` (rad/s, Q46) times ``gap`` (s, Q28), rad in Q28, at most 4."""
    angle = multiply_q31(abs(rate), gap >> GAP_RIGHT)
    return min(rounded_shift(angle, STEP_Q - GAP_RIGHT - SQUARE_Q), LARGEST_SQUARED)


@kernel
def interpolation_var(state: Any, cycle: int, at: int) -> int:
    """Variance (rad^2, Q56) of taking the spin as linear inside ``cycle``, from how its neighbours' means bend."""
    if cycle == 0:
        return 0
    slot = cycle & SLOT
    if is_split(state, cycle):
        a_unit = rounded_shift(int(bend_at(state, cycle, at)), RATE_RIGHT + 2)
        beside = multiply_q31(multiply_q31(state.P[D, D], a_unit), a_unit)
        return int(angular_square(bent_angle(state, cycle, at))) + beside + curvature_var(state, cycle)
    inside = abs(min(at - state.ring_start[slot], state.ring_end[slot] - at))
    bend = 2 * (state.ring_rate[slot, 2] - state.ring_rate[(cycle - 1) & SLOT, 2])
    if cycle + 1 < state.cycles:
        bend = (bend >> 1) - (state.ring_rate[(cycle + 1) & SLOT, 2] - state.ring_rate[slot, 2])
    error = min(
        rounded_shift(multiply_q31(abs(bend), min(inside, LONGEST_STEP)), STEP_Q + 2 - SQUARE_Q), LARGEST_SQUARED
    )
    a_unit = rounded_shift(bend, RATE_RIGHT + 2)
    return error * error + multiply_q31(multiply_q31(state.P[D, D], a_unit), a_unit) + curvature_var(state, cycle)


@kernel
def curvature_var(state: Any, cycle: int) -> int:
    """Variance 3/4 (a P_dd)^2, rad^2 in Q56, of the time stamp's error on a ramp of the slope a."""
    if cycle + 1 >= state.cycles:
        return 0
    before, after = (cycle - 1) & SLOT, (cycle + 1) & SLOT
    apart = state.ring_start[after] + state.ring_end[after] - state.ring_start[before] - state.ring_end[before]
    seconds = rounded_shift(quotient_q30(state.P[D, D], max(apart, ONE_SECOND)), 30)  # P_dd over half of it, s in Q39
    angle = multiply_q31(abs(state.ring_rate[after, 2] - state.ring_rate[before, 2]), seconds)
    curved = min(rounded_shift(angle, RATE_Q + 39 - 31 - SQUARE_Q), LARGEST_SQUARED)
    return (3 * curved * curved) >> 2


@kernel
def take_pending(state: Any, config: Any, cycle: int, until: int) -> int:
    """Pass every waiting measurement valid up to ``until`` (s, Q28), oldest first; returns ``CycleStatus`` bits."""
    status = 0
    while state.pending > 0 and state.pending_at[0] <= until + SLACK:
        at = state.pending_at[0] + rounded_shift(state.stamp, STAMP_RIGHT)
        yaw, var = int(state.pending_yaw[0]), state.pending_var[0]
        held = min(at, until)
        if held >= state.epoch:
            advance_epoch(state, config, cycle, held)
            beyond = min(at - held, LONGEST_STEP)
            within = cycle + 1 if at > until and is_split(state, cycle + 1) else cycle
            yaw = (yaw - radians_to_counts(multiply_q31(mean_spin(state, within, held, at), beyond), STEP_Q)) & TURN
            spread, own = interpolation_var(state, within, at), int(var)
            used = apply_aiding(state, config, yaw, var + spread, mean_spin(state, cycle, held, held), at)
            status |= used
            if spread > COARSE * own:
                state.last_sequence = -1
            elif used == AIDED:
                drop_repetitions(state)
        else:
            status |= aid_late(state, config, yaw, var, at)
        drop_first_pending(state)
    return status


@kernel
def aid_late(state: Any, config: Any, yaw: int, var: int, at: int) -> int:
    """A measurement older than the filter's epoch: carried forward by the increments since, their noise added."""
    moved, rate = yaw, 0
    earliest = state.epoch
    cycle = state.consumed
    while cycle >= 0 and cycle > state.cycles - RING and earliest > at:
        slot = cycle & SLOT
        begin = max(state.ring_start[slot], at)
        if begin < earliest:
            moved += radians_to_counts(
                multiply_q31(mean_spin(state, cycle, begin, earliest), min(earliest - begin, LONGEST_STEP)), STEP_Q
            )
            rate = mean_spin(state, cycle, begin, begin)
            earliest = begin
        cycle -= 1
    if earliest > at + MISSED_GAP:
        state.last_sequence = -1  # it was not used either
        return LATE_DROPPED
    lag = state.epoch - at
    var += interpolation_var(state, cycle + 1, at)
    return apply_aiding(state, config, moved & TURN, var + lag_var(state, config, lag), rate, at)


@kernel
def lag_var(state: Any, config: Any, lag: int) -> int:
    """N^2 T + P_b T^2, rad^2 in Q56, of a ``lag`` T (s, Q28), which the ring keeps within 64 cycles."""
    t = min(lag >> (TIME_Q - 25), (64 << 25) - 1)  # Q25, 31 bits
    return (multiply_q31(config.noise_var[2], t) << 6) + rounded_shift(
        multiply_q31(multiply_q31(state.P[BZ, BZ], t), t), 2 * UNIT - 12
    )


@kernel
def filter_due_cycles(state: Any, config: Any) -> int:
    """Filter every cycle that is old enough; returns ``CycleStatus`` bits."""
    status = 0
    while state.consumed < state.cycles - config.lag_cycles:
        cycle = state.consumed
        slot = cycle & SLOT
        end = state.ring_end[slot]
        status |= take_pending(state, config, cycle, end)
        advance_epoch(state, config, cycle, end)
        if stood_still(state, cycle):
            zero_rate(state, state.ring_rate[slot], end - state.ring_start[slot], config)
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
        end = state.ring_end[cycle & SLOT]
        dt = gap_held(state, end - state.now)
        if dt > 0:
            gap = state.ring_start[cycle & SLOT] - state.now
            state.now_yaw = integrate_cycle(
                state, config, cycle, end - dt, end, int(state.now_yaw), state.now_down, state.now_P
            )
            if gap > MISSED_GAP:
                widen_variance(state, state.now_P, PSI, missed_var(state, cycle, gap))
            state.now = end
    state.now_rate = true_rate_z(state, state.ring_rate[(state.cycles - 1) & SLOT, 2])
