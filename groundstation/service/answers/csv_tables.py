"""Answers as tables: the list of an answer as CSV, its columns from the fields that its key promises."""

from __future__ import annotations

import csv
import io
from typing import Any

from groundstation.entry.quoted_cells import quoted_cell
from groundstation.errors import SelectorError
from groundstation.service.answers.shapes.answer_fields import AnswerField, Fields

View = dict[str, Any]


def table_of(path: str, fields: Fields, view: View) -> str:
    """The list of an answer as CSV with a header; a short list in a cell is parted by blanks, a matrix left out.

    Raises
    ------
    SelectorError
        When the answer has no list of rows.
    """
    lists = [field for field in fields if field.kind == "object" and field.rank == 1]
    if len(lists) != 1:
        raise SelectorError(f"{path}: no table; expected an answer with one list of rows, such as stations")
    columns = columns_of(lists[0].fields)
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([".".join(names) for names in columns])
    writer.writerows([csv_cell(row, names) for names in columns] for row in view[lists[0].name])
    return out.getvalue()


def columns_of(fields: Fields, before: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    """Names of the columns, those of an object in a row below its own name."""
    found: list[tuple[str, ...]] = []
    for field in fields:
        if field.kind == "object" and field.rank == 0:
            found += columns_of(field.fields, (*before, field.name))
        elif is_cell(field):
            found.append((*before, field.name))
    return found


def is_cell(field: AnswerField) -> bool:
    """Whether a field goes into one cell."""
    return field.kind not in ("object", "map") and field.rank <= 1


def csv_cell(row: View, names: tuple[str, ...]) -> Any:
    """Value of one cell; empty for null."""
    value: Any = row
    for name in names:
        value = None if value is None else value[name]
    return quoted_cell(" ".join(map(str, value)) if isinstance(value, list) else value)
