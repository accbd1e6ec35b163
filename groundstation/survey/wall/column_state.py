"""What there is of a column at a depth."""

from __future__ import annotations

from enum import IntEnum


class ColumnState(IntEnum):
    """State of a column at a depth."""

    SURVEYED = 0
    UNSURVEYED = 1  # drilled, but below its last survey: extrapolated
    MISSING = 2  # planned, not drilled, or below the end of the column: an opening
    OUTSIDE = 3  # above the head or below the toe of its design: nothing is required
