"""Columns of a wall's tables, read like any survey: names and units of the field, separators, decimals, workbooks.

Numbers that stand for none are not a number here, and their rows are the caller's to name.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from groundstation.entry.null_values import ANGLES_NEVER, BEYOND, NEVER, is_null
from groundstation.errors import SurveyError
from groundstation.survey.files.cell_numbers import cell_numbers, decimal_sign, plain_cell
from groundstation.survey.files.field_table import FieldTable
from groundstation.survey.files.file_bytes import decode_text, read_file
from groundstation.survey.files.survey_columns import ALLOWED, TO_SI, named_columns
from groundstation.survey.files.text_tables import IsHeader, find_table
from groundstation.survey.files.xlsx_files import read_xlsx

Array = npt.NDArray[np.float64]
OWN = {"md": "md_m", "inclination": "inclination_deg", "azimuth": "azimuth_deg"}


def read_table_columns(
    path: Path, names: tuple[str, ...], texts: tuple[str, ...] = ()
) -> tuple[dict[str, Array], list[int]]:
    """Columns by name and the line of every row; ``names`` must be there, ``texts`` are kept as text.

    A number that stands for none is nan. A column that is not asked for is left out where it holds anything but
    numbers.

    Raises
    ------
    SurveyError
        Names file, line and column.
    """
    content = read_file(path)
    is_header = _header_of(names)
    if content.startswith(b"PK\x03\x04"):
        table = read_xlsx(path, content, is_header)
    else:
        table = find_table(path, decode_text(path, content), is_header)
    scales = _renamed(path, table, set(names))
    header = [name for name, _ in scales]
    if not set(names) <= set(header):
        raise SurveyError(f"{path}: expected the columns {', '.join(names)}, got {', '.join(table.header)}")
    twice = [name for name in header if name and header.count(name) > 1]
    if twice:
        raise SurveyError(f"{path}: column {twice[0]} stands there twice")
    found: dict[str, Array] = {}
    decimal = _decimal(path, table, header, texts)
    for place, (name, scale) in enumerate(scales):
        cells = [row[place] for row in table.rows]
        if name in texts:
            if decimal != ".":
                cells = [plain_cell(cell, decimal) if _is_number(cell, decimal) else cell for cell in cells]
            found[name] = np.array(cells)
            continue
        try:
            values = cell_numbers(path, table.lines, table.header[place], cells, decimal)
        except SurveyError:
            if name in names:
                raise
            continue
        numbers = np.array(values, float)  # None becomes nan
        if not _are_plain(numbers):
            for line, value in zip(table.lines, values, strict=True) if name in OWN.values() else ():
                if value is not None and not math.isfinite(value):
                    raise SurveyError(f"{path}: line {line}: expected a finite {name}, got {value}")
            numbers = np.array([_value(name, value) for value in values])
        found[name] = scale * numbers
    return found, table.lines


def _header_of(names: tuple[str, ...]) -> IsHeader:
    """Whether cells are a header with these names, in the words of the field."""

    def is_header(cells: list[str]) -> bool:
        known = {cell.strip() for cell in cells}
        return set(names) <= known | {OWN.get(column.quantity, "") for column in named_columns(cells)}

    return is_header


def _renamed(path: Path, table: FieldTable, names: set[str]) -> list[tuple[str, float]]:
    """Name of every column and factor to our unit of it: our own names, then those of the field."""
    found = [(cell.strip(), 1.0) for cell in table.header]
    have = {name for name, _ in found}
    for column in named_columns(table.header):
        own = OWN.get(column.quantity)
        if own not in names or own in have:
            continue
        if column.unknown or column.unit not in ALLOWED[column.quantity]:
            unit = column.unknown or column.unit
            raise SurveyError(
                f"{path}: {table.header[column.place]}: expected {column.quantity} in "
                f"{', '.join(ALLOWED[column.quantity])}, got {unit}"
            )
        found[column.place] = (own, TO_SI[column.unit])
    return found


def _decimal(path: Path, table: FieldTable, header: list[str], texts: tuple[str, ...]) -> str:
    """Decimal sign of all columns of numbers."""
    if not table.numbers_as_text or not any("," in "".join(row) for row in table.rows):
        return "."
    places = [k for k, name in enumerate(header) if name not in texts and name]
    cells = [row[k] for row in table.rows for k in places if row[k] and row[k].lstrip("+-")[:1].isdigit()]
    return decimal_sign(path, cells, table.separator, None)


def _is_number(cell: str, decimal: str) -> bool:
    try:
        float(plain_cell(cell, decimal))
    except ValueError:
        return False
    return decimal != "."


def _are_plain(numbers: Array) -> bool:
    """Whether none of them is missing, without end or stands for none: each need not be looked at by itself."""
    return bool(np.all(np.abs(numbers) <= BEYOND)) and not np.any(np.isin(numbers, [*NEVER, *ANGLES_NEVER]))


def _value(name: str, value: float | None) -> float:
    angle = name.endswith("_deg")
    return np.nan if value is None or is_null(value, angle=angle) else value
