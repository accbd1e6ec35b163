"""The numbers of a logger's file, with the line of each row: text of any usual delimiter, or a ``.npy`` array.

A line that is no row of numbers does not end the reading: it is counted, and stands as a row without numbers. A line
of names that comes again is where a logger began anew; another line of names is another record, and refused.
"""

from __future__ import annotations

import hashlib
import io
import math
from collections import Counter
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from tokenize import TokenError
from typing import Final
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt

from telemetry.bounded_bytes import LARGEST_LOG, bounded_bytes
from telemetry.errors import LoggerError

Array = npt.NDArray[np.float64]
DELIMITERS: Final = ",;\t"  # else white space
MISSING: Final = {"", "nan", "na", "n/a", "null", "none", "-"}
MOST_DAMAGED: Final = 0.2  # of the lines; beyond it the file is another than it was taken for


@dataclass(frozen=True, slots=True)
class LoggedCells:
    """Cells (n, c) of a file; NaN where one is missing.

    ``lines`` (n,) counts from 1, ``again`` are the rows before which the names came again, ``damaged`` the lines that
    are no row, ``integers`` (c,) the columns that hold whole numbers written as such.
    """

    name: str
    names: tuple[str, ...]
    cells: Array
    lines: npt.NDArray[np.int64]
    again: tuple[int, ...]
    damaged: tuple[int, ...]
    integers: tuple[bool, ...]
    sha256: str


def read_logged_cells(path: Path) -> LoggedCells:
    """Numbers of a file.

    Raises
    ------
    LoggerError
        When there is no such file, it is empty or holds no rows of numbers, or two records of other columns.
    """
    try:
        data = bounded_bytes(path, LARGEST_LOG)
    except OSError as error:
        raise LoggerError(f"{path.name}: expected a file to read, got {error.strerror}") from error
    if not data.strip():
        raise LoggerError(f"{path.name}, line 1: expected a record, got an empty file")
    return _array_cells(path.name, data) if path.suffix == ".npy" else _text_cells(path.name, data)


def _array_cells(name: str, data: bytes) -> LoggedCells:
    try:
        raw = np.load(io.BytesIO(data), allow_pickle=False)
    except (ValueError, EOFError, OSError, MemoryError, TokenError, BadZipFile) as error:
        raise LoggerError(f"{name}: expected an array in the NPY format, got {error}") from error
    if isinstance(raw, np.ndarray) and raw.dtype.names:
        names, kinds = raw.dtype.names, [raw.dtype[field].kind for field in raw.dtype.names]
        columns = [raw[field] for field in names] if set(kinds) <= set("fiu") and raw.ndim == 1 else []
    elif isinstance(raw, np.ndarray) and raw.ndim == 2 and raw.dtype.kind in "fiu":
        names, kinds, columns = (), [raw.dtype.kind] * raw.shape[1], list(raw.T)
    else:
        columns = []
    if not columns or not len(columns[0]):
        got = f"{raw.dtype} {raw.shape}" if isinstance(raw, np.ndarray) else "an archive"
        raise LoggerError(f"{name}: expected rows of numbers, got {got}")
    cells = np.column_stack(columns).astype(np.float64)
    cells[~np.isfinite(cells)] = np.nan
    integers, lines = tuple(kind in "iu" for kind in kinds), np.arange(1, len(cells) + 1)
    return LoggedCells(name, tuple(names), cells, lines, (), (), integers, hashlib.sha256(data).hexdigest())


def _text_cells(name: str, data: bytes) -> LoggedCells:
    text = data.removeprefix(b"\xef\xbb\xbf").decode("utf-8", errors="replace")
    kept = [(k, line.strip()) for k, line in enumerate(text.splitlines(), start=1) if line.strip()]
    comments = [line.lstrip("# ") for _, line in kept if line.startswith("#")]
    kept = [(k, line) for k, line in kept if not line.startswith("#")]
    if not kept:
        raise LoggerError(f"{name}: expected rows of numbers, got only comments")
    delimiter = next((mark for mark in DELIMITERS if mark in kept[0][1]), None)
    header: list[str] = []
    if not _is_row(first := _cells_of(kept[0][1], delimiter)):
        header, kept = first, kept[1:]
    elif comments and len(found := _cells_of(comments[-1], delimiter)) == len(first) and not _is_row(found):
        header = found  # as numpy writes it
    width = _usual_width(name, kept, delimiter, header)
    header = header[:width]
    rows, lines, again, damaged = _rows_of(name, kept, delimiter, header, width)
    if len(damaged) > MOST_DAMAGED * len(rows) or not rows:
        where = f"line {damaged[0]}" if damaged else "line 1"
        raise LoggerError(f"{name}, {where}: expected rows of numbers, got {len(damaged)} lines that are none")
    cells = np.array(rows)
    whole = np.all((cells == np.floor(cells)) | np.isnan(cells), axis=0)
    some = _sampled(kept, delimiter, width)
    integers = tuple(bool(whole[k]) and all("." not in row[k] for row in some) for k in range(width))
    digest = hashlib.sha256(data).hexdigest()
    return LoggedCells(name, tuple(header), cells, np.array(lines), again, damaged, integers, digest)


def _rows_of(
    name: str, kept: list[tuple[int, str]], delimiter: str | None, header: list[str], width: int
) -> tuple[list[list[float]], list[int], tuple[int, ...], tuple[int, ...]]:
    """Rows, their lines, rows before which the names came again, and lines that are no row."""
    rows: list[list[float]] = []
    lines: list[int] = []
    again: list[int] = []
    damaged: list[int] = []
    for k, line in kept:
        cells = _cells_of(line, delimiter)
        try:
            row = [_number(cell) for cell in cells]
        except ValueError:
            row = []
            if len(cells) > 1 and not any(_has_number(cell) for cell in cells):
                if header and cells[:width] != header:
                    raise LoggerError(
                        f"{name}, line {k}: expected the columns {','.join(header)}, got a second line of names, "
                        f"{','.join(cells)}: these are two records"
                    ) from None
                again.append(len(rows))
                continue
        if len(row) != width:
            damaged.append(k)
            row = [math.nan] * width
        rows.append(row)
        lines.append(k)
    return rows, lines, tuple(again), tuple(damaged)


def _usual_width(name: str, kept: list[tuple[int, str]], delimiter: str | None, header: list[str]) -> int:
    """Number of columns of most rows; the last names of a file may have no column, no column is without a name."""
    widths = Counter(len(_cells_of(line, delimiter)) for _, line in kept[:: max(1, len(kept) // 200)])
    width = widths.most_common(1)[0][0] if widths else len(header)
    if header and width > len(header):
        raise LoggerError(f"{name}, line {kept[0][0]}: expected {len(header)} numbers, one of each name, got {width}")
    return width


def _cells_of(line: str, delimiter: str | None) -> list[str]:
    cells = [cell.strip().strip('"') for cell in line.split(delimiter)]
    if delimiter == ";":
        cells = [cell.replace(",", ".") if _has_number(cell.replace(",", ".")) else cell for cell in cells]
    while len(cells) > 1 and delimiter and not cells[-1]:
        cells.pop()  # a delimiter at the end of the line
    return cells


def _sampled(kept: list[tuple[int, str]], delimiter: str | None, width: int) -> list[list[str]]:
    """Cells of some rows, to see how their numbers are written."""
    some = [_cells_of(line, delimiter) for _, line in kept[:: max(1, len(kept) // 200)]]
    return [cells for cells in some if len(cells) == width and _is_row(cells)]


def _is_row(cells: list[str]) -> bool:
    return any(_has_number(cell) for cell in cells)


def _has_number(cell: str) -> bool:
    try:
        return math.isfinite(_number(cell))
    except ValueError:
        return False


def _number(cell: str) -> float:
    """Number of a cell, s since 1970 of a day and time, NaN where it is marked as missing."""
    try:
        value = float(cell)
    except ValueError:
        if cell.lower() in MISSING:
            return math.nan
        moment = datetime.fromisoformat(cell)
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    if "_" in cell:  # Python would read 1_0 as ten
        raise ValueError(cell)
    return value if math.isfinite(value) else math.nan
