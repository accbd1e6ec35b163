"""From a table of any format to a survey record, and one line of how it was read.

What could be read in two ways is refused: a guess here would be signed as a survey. A value that says that there is
none is missing: its station is left out, and a warning names it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from groundstation.entry.entry_warning import EntryWarning
from groundstation.entry.null_values import is_null
from groundstation.errors import SurveyError
from groundstation.survey.files.cell_numbers import cell_numbers, decimal_sign
from groundstation.survey.files.dip_columns import inclinations_of_dips
from groundstation.survey.files.field_table import FieldTable, TableWish
from groundstation.survey.files.hole_choice import choose_hole
from groundstation.survey.files.instrument_columns import instrument_column
from groundstation.survey.files.survey_columns import (
    ALLOWED,
    TO_SI,
    NamedColumn,
    named_columns,
)
from groundstation.survey.files.survey_records import STATIONS, stations_of
from groundstation.survey.files.unit_rows import with_unit_row
from groundstation.survey.well.analysis import RECORD_COLUMNS
from groundstation.survey.well.well_record import SurveyRecord

Array = npt.NDArray[np.float64]
VERTICAL_DEG = 1e-9  # inclination below which an azimuth that is missing is not missed


@dataclass(frozen=True, slots=True)
class Understood:
    """A record, the one line of how its file was read, and what the file says of its frame."""

    record: SurveyRecord
    line: str
    north: str = ""
    depth_reference: str = ""


def understand_table(path: Path, table: FieldTable, wish: TableWish) -> Understood:
    """The record of a table.

    Raises
    ------
    SurveyError
        Names file, line and column: what was expected and what came.
    """
    table, columns = with_unit_row(path, table, named_columns(table.header))
    columns = _settled(path, table, columns, wish)
    table, warnings = choose_hole(path, table, {column.place for column in columns}, wish)
    cells = [row[column.place] for column in columns for row in table.rows]
    people = table.numbers_as_text
    decimal = decimal_sign(path, cells, table.separator, wish.decimal) if people else "."
    values = {
        name: cell_numbers(path, table.lines, table.header[c.place], [row[c.place] for row in table.rows], decimal)
        for name, c in zip(STATIONS, columns, strict=True)
    }
    kept, missing = _without_missing(table, columns, values)
    lines = [table.lines[k] for k in kept]
    numbers = {
        name: np.array([_number(values[name][k]) for k in kept]) * TO_SI[c.unit]
        for name, c in zip(STATIONS, columns, strict=True)
    }
    if columns[1].quantity == "dip":
        name = table.header[columns[1].place]
        numbers[STATIONS[1]] = inclinations_of_dips(path, name, numbers[STATIONS[1]], lines, signed=table.dips_go_up)
    numbers |= _other_columns(path, table, columns, kept, decimal)
    record = replace(stations_of(path, numbers, lines, wish.fewest), warnings=(*warnings, *missing))
    north = columns[2].north or table.said.get("north", "")
    return Understood(record, _line(table, columns, decimal, record), north, table.said.get("depth_reference", ""))


def _number(value: float | None) -> float:
    return 0.0 if value is None else value


def _settled(path: Path, table: FieldTable, columns: list[NamedColumn], wish: TableWish) -> list[NamedColumn]:
    """Columns of depth, lean and azimuth, one each."""
    header = table.header
    md, lean = _one(path, header, columns, ("md",)), _one(path, header, columns, ("inclination", "dip"))
    azimuth = _azimuth(path, header, [column for column in columns if column.quantity == "azimuth"], wish)
    if wish.md_unit is not None:
        if md.stated and md.unit != wish.md_unit:
            raise SurveyError(f"{path}: {header[md.place]} is in {md.unit}, --md-unit says {wish.md_unit}")
        md = replace(md, unit=wish.md_unit, stated=True)
    if lean.unit != azimuth.unit:
        raise SurveyError(
            f"{path}: {lean.quantity} in {lean.unit} and azimuth in {azimuth.unit}; expected one unit of angle"
        )
    return [md, lean, azimuth]


def _one(path: Path, header: list[str], columns: list[NamedColumn], quantities: tuple[str, ...]) -> NamedColumn:
    some = [column for column in columns if column.quantity in quantities]
    if not some:
        raise SurveyError(f"{path}: expected depth, inclination and azimuth, got {', '.join(header)}")
    if len(some) > 1:
        names = " and ".join(header[column.place] for column in some)
        raise SurveyError(f"{path}: {names} are both {some[0].quantity}; expected one of them")
    return _in_units(path, header, some[0])


def _in_units(path: Path, header: list[str], column: NamedColumn) -> NamedColumn:
    units = ALLOWED[column.quantity]
    if column.unit not in units:
        raise SurveyError(
            f"{path}: {header[column.place]}: expected {column.quantity} in {', '.join(units)}, got {column.unit}"
        )
    return column


def _azimuth(path: Path, header: list[str], some: list[NamedColumn], wish: TableWish) -> NamedColumn:
    """The azimuth to take: the only one, or that of the north that is wished for."""
    if not some:
        raise SurveyError(f"{path}: expected depth, inclination and azimuth, got {', '.join(header)}")
    asked = wish.north if wish.north not in (None, "site") else None
    if len(some) > 1:
        names = " and ".join(header[column.place] for column in some)
        if len({column.north for column in some}) < len(some):
            raise SurveyError(f"{path}: {names} are both azimuth; expected one of them")
        chosen = [column for column in some if column.north == asked]
        if not chosen:
            norths = " or ".join(column.north or "site" for column in some)
            raise SurveyError(f"{path}: {names} count from two norths; expected --north {norths}")
        some = chosen
    (column,) = some
    if asked is not None and column.north and column.north != asked:
        raise SurveyError(f"{path}: {header[column.place]} counts from {column.north} north, --north says {asked}")
    return _in_units(path, header, column)


def _without_missing(
    table: FieldTable, columns: list[NamedColumn], values: dict[str, list[float | None]]
) -> tuple[list[int], list[EntryWarning]]:
    """Rows whose values are all there, and a warning for every other one."""
    kept, warnings = [], []
    for k in range(len(table.rows)):
        row = {name: values[name][k] for name in STATIONS}
        gone = [
            (name, table.header[column.place], table.rows[k][column.place])
            for name, column in zip(STATIONS, columns, strict=True)
            if row[name] is None or is_null(_number(row[name]), angle=name != "md_m")
        ]
        upright = columns[1].quantity == "inclination" and abs(_number(row["inclination_deg"])) <= VERTICAL_DEG
        if gone and [name for name, _, _ in gone] == ["azimuth_deg"] and upright:
            values["azimuth_deg"][k] = 0.0
            gone = []
        if not gone:
            kept.append(k)
            continue
        name, title, cell = gone[0]
        depth = row["md_m"] if name != "md_m" else None
        at = "" if depth is None else f", at {depth:g}"
        text = f"line {table.lines[k]}: {title} = {cell!r} stands for no value{at}: the station is left out"
        where = None if depth is None else depth * TO_SI[columns[0].unit]
        warnings.append(EntryWarning("missing", title, text, where, where))
    return kept, warnings


def _other_columns(
    path: Path, table: FieldTable, columns: list[NamedColumn], kept: list[int], decimal: str
) -> dict[str, Array]:
    """Further columns of numbers, by their names; those that an instrument may ask for hold good numbers or none."""
    taken = {column.place for column in columns}
    found: dict[str, Array] = {}
    for place, name in enumerate(table.header):
        cells = [table.rows[k][place] for k in kept]
        if place in taken or not name or name in STATIONS:
            continue
        if name in RECORD_COLUMNS:
            found |= instrument_column(path, name, cells, [table.lines[k] for k in kept], decimal)
            continue
        if not all(cells):
            continue
        try:
            numbers = cell_numbers(Path(), [0] * len(cells), name, cells, decimal)
        except SurveyError:
            continue
        if all(number is not None for number in numbers):
            found[name] = np.array([_number(number) for number in numbers])
    return found


def _line(table: FieldTable, columns: list[NamedColumn], decimal: str, record: SurveyRecord) -> str:
    """How a table was read, in one line."""
    words = []
    for column in columns:
        name = {"md": "MD", "dip": "dip (down from the horizontal)"}.get(column.quantity, column.quantity)
        north = f" from {column.north} north" if column.north else ""
        words.append(f"{name} {column.unit}{'' if column.stated else ' (no unit given)'}{north}")
    named = [table.header[column.place] for column in columns]
    signs = {",": ", decimal comma", ",.": ", commas of thousands"}.get(decimal, "")
    form = "" if table.plain and named == list(STATIONS) else f"; {table.form}{signs}"
    return f"read as: {', '.join(words)}{form}; {extent_words(record)}"


def extent_words(record: SurveyRecord) -> str:
    """Number of stations of a record, and from where to where they go."""
    return f"{len(record.md)} stations from {record.md[0]:g} to {record.md[-1]:g} m"
