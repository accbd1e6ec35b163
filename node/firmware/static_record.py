"""The static record: raw readings averaged at rest on command, for a calibration that the ground station solves.

``node.kernels.sensors.static_average`` takes the sums in the node's record; here are the order and the message.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from node.kernels.sensors.static_average import FEWEST, begin_sums, has_moved
from telemetry.messages import Matrix3, StaticRecord, Vector3

SHORTEST, LONGEST = 5.0, 3600.0  # s
MOVED = 3.0  # times the noise, the spread of a record that was not at rest


def begin_record(recording: Any, seconds: object, command: int, *, standing: bool) -> str:
    """Begin with the next cycle of ``recording`` (of dtype ``RECORDING``); returns why not, or nothing.

    A record that is being taken makes way: a new order means that it is not wanted, since what was before the order,
    such as another attitude, would be in it.
    """
    if isinstance(seconds, bool) or not isinstance(seconds, int | float) or not SHORTEST <= seconds <= LONGEST:
        return f"seconds: expected {SHORTEST:g}..{LONGEST:g}, got {seconds!r:.40}"
    if not standing:
        return "the node is turning, or has not stood still for long enough"
    begin_sums(recording["sums"])
    recording["running"], recording["command"] = 1, command
    recording["seconds"], recording["begun"] = seconds, math.nan
    return ""


def static_record(
    recording: Any, tube: int, end: float, rig_now: float, next_sequence: Callable[[], int]
) -> StaticRecord | None:
    """The record that ended at ``end`` (s, own clock), ``rig_now`` (s) of rig time; None when nothing came."""
    sums = recording["sums"]
    if int(sums["samples"]) < FEWEST:
        return None
    spread = sums["scatter"] / (int(sums["samples"]) - 1.0)
    return StaticRecord(
        tube=tube,
        sequence=next_sequence(),
        command=int(recording["command"]),
        begun_at=rig_now - (end - float(recording["begun"])),
        ended_at=rig_now,
        samples=int(sums["samples"]),
        rate=_vector(sums["mean"][:3]),
        rate_cov=_matrix(spread[:3, :3]),
        force=_vector(sums["mean"][3:]),
        force_cov=_matrix(spread[3:, 3:]),
        temperature=float(sums["temperature"]),
        moved=bool(has_moved(sums, MOVED)),
    )


def _vector(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Vector3:
    return float(values[0]), float(values[1]), float(values[2])


def _matrix(rows: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> Matrix3:
    return _vector(rows[0]), _vector(rows[1]), _vector(rows[2])
