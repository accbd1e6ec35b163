"""Mean and covariance of raw readings at rest, as running sums: nothing is stored of the samples themselves."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from node.kernels.calibration import USUAL
from node.kernels.jit import kernel
from node.kernels.layout import Array

STATIC: Final = np.dtype(
    [
        ("samples", "i8"),  # cycles taken in
        ("mean", "f8", (6,)),  # rad/s, then m/s^2
        ("scatter", "f8", (6, 6)),  # sum of the products of deviations from the mean
        ("last", "f8", (6,)),  # newest reading
        ("steps", "f8", (6,)),  # sum of the squared differences of neighbours
        ("temperature", "f8"),  # C, mean
        ("moved", "i8"),  # 1: it was not at rest all the time
        ("delta", "f8", (6,)),  # work space: what the newest differs from the mean by
    ],
    align=True,
)


@kernel
def add_static(record: Any, rate: Array, force: Array, temperature: float, standing: int) -> int:
    """Take one cycle's raw reading into the sums; returns 0 for one that is no number and is left out.

    n m_n = (n - 1) m_(n-1) + x_n,  S_n = S_(n-1) + (n - 1)/n d d^T with d = x_n - m_(n-1).

    Parameters
    ----------
    record : record of dtype ``STATIC``
    rate, force : (3,) raw, rad/s and m/s^2
    temperature : C
    standing : 0 when the node was not at rest in this cycle

    Source: Welford, Technometrics 4 (1962) 419.
    """
    for k in range(3):
        if not (math.isfinite(rate[k]) and math.isfinite(force[k])):
            return 0
    record.samples += 1
    n = record.samples
    if standing == 0:
        record.moved = 1
    record.temperature += (temperature - record.temperature) / n
    for i in range(6):
        x = rate[i] if i < 3 else force[i - 3]
        if n > 1:
            record.steps[i] += (x - record.last[i]) ** 2
        record.last[i] = x
        record.delta[i] = x - record.mean[i]
        record.mean[i] += record.delta[i] / n
    weight = (n - 1.0) / n
    for i in range(6):
        for j in range(6):
            record.scatter[i, j] += weight * record.delta[i] * record.delta[j]
    return 1


@kernel
def begin_sums(record: Any) -> None:
    """Begin anew."""
    record.samples, record.temperature, record.moved = 0, 0.0, 0
    for i in range(6):
        record.mean[i], record.last[i], record.steps[i] = 0.0, 0.0, 0.0
        for j in range(6):
            record.scatter[i, j] = 0.0


@kernel
def follow_recording(node: Any, start: float, end: float, standing: int) -> bool:
    """Take the cycle's raw reading (``start`` to ``end``, s, own clock) into the record being taken; whether it is due.

    What is due is no longer running.
    """
    recording = node.recording
    if recording.running == 0:
        return False
    if math.isnan(recording.begun):
        recording.begun = start
    temperature = node.temperature if math.isfinite(node.temperature) else USUAL
    add_static(recording.sums, node.raw_rate, node.raw_force, temperature, standing)
    if end - recording.begun < recording.seconds:
        return False
    recording.running = 0
    return True


@kernel
def has_moved(record: Any, limit: float) -> int:
    """Whether the spread of any axis is beyond ``limit`` times the noise that its neighbours show, 1 or 0.

    s^2 = S/(n - 1) against limit^2 sum (x_k - x_(k-1))^2 / (2 (n - 1)): neighbours at rest differ by the noise alone,
    whatever the mean does slowly. Source: von Neumann, Ann. Math. Stat. 12 (1941) 367.
    """
    if record.moved == 1:
        return 1
    for i in range(6):
        if record.scatter[i, i] > 0.5 * limit * limit * record.steps[i]:
            return 1
    return 0
