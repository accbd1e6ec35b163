"""Which hole of a table is meant: a column of words that differ is a choice and never ignored.

Two holes whose depths follow on would be one path.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from groundstation.entry.entry_warning import EntryWarning
from groundstation.errors import SurveyError
from groundstation.survey.files.field_table import FieldTable, TableWish
from groundstation.survey.well.analysis import RECORD_COLUMNS

REMARKS = (
    "comment", "comments", "remark", "remarks", "note", "notes", "bemerkung", "description", "date", "time", "datetime",
    "date time", "datum", "zeit", "utc", "timestamp",
)  # fmt: skip  # of a station, not of a hole
NUMBERED = (
    "hole", "holeid", "bhid", "bh", "dhid", "drillhole", "drill hole", "borehole", "boreholeid", "bore", "well",
    "wellid", "wellbore", "uwi", "api", "column", "pile", "loca", "location", "sidetrack", "bohrung", "bohrloch",
    "pfahl", "sondage", "forage", "sondaggio", "pozzo", "pozo",
)  # fmt: skip  # names of columns that tell holes apart, by numbers too
OF_NAMES = ("id", "no", "nr", "nbr", "num", "number", "name", "nummer", "numero")  # words beside them
ALL = "*"
SHOWN = 6


def choose_hole(
    path: Path, table: FieldTable, taken: set[int], wish: TableWish
) -> tuple[FieldTable, list[EntryWarning]]:
    """The rows of one hole, and warnings of words that nothing was made of.

    Raises
    ------
    SurveyError
        When a table has several holes and none was chosen, or not the one that was.
    """
    choices = {
        place: names
        for place in range(len(table.header))
        if place not in taken and len(names := _names(table, place)) > 1
    }
    if wish.hole == ALL:
        return table, []
    if wish.hole is not None:
        return _chosen(path, table, taken, choices, wish.hole)
    if choices:
        place, names = next(iter(choices.items()))
        shown = ", ".join(names[:SHOWN]) + (" ..." if len(names) > SHOWN else "")
        raise SurveyError(
            f"{path}: {table.header[place]} tells {len(names)} holes apart: {shown}; "
            f"expected --hole with one of them, or --hole '{ALL}' where all rows are one"
        )
    return table, []


def _chosen(
    path: Path, table: FieldTable, taken: set[int], choices: dict[int, list[str]], hole: str
) -> tuple[FieldTable, list[EntryWarning]]:
    places = [place for place in range(len(table.header)) if place not in taken and hole in _names(table, place)]
    if not places:
        known = ", ".join(name for names in choices.values() for name in names) or "no names of holes"
        raise SurveyError(f"{path}: --hole {hole}: expected one of its holes, {known}")
    rows = [k for k, row in enumerate(table.rows) if row[places[0]] == hole]
    chosen = replace(table, rows=[table.rows[k] for k in rows], lines=[table.lines[k] for k in rows])
    left = [place for place in choices if place not in places and len(_names(chosen, place)) > 1]
    warnings = [
        EntryWarning("unread", hole, f"{hole}: {table.header[place]} differs among its stations and was not read")
        for place in left
    ]
    return chosen, warnings


def _names(table: FieldTable, place: int) -> list[str]:
    """Different words of a column; none where it holds numbers or remarks, or what an instrument asks for."""
    if table.header[place] in RECORD_COLUMNS:
        return []
    title = " ".join(table.header[place].lower().replace("_", " ").split())
    if title in REMARKS:
        return []
    cells = list(dict.fromkeys(row[place] for row in table.rows if row[place]))
    if _tells_holes(title):
        return cells
    return cells if any(not _is_number(cell) for cell in cells) else []


def _tells_holes(title: str) -> bool:
    """Whether a column is that of holes by its name: ``Hole No.``, ``BHID``, ``well_name``; not ``hole size``."""
    words = [word for word in title.replace(".", " ").replace("#", " ").split() if word not in OF_NAMES]
    return " ".join(words) in NUMBERED


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True
