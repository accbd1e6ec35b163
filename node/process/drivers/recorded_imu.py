"""An IMU's record as means over cycles, with the faults that it holds.

A row is the mean since the row before, so the mean over any cycle follows from the running integral, and neither the
rate of the rows nor a late cycle loses any turning; so does what its eighths turned, where the rows are as close as
those of a sensor that tells it itself. A cycle that reaches across a gap, a jump of the stamps or a row without numbers
has no mean: what turned there was not measured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from node.errors import SensorError
from node.kernels.record.filter_record import PARTS
from node.kernels.sensors.correction import USUAL
from node.process.drivers.fifo_window import LEAST
from node.process.drivers.source import ImuSample
from telemetry.errors import LoggerError
from telemetry.records.imu_record import ImuRecord, read_imu_record
from telemetry.records.record_columns import OWN_NAMES
from telemetry.records.record_reading import RecordReading
from telemetry.records.sensor_columns import FORCE, RATE
from telemetry.records.understood_record import NO_FAULT, fault_phrases, understood_line

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class NodeRecord:
    """A record that a node can take: ``times`` (n,) s, ``readings`` (n, 6 or 7) in rad/s, m/s^2, C.

    ``understood`` is the line to be told; of a node's own recording without a fault there is nothing to tell.
    """

    record: ImuRecord
    times: Array
    readings: Array
    understood: str


def load_record(path: Path, reading: RecordReading) -> NodeRecord:
    """Record of a file that holds a gyroscope, an accelerometer and times.

    Raises
    ------
    SensorError
        When it cannot be read or lacks one of them; the message names it.
    """
    try:
        record = read_imu_record(path, reading)
        columns = [record.triad(RATE), record.triad(FORCE)]
        times = record.times()
    except LoggerError as error:
        raise SensorError(str(error)) from error
    if record.temperature is not None:
        columns.append(record.temperature[:, None])
    own_form = tuple(name for one in record.placed.values() for name in one.names) in (OWN_NAMES[:7], OWN_NAMES)
    is_plain = own_form and fault_phrases(record) == [NO_FAULT]
    return NodeRecord(record, times, np.hstack(columns), "" if is_plain else understood_line(record))


class RecordedMeans:
    """Means of a record over any cycle."""

    def __init__(self, given: NodeRecord) -> None:
        self._name, self._lines = given.record.name, given.record.lines
        self._times, self._readings = given.times, given.readings
        lengths = np.diff(given.times)
        self._integral = np.zeros_like(given.readings)
        np.cumsum(given.readings[1:] * lengths[:, None], axis=0, out=self._integral[1:])
        self._turned = np.ascontiguousarray(self._integral[:, 2])  # about the tube's axis
        self._breaks = np.flatnonzero(given.record.breaks)
        self._saturated = given.record.saturated
        self._slots = np.sort(np.concatenate([self._lines, np.array(given.record.lost, dtype=np.int64)]))
        self.period = 1.0 / given.record.row_rate()  # s, of its rows

    @property
    def first(self) -> float:
        """Time of the first row, s."""
        return float(self._times[0])

    def row(self, k: int) -> ImuSample:
        """Row ``k`` of the file as it stands.

        Raises
        ------
        SensorError
            When the record has ended, or the row holds no reading.
        """
        if k >= len(self._slots):
            raise SensorError(f"{self._name}: the recording of {len(self._slots)} cycles has ended")
        line = self._slots[k]
        at = int(np.searchsorted(self._lines, line))
        if at == len(self._lines) or self._lines[at] != line:
            raise SensorError(f"{self._name}, line {line}: expected finite numbers")
        return _sample(self._readings[at], int(self._saturated[at]))

    def mean(self, begin: float, end: float) -> ImuSample:
        """Mean from ``begin`` to ``end``, s by the record's times.

        Raises
        ------
        SensorError
            When a part of it was not recorded.
        """
        first, last = self._row_after(begin), self._row_after(end)
        ended = last - 1 if end == self._times[last - 1] else last  # the row that the cycle ends in
        missing = self._breaks[(self._breaks >= first) & (self._breaks <= ended)]
        if missing.size:
            k = int(missing[0])
            raise SensorError(
                f"{self._name}, line {self._lines[k]}: what came between {self._times[k - 1]:.2f} and "
                f"{self._times[k]:.2f} s was not recorded"
            )
        turned = (self._at(end, last) - self._at(begin, first)) / (end - begin)
        sample = _sample(turned, int(np.bitwise_or.reduce(self._saturated[first : ended + 1])))
        return sample if last - first < LEAST else replace(sample, parts=self._parts(begin, end))

    def _parts(self, begin: float, end: float) -> tuple[float, ...]:
        """Mean rates (9) about z: none of the cycle before, for the window is the cycle's own, and of its eighths."""
        borders = np.linspace(begin, end, PARTS + 1)
        rates = np.diff(np.interp(borders, self._times, self._turned)) / np.diff(borders)
        return (0.0, *rates.tolist())

    def _row_after(self, t: float) -> int:
        k = int(np.searchsorted(self._times, t, side="right"))
        if k == len(self._times) and t == self._times[-1]:
            return k - 1
        if not 0 < k < len(self._times):
            raise SensorError(outside_recording_text(self._name, self._times, t))
        return k

    def _at(self, t: float, k: int) -> Array:
        before, after = self._times[k - 1], self._times[k]
        share = (t - before) / (after - before)
        return np.asarray((1.0 - share) * self._integral[k - 1] + share * self._integral[k])


def outside_recording_text(name: str | Path, times: Array, t: float) -> str:
    """Error text for a time outside the recording."""
    return f"{name}: recorded from {times[0]:.1f} s to {times[-1]:.1f} s, asked for {t:.1f} s"


def _sample(values: Array, saturated: int) -> ImuSample:
    wx, wy, wz, fx, fy, fz, *rest = values.tolist()
    return ImuSample((wx, wy, wz), (fx, fy, fz), rest[0] if rest else USUAL, saturated)
