"""Recordings as sources, one row a cycle. The end of a recording and a row without numbers are sensor faults.

IMU: ``time, wx, wy, wz, fx, fy, fz`` and, if it was recorded, ``temperature``; s, rad/s, m/s^2, C.
Encoder: ``time, count, edge_at, rising`` and, if they were taken, the times of the edges before the last in its
direction, newest first; s, counts, s, 1 or 0, s. A row that has fewer of them repeats the oldest.
A ``.npy`` file holds the same columns as an array of float64; a ``.csv`` file may begin with one line of names.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from node.errors import SensorError
from node.firmware.edge_interpolation import EDGES
from node.firmware.encoder_node import EncoderSample
from node.kernels.sensors.correction import USUAL
from node.process.drivers.source import ImuSample

Rows = npt.NDArray[np.float64]
IMU_COLUMNS = (7, 8)
ENCODER_COLUMNS = tuple(range(4, 4 + EDGES))
FARTHEST = 1e15  # of a count


class ReplayImu:
    """Plays a recording of an IMU, one row a cycle, whatever the clock says."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._rows: Rows | None = None
        self._next = 0

    def start(self) -> None:
        """Read the file on the first start; later starts continue after the row that failed."""
        if self._rows is None:
            self._rows = load_rows(self._path, IMU_COLUMNS)

    def read(self, begin: float, end: float) -> ImuSample:
        """The next row."""
        row = self._take()
        return ImuSample(
            (float(row[1]), float(row[2]), float(row[3])),
            (float(row[4]), float(row[5]), float(row[6])),
            float(row[7]) if len(row) > 7 else USUAL,
        )

    def close(self) -> None:
        """Nothing to release."""

    def _take(self) -> Rows:
        if self._rows is None:
            raise SensorError(f"{self._path}: not started")
        if self._next >= len(self._rows):
            raise SensorError(f"{self._path}: the recording of {len(self._rows)} cycles has ended")
        row = self._rows[self._next]
        self._next += 1
        if not np.all(np.isfinite(row)):
            raise SensorError(f"{self._path}: row {self._next}: expected finite numbers")
        return np.asarray(row)


class ReplayEncoder:
    """Plays a recording of the counter, moved in time so that its first row is now."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._rows: Rows | None = None
        self._next = 0
        self._shift: float | None = None

    def start(self) -> None:
        """Read the file on the first start; later starts continue after the row that failed."""
        if self._rows is None:
            self._rows = load_rows(self._path, ENCODER_COLUMNS)

    def read(self, now: float) -> EncoderSample:
        """The next row."""
        if self._rows is None or self._next >= len(self._rows):
            raise SensorError(f"{self._path}: the recording has ended, or was not started")
        at, count, edge_at, rising, *earlier = self._rows[self._next].tolist()
        self._next += 1
        if not (math.isfinite(at) and math.isfinite(edge_at) and abs(count) < FARTHEST and edge_at <= at):
            raise SensorError(f"{self._path}: row {self._next}: expected a count and an edge before its time")
        if self._shift is None:
            self._shift = now - at
        moved = tuple(edge + self._shift for edge in earlier)
        return EncoderSample(int(count), edge_at + self._shift, rising > 0.5, earlier=moved)

    def close(self) -> None:
        """Nothing to release."""


def load_rows(path: Path, columns: tuple[int, ...]) -> Rows:
    """Rows of a recording.

    Raises
    ------
    SensorError
        When the file is absent, empty, unreadable or of another width; the message names it.
    """
    try:
        rows = np.load(path, allow_pickle=False) if path.suffix == ".npy" else _load_csv(path)
        rows = np.asarray(rows, dtype=np.float64)
    except (OSError, ValueError, TypeError) as error:
        raise SensorError(f"{path}: {error}") from error
    if rows.ndim != 2 or len(rows) == 0 or rows.shape[1] not in columns:
        wanted = f"{columns[0]} to {columns[-1]}"
        raise SensorError(f"{path}: expected rows of {wanted} columns, got an array of shape {rows.shape}")
    return rows


def _load_csv(path: Path) -> Rows:
    lines = [line for line in path.read_text().splitlines() if line.strip()]
    first = 1 if lines and _is_name(lines[0].split(",")[0]) else 0
    return np.array([[float(cell) for cell in line.split(",")] for line in lines[first:]])


def _is_name(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return True
    return False
