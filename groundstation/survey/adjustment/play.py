"""How far tubes lie askew in the hole, as what the looks leave tells it. Source: Foerstner 1979, with a prior."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.kernels.observations import add_looks
from groundstation.survey.adjustment.kernels.sparse_products import add_rooted
from groundstation.survey.adjustment.looks import OF_TUBE
from groundstation.survey.adjustment.normal_equations import WIDE

if TYPE_CHECKING:
    from groundstation.survey.adjustment.adjusted import Adjusted

Array = npt.NDArray[np.float64]
PLAY_KNOWN_AS = 4.0  # looks that the play before them counts for
LEAST, MOST = 1e-14, 0.03  # rad^2
LEAST_SLOPE, MOST_SLOPE = -3.0, 0.8  # of what is found by what was tried, both in logarithms
TOO_NEAR = 1e-6  # logarithms, between which a slope is not told


def learnt_play(found: Adjusted, before: float, known_as: float) -> float:
    """Variance (rad^2) of each axis of the play from what an adjustment with another one leaves; a step of iteration.

    Parameters
    ----------
    before, known_as : rad^2, variance before the looks, and the number of looks that this counts for
    """
    var = found.now.play_var
    tilts = found.linear.tilts
    weighed = found.linear.weights @ tilts
    pulled = np.einsum("kai,ka->ki", weighed, found.left).ravel()
    whole = float(np.einsum("kai,kai->", tilts, weighed))
    free = whole - told_by_all(found, weighed @ np.swapaxes(weighed, 1, 2))
    seen = var * var * float(pulled @ pulled)
    return float(np.clip((known_as * before + seen) / (known_as + var * free), LEAST, MOST))


def told_by_all(found: Adjusted, weights: Array) -> float:
    """Sum over the looks of the trace of weights (n, 3, 3) times J Q J^T, of what they should read.

    As normal equations with these weights it costs a hundredth of what it does look by look.
    """
    looks, linear, size, count = found.looks, found.linear, len(found.known), len(found.path.md)
    own, coupled = np.zeros((count, 2, 2)), np.zeros((count, 2, size + 1))
    in_common = np.zeros((size + 1, size + 1))
    add_looks(
        looks.station, looks.tube, looks.make_up, linear.jacobians, weights, linear.residuals, found.extra.columns,
        linear.places, linear.gravity_at, own, coupled, in_common,
    )  # fmt: skip
    # the covariance is R R^T: times B^T (N B + 2 C) its trace is that of (B R)^T (N B + 2 C) R
    if found.solution.sparse is not None:
        rooted = own @ found.direction_columns
        add_rooted(coupled, found.common_root, 2.0, rooted)
    else:
        both = own @ found.by_common[:, :2] + 2.0 * coupled[:, :, :size]
        rooted = found.solution.in_common.times_root(both.reshape(-1, size)).reshape(count, 2, size)
    of_path = np.sum(rooted * found.direction_columns)
    return float(np.sum(own * found.own_covs[:, :2, :2]) + of_path) + _told_in_common(found, in_common[:size, :size])


def _told_in_common(found: Adjusted, weights: Array) -> float:
    """Trace of the covariance of what stations have in common times weights (p, p) of looks.

    No look is of two tubes, so of many unknowns the covariance is worked out where a look may be alone.
    """
    begin, size = found.linear.gravity_at, len(weights)
    if size < WIDE or found.linear.places.size != begin:
        return float(np.sum(found.common_cov * weights))
    root = found.common_root
    tubes, place = root[:begin].reshape(-1, OF_TUBE, size), np.arange(begin // OF_TUBE)
    own = weights[:begin, :begin].reshape(len(place), OF_TUBE, -1, OF_TUBE)[place, :, place]
    with_ends = root @ root[begin:].T  # gravity, make-ups and further effects go with every tube
    ends = weights[:, begin:] * with_ends
    of_tubes = float(np.sum(own * (tubes @ np.swapaxes(tubes, 1, 2))))
    return of_tubes + 2.0 * float(np.sum(ends[:begin])) + float(np.sum(ends[begin:]))


def faster_play(tried: Sequence[tuple[float, float]]) -> float:
    """Variance to go on with, from those tried so far and what each was taken for then: the secant in logarithms.

    A variance that shrinks as the looks say so goes there slowly, and one that nothing shakes swings about its place.
    """
    (before, gone), (var, found) = ([math.log(one) for one in pair] for pair in (tried[-min(len(tried), 2)], tried[-1]))
    slope = (found - gone) / (var - before) if abs(var - before) > TOO_NEAR else 0.0
    step = (found - var) / (1.0 - min(max(slope, LEAST_SLOPE), MOST_SLOPE))
    return float(np.clip(math.exp(var + step), LEAST, MOST))
