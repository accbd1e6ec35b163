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


def read_las(path: Path, content: bytes) -> FieldTable:
    """Table of the first section whose columns are those of a survey.

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
    for definition, data in _pairs(sections):
        header = [_column(line) for _, line in definition]
        if is_survey_header(header):
            rows, lines = _rows(path, data, len(header), delimiter, wrapped)
            cells = [["" if _is_same(cell, null) else cell for cell in row] for row in rows]
            return FieldTable(f"LAS {version}", header, cells, lines)
    raise SurveyError(f"{path}: LAS {version}: expected curves of depth, inclination and azimuth")


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
    for title, lines in sections:
        if title.upper().startswith(letter):
            for _, line in lines:
                match = LINE.match(line)
                if match and match[1].strip().upper() == name:
                    return f"{match[2]} {match[3].rpartition(':')[0]}".strip()
    return ""


def _pairs(sections: list[tuple[str, Lines]]) -> list[tuple[Lines, Lines]]:
    """Definitions of columns with their data."""
    named = {title.split("|")[0].strip().split()[0].lower(): lines for title, lines in sections if title.strip()}
    found = []
    for title, lines in sections:
        if "|" in title:
            definition = title.split("|")[1].strip().lower()
            found.append((named.get(definition, []), lines))
        elif title.upper().startswith("A"):
            curves = [x for t, x in sections if t.upper().startswith("C") or t.lower().startswith("log_definition")]
            found += [(curve, lines) for curve in curves[:1]]
    return found


def _column(line: str) -> str:
    match = LINE.match(line)
    name, unit = (match[1].strip(), match[2]) if match else (line, "")
    return f"{name} ({unit})" if unit else name


def _rows(path: Path, data: Lines, width: int, delimiter: str, wrapped: bool) -> tuple[list[list[str]], list[int]]:
    if wrapped:
        cells = [cell for _, line in data for cell in line.split()]
        number = data[0][0] if data else 0
        rows = [(number, cells[k : k + width]) for k in range(0, len(cells), width)]
    elif delimiter == " ":
        rows = [(number, line.split()) for number, line in data]
    else:
        rows = [
            (number, [c.strip() for c in row])
            for number, line in data
            for row in csv.reader([line], delimiter=delimiter)
        ]
    for number, row in rows:
        if len(row) != width:
            raise SurveyError(f"{path}: line {number}: expected {width} values, got {len(row)}")
    return [row for _, row in rows], [number for number, _ in rows]


def _is_same(cell: str, null: str) -> bool:
    try:
        return bool(null) and float(cell) == float(null)
    except ValueError:
        return False
