"""Which column of a file is what, and in which unit: by the file's names, by what is told, and by no guess."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from telemetry.errors import RecordError
from telemetry.records.known_columns import (
    COUNTS,
    FIELD,
    FORCE,
    RATE,
    SI_STEMS,
    SKIPPED,
    TEMPERATURE,
    TIME,
    TRIAD,
    UNITS,
    Column,
    column_of,
)
from telemetry.records.logged_cells import LoggedCells
from telemetry.records.record_reading import SENSOR_KEYS, RecordReading, scale_of

Array = npt.NDArray[np.float64]
OWN_NAMES: Final = ("time", "wx", "wy", "wz", "fx", "fy", "fz", "temperature")  # of a node's recording, by width
EPOCHS: Final = ((1e17, "ns"), (1e14, "us"), (1e11, "ms"), (1e8, "s"))  # whole stamps since 1970, by size
LARGEST_SI: Final = 100.0  # of whole numbers in rad/s or m/s^2 without a unit; beyond it they are counts
TYPICAL: Final = {RATE: "0.05 deg/s", FORCE: "0.000244 g", FIELD: "0.15 uT"}


@dataclass(frozen=True, slots=True)
class Placed:
    """One quantity of a record: its columns (1 or 3) in the file, their names, the unit in words, SI of one."""

    quantity: str
    columns: tuple[int, ...]
    names: tuple[str, ...]
    unit: str
    scale: float

    def take(self, cells: Array) -> Array:
        """Values in SI, (n, 3) of a triad and (n,) of another quantity; C of a temperature."""
        values = cells[:, list(self.columns)] * self.scale
        if self.quantity == TEMPERATURE and self.unit == "K":
            values = values - 273.15
        return values if len(self.columns) == 3 else np.asarray(values[:, 0])


def place_columns(found: LoggedCells, reading: RecordReading) -> dict[str, Placed]:
    """Quantities of a file.

    Raises
    ------
    RecordError
        When a sensor lacks an axis, its axes have different units, its unit is not told or contradicts what is told.
    """
    columns = [column_of(name) if name != SKIPPED else None for name in _names(found, reading)]
    placed = {}
    for quantity in (TIME, RATE, FORCE, FIELD, TEMPERATURE):
        at = _by_axis(columns, quantity)
        if not at:
            continue
        if quantity in (TIME, TEMPERATURE):
            placed[quantity] = _single(found, quantity, at[0], columns)
        else:
            placed[quantity] = _triad(found, quantity, at, columns, reading)
    triad = _by_axis(columns, TRIAD)
    if triad:
        quantity = _told_quantity(found, reading, placed)
        placed[quantity] = _triad(found, quantity, triad, columns, reading)
    for quantity, key in SENSOR_KEYS.items():
        if reading.told_unit(quantity) and quantity not in placed:
            raise RecordError(f"{found.name}: {key}: expected columns of the {quantity}, got {_listed(found, reading)}")
    if not set(placed) & set(SENSOR_KEYS):
        raise RecordError(
            f"{found.name}: expected columns of a sensor such as time_s,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g; got "
            f"{_listed(found, reading)}; name them in the order of the file: columns=time_s,gx_dps,.. (- is not used)"
        )
    return placed


def ignored_columns(found: LoggedCells, reading: RecordReading, placed: dict[str, Placed]) -> list[str]:
    """Names of columns that are not used."""
    used = {k for one in placed.values() for k in one.columns}
    return [name for k, name in enumerate(_names(found, reading)) if k not in used and name != SKIPPED]


def _names(found: LoggedCells, reading: RecordReading) -> tuple[str, ...]:
    width = found.cells.shape[1]
    if reading.columns:
        if len(reading.columns) != width:
            raise RecordError(
                f"{found.name}: columns: expected {width} names, one of each column, got {len(reading.columns)}"
            )
        return reading.columns
    if found.names:
        return found.names
    if width in (7, 8):
        return OWN_NAMES[:width]
    if width == 3:
        return ("x", "y", "z")
    raise RecordError(
        f"{found.name}: expected names of its {width} columns: columns=time_s,gx_dps,.. in their order (- is not used)"
    )


def _by_axis(columns: list[Column | None], quantity: str) -> dict[int, int]:
    """Column of each axis, the first whose unit is one."""
    at: dict[int, int] = {}
    for k, column in enumerate(columns):
        if column is not None and column.quantity == quantity:
            taken = columns[at[column.axis]] if column.axis in at else None
            if taken is None or (taken.odd and not column.odd):
                at[column.axis] = k
    return at


def _single(found: LoggedCells, quantity: str, at: int, columns: list[Column | None]) -> Placed:
    column = columns[at]
    assert column is not None
    unit = column.unit or (_epoch_unit(found, at) if quantity == TIME else "")
    if column.odd or unit not in UNITS[quantity]:
        got = column.odd or unit or "whole numbers without a unit"
        known = ", ".join(UNITS[quantity])
        raise RecordError(f"{found.name}: column {column.name}: expected a {quantity} in {known}, got {got}")
    return Placed(quantity, (at,), (column.name,), unit, UNITS[quantity][unit])


def _epoch_unit(found: LoggedCells, at: int) -> str:
    """Unit of stamps whose name tells none: s, unless they are whole numbers that count from 1970 in another."""
    if not found.integers[at]:
        return "s"
    largest = float(np.nanmax(found.cells[:, at]))
    return next((unit for size, unit in EPOCHS if largest > size), "s" if largest < found.cells.shape[0] else "")


def _triad(
    found: LoggedCells, quantity: str, at: dict[int, int], columns: list[Column | None], reading: RecordReading
) -> Placed:
    names = tuple(column.name for k in sorted(at) if (column := columns[at[k]]) is not None)
    if missing := [axis for k, axis in enumerate("xyz") if k not in at]:
        raise RecordError(f"{found.name}: {quantity}: expected three axes, got {','.join(names)}: no {missing[0]}")
    chosen = [column for k in range(3) if (column := columns[at[k]]) is not None]
    if odd := [column for column in chosen if column.odd]:
        known = ", ".join(UNITS[quantity])
        raise RecordError(f"{found.name}: column {odd[0].name}: expected a unit, {known} or counts, got {odd[0].odd}")
    units = {column.unit for column in chosen}
    if len(units) > 1:
        told = ", ".join(f"{column.name} in {column.unit or 'no unit'}" for column in chosen)
        raise RecordError(f"{found.name}: {quantity}: expected one unit of its three axes, got {told}")
    where = (at[0], at[1], at[2])
    unit, scale = _unit(found, quantity, where, chosen, reading)
    return Placed(quantity, where, names, unit, scale)


def _unit(
    found: LoggedCells, quantity: str, at: tuple[int, int, int], chosen: list[Column], reading: RecordReading
) -> tuple[str, float]:
    """Unit in words and SI of one of the file's numbers."""
    told, own, key = reading.told_unit(quantity), chosen[0].unit, SENSOR_KEYS[quantity]
    whole = all(found.integers[k] for k in at)
    by_stem = own and chosen[0].name.lower()[:1] in SI_STEMS and len(chosen[0].name) == 2
    if by_stem and whole and float(np.nanmax(np.abs(found.cells[:, list(at)]))) > LARGEST_SI:
        own = COUNTS
    names = ",".join(column.name for column in chosen)
    if own and own != COUNTS and chosen[0].quantity != TRIAD and not by_stem:
        scale, words = scale_of(quantity, own)
        if told and scale_of(quantity, told) != (scale, words):
            raise RecordError(f"{found.name}: {key}: the file says {names} in {own}, told was {told}")
        return words, scale
    if told or (by_stem and own != COUNTS):
        scale, words = scale_of(quantity, told or own)
        if whole and told and scale == UNITS[quantity][scale_of(quantity, told)[1].split()[-1]]:
            raise RecordError(
                f"{found.name}: {quantity}: {names} are whole numbers, counts of a converter: expected {key}= with "
                f"their scale as '{TYPICAL[quantity]}', got '{told}'"
            )
        return words, scale
    what = "counts" if own == COUNTS or whole else "numbers without a unit"
    raise RecordError(
        f"{found.name}: {quantity}: {names} are {what}: expected {key}= with "
        + (f"their scale, as '{TYPICAL[quantity]}'" if what == "counts" else f"their unit, as '{_example(quantity)}'")
    )


def _example(quantity: str) -> str:
    return {RATE: "deg/s", FORCE: "g", FIELD: "uT"}[quantity]


def _told_quantity(found: LoggedCells, reading: RecordReading, placed: dict[str, Placed]) -> str:
    told = [quantity for quantity in SENSOR_KEYS if reading.told_unit(quantity) and quantity not in placed]
    if len(told) != 1:
        raise RecordError(
            f"{found.name}: columns x,y,z: expected what they are, gyro=UNIT, accel=UNIT or mag=UNIT, as "
            f"gyro='{TYPICAL[RATE]}'"
        )
    return told[0]


def _listed(found: LoggedCells, reading: RecordReading) -> str:
    names = _names(found, reading)
    return ",".join(names[:8]) + (",.." if len(names) > 8 else "")
