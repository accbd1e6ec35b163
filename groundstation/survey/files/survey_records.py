"""Survey records as files: lateral displacements or stations, CSV, comments with #.

A displacement is read over the interval before it, on two axes of which north is -B and east is +A, as on the field
record of thesis Table 4.1. Further columns are let be. Every refusal names file, line, what was expected and what came.
"""

from __future__ import annotations

import csv
from enum import Enum
from pathlib import Path

import numpy as np
import numpy.typing as npt

from groundstation.entry.null_values import is_null
from groundstation.entry.quantity_ranges import RANGES
from groundstation.errors import SurveyError
from groundstation.survey.bearings import wrap_azimuth
from groundstation.survey.well.well_record import SurveyRecord
from telemetry.bounded_bytes import bounded_text

Array = npt.NDArray[np.float64]
DISPLACEMENTS = ("md_m", "a_cm", "b_cm")
LARGEST = 1e12  # beyond it a number is neither a depth nor an angle
STATIONS = ("md_m", "inclination_deg", "azimuth_deg")


class DisplacementRule(Enum):
    """Rule that gives an inclination from lateral displacements."""

    EXACT = "exact"  # I = asin(hypot(a, b) / L), L the measured length between two readings
    THESIS = "thesis"  # I = hypot(atan(a / L), atan(b / L)), which is how Table 4.1 was printed


def read_record(path: Path, rule: DisplacementRule = DisplacementRule.EXACT) -> SurveyRecord:
    """Record of either kind, distinguished by its header.

    Raises
    ------
    SurveyError
        Names file and line.
    """
    table, lines = read_columns(path)
    if set(DISPLACEMENTS) <= set(table):
        return _from_displacements(path, table, lines, rule)
    if set(STATIONS) <= set(table):
        return stations_of(path, table, lines)
    header = _cells(path, *_lines(path, DISPLACEMENTS)[0])
    raise SurveyError(
        f"{path}: expected the columns {', '.join(DISPLACEMENTS)} or {', '.join(STATIONS)}, got {', '.join(header)}"
        + _unit_hint(header)
    )


def with_collar(record: SurveyRecord) -> SurveyRecord:
    """The record with a vertical collar at 0 m before its first station; its further columns there are those of it.

    Raises
    ------
    SurveyError
        When the record begins at 0 m or above.
    """
    if not record.md[0] > 0.0:
        raise SurveyError(f"collar: expected a record that begins below 0 m, got {record.md[0]:g} m")
    columns = {name: np.concatenate([values[:1], values]) for name, values in record.columns.items()}
    md, inclination, azimuth = (np.concatenate([[0.0], a]) for a in (record.md, record.inclination, record.azimuth))
    return SurveyRecord(md, inclination, azimuth, [0, *record.lines], columns, record.of_displacements, record.warnings)


def read_columns(
    path: Path, names: tuple[str, ...] = (), texts: tuple[str, ...] = ()
) -> tuple[dict[str, Array], list[int]]:
    """Columns of numbers by name and the line of every row; ``names`` must be there, ``texts`` are kept as text.

    A column that is not asked for is left out where it holds anything but numbers.

    Raises
    ------
    SurveyError
        Names file and line.
    """
    numbered = _lines(path, names or DISPLACEMENTS)
    rows = [_cells(path, number, line) for number, line in numbered]
    header = [name.strip() for name in rows[0]]
    if not set(names) <= set(header):
        raise SurveyError(
            f"{path}: expected the columns {', '.join(names)}, got {', '.join(header)}{_unit_hint(header)}"
        )
    twice = [name for name in header if header.count(name) > 1]
    if twice:
        raise SurveyError(f"{path}: line {numbered[0][0]}: column {twice[0]} stands there twice")
    lines = [number for number, _ in numbered[1:]]
    for number, row in zip(lines, rows[1:], strict=True):
        if len(row) != len(header):
            raise SurveyError(f"{path}: line {number}: expected {len(header)} values, got {len(row)}")
    needed = set(names or DISPLACEMENTS + STATIONS) - set(texts)
    table: dict[str, Array] = {}
    for k, name in enumerate(header):
        column = [row[k].strip() for row in rows[1:]]
        if name in texts:
            table[name] = np.array(column)
            continue
        try:
            table[name] = np.array([float(text) for text in column])
        except ValueError:
            if name in needed:
                raise _not_a_number(path, name, column, lines) from None
    return table, lines


def _lines(path: Path, names: tuple[str, ...]) -> list[tuple[int, str]]:
    try:
        text = bounded_text(path, "utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise SurveyError(f"{path}: {reason}; expected a CSV file with {', '.join(names)}") from error
    numbered = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not numbered:
        raise SurveyError(f"{path}: expected a header and stations, the file is empty")
    return numbered


def _cells(path: Path, number: int, line: str) -> list[str]:
    """Cells of one line; a cell never goes on in the next."""
    try:
        return next(csv.reader([line], strict=True))
    except (csv.Error, StopIteration) as error:
        raise SurveyError(f"{path}: line {number}: expected values with commas between them: {error}") from None


def _not_a_number(path: Path, name: str, column: list[str], lines: list[int]) -> SurveyError:
    for number, text in zip(lines, column, strict=True):
        try:
            float(text)
        except ValueError:
            return SurveyError(f"{path}: line {number}: expected numbers, got {name} = {text!r}")
    raise AssertionError


def _unit_hint(header: object) -> str:
    """Name the column that is there in another unit."""
    have = [str(name) for name in header]  # type: ignore[attr-defined]
    for wanted in (*DISPLACEMENTS, *STATIONS):
        stem = wanted.rpartition("_")[0]
        other = [name for name in have if name.rpartition("_")[0] == stem and name != wanted]
        if other and wanted not in have:
            return f"; {other[0]} is in another unit, expected {wanted}"
    return ""


def _finite(path: Path, name: str, values: Array, lines: list[int]) -> None:
    for number, value in zip(lines, values.tolist(), strict=True):
        if not abs(value) < LARGEST:
            raise SurveyError(f"{path}: line {number}: expected a finite {name}, got {value}")


def _check(path: Path, md: Array, lines: list[int], fewest: int = 2) -> None:
    if len(md) < fewest:
        words = "two stations, the first one the collar" if fewest == 2 else "one station"
        raise SurveyError(f"{path}: expected at least {words}, got {len(md)}")
    back = np.flatnonzero(~(np.diff(md) > 0.0))
    if len(back):
        k = int(back[0])
        raise SurveyError(
            f"{path}: line {lines[k + 1]}: expected a measured depth beyond {md[k]:g} m, got {md[k + 1]:g} m; "
            "depths must grow and none may stand there twice"
        )


def stations_of(path: Path, table: dict[str, Array], lines: list[int], fewest: int = 2) -> SurveyRecord:
    """Record of the columns ``STATIONS`` and what stands beside them; errors as ``read_record``."""
    for name in STATIONS:
        _finite(path, name, table[name], lines)
    md, inclination_deg, azimuth_deg = (table[name] for name in STATIONS)
    outside = np.flatnonzero((inclination_deg < 0.0) | (inclination_deg > 180.0))
    if len(outside):
        k = int(outside[0])
        raise SurveyError(f"{path}: line {lines[k]}: expected an inclination of 0..180 deg, got {inclination_deg[k]:g}")
    for name, key, values in (("md_m", "depth", md), ("azimuth_deg", "azimuth_deg", azimuth_deg)):
        for k in np.flatnonzero(np.abs(values) > RANGES[key].high)[:1].tolist():
            RANGES[key].check(f"{path}: line {lines[k]}: {name}", float(values[k]))
    _check(path, md, lines, fewest)
    return SurveyRecord(md, np.radians(inclination_deg), np.radians(azimuth_deg), lines, _others(table, STATIONS))


def _from_displacements(path: Path, table: dict[str, Array], lines: list[int], rule: DisplacementRule) -> SurveyRecord:
    for name in DISPLACEMENTS:
        _finite(path, name, table[name], lines)
        none = [k for k, value in enumerate(table[name].tolist()) if is_null(value, angle=name != "md_m")]
        if none:
            raise SurveyError(
                f"{path}: line {lines[none[0]]}: {name} = {table[name][none[0]]:g} stands for no value; "
                "without a displacement nothing is known of the stations below it"
            )
    md, a, b = table["md_m"], table["a_cm"] / 100.0, table["b_cm"] / 100.0
    _check(path, md, lines)
    if a[0] != 0.0 or b[0] != 0.0:
        raise SurveyError(f"{path}: line {lines[0]}: expected the collar first, without a displacement")
    length = np.concatenate([[1.0], np.diff(md)])
    lateral = np.hypot(a, b)
    wrong = np.flatnonzero(lateral >= length)
    if len(wrong):
        k = int(wrong[0])
        raise SurveyError(
            f"{path}: line {lines[k]}: a displacement of {lateral[k]:g} m over {length[k]:g} m cannot be; "
            "expected a_cm and b_cm in centimetres"
        )
    exact = rule is DisplacementRule.EXACT
    inclination = np.arcsin(lateral / length) if exact else np.hypot(np.arctan(a / length), np.arctan(b / length))
    azimuth = wrap_azimuth(np.arctan2(a, -b)) * (lateral > 0.0)
    return SurveyRecord(md, inclination, azimuth, lines, _others(table, DISPLACEMENTS), of_displacements=True)


def _others(table: dict[str, Array], taken: tuple[str, ...]) -> dict[str, Array]:
    return {name: values for name, values in table.items() if name not in taken}
