"""Workbooks: the first sheet that holds a table of stations."""

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


def read_xlsx(path: Path, content: bytes, is_header: IsHeader = is_survey_header) -> FieldTable:
    """Table of the first sheet with a header of stations.

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
        sheets = [(sheet.title, [list(row) for row in sheet.iter_rows(values_only=True)]) for sheet in book.worksheets]
    except SurveyError:
        raise
    except Exception as error:  # the library raises of a damaged workbook whatever its parts raise
        raise SurveyError(f"{path}: a damaged workbook: {type(error).__name__}: {error!s:.80}") from error
    for title, rows in sheets:
        found = _table(title, [[_text(cell) for cell in row] for row in rows], is_header)
        if found is not None:
            return found
    names = ", ".join(title for title, _ in sheets)
    raise SurveyError(f"{path}: expected a sheet with depth, inclination and azimuth, got the sheets {names}")


def _table(title: str, rows: list[list[str]], is_header: IsHeader) -> FieldTable | None:
    for place, row in enumerate(rows[:LONGEST_TITLE]):
        header = [cell.lstrip("#").strip() for cell in row]
        if not is_header(header):
            continue
        while header and not header[-1]:
            header.pop()
        width = len(header)
        kept = [(k + 1, cells[:width]) for k, cells in enumerate(rows) if k > place and any(cells)]
        cells = [[*line, *[""] * (width - len(line))] for _, line in kept]
        return FieldTable(f"sheet {title!r}", header, cells, [number for number, _ in kept])
    return None


def _text(cell: Any) -> str:
    if isinstance(cell, float):
        return repr(cell)
    return "" if cell is None else str(cell).strip()
