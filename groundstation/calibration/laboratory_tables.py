"""Tables that a laboratory wrote: lines, cells and numbers, each refused with its file and line.

Empty lines and lines that begin with ``#`` do not count; the first other line is the header.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from groundstation.entry.null_values import is_null
from telemetry.bounded_bytes import bounded_bytes
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
LARGEST = 1e30  # of a reading; no sensor reaches it, and its square is still a number


@dataclass(frozen=True, slots=True)
class LaboratoryTable:
    """Cells of a file with the line each row stands on; ``header`` is the one of the accepted that it has."""

    name: str
    header: list[str]
    lines: list[int]
    cells: list[list[str]]
    sha256: str

    def numbers(self, row: int, begin: int) -> list[float]:
        """Numbers of one row from column ``begin`` on, all finite."""
        named = zip(self.header[begin:], self.cells[row][begin:], strict=True)
        return [_number(self.name, self.lines[row], column, text) for column, text in named]


def check_range(name: str, line: int, columns: list[str], values: Array, limit: float) -> None:
    """Refuse a reading at or beyond the full scale."""
    for column, value in zip(columns, values, strict=True):
        if abs(value) >= limit:
            raise line_error(
                name, line, f"column {column} inside the range of +-{limit:.6g}", f"{value:.6g}: saturated"
            )


def line_error(name: str, line: int, expected: str, got: str) -> CalibrationError:
    """The error of one line."""
    shown = "".join(one if one.isprintable() else "?" for one in got)
    return CalibrationError(f"{name}, line {line}: expected {expected}, got {shown}")


def read_bytes(path: Path) -> bytes:
    """Content of a file that is neither missing nor empty."""
    try:
        data = bounded_bytes(path)
    except OSError as error:
        raise CalibrationError(f"{path.name}: expected a file to read, got {error.strerror}") from error
    if not data.strip():
        raise line_error(path.name, 1, "a record", "an empty file")
    return data


def read_table(path: Path, headers: tuple[str, ...]) -> LaboratoryTable:
    """Table of a CSV whose header is one of the given."""
    data = read_bytes(path)
    rows = _rows(path.name, data)
    line, header = next(rows, (1, []))
    if ",".join(header) not in headers:
        raise line_error(path.name, line, f"the header {' or '.join(headers)}", ",".join(header) or "only comments")
    lines, cells = [], []
    for number, row in rows:
        if len(row) != len(header):
            raise line_error(path.name, number, f"{len(header)} values", f"{len(row)}")
        lines.append(number)
        cells.append(row)
    if not cells:
        raise line_error(path.name, line, "rows below the header", "the end of the file")
    return LaboratoryTable(path.name, header, lines, cells, hashlib.sha256(data).hexdigest())


def _rows(name: str, data: bytes) -> Iterator[tuple[int, list[str]]]:
    """Line number and cells of every line that is neither empty nor a comment."""
    for number, raw in enumerate(data.removeprefix(b"\xef\xbb\xbf").splitlines(), start=1):
        try:
            line = raw.decode().strip()
        except UnicodeDecodeError as error:
            raise line_error(name, number, "UTF-8 text", f"byte {raw[error.start]:#04x}") from error
        if line and not line.startswith("#"):
            yield number, [cell.strip() for cell in line.split(",")]


def _number(name: str, line: int, column: str, text: str) -> float:
    try:
        # Python would read 1_0 as ten.
        value = float(text.replace("_", " "))
    except ValueError as error:
        raise line_error(name, line, f"a number in column {column}", f"{text!r}") from error
    if not math.isfinite(value):
        raise line_error(name, line, f"a finite number in column {column}", f"{text}")
    if is_null(value, angle=True):
        raise line_error(name, line, f"a reading in column {column}", f"{text}, which stands for no value")
    return value
