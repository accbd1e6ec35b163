"""Text in cells of tables that a spreadsheet opens: what begins like a formula is quoted, so that none is computed."""

from __future__ import annotations

STARTS = ("=", "+", "-", "@", "\t", "\r", "\n")


def quoted_cell(value: object) -> object:
    """The value; of a text that begins like a formula, with an apostrophe before it. Numbers stay numbers."""
    if not isinstance(value, str) or not value.startswith(STARTS):
        return value
    try:
        float(value)
    except ValueError:
        return f"'{value}"
    return value
