"""Recordings as sources. The end of a recording, a gap in it and a row without numbers are sensor faults.

IMU: any record that ``telemetry.records`` reads. One whose rows are cycles plays one row a cycle, whatever the clock
says; one of a faster sensor plays the mean of the rows of each cycle, by its own times, which begin with the first
cycle.
Encoder: ``time, count, edge_at, rising`` and, if they were taken, the times of the edges before the last in its
direction, newest first; s, counts, s, 1 or 0, s. A row that has fewer of them repeats the oldest. ``time, count`` of a
counter that does not time its edges: a changed count is read in its middle, as from the device.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from node.errors import SensorError
from node.firmware.edge_interpolation import EDGES
from node.firmware.encoder_node import EncoderSample
from node.process.drivers.recorded_imu import RecordedMeans, load_record
from node.process.drivers.source import ImuSample
from telemetry.bounded_bytes import LARGEST_LOG, bounded_bytes
from telemetry.records.record_reading import RecordReading

Rows = npt.NDArray[np.float64]
COUNTS_ALONE = 2  # columns of a counter that does not time its edges
ENCODER_COLUMNS = tuple(range(4, 4 + EDGES))
FARTHEST = 1e15  # of a count
A_CYCLE = 0.5  # of a cycle: rows that are closer are a sensor's samples, and are averaged


class ReplayImu:
    """Plays a recording of an IMU from its first row on, when it was started."""

    def __init__(self, path: Path, reading: RecordReading | None = None) -> None:
        self._path, self._reading = path, reading or RecordReading()
        self._means: RecordedMeans | None = None
        self._next = 0
        self._shift: float | None = None
        self.understood = ""

    def start(self) -> None:
        """Read the file on the first start; later starts continue after the row that failed."""
        if self._means is None:
            record = load_record(self._path, self._reading)
            self._means, self.understood = RecordedMeans(record), record.understood

    def read(self, begin: float, end: float) -> ImuSample:
        """The next row, or the mean of the next cycle of a faster record."""
        if self._means is None:
            raise SensorError(f"{self._path}: not started")
        if self._means.period < A_CYCLE * (end - begin):
            if self._shift is None:
                self._shift = self._means.first - begin
            first = max(begin + self._shift, self._means.first)  # by rounding the first cycle may begin before it
            return self._means.mean(first, end + self._shift)
        k, self._next = self._next, self._next + 1
        return self._means.row(k)

    def close(self) -> None:
        """Nothing to release."""


class ReplayEncoder:
    """Plays a recording of the counter, moved in time so that its first row is now."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._rows: Rows | None = None
        self._next = 0
        self._shift: float | None = None
        self._untimed = EncoderSample(0, 0.0, rising=True, timed=False)

    def start(self) -> None:
        """Read the file on the first start; later starts continue after the row that failed."""
        if self._rows is None:
            self._rows = load_rows(self._path, (COUNTS_ALONE, *ENCODER_COLUMNS))

    def read(self, now: float) -> EncoderSample:
        """The next row."""
        if self._rows is None or self._next >= len(self._rows):
            raise SensorError(f"{self._path}: the recording has ended, or was not started")
        row = self._rows[self._next].tolist()
        self._next += 1
        if len(row) == COUNTS_ALONE:
            return self._count_alone(row[1], now)
        at, count, edge_at, rising, *earlier = row
        if not (math.isfinite(at) and math.isfinite(edge_at) and abs(count) < FARTHEST and edge_at <= at):
            raise SensorError(f"{self._path}: row {self._next}: expected a count and an edge before its time")
        if self._shift is None:
            self._shift = now - at
        moved = tuple(edge + self._shift for edge in earlier)
        return EncoderSample(int(count), edge_at + self._shift, rising > 0.5, earlier=moved)

    def _count_alone(self, count: float, now: float) -> EncoderSample:
        """Sample of a count whose edges have no times: the newest was passed by the read that found another count."""
        if not abs(count) < FARTHEST:
            raise SensorError(f"{self._path}: row {self._next}: expected a count, got {count}")
        last = self._untimed
        if int(count) != last.count:
            self._untimed = EncoderSample(int(count), now, rising=count > last.count, timed=False)
        return self._untimed

    def close(self) -> None:
        """Nothing to release."""


def load_rows(path: Path, columns: tuple[int, ...]) -> Rows:
    """Rows of a counter's recording: a ``.npy`` array, or a ``.csv`` that may begin with one line of names.

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
        wanted = ", ".join(map(str, columns))
        raise SensorError(f"{path}: expected rows of {wanted} columns, got an array of shape {rows.shape}")
    return rows


def _load_csv(path: Path) -> Rows:
    lines = [line for line in bounded_bytes(path, LARGEST_LOG).decode().splitlines() if line.strip()]
    first = 1 if lines and _is_name(lines[0].split(",")[0]) else 0
    return np.array([[float(cell) for cell in line.split(",")] for line in lines[first:]])


def _is_name(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return True
    return False
