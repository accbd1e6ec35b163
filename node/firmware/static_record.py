"""The static record: raw readings averaged at rest on command, for a calibration that the ground station solves."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from node.kernels.static_average import STATIC, add_static, has_moved
from telemetry.messages import Matrix3, StaticRecord, Vector3

SHORTEST, LONGEST = 5.0, 3600.0  # s
FEWEST = 2  # samples of a covariance
MOVED = 3.0  # times the noise, the spread of a record that was not at rest


class StaticRecorder:
    """At most one record at a time."""

    def __init__(self) -> None:
        self._sums = np.zeros(1, STATIC)
        self._command: int | None = None
        self._seconds = 0.0
        self._begun = 0.0
        self._rate, self._force = np.zeros(3), np.zeros(3)

    @property
    def running(self) -> bool:
        """Whether a record is being taken."""
        return self._command is not None

    def start(self, seconds: object, command: int, *, standing: bool) -> str:
        """Begin with the next cycle; returns why not, or nothing."""
        if isinstance(seconds, bool) or not isinstance(seconds, int | float) or not SHORTEST <= seconds <= LONGEST:
            return f"seconds: expected {SHORTEST:g}..{LONGEST:g}, got {seconds!r:.40}"
        if self.running:
            return "a static record is being taken"
        if not standing:
            return "the node is turning, or has not stood still for long enough"
        self._sums[:] = 0
        self._command, self._seconds, self._begun = command, float(seconds), math.nan
        return ""

    def append_reading(
        self, rate: Vector3, force: Vector3, temperature: float, start: float, *, standing: bool
    ) -> None:
        """Add one cycle's raw reading that began at ``start`` (s, own clock)."""
        if math.isnan(self._begun):
            self._begun = start
        self._rate[:], self._force[:] = rate, force
        add_static(self._sums[0], self._rate, self._force, temperature, int(standing))

    def finish(self, tube: int, end: float, rig_now: float, next_sequence: Callable[[], int]) -> StaticRecord | None:
        """The record that ended at ``end`` (s, own clock), ``rig_now`` (s) of rig time; None when nothing came."""
        sums, command = self._sums[0], self._command
        self._command = None
        if int(sums["samples"]) < FEWEST:
            return None
        spread = sums["scatter"] / (int(sums["samples"]) - 1.0)
        return StaticRecord(
            tube=tube,
            sequence=next_sequence(),
            command=command if command is not None else 0,
            begun_at=rig_now - (end - self._begun),
            ended_at=rig_now,
            samples=int(sums["samples"]),
            rate=_vector(sums["mean"][:3]),
            rate_cov=_matrix(spread[:3, :3]),
            force=_vector(sums["mean"][3:]),
            force_cov=_matrix(spread[3:, 3:]),
            temperature=float(sums["temperature"]),
            moved=bool(has_moved(sums, MOVED)),
        )

    def is_due(self, end: float) -> bool:
        """Whether the record is long enough at ``end`` (s, own clock)."""
        return self.running and end - self._begun >= self._seconds


def _vector(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Vector3:
    return float(values[0]), float(values[1]), float(values[2])


def _matrix(rows: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> Matrix3:
    return _vector(rows[0]), _vector(rows[1]), _vector(rows[2])
