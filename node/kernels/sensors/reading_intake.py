"""Readings on their way into the step: corrected, turned into the tube's frame, and of several IMUs made one."""

from __future__ import annotations

from typing import Any

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import are_numbers
from node.kernels.filter.resets import open_yaw
from node.kernels.record.node_record import FX, LATE, LATE_STD, SATURATED, TEMPERATURE, WX
from node.kernels.sensors.alignment import to_tube
from node.kernels.sensors.cluster import fuse_imus
from node.kernels.sensors.correction import correct_cycle
from node.kernels.sensors.delay import date_window, make_up_delay
from node.kernels.sensors.parts import read_parts, split_cycle


@kernel
def take_readings(node: Any, settings: Any, parameters: Array, readings: Array, length: float) -> int:
    """Leave in the node what one IMU would have read; bits of what of it was at the range. See ``node_step``.

    A cluster looks at the range of each IMU by itself. The cycle took ``length`` (s).
    """
    if settings.imus > 1:
        take_cluster(node, settings, parameters, readings, length)
        return 0
    correct_reading(node, parameters, readings, 0)
    rate, force = node.rate[:], node.force[:]  # arrays, as those of a cluster: the kernels below are compiled once
    for i in range(3):
        rate[i], force[i] = readings[0, WX + i], readings[0, FX + i]
    correct_one(node, parameters, 0, node.temperature, rate, force)
    read_parts(node, parameters, readings[0], 0, length)
    split_cycle(node, 1)
    date_window(node.cluster.delayed[0], readings[0, LATE_STD])
    doubt_turn(node, make_up_delay(node.cluster.delayed[0], readings[0, LATE], rate, length))
    return int(readings[0, SATURATED])


@kernel
def take_cluster(node: Any, settings: Any, parameters: Array, readings: Array, length: float) -> None:
    """Correct the readings of several IMUs, each by itself, and fuse them."""
    cluster, offsets = node.cluster, node.mount.rate_offset
    doubt: float = 0
    for k in range(settings.imus):
        correct_reading(node, parameters, readings, k)
        rate, force = cluster.rates[k], cluster.readings[k, 3:]
        for i in range(3):
            rate[i], force[i] = readings[k, WX + i], readings[k, FX + i]
        correct_one(node, parameters, k, node.temperature, rate, force)
        read_parts(node, parameters, readings[k], k, length)
        date_window(cluster.delayed[k], readings[k, LATE_STD])
        doubt = max(doubt, make_up_delay(node.cluster.delayed[k], readings[k, LATE], rate, length))
        for i in range(3):
            cluster.readings[k, i] = rate[i] - offsets[k, i]
    doubt_turn(node, doubt)
    fuse_imus(node, settings, readings)
    split_cycle(node, settings.imus)


@kernel
def doubt_turn(node: Any, var: float) -> None:
    """What the windows of the sensors leave open of the yaw (rad^2)."""
    if var > 0:
        open_yaw(node.filter, var)


@kernel
def correct_reading(node: Any, parameters: Array, readings: Array, imu: int) -> None:
    """Apply an IMU's own correction in place, and keep the raw reading that a block of parameters would correct."""
    own = parameters[1 + imu]
    node.temperature = readings[imu, TEMPERATURE]
    if own.identity != 1:
        correct_cycle(own, node.temperature, readings[imu, WX : WX + 3], readings[imu, FX : FX + 3])
    for k in range(3):
        node.raw_rate[k], node.raw_force[k] = readings[imu, WX + k], readings[imu, FX + k]


@kernel
def correct_one(node: Any, parameters: Array, imu: int, temperature: float, rate: Array, force: Array) -> None:
    """Correct the rate and force of one IMU by the block in use, and turn them into the tube's frame."""
    if not are_numbers(rate, force):
        return
    correct_cycle(parameters[0], temperature, rate, force)
    for k in range(3):
        node.unaligned[imu, k] = force[k]
    axis = node.mount.axis[imu]
    to_tube(axis, rate)
    to_tube(axis, force)
