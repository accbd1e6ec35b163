"""A share of independent trials with its 95 % interval.

Source: Wilson, J. Am. Stat. Assoc. 22 (1927) 209: the interval of those shares p whose score test the observed one
passes; of few trials, and of none or all that show it, it is as wide as it is to be.
"""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import Final

SIGMAS: Final = NormalDist().inv_cdf(0.975)


def wilson_interval(share: float, trials: float) -> tuple[float, float]:
    """Ends of the 95 % interval of a share observed in so many trials.

    >>> tuple(round(end, 4) for end in wilson_interval(0.1, 10))
    (0.0179, 0.4042)
    >>> wilson_interval(0.0, 80)[0], wilson_interval(1.0, 80)[1]
    (0.0, 1.0)
    """
    squares = SIGMAS**2 / trials
    middle = (share + 0.5 * squares) / (1.0 + squares)
    half = SIGMAS * math.sqrt(share * (1.0 - share) / trials + 0.25 * squares / trials) / (1.0 + squares)
    return middle - half if share > 0.0 else 0.0, middle + half if share < 1.0 else 1.0


def interval_of(key: str, share: float, trials: float) -> dict[str, float]:
    """Columns of a share, %, under ``key``, and of the ends of its interval."""
    low, high = wilson_interval(share, trials)
    return {f"{key}_percent": 100.0 * share, f"{key}_low": 100.0 * low, f"{key}_high": 100.0 * high}
