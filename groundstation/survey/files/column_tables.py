"""Columns of a wall's tables, read like any survey: names and units of the field, separators, decimals, workbooks.

Numbers that stand for none are not a number here, and their rows are the caller's to name.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from groundstation.entry.null_values import ANGLES_NEVER, BEYOND, NEVER, is_null
from groundstation.errors import SurveyError
from groundstation.survey.files.cell_numbers import cell_numbers, decimal_sign, plain_cell
from groundstation.survey.files.dip_columns import inclinations_of_dips
from groundstation.survey.files.field_table import FieldTable
from groundstation.survey.files.file_bytes import decode_text, read_file
from groundstation.survey.files.several_tables import only_table
from groundstation.survey.files.survey_columns import ALLOWED, TO_SI, NamedColumn, named_columns
from groundstation.survey.files.text_tables import IsHeader, find_table
from groundstation.survey.files.unit_rows import with_unit_row
from groundstation.survey.files.xlsx_files import read_xlsx

Array = npt.NDArray[np.float64]
OWN = {"md": "md_m", "inclination": "inclination_deg", "dip": "inclination_deg", "azimuth": "azimuth_deg"}


@dataclass(frozen=True, slots=True)
class _OwnColumn:
    """A column in our words: factor to our unit of it, and whether it holds dips."""

    name: str
    scale: float = 1.0
    is_dip: bool = False

    @property
    def is_ours(self) -> bool:
        """Whether its numbers are those that we ask for."""
        return self.scale == 1.0 and not self.is_dip

    def to_own(self, path: Path, table: FieldTable, place: int, numbers: Array) -> Array:
        """Numbers in our unit."""
        scaled = self.scale * numbers
        return (
            inclinations_of_dips(path, table.header[place], scaled, table.lines, signed=False)
            if self.is_dip
            else scaled
        )


def read_table_columns(
    path: Path, names: tuple[str, ...], texts: tuple[str, ...] = (), north: str = "site"
) -> tuple[dict[str, Array], list[int]]:
    """Columns by name and the line of every row; ``names`` must be there, ``texts`` are kept as text.

    A number that stands for none is nan. A column that is not asked for is left out where it holds anything but
    numbers. ``north`` is the one that azimuths are to count from.

    Raises
    ------
    SurveyError
        Names file, line and column.
    """
    table, columns = _read_table(path, names, texts, north)
    header = [column.name for column in columns]
    if not set(names) <= set(header):
        raise SurveyError(f"{path}: expected the columns {', '.join(names)}, got {', '.join(table.header)}")
    twice = [name for name in header if name and header.count(name) > 1]
    if twice:
        raise SurveyError(f"{path}: column {twice[0]} stands there twice")
    found: dict[str, Array] = {}
    decimal = _decimal(path, table, header, texts)
    for place, column in enumerate(columns):
        cells = [row[place] for row in table.rows]
        if column.name in texts:
            found[column.name] = np.array([_own_text(path, table, place, column, cell, decimal) for cell in cells])
            continue
        try:
            values = cell_numbers(path, table.lines, table.header[place], cells, decimal)
        except SurveyError:
            if column.name in names:
                raise
            continue
        found[column.name] = _own_numbers(path, table, place, column, values)
    return found, table.lines


def _read_table(
    path: Path, names: tuple[str, ...], texts: tuple[str, ...], north: str
) -> tuple[FieldTable, list[_OwnColumn]]:
    """The table without its row of units, and every column of it in our words."""
    content = read_file(path)
    is_header = _header_of(names)
    if content.startswith(b"PK\x03\x04"):
        table = only_table(path, read_xlsx(path, content, is_header))
    else:
        table = find_table(path, decode_text(path, content), is_header)
    wanted = {*names, *texts}
    known = [column for column in named_columns(table.header) if OWN.get(column.quantity) in wanted]
    table, known = with_unit_row(path, table, known)
    return table, _renamed(path, table, _of_north(path, table, known, north))


def _of_north(path: Path, table: FieldTable, known: list[NamedColumn], north: str) -> list[NamedColumn]:
    """Columns without the azimuths of another north than is asked for.

    Raises
    ------
    SurveyError
        When all azimuths say another one.
    """
    told = [column for column in known if column.quantity == "azimuth" and column.north]
    others = [column for column in told if column.north != north]
    if others and len(others) == sum(column.quantity == "azimuth" for column in known):
        words = " and ".join(f"{table.header[column.place]} counts from {column.north} north" for column in others)
        raise SurveyError(f"{path}: {words}, the wall says {north}; expected north or stations_north to say so")
    return [column for column in known if column not in others]


def _own_text(path: Path, table: FieldTable, place: int, column: _OwnColumn, cell: str, decimal: str) -> str:
    """A cell as text, a number of it with a decimal point and in our unit."""
    if decimal != "." and _is_number(cell, decimal):
        cell = plain_cell(cell, decimal)
    if not column.is_ours and _is_number(cell, "."):
        return repr(float(column.to_own(path, table, place, np.array([float(cell)]))[0]))
    return cell


def _own_numbers(path: Path, table: FieldTable, place: int, column: _OwnColumn, values: list[float | None]) -> Array:
    """Numbers of a column in our unit."""
    numbers = np.array(values, float)  # None becomes nan
    name = column.name
    if not _are_plain(numbers):
        for line, value in zip(table.lines, values, strict=True) if name in OWN.values() else ():
            if value is not None and not math.isfinite(value):
                raise SurveyError(f"{path}: line {line}: expected a finite {name}, got {value}")
        numbers = np.array([_value(name, value) for value in values])
    return column.to_own(path, table, place, numbers)


def _header_of(names: tuple[str, ...]) -> IsHeader:
    """Whether cells are a header with these names, in the words of the field."""

    def is_header(cells: list[str]) -> bool:
        known = {cell.strip() for cell in cells}
        return set(names) <= known | {OWN.get(column.quantity, "") for column in named_columns(cells)}

    return is_header


def _renamed(path: Path, table: FieldTable, known: list[NamedColumn]) -> list[_OwnColumn]:
    """Every column in our words: our own names, then those of the field."""
    found = [_OwnColumn(cell.strip()) for cell in table.header]
    have = {column.name for column in found}
    for column in known:
        own = OWN[column.quantity]
        if own in have:
            continue
        if column.unit not in ALLOWED[column.quantity]:
            raise SurveyError(
                f"{path}: {table.header[column.place]}: expected {column.quantity} in "
                f"{', '.join(ALLOWED[column.quantity])}, got {column.unit}"
            )
        found[column.place] = _OwnColumn(own, TO_SI[column.unit], column.quantity == "dip")
    return found


def _decimal(path: Path, table: FieldTable, header: list[str], texts: tuple[str, ...]) -> str:
    """Decimal sign of all columns of numbers."""
    if not table.numbers_as_text or not any("," in "".join(row) for row in table.rows):
        return "."
    places = [k for k, name in enumerate(header) if name not in texts and name]
    cells = [row[k] for row in table.rows for k in places if row[k] and row[k].lstrip("+-")[:1].isdigit()]
    return decimal_sign(path, cells, table.separator, None, option="")


def _is_number(cell: str, decimal: str) -> bool:
    try:
        float(plain_cell(cell, decimal))
    except ValueError:
        return False
    return True


def _are_plain(numbers: Array) -> bool:
    """Whether none of them is missing, without end or stands for none: each need not be looked at by itself."""
    return bool(np.all(np.abs(numbers) <= BEYOND)) and not np.any(np.isin(numbers, [*NEVER, *ANGLES_NEVER]))


def _value(name: str, value: float | None) -> float:
    angle = name.endswith("_deg")
    return np.nan if value is None or is_null(value, angle=angle) else value
