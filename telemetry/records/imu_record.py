"""A record of an IMU in SI, read as it comes, with the line of what was understood of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from telemetry.errors import LoggerError
from telemetry.records.logged_cells import LoggedCells, read_logged_cells
from telemetry.records.reading_faults import rows_at_range, rows_read_twice
from telemetry.records.record_columns import Placed, ignored_columns, place_columns
from telemetry.records.record_reading import RecordReading
from telemetry.records.record_stamps import Mask, RowTimes, stretches_of, times_of_rate, times_of_stamps
from telemetry.records.sensor_columns import FIELD, FORCE, RATE, TEMPERATURE, TIME, TRIAD, UNITS, G, column_of

Array = npt.NDArray[np.float64]
AT_REST: Final = 0.15  # relative, by which the size of a force in the right unit may differ from gravity
FEWEST: Final = 2  # rows
SELDOM: Final = 0.01  # of the rows; where more stand at the range, what is left between them says nothing


@dataclass(frozen=True, slots=True, eq=False)
class ImuRecord:
    """Rows of a record in SI.

    ``rate`` (n, 3) rad/s, ``force`` (n, 3) m/s^2, ``field`` (n, 3) T and ``temperature`` (n,) C are None where the
    record has none. ``times`` of the rows are None without stamps and without a told rate. ``lines`` (n,) of the file.
    ``saturated`` (n,): 1 gyroscope, 2 accelerometer at their range. ``lost`` are lines that hold no reading,
    ``repeated`` counts rows that stand twice; those were left out if it was asked for.
    """

    name: str
    placed: dict[str, Placed]
    stamps: RowTimes | None
    rate: Array | None
    force: Array | None
    field: Array | None
    temperature: Array | None
    lines: npt.NDArray[np.int64]
    saturated: npt.NDArray[np.int64]
    lost: tuple[int, ...]
    repeated: int
    ignored: tuple[str, ...]
    sha256: str

    @property
    def breaks(self) -> Mask:
        """Rows (n,) that do not follow on the one before."""
        return self.stamps.breaks if self.stamps is not None else np.zeros(len(self.lines), dtype=bool)

    def times(self) -> Array:
        """Times (n,) s of the rows.

        Raises
        ------
        LoggerError
            When the record has no stamps and no rate was told.
        """
        return self._known_stamps().times

    def row_rate(self) -> float:
        """Rows a second where none is missing; raises as ``times``."""
        return 1.0 / self._known_stamps().period

    def triad(self, quantity: str) -> Array:
        """Readings (n, 3) of a sensor.

        Raises
        ------
        LoggerError
            When the record has none of it; the message lists what it has.
        """
        values = {RATE: self.rate, FORCE: self.force, FIELD: self.field}[quantity]
        if values is None:
            has = ", ".join(name for name in self.placed if name != TIME)
            raise LoggerError(f"{self.name}: expected readings of the {quantity}, got a record of {has}")
        return values

    def longest_stretch(self) -> slice:
        """Rows of the longest stretch without a break, and without a sensor at its range where that is seldom."""
        broken, at_range = self.breaks.copy(), self.saturated > 0
        if np.mean(at_range) < SELDOM:
            broken |= at_range
            broken[1:] |= at_range[:-1]
        return max(stretches_of(broken), key=lambda part: part.stop - part.start)

    def _known_stamps(self) -> RowTimes:
        if self.stamps is None:
            raise LoggerError(f"{self.name}: has no column of times: expected its rate (rows a second)")
        if self.stamps.period <= 0.0:
            raise LoggerError(
                f"{self.name}: its times stand still: expected times that grow, or a rate (rows a second)"
            )
        return self.stamps


def read_imu_record(path: Path, reading: RecordReading, *, leave_out_repeats: bool = False) -> ImuRecord:
    """Record of a file.

    Raises
    ------
    LoggerError
        When the file is no record, a column or a unit is not known, or a sensor is in another unit than told.
    """
    found = read_logged_cells(path)
    placed = place_columns(found, reading)
    used = [k for one in placed.values() for k in one.columns]
    whole = np.all(np.isfinite(found.cells[:, used]), axis=1)
    if np.sum(whole) < FEWEST:
        raise LoggerError(f"{found.name}: expected {FEWEST} rows or more of numbers, got {int(np.sum(whole))}")
    lost = tuple(int(line) for line in found.lines[~whole])
    again = np.zeros(len(found.cells) + 1, dtype=bool)
    again[list(found.again)] = True
    again[1:] |= ~whole  # what follows a row without numbers
    kept, fresh = found.cells[whole], _carried(again[:-1], whole)
    readings = [k for one in placed.values() if one.quantity not in (TIME, TEMPERATURE) for k in one.columns]
    twice = rows_read_twice(kept[:, readings])
    share = 1.0
    if leave_out_repeats and np.any(twice):
        share = float(np.mean(~twice))
        kept, fresh, lines = kept[~twice], fresh[~twice], found.lines[whole][~twice]
    else:
        lines = found.lines[whole]
    stamps = _stamps_of(found, placed, kept, fresh, reading.rate * share)
    taken = _taken(found.name, stamps, len(kept), reading)
    return _made(found, placed, kept[taken], _cut(stamps, taken), lines[taken], lost, int(np.sum(twice)), reading)


def has_bare_triad(path: Path, columns: str) -> bool:
    """Whether a file's columns are x, y and z, of a sensor that they do not name."""
    found = read_logged_cells(path)
    names = tuple(name.strip() for name in columns.split(",")) if columns else found.names
    if not names:
        return found.cells.shape[1] == 3 and not any(found.integers)
    kinds = [column_of(name) for name in names]
    return sum(one is not None and one.quantity == TRIAD for one in kinds) == 3


def _carried(again: Mask, whole: Mask) -> Mask:
    """Breaks of the kept rows: a break before a row that is left out stands before the next."""
    groups = np.cumsum(whole)  # the rows left out behind a kept one belong to the next
    fresh = np.zeros(int(groups[-1]), dtype=bool)
    for k in np.flatnonzero(again):
        at = int(groups[k]) - (1 if whole[k] else 0)
        if 0 < at < len(fresh):
            fresh[at] = True
    return fresh


def _stamps_of(found: LoggedCells, placed: dict[str, Placed], kept: Array, fresh: Mask, rate: float) -> RowTimes | None:
    if TIME not in placed:
        return times_of_rate(len(kept), rate, fresh) if rate > 0.0 else None
    one = placed[TIME]
    stamps = times_of_stamps(one.take(kept), one.scale, found.integers[one.columns[0]], fresh)
    if rate > 0.0 and not abs(rate * stamps.period - 1.0) < 0.1:
        raise LoggerError(f"{found.name}: rate: the stamps say {1.0 / stamps.period:.4g} Hz, told was {rate:.4g} Hz")
    return stamps


def _taken(name: str, stamps: RowTimes | None, count: int, reading: RecordReading) -> Mask:
    """Rows (n,) that are used, by what is told in seconds after the first."""
    taken = np.ones(count, dtype=bool)
    if reading.begin <= 0.0 and math.isinf(reading.end) and not reading.without:
        return taken
    if stamps is None:
        raise LoggerError(f"{name}: from, to, without: expected times, got a record without them: tell its rate")
    after = stamps.times - stamps.times[0]
    taken &= (after >= reading.begin) & (after <= reading.end)
    for begin, end in reading.without:
        taken &= (after < begin) | (after > end)
    if np.sum(taken) < FEWEST:
        raise LoggerError(f"{name}: from, to, without: expected rows of a record of {after[-1]:.1f} s, none is left")
    return taken


def _cut(stamps: RowTimes | None, taken: Mask) -> RowTimes | None:
    if stamps is None or np.all(taken):
        return stamps
    breaks = stamps.breaks[taken]
    breaks |= np.diff(np.flatnonzero(taken), prepend=-1)[: len(breaks)] > 1
    breaks[0] = False
    place = np.cumsum(taken) - 1
    return RowTimes(
        stamps.times[taken],
        breaks,
        stamps.period,
        tuple((int(place[k]), length) for k, length in stamps.gaps if taken[k]),
        tuple((int(place[k]), length) for k, length in stamps.jumps if taken[k]),
        stamps.wraps,
        tuple(int(place[k]) for k in stamps.strays if taken[k]),
        stamps.repeats,
        stamps.bursts,
    )


def _made(
    found: LoggedCells,
    placed: dict[str, Placed],
    cells: Array,
    stamps: RowTimes | None,
    lines: npt.NDArray[np.int64],
    lost: tuple[int, ...],
    repeated: int,
    reading: RecordReading,
) -> ImuRecord:
    values: dict[str, Any] = {quantity: one.take(cells) for quantity, one in placed.items()}
    saturated = np.zeros(len(cells), dtype=np.int64)
    for bit, quantity in ((1, RATE), (2, FORCE)):
        if quantity in values:
            saturated += bit * rows_at_range(values[quantity])
    if FORCE in values:
        _check_gravity(found.name, placed[FORCE], values[FORCE])
    return ImuRecord(
        found.name,
        placed,
        stamps,
        values.get(RATE),
        values.get(FORCE),
        values.get(FIELD),
        values.get(TEMPERATURE),
        lines,
        saturated,
        lost,
        repeated,
        tuple(ignored_columns(found, reading, placed)),
        found.sha256,
    )


def _check_gravity(name: str, one: Placed, force: Array) -> None:
    """Refuse forces whose usual size is gravity in another unit."""
    size = float(np.median(np.linalg.norm(force, axis=1)))
    for right, factor in (("g", G), ("m/s2", 1.0 / G)):
        if abs(size * factor / G - 1.0) < AT_REST and UNITS[FORCE].get(one.unit) != UNITS[FORCE][right]:
            raise LoggerError(
                f"{name}: accelerometer: {','.join(one.names)} are {size / one.scale:.4g} long at the median, in "
                f"{one.unit}: they look in {right}"
            )
