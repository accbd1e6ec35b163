"""Values that stand for none by the habits of the formats: they are missing, and never a number.

LAS writes -999.25, surfaces of old programs -9999 and 1e30, data bases blanks. A depth of 9999 m may be; an angle of
9999 deg may not, so which numbers count depends on the quantity.
"""

from __future__ import annotations

import math

BLANKS = ("", "-", "--", "n/a", "na", "null", "none", "#n/a")  # of cells, in lower case
NEVER = frozenset((-999.25, -9999.25, -999.0, -9999.0, -99999.0, -999999.0))
ANGLES_NEVER = frozenset((999.25, 9999.0, 9999.25, 99999.0, 999999.0))
BEYOND = 1e29  # 1e30 and what a single of it reads as


def is_null(value: float, *, angle: bool = False) -> bool:
    """Whether a number stands for none; ``angle`` of one that no angle or small quantity can be."""
    return value in NEVER or abs(value) > BEYOND or (angle and value in ANGLES_NEVER)


def null_or_number(text: str) -> float | None:
    """Number of a cell; None where the cell says that there is none.

    Raises
    ------
    ValueError
        When the cell is neither.
    """
    cell = text.strip()
    if cell.lower() in BLANKS:
        return None
    value = float(cell.replace("_", " "))  # Python would read 1_0 as ten
    return None if math.isfinite(value) and is_null(value) else value
