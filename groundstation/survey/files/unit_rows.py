"""Rows of units below a header, and units that are not known: both are said of a column by its name."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from groundstation.errors import SurveyError
from groundstation.survey.files.field_table import FieldTable
from groundstation.survey.files.survey_columns import ALLOWED, UNITS, NamedColumn


def with_unit_row(path: Path, table: FieldTable, columns: list[NamedColumn]) -> tuple[FieldTable, list[NamedColumn]]:
    """Table and columns with the units of a first row where that holds units instead of numbers.

    Raises
    ------
    SurveyError
        Names the column and the unit that is not known, or is not that of its header.
    """
    for column in columns:
        if column.unknown:
            name = table.header[column.place]
            raise SurveyError(f"{path}: {name}: unknown unit {column.unknown!r}; expected one of {_units(column)}")
    if not table.rows or not columns:
        return table, columns
    first = [cell.strip("()[] ").lower() for cell in table.rows[0]]
    told = [first[column.place] for column in columns]
    if not any(unit in UNITS for unit in told) or any(_is_number(unit) for unit in told):
        return table, columns
    filled = []
    for column, text in zip(columns, told, strict=True):
        unit = UNITS.get(text, "")
        if text and not unit:
            name = table.header[column.place]
            raise SurveyError(
                f"{path}: line {table.lines[0]}: {name}: unknown unit {text!r}; expected one of {_units(column)}"
            )
        if column.stated and unit and unit != column.unit:
            raise SurveyError(
                f"{path}: line {table.lines[0]}: {unit} under a header in {column.unit}; expected one unit"
            )
        filled.append(replace(column, unit=unit or column.unit, stated=column.stated or bool(unit)))
    return replace(table, rows=table.rows[1:], lines=table.lines[1:]), filled


def _units(column: NamedColumn) -> str:
    return ", ".join(ALLOWED[column.quantity])


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
