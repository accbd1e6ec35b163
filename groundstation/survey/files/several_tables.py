"""Files that may hold several tables of stations: sheets of a workbook, sections of a log, results of a document.

None is taken for the only one: a second hole that is not read would be a hole that was never surveyed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from groundstation.errors import SurveyError
from groundstation.survey.files.field_table import FieldTable, TableWish
from groundstation.survey.files.hole_choice import SHOWN


def choose_table(path: Path, tables: Sequence[FieldTable], wish: TableWish) -> tuple[FieldTable, TableWish]:
    """The table of the hole that is wished for, and what is still to be chosen in it.

    Raises
    ------
    SurveyError
        When there are several and none was named, or not the one that was.
    """
    if len(tables) == 1:
        return tables[0], wish
    for fits in (lambda table: table.name == wish.hole, lambda table: any(wish.hole in row for row in table.rows)):
        found = [table for table in tables if fits(table)]
        if len(found) == 1:
            return found[0], replace(wish, hole=None) if found[0].name == wish.hole else wish
    asked = "" if wish.hole is None else f"--hole {wish.hole}: "
    raise SurveyError(f"{path}: {asked}{_several(tables)}; expected --hole with one of them")


def only_table(path: Path, tables: Sequence[FieldTable]) -> FieldTable:
    """The table of a file that is to hold one.

    Raises
    ------
    SurveyError
        When it holds several.
    """
    if len(tables) == 1:
        return tables[0]
    raise SurveyError(f"{path}: {_several(tables)}; expected one with these columns")


def _several(tables: Sequence[FieldTable]) -> str:
    shown = ", ".join(table.name for table in tables[:SHOWN]) + (" ..." if len(tables) > SHOWN else "")
    return f"it holds {len(tables)} tables: {shown}"
