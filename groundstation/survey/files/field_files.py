"""Station files as people have them: other names, feet, semicolons, decimal commas, quotes; said back in one line.

What is read is measured depth, inclination and azimuth by their header; a unit stands in the name, in brackets or in a
second row. What could be read in two ways is refused: a guess here would be signed as a survey.
"""

from __future__ import annotations

import csv
import math
import re
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.files.survey_records import STATIONS, DisplacementRule, read_record, stations_of
from groundstation.survey.well.well_record import SurveyRecord

Array = npt.NDArray[np.float64]
NAMES = {
    "md": "md", "measured depth": "md", "meas depth": "md", "depth": "md", "md depth": "md", "bohrlänge": "md",
    "inc": "inclination", "incl": "inclination", "inclination": "inclination", "dev": "inclination",
    "deviation": "inclination", "drift": "inclination", "neigung": "inclination",
    "azi": "azimuth", "az": "azimuth", "azim": "azimuth", "azimuth": "azimuth", "azimut": "azimuth",
}  # fmt: skip
UNITS = {
    "m": "m", "meter": "m", "meters": "m", "metre": "m", "metres": "m", "ft": "ft", "feet": "ft", "foot": "ft",
    "deg": "deg", "degree": "deg", "degrees": "deg", "°": "deg", "rad": "rad", "radians": "rad",
}  # fmt: skip
TO_SI = {"m": 1.0, "ft": 0.3048, "deg": 1.0, "rad": math.degrees(1.0)}  # angles to deg, as records have them
ALLOWED = {"md": ("m", "ft"), "inclination": ("deg", "rad"), "azimuth": ("deg", "rad")}
ASSUMED = {"md": "m", "inclination": "deg", "azimuth": "deg"}
SEPARATORS = {";": "';'", "\t": "tabs", ",": "','"}
DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+")


@dataclass(frozen=True, slots=True)
class Understood:
    """A record and the one line of how its file was read."""

    record: SurveyRecord
    line: str


@dataclass(frozen=True, slots=True)
class _Column:
    quantity: str
    place: int
    unit: str
    stated: bool


def read_any(path: Path, rule: DisplacementRule = DisplacementRule.EXACT, md_unit: str | None = None) -> Understood:
    """Record of a file, or of standard input where ``path`` is ``-``.

    Parameters
    ----------
    rule : how displacements become angles
    md_unit : ``m`` or ``ft``, of a depth whose header does not say

    Raises
    ------
    SurveyError
        Names file and line, what was expected and what came.
    """
    text = _text(path)
    numbered = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if path != Path("-") and (not numbered or not _is_foreign(numbered[0][1])):
        record = read_record(path, rule)
        kind = "displacements, cm" if "a_cm" in numbered[0][1] else "inclination deg, azimuth deg"
        return Understood(record, f"read as: MD m, {kind}; {_extent(record)}")
    return _foreign(path, numbered, md_unit)


def _is_foreign(header: str) -> bool:
    """Whether a header is not ours, yet names depth, inclination and azimuth."""
    cells = _split(header, _separator(header))
    if set(STATIONS) <= {cell.strip() for cell in cells}:
        return _separator(header) != "," or '"' in header
    return {column.quantity for column in _columns(cells)} == set(ALLOWED)


def _text(path: Path) -> str:
    try:
        content = sys.stdin.buffer.read() if path == Path("-") else path.read_bytes()
    except OSError as error:
        raise SurveyError(f"{path}: {error.strerror}; expected a file of stations") from error
    for encoding in ("utf-8-sig", "cp1252"):
        try:
            return content.decode(encoding)
        except UnicodeDecodeError:
            continue
    raise SurveyError(f"{path}: not a text file; expected a file of stations")


def _separator(header: str) -> str:
    return next((sign for sign in SEPARATORS if sign in header), ",")


def _split(line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator, strict=True))
    except (csv.Error, StopIteration):
        return []


def _columns(cells: list[str]) -> list[_Column]:
    found = []
    for place, cell in enumerate(cells):
        words = re.sub(r"[()\[\]_.,/]+", " ", cell.strip().lower()).split()
        unit = next((UNITS[word] for word in words[1:] if word in UNITS), "")
        name = " ".join(word for k, word in enumerate(words) if k == 0 or word not in UNITS)
        if name in NAMES:
            quantity = NAMES[name]
            found.append(_Column(quantity, place, unit or ASSUMED[quantity], bool(unit)))
    return found


def _foreign(path: Path, numbered: list[tuple[int, str]], md_unit: str | None) -> Understood:
    if not numbered:
        raise SurveyError(f"{path}: expected a header and stations, the file is empty")
    separator = _separator(numbered[0][1])
    rows = [(number, [cell.strip() for cell in _split(line, separator)]) for number, line in numbered]
    columns, rows = _with_unit_row(path, rows)
    columns = _settled(path, rows[0][1], columns, md_unit)
    _check_widths(path, rows, separator)
    decimal = _decimal(path, [row for _, row in rows[1:]], [c.place for c in columns], separator)
    lines = [number for number, _ in rows[1:]]
    table = {}
    for name, column in zip(STATIONS, columns, strict=True):
        cells = [row[column.place] for _, row in rows[1:]]
        table[name] = _numbers(path, lines, rows[0][1][column.place], cells, decimal) * TO_SI[column.unit]
    record = stations_of(path, table, lines)
    words = [
        f"{'MD' if c.quantity == 'md' else c.quantity} {c.unit}{'' if c.stated else ' (no unit given)'}"
        for c in columns
    ]
    comma = ", decimal comma" if decimal == "," else ""
    return Understood(
        record, f"read as: {', '.join(words)}; separated by {SEPARATORS[separator]}{comma}; {_extent(record)}"
    )


def _with_unit_row(path: Path, rows: list[tuple[int, list[str]]]) -> tuple[list[_Column], list[tuple[int, list[str]]]]:
    """Columns by the header, with the units of a second row where that holds nothing but units."""
    columns = _columns(rows[0][1])
    units = [cell.strip("()[] ").lower() for cell in rows[1][1]] if len(rows) > 1 else []
    if not units or not all(unit in UNITS or not unit for unit in units) or len(units) != len(rows[0][1]):
        return columns, rows
    filled = []
    for column in columns:
        unit = UNITS.get(units[column.place], "")
        if column.stated and unit and unit != column.unit:
            raise SurveyError(f"{path}: line {rows[1][0]}: {unit} under a header in {column.unit}; expected one unit")
        filled.append(_Column(column.quantity, column.place, unit or column.unit, column.stated or bool(unit)))
    return filled, [rows[0], *rows[2:]]


def _settled(path: Path, header: list[str], columns: list[_Column], md_unit: str | None) -> list[_Column]:
    """One column for each quantity, in the order of ``STATIONS``."""
    out = []
    for quantity, units in ALLOWED.items():
        some = [column for column in columns if column.quantity == quantity]
        if not some:
            raise SurveyError(f"{path}: expected depth, inclination and azimuth, got {', '.join(header)}")
        if len(some) > 1:
            names = " and ".join(header[column.place] for column in some)
            raise SurveyError(f"{path}: {names} are both {quantity}; expected one of them")
        (column,) = some
        if column.unit not in units:
            expected = " or ".join(units)
            raise SurveyError(f"{path}: {header[column.place]}: expected {quantity} in {expected}, got {column.unit}")
        if quantity == "md" and md_unit is not None:
            if column.stated and column.unit != md_unit:
                raise SurveyError(f"{path}: {header[column.place]} is in {column.unit}, --md-unit says {md_unit}")
            column = _Column("md", column.place, md_unit, stated=True)
        out.append(column)
    if out[1].unit != out[2].unit:
        raise SurveyError(
            f"{path}: inclination in {out[1].unit} and azimuth in {out[2].unit}; expected one unit of angle"
        )
    return out


def _check_widths(path: Path, rows: list[tuple[int, list[str]]], separator: str) -> None:
    width = len(rows[0][1])
    for number, row in rows[1:]:
        if len(row) != width:
            hint = ""
            if separator == "," and len(row) == 2 * width:
                hint = "; decimal commas between values that commas separate cannot be told apart"
            raise SurveyError(f"{path}: line {number}: expected {width} values, got {len(row)}{hint}")


def _decimal(path: Path, rows: list[list[str]], places: list[int], separator: str) -> str:
    cells = [row[place] for row in rows for place in places]
    commas, points = [c for c in cells if "," in c], [c for c in cells if "." in c]
    if not commas:
        return "."
    if points or not all(DECIMAL_COMMA.fullmatch(cell) for cell in commas):
        raise SurveyError(
            f"{path}: {commas[0]!r} may be a decimal comma or thousands{f' beside {points[0]!r}' if points else ''}; "
            "expected one sign for decimals and none for thousands"
        )
    if separator == "," or all(re.fullmatch(r"[+-]?\d{1,3},\d{3}", cell) for cell in commas):
        raise SurveyError(f"{path}: {commas[0]!r} may be thousands or a decimal comma; expected decimal points")
    return ","


def _numbers(path: Path, lines: list[int], name: str, cells: list[str], decimal: str) -> Array:
    values = []
    for number, cell in zip(lines, cells, strict=True):
        text = cell.replace(",", ".") if decimal == "," else cell
        unit = re.fullmatch(r"\S+\s*(m|ft|deg|rad|°|'|feet)", text)
        if unit is not None:
            raise SurveyError(
                f"{path}: line {number}: {name} = {cell!r} has a unit of its own; expected units in the header alone"
            )
        try:
            values.append(float(text))
        except ValueError:
            raise SurveyError(f"{path}: line {number}: expected numbers, got {name} = {cell!r}") from None
    return np.array(values)


def _extent(record: SurveyRecord) -> str:
    return f"{len(record.md)} stations from {record.md[0]:g} to {record.md[-1]:g} m"
