"""How sharply a hole bends among all holes: a population of which this one is learnt to be a member.

How sharply holes bend differs by a factor of e and more, from ground to ground. So the logarithm of the size is normal
beforehand: half of what is stated in the middle, and as wide as has that for its root mean square. What this hole shows
is weighed against it size by size, and the variance that is expected is the mean over all of them.

The prior in ``curvature_size`` knows no calm holes, and is meant not to: blunders are told from bends by it.
Source: Gelman, "Prior distributions for variance parameters in hierarchical models", Bayesian Analysis 1 (2006).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.curvature_size import LEG_KNOWN_AS, bends_seen

Array = npt.NDArray[np.float64]
MEDIAN = 0.5  # of what is stated
SPREAD = math.sqrt(-math.log(MEDIAN))  # of the logarithm of a size, by which its root mean square is what is stated
DEVIATIONS: Final = np.linspace(-4.0, 4.0, 41)  # of that logarithm
ROUNDS = 2  # what a hole shows depends a little on what was expected
MANY_LEGS = 100  # from which on a hole tells its own size whatever was known before


def bent_as_holes_are(found: Adjusted) -> Adjusted:
    """An adjustment of the same looks by a hole that bends as sharply as it seems to among all holes.

    A hole of many legs is left as it is: what was known before counts nothing there.
    """
    if not 0 < len(found.now.leg_vars) < MANY_LEGS:
        return found
    for _ in range(ROUNDS):
        whole, legs = expected_curvature(found)
        now = replace(found.now, curvature_var=whole, leg_vars=legs, is_learnt=True)
        found = adjust_hole(found.looks, found.string, found.path, found.extra, now, found.known)
    return found


def expected_curvature(found: Adjusted) -> tuple[float, Array]:
    """Variance (rad^2/m^2) of the curvature of a hole that is expected, and that by which each leg (s,) is driven."""
    seen, free = bends_seen(found)
    variances = (MEDIAN * found.path.curvature_std) ** 2 * np.exp(2.0 * SPREAD * DEVIATIONS)
    logs = -0.5 * (DEVIATIONS**2 + free.sum() * np.log(variances) + seen.sum() / variances)
    weights = np.exp(logs - logs.max())
    whole = float(weights @ variances / weights.sum())
    return whole, (LEG_KNOWN_AS * whole + seen[1:]) / (LEG_KNOWN_AS + free[1:])
