"""The parts of a cycle on their way into the step: of the cycle's own window, about the tube's axis, of all IMUs one.

A turn about the tube's axis shows on the z axis of a gyroscope as its correction has it: what a part turned beyond the
mean is divided by that. Constant biases are no part of it.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import (
    as_number,
    half_of,
    is_number,
    over_factor,
    proportional_share,
    times_factor,
    turning_rate,
)
from node.kernels.arithmetic.quantity import factor_quantity
from node.kernels.filter.modes import STATIC_BIAS
from node.kernels.record.filter_record import BEGAN_STILL, ENDED_STILL, KNOWN, PARTS, RECENT, RING
from node.kernels.record.node_record import BEHIND, LATE, PART, SPLIT
from node.kernels.record.ring import is_split
from node.kernels.sensors.cluster import fuse_readings, of_weighed, weighted_share

LEAST: Final = factor_quantity(0.5)  # of a turn about the tube's axis, that a gyroscope's z axis shows


@kernel
def read_parts(node: Any, parameters: Array, reading: Array, imu: int, length: float) -> None:
    """Leave in the cluster how much faster each part of the coming cycle turned than all of it, by one IMU.

    Its correction has been made, its delay not: that is known until then of the window before. Of the last part the end
    is missing where the window was late: the slope from the part before goes on, but not through 0, for what slows down
    is stopping.

    Parameters
    ----------
    parameters : as ``node.kernels.step.node_step.node_step`` takes them
    reading : (READING,) of the IMU
    length : s, of the cycle
    """
    state, cluster = node.filter, node.cluster
    memory = cluster.delayed[imu]
    newest = state.cycles - 1
    memory.joins = 1 if is_split(state, newest) and newest >= state.consumed else 0
    cluster.split[imu] = memory.told = 1 if reading[SPLIT] != 0 and are_parts(reading) else 0
    if cluster.split[imu] == 0:
        return
    told, own = reading[PART:], cluster.parts[imu]
    late, since, part = reading[LATE], memory.late, half_of(half_of(half_of(length)))
    since = since if is_number(since) else late
    rise = told[PARTS - 1] - told[PARTS - 2]
    ahead = told[PARTS - 1] + proportional_share(half_of(rise), part, part - half_of(late))
    if (ahead < 0) != (told[PARTS - 1] < 0):
        ahead = 0 * ahead
    total: float = 0
    for j in range(PARTS):
        own[j] = told[j]
        total += half_of(half_of(half_of(told[j])))
    window = length - late + since
    shown = (
        proportional_share(total, length, window)
        - proportional_share(told[PARTS - 1], late, window)
        + proportional_share(reading[BEHIND], since, window)
    )
    turned = axis_reading(node, parameters, imu)
    memory.behind, memory.ahead = over_factor(reading[BEHIND] - shown, turned), over_factor(ahead - shown, turned)
    own[PARTS - 1] += proportional_share(ahead - told[PARTS - 1], late, part)
    total += half_of(half_of(half_of(own[PARTS - 1] - told[PARTS - 1])))
    for j in range(PARTS):
        own[j] = over_factor(own[j] - total, turned)


@kernel
def are_parts(reading: Array) -> bool:
    """Whether a reading's parts are all finite numbers."""
    found = 1 if is_number(reading[BEHIND]) else 0
    for j in range(PARTS):
        found += 1 if is_number(reading[PART + j]) else 0
    return found == PARTS + 1


@kernel
def put_right(node: Any, imus: int) -> None:
    """Add to the last cycle, which the filter has not passed yet, what the windows that came now show of its end.

    Not where the guard has put something else in the place of these.
    """
    state, cluster = node.filter, node.cluster
    newest = state.cycles - 1
    if state.ring_split[state.cycles % RECENT] == 0:
        return
    total: float = 0
    shown: float = 0
    for k in range(imus):
        total += cluster.weights[k] if imus > 1 else 0
    for k in range(imus):
        if imus == 1:
            shown = cluster.delayed[k].shown
        elif cluster.used[k] == 1:
            shown += weighted_share(cluster.delayed[k].shown, cluster.weights[k], total)
    if imus > 1:
        shown = of_weighed(shown, total) if total > 0 else 0
    if shown == 0:
        return
    slot = newest % RING
    faster = turning_rate(shown, state.ring_end[slot] - state.ring_start[slot])
    state.ring_rate[slot, 2] += faster
    for j in range(PARTS):
        state.ring_parts[newest % RECENT, j] -= faster
    state.ring_parts[newest % RECENT, PARTS - 1] += PARTS * faster


@kernel
def axis_reading(node: Any, parameters: Array, imu: int) -> float:
    """What the z axis of a gyroscope shows, uncorrected, of a turn by 1 about the tube's axis."""
    axis, block, own = node.mount.axis[imu], parameters[0], parameters[1 + imu]
    x, y, z = axis[0], axis[1], axis[2]
    if block.identity != 1:
        m = block.gyroscope.m
        x, y, z = (
            times_factor(x, m[0, 0]) + times_factor(y, m[0, 1]) + times_factor(z, m[0, 2]),
            times_factor(x, m[1, 0]) + times_factor(y, m[1, 1]) + times_factor(z, m[1, 2]),
            times_factor(x, m[2, 0]) + times_factor(y, m[2, 1]) + times_factor(z, m[2, 2]),
        )
    if own.identity != 1:
        m = own.gyroscope.m
        z = times_factor(x, m[2, 0]) + times_factor(y, m[2, 1]) + times_factor(z, m[2, 2])
    return as_number(max(z, LEAST))


@kernel
def split_cycle(node: Any, imus: int) -> None:
    """Leave in the filter's ring what the IMUs in use show of the parts of the coming cycle, if each of them does."""
    state, cluster = node.filter, node.cluster
    slot = state.cycles % RECENT
    state.ring_split[slot] = 0
    own = state.ring_parts[slot]
    if imus > 1:
        if not fuse_parts(cluster, imus, own):
            return
    elif cluster.split[0] == 1:
        for j in range(PARTS):
            own[j] = cluster.parts[0, j]
    else:
        return
    began = BEGAN_STILL if is_at_rest(node, half_of(own[0] + own[1])) else 0
    ended = ENDED_STILL if is_at_rest(node, half_of(own[PARTS - 2] + own[PARTS - 1])) else 0
    state.ring_split[slot] = KNOWN | began | ended


@kernel
def is_at_rest(node: Any, beyond: float) -> bool:
    """Whether what is ``beyond`` (rad/s) the mean of the cycle leaves the rate of a body at rest."""
    state = node.filter
    turning = node.rate[2] + beyond - state.static_bias[2] - state.bias[2]
    return bool(state.mode != STATIC_BIAS and abs(turning) <= node.config.still_rate)


@kernel
def fuse_parts(cluster: Any, imus: int, own: Array) -> bool:
    """Inverse-variance mean of the parts of the IMUs in use into ``own`` (8); whether every one of them tells its."""
    count = 0
    for k in range(imus):
        if cluster.used[k] == 1 and cluster.split[k] == 0:
            return False
        count += cluster.used[k]
    if count == 0:
        return False
    fuse_readings(cluster.parts[:], cluster.weights, own)
    return True
