"""Alignment, cycle by cycle: slow turns of the string show how each IMU sits against the tube's axis.

Ordered by the crew; the node waits for the string to turn slowly, follows the angle by its gyroscope, and ends with an
offset of pitch and roll, or with the reason why there is none. The offset in use stays until a new one is found.
"""

from __future__ import annotations

import enum
import math
from typing import Any, Final

from node.kernels.alignment import CIRCLE, add_to_sweep, clear_sweep, fit_circle, take_extremes, to_tube
from node.kernels.angles import from_binary, wrap
from node.kernels.cluster import all_used
from node.kernels.events import Code, tell, tell_more
from node.kernels.jit import constant, kernel
from node.kernels.layout import DEG, PERIOD, RING, Array
from node.kernels.quantity import NONE

SLOWEST, FASTEST = 2.0 * DEG, 15.0 * DEG  # rad/s, of the turn
PATIENCE: Final = 120.0  # s, for the turn to begin
STEADY_CYCLES: Final = 3  # of turning, before the first that counts: those of the speeding up do not
STOOD_CYCLES: Final = 4  # too slow in a row
LARGEST_GAP: Final = 5.0  # s, between two cycles
LARGEST_STEP: Final = 3.0 * DEG  # of the yaw in a cycle, beyond what the gyroscope turned
LEAST_LEAN: Final = 20.0  # standard errors: with less the readings do not show that they turned with the tube
MOST_LEAN: Final = 60.0 * DEG  # beyond it gravity's circle is wide, its middle near the centre: it determines no axis
SHAKING: Final = 5.0  # times the noise of a sample at rest
LARGEST_OFFSET: Final = 10.0 * DEG  # of a mount; a block of parameters can hold no larger one either
TAU: Final = math.tau


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
    constant(Reason.CYCLES_LOST),
    constant(Reason.SENSOR_FAULTY),
    constant(Reason.TOO_FAST),
)
TURNED_BACK, NEVER_TURNED = constant(Reason.TURNED_BACK), constant(Reason.NEVER_TURNED)
TOO_FEW_TURNS, TOO_LONG, NO_CIRCLE = (
    constant(Reason.TOO_FEW_TURNS),
    constant(Reason.TOO_LONG),
    constant(Reason.NO_CIRCLE),
)
SHAKES, LITTLE_LEAN, MUCH_LEAN = constant(Reason.SHAKES), constant(Reason.LITTLE_LEAN), constant(Reason.MUCH_LEAN)
LARGE_OFFSET = constant(Reason.LARGE_OFFSET)
BEGUN, TURNING, ALIGNED = constant(Code.ALIGNMENT_BEGUN), constant(Code.ALIGNMENT_TURNING), constant(Code.ALIGNED)
REFUSED, DROPPED = constant(Code.ALIGNMENT_REFUSED), constant(Code.ALIGNMENT_DROPPED)


@kernel
def begin_alignment(node: Any, method: int, turns: float) -> None:
    """Wait for ``turns`` slow turns from the next cycle on, to be taken by ``method``."""
    aligner = node.aligner
    aligner.method, aligner.wanted = method, turns
    aligner.ordered_at, aligner.last_end = math.nan, math.nan
    aligner.steady, aligner.slow = 0, 0
    aligner.angle, aligner.sense = 0.0, 0.0
    node.mount.aligning = 1
    tell(node, BEGUN, float(method), turns, NONE, NONE)


@kernel
def refuse_alignment(node: Any, reason: int, imu: int, a: float, b: float) -> None:
    """End the alignment under way without an offset; ``a`` and ``b`` are numbers of the reason, ``imu`` 0 is all."""
    turns = abs(node.aligner.angle) / TAU
    tell(node, REFUSED, float(reason), turns, float(imu), a)
    tell_more(node, 4, b, NONE, NONE)
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
    tell(node, DROPPED, float(reason), NONE, NONE, NONE)
    realign(node, settings)


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
    yaw = from_binary(state.now_yaw) if aided else math.nan
    if math.isnan(aligner.last_end):
        aligner.ordered_at, aligner.last_end = start, start
    gap, turned, rate = start - aligner.last_end, wrap(yaw - aligner.yaw), state.now_rate
    aligner.last_end, aligner.yaw = end, yaw
    if not -PERIOD < gap < LARGEST_GAP:
        refuse_alignment(node, CYCLES_LOST, 0, NONE, NONE)
    elif guard.gyro.fault != 0 or guard.force.fault != 0 or not all_used(node, settings):
        refuse_alignment(node, SENSOR_FAULTY, 0, NONE, NONE)
    elif abs(rate) > FASTEST:
        refuse_alignment(node, TOO_FAST, 0, abs(rate) / DEG, NONE)
    elif aligner.sense == 0.0:
        await_turn(node, settings, rate, end)
    elif rate * aligner.sense < -SLOWEST:
        refuse_alignment(node, TURNED_BACK, 0, NONE, NONE)
    else:
        moved = rate * (max(gap, 0.0) + end - start)
        followed = abs(wrap(turned - moved)) < LARGEST_STEP  # where the yaw is set again it jumps
        follow_turn(node, settings, rate, turned if followed else moved, 0.5 * rate * (end - start))


@kernel
def await_turn(node: Any, settings: Any, rate: float, end: float) -> None:
    """Until the string turns steadily at ``rate`` (rad/s)."""
    aligner = node.aligner
    aligner.steady = aligner.steady + 1 if abs(rate) >= SLOWEST else 0
    if aligner.steady >= STEADY_CYCLES:
        aligner.sense = math.copysign(1.0, rate)
        for k in range(settings.imus):
            clear_sweep(aligner.sweeps[k])
        tell(node, TURNING, rate / DEG, NONE, NONE, NONE)
    elif end - aligner.ordered_at > PATIENCE:
        refuse_alignment(node, NEVER_TURNED, 0, NONE, NONE)


@kernel
def follow_turn(node: Any, settings: Any, rate: float, turned: float, half: float) -> None:
    """One cycle of the turn: ``turned`` (rad) since the last, ``half`` of it after the middle of the readings."""
    aligner, force = node.aligner, node.aligner.force
    aligner.slow = aligner.slow + 1 if abs(rate) < SLOWEST else 0
    if aligner.slow >= STOOD_CYCLES:
        refuse_alignment(node, TOO_FEW_TURNS, 0, aligner.wanted, NONE)
        return
    if aligner.last_end - aligner.ordered_at > PATIENCE + aligner.wanted * TAU / SLOWEST:
        refuse_alignment(node, TOO_LONG, 0, aligner.wanted, NONE)
        return
    aligner.angle += turned
    for k in range(settings.imus):
        for i in range(3):
            force[i] = node.unaligned[k, i]
        for i in range(2):
            force[i] += rate * rate * settings.place[k, i]  # the circle around the axis pulls inwards
        add_to_sweep(aligner.sweeps[k], force, aligner.angle - half)
    if abs(aligner.angle) >= aligner.wanted * TAU:
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
            judge_offset(offset, settings.tilt_noise * settings.noise[k]) if found else (NO_CIRCLE, NONE, NONE)
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
        tell(node, ALIGNED, k + 1.0, float(aligner.method), abs(aligner.angle) / TAU, offset.pitch / DEG)
        tell_more(node, 4, offset.roll / DEG, offset.pitch_std / DEG, offset.roll_std / DEG)
        tell_more(node, 7, offset.lean / DEG, offset.noise / DEG, float(aligner.sweeps[k].samples))
    mount.method = aligner.method
    end_alignment(node)
    realign(node, settings)


@kernel
def judge_offset(offset: Any, noise: float) -> tuple[int, float, float]:
    """Why an offset is none, 0 when it is one, and two numbers of the reason; ``noise`` (rad) of a sample at rest."""
    size = math.hypot(offset.axis[0], offset.axis[1])
    if offset.noise > SHAKING * noise:
        return SHAKES, offset.noise / DEG, SHAKING * noise / DEG
    if offset.lean < LEAST_LEAN * offset.lean_std:
        return LITTLE_LEAN, offset.lean / DEG, LEAST_LEAN * offset.lean_std / DEG
    if offset.lean > MOST_LEAN:
        return MUCH_LEAN, offset.lean / DEG, NONE
    if size > math.sin(LARGEST_OFFSET):
        return LARGE_OFFSET, math.asin(min(size, 1.0)) / DEG, NONE
    return 0, NONE, NONE


@kernel
def add_axes(node: Any, settings: Any, which: int) -> None:
    """Sum of the axes of all IMUs, before (``which`` 0) or after (1) they change: the axis of the fused reading."""
    total = node.aligner.sums[which]
    for i in range(3):
        total[i] = 0.0
        for k in range(settings.imus):
            total[i] += node.mount.axis[k, i]


@kernel
def realign(node: Any, settings: Any) -> None:
    """Turn what the filter holds in the tube's frame when the axes have changed since ``add_axes(.., 0)``.

    R = R_after R_before^T. The covariance stays: turning it by so little changes it in the second order.
    """
    state, aligner = node.filter, node.aligner
    add_axes(node, settings, 1)
    before, after, turn, work = aligner.sums[0], aligner.sums[1], aligner.turn, aligner.force
    if before[0] == after[0] and before[1] == after[1] and before[2] == after[2]:
        return
    rotation_to_tube(before, work, aligner.rotations[0])
    rotation_to_tube(after, work, aligner.rotations[1])
    for i in range(3):
        for j in range(3):
            turn[i, j] = 0.0
            for k in range(3):
                turn[i, j] += aligner.rotations[1, i, k] * aligner.rotations[0, j, k]
    turn_vector(turn, state.down, work)
    turn_vector(turn, state.now_down, work)
    turn_vector(turn, state.static_bias, work)
    turn_vector(turn, state.bias, work)
    for slot in range(RING):
        turn_vector(turn, state.ring_rate[slot], work)
        turn_vector(turn, state.ring_force[slot], work)


@kernel
def rotation_to_tube(axis: Array, work: Array, rotation: Array) -> None:
    """Matrix (3, 3) of ``to_tube`` into ``rotation``; ``axis`` (3) is made a unit vector, ``work`` is 3 numbers."""
    size = math.sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2])
    for i in range(3):
        axis[i] /= size
    for j in range(3):
        for i in range(3):
            work[i] = 1.0 if i == j else 0.0
        to_tube(axis, work)
        for i in range(3):
            rotation[i, j] = work[i]


@kernel
def turn_vector(turn: Array, vector: Array, work: Array) -> None:
    """Multiply ``vector`` (3) by ``turn`` (3, 3), in place."""
    for i in range(3):
        work[i] = turn[i, 0] * vector[0] + turn[i, 1] * vector[1] + turn[i, 2] * vector[2]
    for i in range(3):
        vector[i] = work[i]
