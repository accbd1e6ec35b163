"""How sharply a hole bends, learnt from its own directions: of the hole as a whole, and leg by leg.

A curvature that wanders is driven by a noise of one size, so that a hole which is steered back in a single leg would
contradict whatever reads its lowest station. The noise of each leg has therefore a variance of its own about that of
the hole, which in turn is about what was known before: the tails are those of Student's distribution.
Source: Foerstner 1979, with a prior at each of the two levels; Lange, Little and Taylor, "Robust Statistical Modeling
Using the t Distribution", JASA 84 (1989).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.equations import STATE, leg_steps, path_departures
from groundstation.survey.adjustment.kernels.path_legs import leg_squares

if TYPE_CHECKING:
    from groundstation.survey.adjustment.adjusted import Adjusted
    from groundstation.survey.adjustment.looks import StartingPoint

Array = npt.NDArray[np.float64]
HOLE_KNOWN_AS = 6.0  # directions that the size of the hole's curvature before them counts for
LEG_KNOWN_AS = 4.0  # likewise of one leg, that of the hole: the degrees of freedom of its tails
OF_LEG = 2.0  # directions that the bend of a leg tells of it, about
FEWEST_BELOW = 2  # legs that tell how a hole bends without its first
TOGETHER = 4  # rounds
LEAST = 1e-12  # rad^2/m^2


def learnt_curvature(found: Adjusted) -> tuple[float, Array]:
    """Variance (rad^2/m^2) of the curvature of the hole, and that by which each leg (s,) is driven.

    It is a step of iteration, in which the two settle together for the departures as they stand.
    """
    before, legs = found.path.curvature_std**2, found.now.leg_vars
    if not len(legs):
        return before, legs
    seen, free = bends_seen(found)
    known, known_as = HOLE_KNOWN_AS * before + seen[0], HOLE_KNOWN_AS + float(free.sum())
    (seen, free) = seen[1:], free[1:]
    whole = found.now.curvature_var
    for _ in range(TOGETHER):
        legs = (LEG_KNOWN_AS * whole + seen) / (LEG_KNOWN_AS + free)
        whole = (known + whole * float(np.sum(seen / legs))) / known_as
    return max(whole, LEAST), np.maximum(legs, LEAST)


def bends_seen(found: Adjusted) -> tuple[Array, Array]:
    """Squares (s + 1,), rad^2/m^2, of the curvature at the collar and of what drives each leg, and directions in each.

    Of holes that bend as was taken they are their variance times these numbers in the mean.
    """
    now, solution = found.now, found.solution
    of_legs, told = np.empty((2, len(now.leg_vars)))
    leg_squares(
        *leg_steps(found.path), now.tangents, found.bases, now.curvatures, solution.diagonal, solution.tied,
        found.own_covs, found.columns, of_legs, told,
    )  # fmt: skip
    free = STATE - told / now.leg_vars
    at_collar = now.curvatures[0]
    of_collar = found.own_covs[0] + found.columns[0] @ found.columns[0].T
    free_at_collar = 2.0 - float(np.trace(of_collar[2:, 2:])) / now.curvature_var
    return np.append(at_collar @ at_collar, of_legs), np.append(free_at_collar, free)


def curvature_below(found: Adjusted) -> float:
    """Variance (rad^2/m^2) of the curvature of the hole as the legs below the first tell it; of few, as all do."""
    now, legs = found.now, found.now.leg_vars[1:]
    if len(legs) < FEWEST_BELOW:
        return now.curvature_var
    off = path_departures(found.path, now, found.bases)[1:]
    told = float(np.sum(np.einsum("ka,kab,kb->k", off, leg_steps(found.path)[1][1:], off) / legs))
    known = HOLE_KNOWN_AS * found.path.curvature_std**2 + now.curvature_var * told
    return known / (HOLE_KNOWN_AS + OF_LEG * len(legs))


def curvature_deviance(now: StartingPoint, before: float) -> float:
    """Minus twice the logarithm of how likely the variances are beforehand, but for a constant."""
    by_leg = np.log(now.leg_vars / now.curvature_var) + now.curvature_var / now.leg_vars - 1.0
    of_hole = np.log(now.curvature_var) + before / now.curvature_var
    return float(LEG_KNOWN_AS * by_leg.sum() + HOLE_KNOWN_AS * of_hole)
