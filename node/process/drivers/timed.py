"""Recordings played by the clock: a read returns what was recorded at that time.

The columns are those of ``drivers.replay``; the times are those of the node's own clock, in ascending order. A row of
an IMU is the mean since the row before, so the mean over any cycle follows from the running integral, and neither the
rate of the rows nor a late cycle loses any turning.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from node.errors import SensorError
from node.firmware.encoder_node import EncoderSample
from node.kernels.sensors.correction import USUAL
from node.process.drivers.replay_drivers import ENCODER_COLUMNS, IMU_COLUMNS, Rows, load_rows
from node.process.drivers.source import ImuSample


class TimedImu:
    """An IMU's recording by the clock."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._times: Rows | None = None
        self._integral: Rows | None = None

    def start(self) -> None:
        """Read the file on the first start."""
        if self._integral is not None:
            return
        rows = load_times(self._path, IMU_COLUMNS)
        lengths = np.diff(rows[:, 0])
        self._times = rows[:, 0].copy()
        self._integral = np.zeros((len(rows), rows.shape[1] - 1))
        np.cumsum(rows[1:, 1:] * lengths[:, None], axis=0, out=self._integral[1:])

    def read(self, begin: float, end: float) -> ImuSample:
        """Mean from ``begin`` to ``end`` (s, own clock)."""
        wx, wy, wz, fx, fy, fz, *rest = ((self._at(end) - self._at(begin)) / (end - begin)).tolist()
        return ImuSample((wx, wy, wz), (fx, fy, fz), rest[0] if rest else USUAL)

    def close(self) -> None:
        """Nothing to release."""

    def _at(self, t: float) -> Rows:
        if self._times is None or self._integral is None:
            raise SensorError(f"{self._path}: not started")
        k = int(np.searchsorted(self._times, t, side="right"))
        if not 0 < k < len(self._times):
            raise SensorError(outside_recording_text(self._path, self._times, t))
        before, after = self._times[k - 1], self._times[k]
        share = (t - before) / (after - before)
        return np.asarray((1.0 - share) * self._integral[k - 1] + share * self._integral[k])


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
    """Rows of a recording whose times can be searched.

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


def outside_recording_text(path: Path, times: Rows, t: float) -> str:
    """Error text for a time outside the recording."""
    return f"{path}: recorded from {times[0]:.1f} s to {times[-1]:.1f} s, asked for {t:.1f} s"
