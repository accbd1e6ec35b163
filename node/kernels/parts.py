"""The parts of a cycle on their way into the step: of the cycle's own window, about the tube's axis, of all IMUs one.

A turn about the tube's axis shows on the z axis of a gyroscope as its correction has it: what a part turned beyond the
mean is divided by that. Constant biases are no part of it.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.cluster import of_weighed, weighed
from node.kernels.jit import kernel
from node.kernels.layout import BEGAN_STILL, ENDED_STILL, KNOWN, PARTS, RECENT, Array
from node.kernels.modes import STATIC_BIAS
from node.kernels.numbers import half, is_number, number, over, share, times
from node.kernels.quantity import factor
from node.kernels.record import LATE, PART, SPLIT

LEAST: Final = factor(0.5)  # of a turn about the tube's axis, that a gyroscope's z axis shows


@kernel
def read_parts(node: Any, parameters: Array, reading: Array, imu: int, length: float) -> None:
    """Leave in the cluster how much faster each part of the coming cycle turned than all of it, by one IMU.

    Its correction has been made, its delay not: that is known until then of the window before.

    Parameters
    ----------
    parameters : as ``node.kernels.step.node_step`` takes them
    reading : (READING,) of the IMU
    length : s, of the cycle
    """
    cluster = node.cluster
    cluster.split[imu] = 1 if reading[SPLIT] != 0 else 0
    if cluster.split[imu] == 0:
        return
    told, own = reading[PART:], cluster.parts[imu]
    for j in range(PARTS):
        if not is_number(told[j]):
            cluster.split[imu] = 0
            return
    late, since = reading[LATE], cluster.delayed[imu].late
    since = since if is_number(since) else late
    turned = axis_reading(node, parameters, imu)
    total: float = 0
    for j in range(PARTS):
        own[j] = told[j] if late == 0 and since == 0 else in_cycle(told, j, since, length - late + since, length)
        total += own[j]
    for j in range(PARTS):
        own[j] = over(own[j] - half(half(half(total))), turned)


@kernel
def in_cycle(told: Array, part: int, since: float, window: float, length: float) -> float:
    """Mean rate over a part of a cycle (``length`` s) by those ``told`` of a ``window`` (s).

    The window began ``since`` s before the cycle; where it ends before it, the last of its parts goes on.
    """
    cell, step = half(half(half(length))), half(half(half(window)))
    begin = since + part * cell
    total: float = 0
    for i in range(PARTS):
        first = max(begin, i * step)
        last = begin + cell if i == PARTS - 1 else min(begin + cell, (i + 1) * step)
        if last > first:
            total += share(told[i], last - first, cell)
    return total


@kernel
def axis_reading(node: Any, parameters: Array, imu: int) -> float:
    """What the z axis of a gyroscope shows, uncorrected, of a turn by 1 about the tube's axis."""
    axis, block, own = node.mount.axis[imu], parameters[0], parameters[1 + imu]
    x, y, z = axis[0], axis[1], axis[2]
    if block.identity != 1:
        m = block.gyroscope.m
        x, y, z = (
            times(x, m[0, 0]) + times(y, m[0, 1]) + times(z, m[0, 2]),
            times(x, m[1, 0]) + times(y, m[1, 1]) + times(z, m[1, 2]),
            times(x, m[2, 0]) + times(y, m[2, 1]) + times(z, m[2, 2]),
        )
    if own.identity != 1:
        m = own.gyroscope.m
        z = times(x, m[2, 0]) + times(y, m[2, 1]) + times(z, m[2, 2])
    return number(max(z, LEAST))


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
    began = BEGAN_STILL if is_at_rest(node, half(own[0] + own[1])) else 0
    ended = ENDED_STILL if is_at_rest(node, half(own[PARTS - 2] + own[PARTS - 1])) else 0
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
    total: float = 0
    for k in range(imus):
        if cluster.used[k] == 1 and cluster.split[k] == 0:
            return False
        total += cluster.weights[k]
    if not total > 0:
        return False
    for j in range(PARTS):
        own[j] = 0
        for k in range(imus):
            if cluster.used[k] == 1:
                own[j] += weighed(cluster.parts[k, j], cluster.weights[k], total)
        own[j] = of_weighed(own[j], total)
    return True
