"""Numbers for people: as many digits as their uncertainty is worth.

Two digits of the standard deviation, and the value to the same place.
Source: JCGM 100:2008 (GUM), 7.2.6.
"""

from __future__ import annotations

import math

DIGITS = 2  # significant, of a standard deviation
FINEST = 6  # places behind the point
ALIKE = 6  # significant digits, in which two sizes are alike


def decimal_places(std: float) -> int:
    """Places behind the point (negative: before it) to which ``std``, and what it belongs to, is worth telling."""
    if not math.isfinite(std) or std <= 0.0:
        return FINEST
    return min(DIGITS - 1 - math.floor(math.log10(std)), FINEST)


def round_to_std(value: float, std: float) -> float:
    """A value to the places that its standard deviation is worth."""
    return round(value, decimal_places(std))


def rounded_std(std: float) -> float:
    """A standard deviation to two digits, rounded up: it is never told smaller than it is."""
    if not math.isfinite(std) or std <= 0.0:
        return std
    step = 10.0 ** -decimal_places(std)
    return round(math.ceil(std / step - 1e-9) * step, max(decimal_places(std), 0))


def largest_first(size: float) -> float:
    """Key that sorts rows by their size (not negative), those of `ALIKE` sizes staying as they stand.

    Sizes that are the same by symmetry differ in their last digits, and by these from processor to processor.
    """
    return -float(f"{size:.{ALIKE}g}")
