"""AGS4: the group HORN, orientation and inclination of a hole, from the top of each interval on.

An inclination of AGS counts from the horizontal, downwards; a hole that rises has a negative one.
Source: Association of Geotechnical and Geoenvironmental Specialists, AGS 4.1.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

from groundstation.errors import SurveyError
from groundstation.survey.files.field_table import FieldTable
from groundstation.survey.files.file_bytes import decode_text

EDITIONS = ("4.0", "4.0.3", "4.0.4", "4.1", "4.1.1", "4.2")
NEEDED = {"LOCA_ID": "LOCA_ID", "HORN_TOP": "md", "HORN_ORNT": "azimuth", "HORN_INCL": "dip"}


def read_ags(path: Path, content: bytes) -> list[FieldTable]:
    """Table of the group HORN.

    Raises
    ------
    SurveyError
        When the edition is not known or the group is not there.
    """
    groups = _groups(path, decode_text(path, content))
    edition = _cell(groups, "TRAN", "TRAN_AGS")
    if edition not in EDITIONS:
        raise SurveyError(f"{path}: AGS {edition or 'without an edition'}: expected one of {', '.join(EDITIONS)}")
    if "HORN" not in groups:
        raise SurveyError(f"{path}: AGS {edition}: expected the group HORN, orientation and inclination of a hole")
    heading, units, rows, lines = _parts(groups["HORN"])
    missing = [name for name in NEEDED if name not in heading]
    if missing:
        raise SurveyError(f"{path}: HORN: {missing[0]} is missing")
    places = [heading.index(name) for name in NEEDED]
    names = [(NEEDED[heading[p]], units[p] if p < len(units) else "") for p in places]
    header = [f"{name} ({unit})" if unit else name for name, unit in names]
    cells = [[row[p] if p < len(row) else "" for p in places] for row in rows]
    return [FieldTable(f"AGS {edition}, group HORN", header, cells, lines, dips_go_up=True)]


def _groups(path: Path, text: str) -> dict[str, list[tuple[int, list[str]]]]:
    found: dict[str, list[tuple[int, list[str]]]] = {}
    name = ""
    reader = csv.reader(io.StringIO(text, newline=""))
    try:
        for row in reader:
            if row[:1] == ["GROUP"]:
                name = row[1] if len(row) > 1 else ""
                if name in found:
                    raise SurveyError(f"{path}: line {reader.line_num}: the group {name} stands there twice")
                found[name] = []
            elif row and name:
                found[name].append((reader.line_num, row))
    except csv.Error as error:
        raise SurveyError(f"{path}: line {reader.line_num}: expected a row of AGS: {error}") from None
    return found


def _parts(rows: list[tuple[int, list[str]]]) -> tuple[list[str], list[str], list[list[str]], list[int]]:
    """Heading, units, data and their lines of a group."""
    kinds: dict[str, list[str]] = {row[0]: row[1:] for _, row in rows if row[0] in ("HEADING", "UNIT")}
    data = [(number, row[1:]) for number, row in rows if row[0] == "DATA"]
    return kinds.get("HEADING", []), kinds.get("UNIT", []), [row for _, row in data], [number for number, _ in data]


def _cell(groups: dict[str, list[tuple[int, list[str]]]], group: str, name: str) -> str:
    heading, _, rows, _ = _parts(groups.get(group, []))
    return rows[0][heading.index(name)] if name in heading and rows else ""
