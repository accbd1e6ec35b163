"""Coverage factors: how many standard errors an interval needs to hold what it states.

Where the noise was estimated from few residuals the normal 1.96 is too small: on two degrees of freedom it holds 81 %.
Source: JCGM 100:2008 (GUM), annex G.3.
"""

from __future__ import annotations

import math
from functools import cache
from statistics import NormalDist

import numpy as np

COVERAGE = 0.95  # of an expanded uncertainty
NODES, WEIGHTS = np.polynomial.legendre.leggauss(64)
LARGEST = 1e6  # standard errors


@cache
def coverage_factor(degrees: int | None, coverage: float = COVERAGE) -> float:
    """Half width of a two-sided interval in standard errors: Student's t, or normal where ``degrees`` is None.

    Parameters
    ----------
    degrees : of freedom of the estimate of the noise, at least 1
    coverage : probability, below 1
    """
    if degrees is None:
        return NormalDist().inv_cdf(0.5 * (1.0 + coverage))
    low, high = 0.0, LARGEST
    while high - low > 1e-12 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if student_t_coverage(middle, degrees) < coverage else (low, middle)
    return 0.5 * (low + high)


def student_t_coverage(t: float, degrees: int) -> float:
    """P(|T| < t) of Student's distribution: with tan(a) = T / sqrt(n) its density is that of cos(a)^(n - 1)."""
    edge = math.atan(t / math.sqrt(degrees))
    angle = 0.5 * edge * (NODES + 1.0)
    scale = math.exp(math.lgamma(0.5 * (degrees + 1)) - math.lgamma(0.5 * degrees)) / math.sqrt(math.pi)
    return float(edge * scale * np.sum(WEIGHTS * np.cos(angle) ** (degrees - 1)))
