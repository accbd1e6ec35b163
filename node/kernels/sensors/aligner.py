"""Alignment, cycle by cycle: slow turns of the string show how each IMU sits against the tube's axis.

Ordered by the crew; the node waits for the string to turn slowly, follows the angle by its gyroscope, and ends with an
offset of pitch and roll, or with the reason why there is none. The offset in use stays until a new one is found.
"""

from __future__ import annotations

import enum
import math
from typing import Any, Final

from node.kernels.arithmetic.angles import wrap_angle
from node.kernels.arithmetic.circular import angle_of_turns, arcsine, planar_length, turns_of
from node.kernels.arithmetic.formats import ANGLE_Q, DEG, FORCE_Q, PERIOD, RATE_Q, TURNS_Q, VECTOR_Q, WEIGHT_Q
from node.kernels.arithmetic.integers import multiply_q31, rounded_shift
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import angle_of, by_type, half_of, is_number, turned_angle
from node.kernels.arithmetic.quantity import NONE, angle_quantity, factor_quantity, time_quantity
from node.kernels.arithmetic.quantity import rate_quantity as of_rate
from node.kernels.record.events import Code, event_count, event_degrees, event_number, extend_event, queue_event
from node.kernels.sensors.alignment import CIRCLE, fit_circle, take_extremes
from node.kernels.sensors.cluster import all_used
from node.kernels.sensors.realign import add_axes, realign_filter
from node.kernels.sensors.sweep import MOST_SAMPLES, add_to_sweep, clear_sweep

SLOWEST, FASTEST = of_rate(2.0 * DEG), of_rate(15.0 * DEG)  # rad/s, of the turn
BACKWARD: Final = of_rate(-2.0 * DEG)
PATIENCE: Final = time_quantity(120.0)  # for the turn to begin
STEADY_CYCLES: Final = 3  # of turning, before the first that counts: those of the speeding up do not
STOOD_CYCLES: Final = 4  # too slow in a row
LARGEST_GAP: Final = time_quantity(5.0)  # between two cycles
LARGEST_OVERLAP: Final = time_quantity(-PERIOD)
LARGEST_STEP: Final = angle_quantity(3.0 * DEG)  # of the yaw in a cycle, beyond what the gyroscope turned
LEAST_LEAN: Final = 20  # standard errors: with less the readings do not show that they turned with the tube
MOST_LEAN: Final = angle_quantity(
    60.0 * DEG
)  # beyond it the middle of gravity's circle is near the centre: it is no axis
SHAKING: Final = 5  # times the noise of a sample at rest
LARGEST_OFFSET: Final = 10.0 * DEG  # of a mount; a block of parameters can hold no larger one either
FARTHEST: Final = factor_quantity(math.sin(LARGEST_OFFSET))  # of the axis from z
SLOWEST_TURN: Final = round(2.0 * math.pi / SLOWEST * 2.0 ** (28 - 7))  # s, Q21: 180


class Reason(enum.IntEnum):
    """Why an alignment ended without an offset, or why the one in use is no longer."""

    CYCLES_LOST = 1
    SENSOR_FAULTY = 2
    TOO_FAST = 3
    TURNED_BACK = 4
    NEVER_TURNED = 5
    TOO_FEW_TURNS = 6
    TOO_LONG = 7
    NO_CIRCLE = 8
    SHAKES = 9
    LITTLE_LEAN = 10
    MUCH_LEAN = 11
    LARGE_OFFSET = 12
    ORDERED = 13
    OTHER_ACCELEROMETER = 14
    OTHER_GYROSCOPE = 15


CYCLES_LOST, SENSOR_FAULTY, TOO_FAST = (
    kernel_constant(Reason.CYCLES_LOST),
    kernel_constant(Reason.SENSOR_FAULTY),
    kernel_constant(Reason.TOO_FAST),
)
TURNED_BACK, NEVER_TURNED = kernel_constant(Reason.TURNED_BACK), kernel_constant(Reason.NEVER_TURNED)
TOO_FEW_TURNS, TOO_LONG, NO_CIRCLE = (
    kernel_constant(Reason.TOO_FEW_TURNS),
    kernel_constant(Reason.TOO_LONG),
    kernel_constant(Reason.NO_CIRCLE),
)
SHAKES, LITTLE_LEAN, MUCH_LEAN = (
    kernel_constant(Reason.SHAKES),
    kernel_constant(Reason.LITTLE_LEAN),
    kernel_constant(Reason.MUCH_LEAN),
)
LARGE_OFFSET = kernel_constant(Reason.LARGE_OFFSET)
BEGUN, TURNING, ALIGNED = (
    kernel_constant(Code.ALIGNMENT_BEGUN),
    kernel_constant(Code.ALIGNMENT_TURNING),
    kernel_constant(Code.ALIGNED),
)
REFUSED, DROPPED = kernel_constant(Code.ALIGNMENT_REFUSED), kernel_constant(Code.ALIGNMENT_DROPPED)


@by_type(lambda wanted: PATIENCE + (multiply_q31(min(wanted, 1 << 31), SLOWEST_TURN) << 14))
def turning_time_limit(wanted: float) -> float:
    """The time (s) within which so many turns are done."""
    return PATIENCE + wanted * math.tau / SLOWEST


def _inward(rate: int, place: int) -> int:
    held = rounded_shift(rate, RATE_Q - VECTOR_Q)
    return rounded_shift(
        rounded_shift(held * held, VECTOR_Q) * max(min(place, 1 << 31), -(1 << 31)), 2 * VECTOR_Q - FORCE_Q
    )


@by_type(_inward)
def centripetal_force(rate: float, place: float) -> float:
    """Force (m/s^2) of a circle at ``place`` (m) from its middle; integers: of a turn that is slow enough."""
    return rate * rate * place


@by_type(lambda tilt, noise: multiply_q31(tilt, min(noise, 1 << 31)) << (31 - WEIGHT_Q))
def tilt_of(tilt: float, noise: float) -> float:
    """The noise of an IMU as a tilt, of the configuration's and its own share; integers: at most 128 of it."""
    return tilt * noise


@kernel
def begin_alignment(node: Any, method: int, turns: float) -> None:
    """Wait for ``turns`` slow turns from the next cycle on, to be taken by ``method``."""
    aligner = node.aligner
    aligner.method, aligner.wanted = method, turns
    aligner.ordered_at, aligner.last_end = math.nan, math.nan
    aligner.steady, aligner.slow = 0, 0
    aligner.angle, aligner.sense = 0.0, 0.0
    node.mount.aligning = 1
    queue_event(node, BEGUN, float(method), turns, NONE, NONE)


@kernel
def refuse_alignment(node: Any, reason: int, imu: int, a: float, b: float) -> None:
    """End the alignment under way without an offset; ``a`` and ``b`` are numbers of the reason, ``imu`` 0 is all."""
    turned = node.aligner.angle
    queue_event(node, REFUSED, event_count(turned, reason), turns_of(abs(turned)), event_count(turned, imu), a)
    extend_event(node, 4, b, NONE, NONE)
    end_alignment(node)


@kernel
def end_alignment(node: Any) -> None:
    """None is under way."""
    node.aligner.method = 0
    node.mount.aligning = 0


@kernel
def drop_alignment(node: Any, settings: Any, reason: int) -> None:
    """Forget the offset in use, and end the alignment under way."""
    if node.aligner.method != 0:
        refuse_alignment(node, reason, 0, NONE, NONE)
    mount = node.mount
    if mount.method == 0:
        return
    add_axes(node, settings, 0)
    mount.method = 0
    for k in range(mount.axis.shape[0]):
        mount.axis[k, 0], mount.axis[k, 1], mount.axis[k, 2] = 0.0, 0.0, 1.0
        mount.std[k, 0], mount.std[k, 1] = 0.0, 0.0
    queue_event(node, DROPPED, float(reason), NONE, NONE, NONE)
    realign_filter(node, settings)


@kernel
def follow_alignment(node: Any, settings: Any, start: float, end: float) -> None:
    """Follow one cycle of the alignment under way, ``start`` to ``end`` (s, own clock), after the filter's.

    The forces are those of ``node.unaligned``.
    """
    aligner, state, guard = node.aligner, node.filter, node.guard
    if aligner.method == 0:
        return
    # an aided yaw knows the turn best; unaided it wobbles with the mount
    aided = end - state.last_aided <= settings.aiding_old_after
    yaw = angle_of(state.now_rate, state.now_yaw) if aided else NONE
    if not is_number(aligner.last_end):
        aligner.ordered_at, aligner.last_end = start, start
    known = is_number(yaw) and is_number(aligner.yaw)
    gap, turned, rate = start - aligner.last_end, wrap_angle(yaw - aligner.yaw), state.now_rate
    aligner.last_end, aligner.yaw = end, yaw
    if not LARGEST_OVERLAP < gap < LARGEST_GAP:
        refuse_alignment(node, CYCLES_LOST, 0, NONE, NONE)
    elif guard.gyro.fault != 0 or guard.force.fault != 0 or not all_used(node, settings):
        refuse_alignment(node, SENSOR_FAULTY, 0, NONE, NONE)
    elif abs(rate) > FASTEST:
        refuse_alignment(node, TOO_FAST, 0, event_degrees(abs(rate), RATE_Q), NONE)
    elif aligner.sense == 0:
        await_turn(node, settings, rate, end)
    elif rate * aligner.sense < BACKWARD:
        refuse_alignment(node, TURNED_BACK, 0, NONE, NONE)
    else:
        moved = turned_angle(rate, max(gap, 0) + end - start)
        followed = known and abs(wrap_angle(turned - moved)) < LARGEST_STEP  # where the yaw is set again it jumps
        follow_turn(node, settings, rate, turned if followed else moved, turned_angle(half_of(rate), end - start))


@kernel
def await_turn(node: Any, settings: Any, rate: float, end: float) -> None:
    """Until the string turns steadily at ``rate`` (rad/s)."""
    aligner = node.aligner
    aligner.steady = aligner.steady + 1 if abs(rate) >= SLOWEST else 0
    if aligner.steady >= STEADY_CYCLES:
        aligner.sense = 1 if rate > 0 else -1
        for k in range(settings.imus):
            clear_sweep(aligner.sweeps[k])
        queue_event(node, TURNING, event_degrees(rate, RATE_Q), NONE, NONE, NONE)
    elif end - aligner.ordered_at > PATIENCE:
        refuse_alignment(node, NEVER_TURNED, 0, NONE, NONE)


@kernel
def follow_turn(node: Any, settings: Any, rate: float, turned: float, rest: float) -> None:
    """One cycle of the turn: ``turned`` (rad) since the last, ``rest`` of it after the middle of the readings."""
    aligner, force = node.aligner, node.aligner.force
    aligner.slow = aligner.slow + 1 if abs(rate) < SLOWEST else 0
    if aligner.slow >= STOOD_CYCLES:
        refuse_alignment(node, TOO_FEW_TURNS, 0, event_number(aligner.wanted, TURNS_Q), NONE)
        return
    late = aligner.last_end - aligner.ordered_at > turning_time_limit(aligner.wanted)
    if late or aligner.sweeps[0].samples >= MOST_SAMPLES:
        refuse_alignment(node, TOO_LONG, 0, event_number(aligner.wanted, TURNS_Q), NONE)
        return
    aligner.angle += turned
    for k in range(settings.imus):
        for i in range(3):
            force[i] = node.unaligned[k, i]
        for i in range(2):
            force[i] += centripetal_force(rate, settings.place[k, i])  # the circle around the axis pulls inwards
        add_to_sweep(aligner.sweeps[k], force, aligner.angle - rest)
    if abs(aligner.angle) >= angle_of_turns(aligner.wanted):
        finish_alignment(node, settings)


@kernel
def finish_alignment(node: Any, settings: Any) -> None:
    """Offsets of all IMUs, or why one of them has none."""
    aligner, mount = node.aligner, node.mount
    for k in range(settings.imus):
        offset = aligner.offsets[k]
        if aligner.method == CIRCLE:
            found = fit_circle(aligner.sweeps[k], offset)
        else:
            found = take_extremes(aligner.sweeps[k], offset)
        reason, a, b = (
            judge_offset(offset, tilt_of(settings.tilt_noise, settings.noise[k])) if found else (NO_CIRCLE, NONE, NONE)
        )
        if reason != 0:
            refuse_alignment(node, reason, k + 1 if settings.imus > 1 else 0, a, b)
            return
    add_axes(node, settings, 0)
    for k in range(settings.imus):
        offset = aligner.offsets[k]
        for i in range(3):
            mount.axis[k, i] = offset.axis[i]
        mount.std[k, 0], mount.std[k, 1] = offset.pitch_std, offset.roll_std
        turned, pitch, roll = aligner.angle, event_degrees(offset.pitch, ANGLE_Q), event_degrees(offset.roll, ANGLE_Q)
        stds = event_degrees(offset.pitch_std, ANGLE_Q), event_degrees(offset.roll_std, ANGLE_Q)
        lean, noise = event_degrees(offset.lean, ANGLE_Q), event_degrees(offset.noise, ANGLE_Q)
        queue_event(
            node, ALIGNED, event_count(turned, k + 1), event_count(turned, aligner.method), turns_of(abs(turned)), pitch
        )
        extend_event(node, 4, roll, stds[0], stds[1])
        extend_event(node, 7, lean, noise, event_count(turned, aligner.sweeps[k].samples))
    mount.method = aligner.method
    end_alignment(node)
    realign_filter(node, settings)


@kernel
def judge_offset(offset: Any, noise: float) -> tuple[int, float, float]:
    """Why an offset is none, 0 when it is one, and two numbers of the reason; ``noise`` (rad) of a sample at rest."""
    size = planar_length(offset.axis[0], offset.axis[1])
    if offset.noise > SHAKING * noise:
        return SHAKES, event_degrees(offset.noise, ANGLE_Q), event_degrees(SHAKING * noise, ANGLE_Q)
    if offset.lean < LEAST_LEAN * offset.lean_std:
        return LITTLE_LEAN, event_degrees(offset.lean, ANGLE_Q), event_degrees(LEAST_LEAN * offset.lean_std, ANGLE_Q)
    if offset.lean > MOST_LEAN:
        return MUCH_LEAN, event_degrees(offset.lean, ANGLE_Q), NONE
    if size > FARTHEST:
        return LARGE_OFFSET, event_degrees(arcsine(size), ANGLE_Q), NONE
    return 0, NONE, NONE
