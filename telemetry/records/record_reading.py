"""What is told of a record beside its file: names of columns, units and scales, its rate, and what is left out.

On the command line of a node it stands behind the file: ``timed:imu.csv?gyro=0.05 deg/s;from=10;without=120..130``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from telemetry.errors import RecordError
from telemetry.records.known_columns import FIELD, FORCE, RATE, UNITS, unit_of

KEYS: Final = {"columns", "gyro", "accel", "mag", "rate", "from", "to", "without"}
SENSOR_KEYS: Final = {RATE: "gyro", FORCE: "accel", FIELD: "mag"}


@dataclass(frozen=True, slots=True)
class RecordReading:
    """How a record is to be read; empty: as its file says.

    Parameters
    ----------
    columns : names in the order of the file, ``-`` for one that is not used
    gyro, accel, mag : what one of the file's numbers is, as ``0.05 deg/s`` or ``g``
    rate : rows a second (Hz), of a record without times; 0 is not told
    begin, end : s after its first row, what is used of it
    without : stretches (s, s) after its first row that are left out
    """

    columns: tuple[str, ...] = ()
    gyro: str = ""
    accel: str = ""
    mag: str = ""
    rate: float = 0.0
    begin: float = 0.0
    end: float = math.inf
    without: tuple[tuple[float, float], ...] = ()

    def told_unit(self, quantity: str) -> str:
        """What is told of one of the file's numbers of a quantity."""
        return {RATE: self.gyro, FORCE: self.accel, FIELD: self.mag}.get(quantity, "")


def scale_of(quantity: str, text: str) -> tuple[float, str]:
    """SI of one of the file's numbers and its unit in words, of ``deg/s`` or ``0.05 deg/s``.

    Raises
    ------
    RecordError
        When it is not a positive number and a unit of the quantity.
    """
    number, unit = _split_number(text)
    name = SENSOR_KEYS.get(quantity, quantity)
    known = unit_of(quantity, unit, name) if unit else ""
    if known not in UNITS.get(quantity, {}) or not 0.0 < number < math.inf:
        example = next(iter(UNITS.get(quantity, {"m/s2": 1.0})))
        raise RecordError(f"{name}: expected a scale and a unit as '0.05 {example}', or a unit, got {text!r}")
    return number * UNITS[quantity][known], known if number == 1.0 else f"{number:g} {known}"


def read_told(text: str) -> tuple[Path, RecordReading]:
    """File and reading of ``FILE?key=value;key=value``.

    Raises
    ------
    RecordError
        When a key is unknown or its value cannot be read.
    """
    name, _, told = text.partition("?")
    if not told or Path(text).exists():
        return Path(text), RecordReading()
    pairs = [pair.partition("=") for pair in told.split(";") if pair.strip()]
    values = {key.strip(): value.strip() for key, _, value in pairs}
    if unknown := sorted(set(values) - KEYS):
        raise RecordError(f"{name}: expected {', '.join(sorted(KEYS))}, got {unknown[0]}")
    return Path(name), reading_of(
        values.get("columns", ""),
        values.get("gyro", ""),
        values.get("accel", ""),
        values.get("mag", ""),
        _number("rate", values.get("rate", "0")),
        _number("from", values.get("from", "0")),
        _number("to", values.get("to", "inf")),
        tuple(values["without"].split(",")) if "without" in values else (),
    )


def reading_of(
    columns: str = "",
    gyro: str = "",
    accel: str = "",
    mag: str = "",
    rate: float = 0.0,
    begin: float = 0.0,
    end: float = math.inf,
    without: tuple[str, ...] = (),
) -> RecordReading:
    """Reading of the words of options; ``columns`` with commas, each of ``without`` as ``120..130``.

    Raises
    ------
    RecordError
        When a value cannot be meant; the message names it.
    """
    for quantity, text in ((RATE, gyro), (FORCE, accel), (FIELD, mag)):
        if text:
            scale_of(quantity, text)
    if not 0.0 <= rate < math.inf:
        raise RecordError(f"rate: expected rows a second, got {rate:g}")
    if not begin < end:
        raise RecordError(f"from, to: expected a moment and a later one, got {begin:g} and {end:g} s")
    names = tuple(name.strip() for name in columns.split(",")) if columns else ()
    return RecordReading(names, gyro, accel, mag, rate, begin, end, tuple(_stretch(text) for text in without))


def _split_number(text: str) -> tuple[float, str]:
    words = text.split()
    if len(words) == 2:
        return _number("scale", words[0]), words[1]
    return 1.0, text.strip()


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise RecordError(f"{name}: expected a number, got {text!r}") from error


def _stretch(text: str) -> tuple[float, float]:
    first, dots, last = text.partition("..")
    begin, end = _number("without", first), _number("without", last)
    if not dots or not begin < end:
        raise RecordError(f"without: expected seconds as 120..130, got {text!r}")
    return begin, end
