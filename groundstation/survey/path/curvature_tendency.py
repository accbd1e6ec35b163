"""How a hole bends, learnt from its own directions: size and length of its curvature, and what it is now.

Every size and length of the prior follows the hole by a filter of its own; its weight is its probability beforehand
times the likelihood of the directions. None is chosen: what is foreseen is the mixture of all of them, so it has the
heavier tails of a spread that is itself uncertain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.path.curvature_prior import STATED, CurvaturePrior
from groundstation.survey.path.curvature_process import process_step
from groundstation.survey.path.developed_directions import develop_directions

Array = npt.NDArray[np.float64]
LOOKED_BACK = 64  # stations: those far above say nothing more of what is ahead
LEAST_STD = math.radians(0.003)  # of a direction each way, where it is stated better
COLLAR_STD = math.radians(0.25)  # of that at the collar, where it is told better: a mast is set up by a level
MOST_JUMPS = 6.0  # that are counted: a curvature that jumps in every leg wanders


@dataclass(frozen=True, slots=True)
class CurvatureTendency:
    """What each cell (size and length) makes of a hole at its last station.

    Directions are relative to the one that was measured there.
    """

    prior: CurvaturePrior
    weights: Array  # (a, b), probability of each cell
    means: Array  # (a b, 4): direction (rad) and curvature (rad/m) on two axes
    blocks: Array  # (a b, 3, 2, 2): covariance of the direction, of it with the curvature, of the curvature
    axes: Array  # (2, 3), the two axes across the hole
    last_leg: float  # m
    looked: float  # m, from the first station that was looked at
    jumped: float  # times, as it seems

    def chance_of_jump(self, distance: float | Array) -> Array:
        """Chance that the curvature jumps within a distance (m), by the rate that the hole itself shows."""
        passed = self.prior.jump_metres + self.looked
        met = self.prior.jumps_expected + min(self.jumped, MOST_JUMPS)
        return np.asarray(-np.expm1(-met * np.log1p(distance / passed)))

    @property
    def size(self) -> float:
        """Standard deviation of the curvature (rad/m), root of the mean square over all cells."""
        return math.sqrt(float(self.weights.sum(axis=1) @ self.prior.sizes**2))

    @property
    def curvature(self) -> Array:
        """Curvature (2,) that is expected at the last station, rad/m."""
        return np.asarray(self.weights.ravel() @ self.means[:, 2:])


def learn_curvature(
    md: Array, tangents: Array, covs: Array, prior: CurvaturePrior = STATED, *, from_collar: bool = True
) -> CurvatureTendency:
    """Learn the curvature of a hole.

    Parameters
    ----------
    md : (n,) m, depths of the collar and the stations, growing
    tangents, covs : (n, 3) and (n, 3, 3), directions there and that part of the covariance of each that no other
        shares: what all share turns the hole as a whole and bends nothing
    prior : what is known of it beforehand
    from_collar : whether the first is the direction at the collar, which is set up and not measured

    Raises
    ------
    SurveyError
        Where the hole turns back on itself.
    """
    first = max(len(md) - LOOKED_BACK, 0)
    rolled = develop_directions(tangents[first:], covs[first:])
    noise = np.full(len(rolled.angles), LEAST_STD**2)
    if from_collar and first == 0:
        noise[0] = COLLAR_STD**2
    legs = np.diff(md[first:])
    return _follow(legs, rolled.angles, rolled.covs + noise[:, None, None] * np.eye(2), prior, rolled.axes)


def _follow(legs: Array, angles: Array, covs: Array, prior: CurvaturePrior, axes: Array) -> CurvatureTendency:
    from groundstation.survey.path.kernels.curvature_filter import (
        follow_directions,  # reading alone needs no compiler
    )

    sizes, count = np.repeat(prior.sizes, len(prior.lengths)), prior.weights.size
    steps, noises = leg_tables(legs, prior)
    with np.errstate(divide="ignore"):
        logs = np.log(prior.weights.ravel())
    means, blocks, counts = np.empty((count, 4)), np.empty((count, 3, 4)), np.empty(count)
    jumps, shares = (np.concatenate([[0.0], of]) for of in (prior.jumps, prior.jump_shares))
    follow_directions(
        angles, covs, steps, noises, legs, jumps, shares, prior.jumps_expected, prior.jump_metres, sizes**2, logs,
        counts, means, blocks,
    )  # fmt: skip
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    means[:, :2] -= angles[-1]
    shape = prior.weights.shape
    return CurvatureTendency(
        prior, weights.reshape(shape), means, blocks.reshape(count, 3, 2, 2), axes, float(legs[-1]), float(legs.sum()),
        float(weights @ counts),
    )  # fmt: skip


def leg_tables(legs: Array, prior: CurvaturePrior) -> tuple[Array, Array]:
    """Steps (n, a b, 2) and noises (n, a b, 3) of direction and curvature over legs (n,), m, in each cell."""
    lengths, places = np.unique(legs, return_inverse=True)
    found = [[process_step(leg, length) for length in prior.lengths.tolist()] for leg in lengths.tolist()]
    steps = np.array([[step[1:, 2] for step, _ in row] for row in found])
    noises = np.array([[(noise[1, 1], noise[1, 2], noise[2, 2]) for _, noise in row] for row in found])
    steps = np.tile(steps, (1, len(prior.sizes), 1))
    sized = prior.sizes[None, :, None, None] ** 2 * noises[:, None]
    return steps[places], sized.reshape(len(lengths), -1, 3)[places]
