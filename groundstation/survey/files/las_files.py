"""LAS 2.0 and 3.0: stations as curves of a log, or of version 3 as a section of inclinometry.

Source: Canadian Well Logging Society, LAS 2.0 and LAS 3.0.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

from groundstation.errors import SurveyError
from groundstation.survey.files.field_table import FieldTable
from groundstation.survey.files.file_bytes import decode_text
from groundstation.survey.files.survey_columns import is_survey_header

VERSIONS = ("2.0", "3.0")
LINE = re.compile(r"([^.:]+)\.(\S*)\s*(.*)")
DELIMITERS = {"COMMA": ",", "TAB": "\t"}
Lines = list[tuple[int, str]]


def read_las(path: Path, content: bytes) -> list[FieldTable]:
    """Tables of all sections whose columns are those of a survey.

    Raises
    ------
    SurveyError
        When the version is not known, or no section holds a survey.
    """
    sections = _sections(decode_text(path, content))
    version = _value(sections, "V", "VERS")
    if version not in VERSIONS:
        raise SurveyError(f"{path}: LAS {version or 'without a version'}: expected version {' or '.join(VERSIONS)}")
    null = _value(sections, "W", "NULL")
    delimiter = DELIMITERS.get(_value(sections, "V", "DLM").upper(), " ")
    wrapped = _value(sections, "V", "WRAP").upper().startswith("Y")
    found = []
    for title, definition, data in _pairs(sections):
        header = [_column(line) for _, line in definition]
        if is_survey_header(header):
            rows, lines = _rows(path, data, len(header), delimiter, wrapped)
            cells = [["" if _is_same(cell, null) else cell for cell in row] for row in rows]
            found.append(FieldTable(f"LAS {version}", header, cells, lines, name=title))
    if not found:
        raise SurveyError(f"{path}: LAS {version}: expected curves of depth, inclination and azimuth")
    return found


def _sections(text: str) -> list[tuple[str, Lines]]:
    found: list[tuple[str, Lines]] = []
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.strip()
        if bare.startswith("~"):
            found.append((bare[1:], []))
        elif bare and not bare.startswith("#") and found:
            found[-1][1].append((number, bare))
    return found


def _value(sections: list[tuple[str, Lines]], letter: str, name: str) -> str:
    """First word of a header line, which ends at its colon."""
    for title, lines in sections:
        if title.upper().startswith(letter):
            for _, line in lines:
                match = LINE.match(line)
                if match and match[1].strip().upper() == name:
                    words = f"{match[2]} {match[3]}".partition(":")[0].split()
                    return words[0] if words else ""
    return ""


def _pairs(sections: list[tuple[str, Lines]]) -> list[tuple[str, Lines, Lines]]:
    """Data by their titles, with the definitions of their columns before them."""
    named = {_title(title).lower(): lines for title, lines in sections}
    found = []
    for title, lines in sections:
        if "|" in title:
            found.append((_title(title), named.get(title.split("|")[1].strip().lower(), []), lines))
        elif title.upper().startswith("A"):
            curves = [x for t, x in sections if t.upper().startswith("C") or t.lower().startswith("log_definition")]
            found += [("log", curve, lines) for curve in curves[:1]]
    return found


def _title(title: str) -> str:
    """First word of a section's title, before the bar that names its definition."""
    words = title.partition("|")[0].split()
    return words[0] if words else ""


def _column(line: str) -> str:
    match = LINE.match(line)
    name, unit = (match[1].strip(), match[2].partition(":")[0]) if match else (line, "")
    return f"{name} ({unit})" if unit else name


def _rows(path: Path, data: Lines, width: int, delimiter: str, wrapped: bool) -> tuple[list[list[str]], list[int]]:
    if wrapped:
        cells = [cell for _, line in data for cell in line.split()]
        number = data[0][0] if data else 0
        rows = [(number, cells[k : k + width]) for k in range(0, len(cells), width)]
    elif delimiter == " ":
        rows = [(number, line.split()) for number, line in data]
    else:
        rows = [(number, [cell.strip() for cell in _cells(path, number, line, delimiter)]) for number, line in data]
    for number, row in rows:
        if len(row) != width:
            raise SurveyError(f"{path}: line {number}: expected {width} values, got {len(row)}")
    return [row for _, row in rows], [number for number, _ in rows]


def _cells(path: Path, number: int, line: str, delimiter: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=delimiter))
    except csv.Error as error:
        raise SurveyError(f"{path}: line {number}: expected values of LAS: {error}") from None


def _is_same(cell: str, null: str) -> bool:
    try:
        return bool(null) and float(cell) == float(null)
    except ValueError:
        return False
