"""Lines of C that are not too long."""

from __future__ import annotations

import re

LINE = 110


def fill_rows(words: list[str]) -> str:
    """Words of a table, a comma between them, in rows."""
    rows, row = [], "   "
    for word in words:
        if len(row) + len(word) + 2 > LINE:
            rows.append(row)
            row = "   "
        row += f" {word},"
    return "\n".join([*rows, row.rstrip(",")])


def break_line(line: str) -> str:
    """A line that is not too long, broken behind commas and before operators."""
    if len(line) <= LINE:
        return line
    indent = re.match(r" *", line)
    assert indent is not None
    rows, row = [], ""
    for piece in re.split(r"(?<=, )|(?<= && )|(?<= \|\| )|(?<= [-+?:] )", line):
        if row.strip() and len(row) + len(piece) > LINE:
            rows.append(row.rstrip())
            row = indent.group() + "    "
        row += piece
    return "\n".join([*rows, row])
