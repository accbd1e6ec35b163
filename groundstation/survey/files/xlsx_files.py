"""Workbooks: every sheet that holds a table of stations."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

from groundstation.errors import SurveyError
from groundstation.survey.files.field_table import FieldTable
from groundstation.survey.files.survey_columns import is_survey_header
from groundstation.survey.files.text_tables import LONGEST_TITLE, IsHeader

LARGEST_BOOK = 256 * 2**20  # bytes, unpacked
WIDEST = 256  # columns that are looked at
LONGEST = 100_000  # rows that are not empty, of a sheet


def read_xlsx(path: Path, content: bytes, is_header: IsHeader = is_survey_header) -> list[FieldTable]:
    """Tables of all sheets with a header of stations.

    Raises
    ------
    SurveyError
        When the workbook is damaged, unpacks to more than any survey, or holds no such table.
    """
    from openpyxl import load_workbook  # an extra

    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
        if size > LARGEST_BOOK:
            raise SurveyError(f"{path}: expected a workbook of at most {LARGEST_BOOK // 2**20} MiB, got more")
        book = load_workbook(io.BytesIO(content), read_only=True, data_only=True)
        sheets = [(sheet.title, _rows(path, sheet)) for sheet in book.worksheets]
    except SurveyError:
        raise
    except Exception as error:  # the library raises of a damaged workbook whatever its parts raise
        raise SurveyError(f"{path}: a damaged workbook: {type(error).__name__}: {error!s:.80}") from error
    found = [table for title, rows in sheets if (table := _table(title, rows, is_header)) is not None]
    if found:
        return found
    names = ", ".join(title for title, _ in sheets)
    raise SurveyError(f"{path}: expected a sheet with depth, inclination and azimuth, got the sheets {names}")


def _rows(path: Path, sheet: Any) -> list[tuple[int, list[str]]]:
    """Rows that are not empty, with their numbers. A sheet whose one cell stands in its last corner holds one row."""
    sheet.reset_dimensions()  # what it says of its own size would be filled with empty cells
    found: list[tuple[int, list[str]]] = []
    for number, row in enumerate(sheet.iter_rows(values_only=True), 1):
        cells = [_text(cell) for cell in row[:WIDEST]]
        if any(cells):
            found.append((number, cells))
        if len(found) > LONGEST:
            raise SurveyError(f"{path}: sheet {sheet.title}: expected at most {LONGEST} rows, got more")
    return found


def _table(title: str, rows: list[tuple[int, list[str]]], is_header: IsHeader) -> FieldTable | None:
    for place, (_, row) in enumerate(rows[:LONGEST_TITLE]):
        header = [cell.lstrip("#").strip() for cell in row]
        if not is_header(header):
            continue
        while header and not header[-1]:
            header.pop()
        width = len(header)
        cells = [[*line[:width], *[""] * (width - len(line))] for _, line in rows[place + 1 :]]
        kept = [(number, line) for (number, _), line in zip(rows[place + 1 :], cells, strict=True) if any(line)]
        lines = [number for number, _ in kept]
        return FieldTable(f"sheet {title!r}", header, [line for _, line in kept], lines, name=title)
    return None


def _text(cell: Any) -> str:
    if isinstance(cell, float):
        return repr(cell)
    return "" if cell is None else str(cell).strip()
