"""What comes from outside is looked at before the filter has it: times of a cycle, and aidings.

A cycle whose times do not follow those of the last begins a new epoch. An aiding is kept out whose time cannot be, that
a poor clock cannot place in a turn, or that comes from an encoder which counts backwards.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.angles import wrap_angle
from node.kernels.arithmetic.formats import DEG, PERIOD, RATE_Q, TIME_Q, Array
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import (
    angle_of,
    angular_square,
    half_of,
    is_number,
    stamp_square,
    time_of_cycles,
    time_root,
    turned_angle,
)
from node.kernels.arithmetic.quantity import LONG_AGO, NONE, rate_quantity, time_quantity, variance_quantity
from node.kernels.filter.modes import STATIC_BIAS
from node.kernels.filter.priors import is_beyond_gate
from node.kernels.filter.resets import begin_epoch, doubt_stamp, doubt_yaw, open_yaw
from node.kernels.record.events import Code, event_count, event_degrees, event_number, queue_event
from node.kernels.record.filter_record import CLOCK_SLACK, Err
from node.kernels.record.node_record import A_CLOCK_VAR, A_RATE, A_VALID, A_YAW, A_YAW_VAR
from node.kernels.turns.aiding_watch import reset_aiding_watch
from node.kernels.turns.guard import stood_in_this_rest
from node.kernels.turns.sensor_trust import is_faulty
from node.kernels.turns.yaw_doubts import is_dated, misfit_var

SLOWEST_REVERSED: Final = rate_quantity(
    5.0 * DEG
)  # rad/s, from where encoder and gyroscope are seen to turn against each other
BACKWARD: Final = time_quantity(
    PERIOD
)  # s, that a cycle may begin before the end of the last; more is a jump of the clock
LONGEST_CYCLE: Final = time_quantity(10.0 * PERIOD)  # s
FARTHEST: Final = LONGEST_CYCLE  # s, that a cycle may begin after the end of the last; no rate stands for more
SLOWEST_STOOD: Final = rate_quantity(
    6.0 * DEG
)  # rad/s, that no offset of a gyroscope reaches; the slow alignment turn is faster
STOOD: Final = 2  # aidings in a row, from where the counter of a head that turns is seen to stand
FAR_OFF: Final = 4  # sigmas, that a clock may be wrong by
SLACK_VAR: Final = variance_quantity(CLOCK_SLACK * CLOCK_SLACK)  # s^2, of a clock that can place an aiding in a turn
PSI = kernel_constant(Err.YAW)
ENCODER_REVERSED, ENCODER_STANDS = kernel_constant(Code.ENCODER_REVERSED), kernel_constant(Code.ENCODER_STANDS)
AIDING_UNTIMELY, CLOCK_JUMPED = kernel_constant(Code.AIDING_UNTIMELY), kernel_constant(Code.CLOCK_JUMPED)


@kernel
def gate_aiding(node: Any, aiding: Array) -> bool:
    """Whether an ``aiding`` of ``node.kernels.step.node_step.node_aiding`` is for the filter.

    One with an invalid time, or one far ahead, would wait for ever and hold up all others. One that a poor clock
    cannot place in a turning is of another angle than the node's, by as much in the next and the next.
    """
    state, guard, valid_local = node.filter, node.guard, aiding[A_VALID]
    timely = is_number(valid_local) and not (state.cycles > 0 and valid_local - state.now > LONGEST_CYCLE)
    if not timely and guard.untimely == 0:
        queue_event(node, AIDING_UNTIMELY, NONE, NONE, NONE, NONE)
    guard.untimely = 0 if timely else 1
    if not timely:
        return False
    if aiding[A_RATE] == 0 and guard.rate != 0:  # what the turning left unexplained, a rest shows
        open_misfit(node)
    elif aiding[A_RATE] != 0 and guard.rate == 0:
        doubt_date(node)
    guard.rate, guard.rate_at, guard.aiding_var = aiding[A_RATE], valid_local, aiding[A_YAW_VAR]
    if is_reversed(node) or stands_still(node) or not is_placed(state, aiding):
        return False
    if guard.gyro.fault != 0 or contradicts_gyroscope(node, aiding[A_YAW] + node.down_offset, valid_local):
        state.last_sequence = -1  # a repetition at rest is to be judged again
    return True


@kernel
def open_misfit(node: Any) -> None:
    """What innovations showed beyond their variance is of the yaw too."""
    var = misfit_var(node)
    if var > 0:
        doubt_yaw(node.filter, var)


@kernel
def doubt_date(node: Any) -> None:
    """The head starts: aidings are off by what the date of the windows is off for good, as by their own time stamp.

    A date that is another one in every window leaves nothing of the kind, and a time stamp would learn its noise.
    """
    window = node.cluster.delayed[0]
    if is_dated(node) and half_of(window.std) < window.lasting:
        doubt_stamp(node.filter, stamp_square(window.lasting))


@kernel
def is_reversed(node: Any) -> bool:
    """Whether the encoder counts backwards, which is told once: as fast as the gyroscope turns, the other way.

    One that did so does it until it turns with the gyroscope, or rests: the last edges of a stop are slow.
    """
    state, guard = node.filter, node.guard
    slowest = min(abs(guard.rate), abs(state.now_rate))
    if is_faulty(guard.gyro):
        return False
    if slowest < SLOWEST_REVERSED:
        return bool(guard.reversed == 1 and guard.rate != 0)
    alike = guard.reversed == 1 or abs(guard.rate + state.now_rate) < half_of(slowest)
    against = bool((guard.rate < 0) != (state.now_rate < 0) and alike)
    if against and guard.reversed == 0:
        told, own = event_degrees(guard.rate, RATE_Q), event_degrees(state.now_rate, RATE_Q)
        queue_event(node, ENCODER_REVERSED, told, own, NONE, NONE)
    guard.reversed = 1 if against else 0
    return against


@kernel
def stands_still(node: Any) -> bool:
    """Whether the counter stands while the head turns, which is told once: the gyroscope goes on as it did before.

    Of two that part the one that has changed is in doubt. A gyroscope that stood still in this rest, or repeats itself,
    or has taken a step without which it stands too, has changed itself. One aiding proves nothing: a head that stopped
    dead was turning in the node's newest cycle.
    """
    state, guard = node.filter, node.guard
    goes_on = guard.rate == 0 and abs(state.now_rate) > SLOWEST_STOOD and state.yaw_known == 1
    changed = is_faulty(guard.gyro) or guard.readings.rates.counts[2] > 0
    changed = changed or stood_in_this_rest(node) or stands_without_step(node)
    if not goes_on or changed or state.mode == STATIC_BIAS:
        guard.stands = 0
        return False
    guard.stands = min(guard.stands + 1, STOOD + 1)
    if guard.stands < STOOD:
        return False
    if guard.stands == STOOD:
        queue_event(node, ENCODER_STANDS, event_degrees(state.now_rate, RATE_Q), NONE, NONE, NONE)
    guard.rate, guard.rate_at = state.now_rate, LONG_AGO  # its word is not taken, neither for a rest nor for a turn
    reset_aiding_watch(guard.aidings)
    return True


@kernel
def stands_without_step(node: Any) -> bool:
    """Whether the gyroscope turns by nothing but the steps that its constant bias took since the last rest."""
    state, before = node.filter, node.guard.before_steps
    if not is_number(before):
        return False
    return bool(abs(state.now_rate + state.static_bias[2] - before) < SLOWEST_STOOD)


@kernel
def is_placed(state: Any, aiding: Array) -> bool:
    """Whether the clock is good enough for the time stamp's state, or the string rests for as long as it may be off."""
    clock_var = aiding[A_CLOCK_VAR]
    if clock_var <= SLACK_VAR:
        return True
    if aiding[A_RATE] != 0 or not is_number(clock_var):
        return False
    return bool(time_of_cycles(clock_var, state.still_cycles) > FAR_OFF * time_root(clock_var))


@kernel
def contradicts_gyroscope(node: Any, yaw: float, valid_local: float) -> bool:
    """Whether a reference at rest (rad) is beyond the gate while the gyroscope turns, or of one that turned unaided."""
    state, guard = node.filter, node.guard
    if guard.rate != 0 or state.yaw_known == 0 or state.mode == STATIC_BIAS:
        return False
    if state.still_cycles > 0 and not state.stopped_at > state.last_aided:
        return False
    then = angle_of(state.now_rate, state.now_yaw) + turned_angle(state.now_rate, valid_local - state.now)
    return is_beyond_gate(node.config, wrap_angle(yaw - then), state.now_P[PSI, PSI] + guard.aiding_var)


@kernel
def admits_cycle(node: Any, start: float, end: float) -> bool:
    """Whether a cycle of these times (s, own clock) can be run; a clock that jumped begins a new epoch."""
    state, guard = node.filter, node.guard
    plain = is_number(start) and is_number(end) and 0 < end - start <= LONGEST_CYCLE
    ahead = start - state.now if state.cycles > 0 else 0
    jumped = not plain or -ahead > BACKWARD or ahead > FARTHEST
    if jumped and guard.jumped == 0:
        by = event_number(start - state.now, TIME_Q) if state.cycles > 0 else event_count(start, 0)
        queue_event(node, CLOCK_JUMPED, by if is_number(start) else NONE, NONE, NONE, NONE)
    if not jumped and ahead < 0:  # the increments overlap, and the turn that was counted once is in doubt
        open_yaw(state, angular_square(turned_angle(state.now_rate, ahead)))
    guard.jumped = 1 if jumped else 0
    if jumped and plain:
        begin_epoch(state)
        reset_aiding_watch(guard.aidings)
    return plain
