"""TOML of a user, within bounds: a file made to exhaust its reader is refused in the line of any other bad file."""

from __future__ import annotations

import re
import tomllib
from typing import Any

LONGEST = 1 << 23  # characters; the largest wall that was drawn has 1 % of them
DEEPEST = 16  # tables and arrays within each other
# a key of more parts than that; its reader takes the square of their number
DOTTED = re.compile(r"""(?<![\w"'-])(?:[\w"'-]+[ \t]*\.[ \t]*)""" + f"{{{DEEPEST}}}")


def parse_toml_tables(text: str) -> dict[str, Any]:
    """Tables of a TOML text.

    Raises
    ------
    tomllib.TOMLDecodeError
        When it is not TOML, too long, or nested deeper than any file of ours.
    """
    if len(text) > LONGEST:
        raise tomllib.TOMLDecodeError(f"expected at most {LONGEST} characters, got {len(text)}")
    too_deep = f"expected tables and arrays at most {DEEPEST} deep"
    if DOTTED.search(text):
        raise tomllib.TOMLDecodeError(too_deep)
    try:
        tables = tomllib.loads(text)
    except RecursionError:
        raise tomllib.TOMLDecodeError(too_deep) from None
    if _depth_of(tables) > DEEPEST:
        raise tomllib.TOMLDecodeError(too_deep)
    return tables


def _depth_of(tables: dict[str, Any]) -> int:
    """Tables and arrays within each other, counted without calls within calls; one more than allowed at most."""
    level: list[Any] = [tables]
    depth = 0
    while level and depth <= DEEPEST:
        depth += 1
        held = [value for one in level for value in (one.values() if isinstance(one, dict) else one)]
        level = [value for value in held if isinstance(value, dict | list)]
    return depth
