"""The frame after an alignment: what the filter holds in the tube's frame turns with the axes of its IMUs."""

from __future__ import annotations

from typing import Any

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import over_factor, times_factor, vector_length
from node.kernels.arithmetic.quantity import ONE
from node.kernels.record.filter_record import RING
from node.kernels.sensors.alignment import to_tube


@kernel
def add_axes(node: Any, settings: Any, which: int) -> None:
    """Sum of the axes of all IMUs, before (``which`` 0) or after (1) they change: the axis of the fused reading."""
    total = node.aligner.sums[which]
    for i in range(3):
        total[i] = 0
        for k in range(settings.imus):
            total[i] += node.mount.axis[k, i]


@kernel
def realign_filter(node: Any, settings: Any) -> None:
    """Turn what the filter holds in the tube's frame when the axes have changed since ``add_axes(.., 0)``.

    R = R_after R_before^T. The covariance stays: turning it by so little changes it in the second order.
    """
    state, aligner = node.filter, node.aligner
    add_axes(node, settings, 1)
    before, after, rotation, work = aligner.sums[0], aligner.sums[1], aligner.turn, aligner.force
    if before[0] == after[0] and before[1] == after[1] and before[2] == after[2]:
        return
    rotation_to_tube(before, work, aligner.rotations[0])
    rotation_to_tube(after, work, aligner.rotations[1])
    for i in range(3):
        for j in range(3):
            rotation[i, j] = 0
            for k in range(3):
                rotation[i, j] += times_factor(aligner.rotations[1, i, k], aligner.rotations[0, j, k])
    state.smoothing = 0  # the last survey is of the frame before
    turn_vector(rotation, state.down, work)
    turn_vector(rotation, state.now_down, work)
    turn_vector(rotation, state.static_bias, work)
    turn_vector(rotation, state.bias, work)
    for slot in range(RING):
        turn_vector(rotation, state.ring_rate[slot], work)
        turn_vector(rotation, state.ring_force[slot], work)


@kernel
def rotation_to_tube(axis: Array, work: Array, rotation: Array) -> None:
    """Matrix (3, 3) of ``to_tube`` into ``rotation``; ``axis`` (3) is made a unit vector, ``work`` is 3 numbers."""
    size = vector_length(axis[0], axis[1], axis[2])
    for i in range(3):
        axis[i] = over_factor(axis[i], size)
    for j in range(3):
        for i in range(3):
            work[i] = 0
        work[j] = ONE
        to_tube(axis, work)
        for i in range(3):
            rotation[i, j] = work[i]


@kernel
def turn_vector(rotation: Array, vector: Array, work: Array) -> None:
    """Multiply ``vector`` (3) by ``rotation`` (3, 3), in place."""
    for i in range(3):
        work[i] = (
            times_factor(vector[0], rotation[i, 0])
            + times_factor(vector[1], rotation[i, 1])
            + times_factor(vector[2], rotation[i, 2])
        )
    for i in range(3):
        vector[i] = work[i]
