"""What is known of the curvature of a hole before it is drilled, and what earlier holes of the site add to that.

How large the curvature is and over which length it is forgotten differ from hole to hole; a prior says how probable
each size and length is. Between the two extremes lie the kinds of hole that crews know: one that goes straight (a size
near zero), one that builds evenly (a length beyond that of the hole), one that wanders (a short length). A layer that
bends the hole where it is met is a jump of the curvature, which may come in any metre; a hole that has met none for
long is less likely to meet one, and one that jumps often goes on so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
STATED_HOLES = 2.0  # as how many holes of the site what is stated beforehand counts


@dataclass(frozen=True, slots=True)
class CurvaturePrior:
    """Sizes and lengths of the curvature with their probability, and the jumps that any hole may meet."""

    sizes: Array  # (a,) rad/m, standard deviations
    lengths: Array  # (b,) m, over which a curvature is forgotten
    weights: Array  # (a, b), probabilities that come to 1
    jumps: Array  # (j,) rad/m, standard deviations of a jump
    jump_shares: Array  # (j,), of all jumps
    jumps_expected: float  # within the metres below: a gamma distribution of the rate of jumps
    jump_metres: float  # m


def stated_prior() -> CurvaturePrior:
    """Prior of a hole of which nothing is known but that a rig drills it.

    A size of 0.06 deg/m, uncertain by a factor of e either way, and one hole in seven as good as straight; lengths from
    two tubes to beyond the hole. It holds wellbore 1, which bends by 0.01 to 0.1 deg/m, and soft columns that build
    0.3; `borechain experiment projection` scores it on holes that are drawn with other constants.
    """
    sizes = np.radians(np.geomspace(0.003, 0.6, 10))
    by_size = np.exp(-0.5 * np.log(sizes / math.radians(TYPICAL_DEG)) ** 2)
    by_size = (1.0 - STRAIGHT) * by_size / by_size.sum()
    by_size[0] += STRAIGHT
    lengths, by_length = np.array([4.0, 12.0, 40.0, 400.0]), np.array([2.0, 3.0, 4.0, 7.0]) / 16.0
    return CurvaturePrior(
        sizes,
        lengths,
        np.outer(by_size, by_length),
        np.radians([0.1, 0.3]),
        np.array([0.5, 0.5]),
        JUMPS_EXPECTED,
        JUMP_METRES,
    )


TYPICAL_DEG = 0.06  # deg/m, of the size of a curvature
STRAIGHT = 0.15  # of all holes
JUMPS_EXPECTED, JUMP_METRES = 0.6, 20.0  # jumps and m
STATED: Final = stated_prior()


def carry_over(stated: CurvaturePrior, learnt: Sequence[Array]) -> CurvaturePrior:
    """Prior for the next hole of a site, of what the holes before came to.

    Parameters
    ----------
    stated : what was known before the first
    learnt : (a, b) each, the weights of sizes and lengths after a hole (`CurvatureTendency.weights`)
    """
    total = STATED_HOLES * stated.weights + sum(learnt, np.zeros_like(stated.weights))
    return replace(stated, weights=total / total.sum())
