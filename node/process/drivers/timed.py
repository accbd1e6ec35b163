"""Recordings played by the clock: a read returns what was recorded at that time, on the node's own clock."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from node.errors import SensorError
from node.firmware.encoder_node import EncoderSample
from node.process.drivers.recorded_imu import RecordedMeans, load_record, outside_recording_text
from node.process.drivers.replay_drivers import ENCODER_COLUMNS, Rows, load_rows
from node.process.drivers.source import ImuSample
from telemetry.records.record_reading import RecordReading


class TimedImu:
    """An IMU's recording by the clock."""

    def __init__(self, path: Path, reading: RecordReading | None = None) -> None:
        self._path, self._reading = path, reading or RecordReading()
        self._means: RecordedMeans | None = None
        self.understood = ""

    def start(self) -> None:
        """Read the file on the first start."""
        if self._means is None:
            record = load_record(self._path, self._reading)
            self._means, self.understood = RecordedMeans(record), record.understood

    def read(self, begin: float, end: float) -> ImuSample:
        """Mean from ``begin`` to ``end`` (s, own clock)."""
        if self._means is None:
            raise SensorError(f"{self._path}: not started")
        return self._means.mean(begin, end)

    def close(self) -> None:
        """Nothing to release."""


class TimedEncoder:
    """A counter's recording by the clock: the newest row that is not in the future."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._rows: Rows | None = None

    def start(self) -> None:
        """Read the file on the first start."""
        if self._rows is None:
            self._rows = load_times(self._path, ENCODER_COLUMNS)

    def read(self, now: float) -> EncoderSample:
        """The counter at ``now`` (s, own clock)."""
        if self._rows is None:
            raise SensorError(f"{self._path}: not started")
        k = int(np.searchsorted(self._rows[:, 0], now, side="right"))
        if not 0 < k < len(self._rows):
            raise SensorError(outside_recording_text(self._path, self._rows[:, 0], now))
        _, count, edge_at, rising, *earlier = self._rows[k - 1].tolist()
        return EncoderSample(int(count), edge_at, rising > 0.5, earlier=tuple(earlier))

    def close(self) -> None:
        """Nothing to release."""


def load_times(path: Path, columns: tuple[int, ...]) -> Rows:
    """Rows of a counter's recording whose times can be searched.

    Raises
    ------
    SensorError
        When the width is wrong, a value is not finite or time steps back; the message names the row.
    """
    rows = load_rows(path, columns)
    if not np.all(np.isfinite(rows)):
        raise SensorError(f"{path}: row {1 + int(np.argmin(np.isfinite(rows).all(axis=1)))}: expected finite numbers")
    steps = np.diff(rows[:, 0])
    if len(rows) < 2 or not np.all(steps > 0.0):
        where = f"row {2 + int(np.argmin(steps > 0.0))}" if len(rows) > 1 else "row 2"
        raise SensorError(f"{path}: {where}: expected a time after that of the row before")
    return rows
