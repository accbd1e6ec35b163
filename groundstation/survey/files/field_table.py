"""A table as a file of any format holds it: header, rows of cells, the line of each. All formats end here."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class FieldTable:
    """Cells of a table as text.

    Attributes
    ----------
    form : how it is written, for people, such as ``separated by ';'`` or ``LAS 2.0``
    numbers_as_text : whether its numbers were written by people, who may write a decimal comma
    said : what the file says of itself beyond its columns, by name: ``north``, ``depth_reference``
    name : of this table where a file may hold several, such as that of a sheet
    dips_go_up : whether its format has dips above the horizontal, as negative ones
    """

    form: str
    header: list[str]
    rows: list[list[str]]
    lines: list[int]
    separator: str = ""
    numbers_as_text: bool = False
    plain: bool = False  # commas, no quotes: the program's own tables
    said: dict[str, str] = field(default_factory=dict)
    name: str = ""
    dips_go_up: bool = False


@dataclass(frozen=True, slots=True)
class TableWish:
    """What a user says of a table that it does not say itself."""

    md_unit: str | None = None
    hole: str | None = None  # of a table of several; ``*`` says that all rows are one
    north: str | None = None  # where it has azimuths from several
    decimal: str | None = None  # ``comma`` or ``point``
    fewest: int = 2  # stations
