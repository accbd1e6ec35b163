"""Tables of text: the header is looked for below titles, with every separator that programs write.

Empty lines and comments (``#``) do not count, unless a comment is the header; rows of separators alone neither.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from pathlib import Path

from groundstation.errors import SurveyError
from groundstation.survey.files.field_table import FieldTable

SEPARATORS = {";": "';'", "\t": "tabs", ",": "','", "  ": "white space", " ": "white space"}
LONGEST_TITLE = 60  # lines above a header
IsHeader = Callable[[list[str]], bool]


def find_table(path: Path, text: str, is_header: IsHeader) -> FieldTable:
    """The table of a text from its header on; from its first line where no line is one.

    Raises
    ------
    SurveyError
        When there is nothing, or a row is not as wide as the header.
    """
    numbered = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip()]
    if not any(not line.lstrip().startswith("#") for _, line in numbered):
        raise SurveyError(f"{path}: expected a header and stations, the file is empty")
    place, separator = _header(numbered, is_header)
    number, line = numbered[place]
    header = split_cells(line.lstrip("#").strip() if line.lstrip().startswith("#") else line, separator)
    if not header:
        raise SurveyError(f"{path}: line {number}: expected values with {SEPARATORS[separator]} between them")
    below = [(n, row) for n, row in numbered[place + 1 :] if not row.lstrip().startswith("#")]
    table = _even_rows(below, separator, len(header))
    if table is None:
        table = [(n, _row(path, n, row, separator, len(header))) for n, row in below]
    kept = [(n, row) for n, row in table if any(row)]
    titles = sum(not row.lstrip().startswith("#") for _, row in numbered[:place])
    form = f"separated by {SEPARATORS[separator]}" + (f" below {titles} lines of title" if titles else "")
    plain = separator == "," and '"' not in line and not titles
    return FieldTable(form, header, [row for _, row in kept], [n for n, _ in kept], separator, True, plain)


def _header(numbered: list[tuple[int, str]], is_header: IsHeader) -> tuple[int, str]:
    """Place of the header and its separator; lines that are no comment come first."""
    for comments in (False, True):
        for place, (_, line) in enumerate(numbered[:LONGEST_TITLE]):
            if line.lstrip().startswith("#") is not comments:
                continue
            bare = line.lstrip().lstrip("#").strip() if comments else line
            for separator in SEPARATORS:
                if separator.strip(" ") in bare and is_header(split_cells(bare, separator)):
                    return place, separator
    first = next(k for k, (_, line) in enumerate(numbered) if not line.lstrip().startswith("#"))
    return first, next((sign for sign in (";", "\t", ",") if sign in numbered[first][1]), ",")


def split_cells(line: str, separator: str) -> list[str]:
    """Cells of one line, none where it is not a row; a cell never goes on in the next."""
    if separator == "  ":
        return re.split(r"\s{2,}|\t", line.strip())
    if separator == " ":
        return line.split()
    if line and '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, strict=True))]
    except (csv.Error, StopIteration):
        return []


def _even_rows(numbered: list[tuple[int, str]], separator: str, width: int) -> list[tuple[int, list[str]]] | None:
    """Rows of cells, split together: in a third of the time. None where a row is to be looked at by itself."""
    lines = [line for _, line in numbered]
    whole = separator.join(lines)
    if not lines or (separator.isspace() and separator != "\t") or '"' in whole:
        return None
    if any(line.count(separator) != width - 1 for line in lines):
        return None
    cells = iter([cell.strip() for cell in whole.split(separator)])
    return [(number, list(row)) for (number, _), row in zip(numbered, zip(*[cells] * width, strict=True), strict=True)]


def _row(path: Path, number: int, line: str, separator: str, width: int) -> list[str]:
    cells = split_cells(line, separator)
    if separator == "  " and len(cells) != width:
        cells = line.split()
    while len(cells) > width and not cells[-1]:
        cells.pop()
    if cells and not any(cells):
        return [""] * width
    if not cells:
        raise SurveyError(f"{path}: line {number}: expected values with {SEPARATORS[separator]} between them")
    if len(cells) != width:
        hint = ""
        if separator == "," and len(cells) == 2 * width:
            hint = "; decimal commas between values that commas separate cannot be told apart"
        raise SurveyError(f"{path}: line {number}: expected {width} values, got {len(cells)}{hint}")
    return cells
