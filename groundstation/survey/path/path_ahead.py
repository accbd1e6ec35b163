"""Where a hole goes beyond its last station: offset and direction as mixtures, at any depth.

Offsets are across the direction that was measured at the last station, on the two axes of the tendency. The hole may
meet one layer more that bends it: a jump of the curvature at a depth that is anywhere ahead, and it is kept.
Angles between the direction now and there are taken as small: the offset of a hole that has turned by 15 degrees is
stated 0.6 % too large.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.path.curvature_process import process_step
from groundstation.survey.path.curvature_tendency import CurvatureTendency
from groundstation.survey.path.normal_mixture import NormalMixture

Array = npt.NDArray[np.float64]
PLACES, SHARES = np.polynomial.legendre.leggauss(6)  # of a jump ahead, in parts of the way


@dataclass(frozen=True, slots=True)
class PathAhead:
    """A hole at its last station, and how well that is known.

    ``position_cov`` (2, 2), m^2, is of its position across the hole, ``shared_cov`` (2, 2) of its direction: what all
    directions share. What the last direction has of its own is in the position with half of the last leg; what is
    shared is taken to err with all of the position: the larger of the two possible answers.
    """

    tendency: CurvatureTendency
    position_cov: Array
    shared_cov: Array

    def offsets(self, distance: float) -> NormalMixture:
        """Offset (m) from the straight line ahead, after a distance (m)."""
        tendency = self.tendency
        a, b, c = tendency.blocks.transpose(1, 0, 2, 3)
        by_curvature, noise = _of_cells(tendency, distance, 0)
        bent = by_curvature[:, None, None]
        means = distance * tendency.means[:, :2] + by_curvature[:, None] * tendency.means[:, 2:]
        covs = self._straight(distance, a) + distance * bent * (b + b.transpose(0, 2, 1)) + bent**2 * c
        return self._with_jumps(means, covs + noise[:, None, None] * np.eye(2), distance, 0)

    def measured(self, distance: float) -> Array:
        """Covariance (2, 2) of the offset that is of the surveys: that of the straight line ahead."""
        weights, (a, _, _) = self.tendency.weights.ravel(), self.tendency.blocks.transpose(1, 0, 2, 3)
        own = np.einsum("c,cij->ij", weights, a)
        return self._straight(distance, own)

    def _straight(self, distance: float, own: Array) -> Array:
        """Covariance (..., 2, 2) of the line ahead, of a direction with what it has of its own (..., 2, 2)."""
        both = root_of(self.position_cov) + root_of(distance**2 * self.shared_cov)
        return np.asarray(both @ both + distance * (distance + self.tendency.last_leg) * own)

    def directions(self, distance: float) -> NormalMixture:
        """Direction (rad) relative to the one measured at the last station, after a distance (m)."""
        tendency = self.tendency
        a, b, c = tendency.blocks.transpose(1, 0, 2, 3)
        by_curvature, noise = _of_cells(tendency, distance, 1)
        bent = by_curvature[:, None, None]
        means = tendency.means[:, :2] + by_curvature[:, None] * tendency.means[:, 2:]
        covs = a + self.shared_cov + bent * (b + b.transpose(0, 2, 1)) + bent**2 * c
        return self._with_jumps(means, covs + noise[:, None, None] * np.eye(2), distance, 1)

    def _with_jumps(self, means: Array, covs: Array, distance: float, place: int) -> NormalMixture:
        """Add what follows from a jump ahead to that without one: about all cells together, for it is wider by far."""
        prior, weights = self.tendency.prior, self.tendency.weights.ravel()
        jumped = float(self.tendency.chance_of_jump(distance))
        left = 0.5 * distance * (1.0 - PLACES)
        responses = 0.5 * left**2 if place == 0 else left
        whole = NormalMixture(weights, means, covs)
        stds = np.multiply.outer(prior.jumps, responses).ravel()
        shares = np.multiply.outer(prior.jump_shares, 0.5 * SHARES).ravel()
        return NormalMixture(
            np.concatenate([(1.0 - jumped) * weights, jumped * shares]),
            np.concatenate([means, np.broadcast_to(whole.mean, (len(stds), 2))]),
            np.concatenate([covs, whole.cov + stds[:, None, None] ** 2 * np.eye(2)]),
        ).without_lightest()


def _of_cells(tendency: CurvatureTendency, distance: float, place: int) -> tuple[Array, Array]:
    """What a curvature comes to (g,) and the variance that is added (g,) over a distance (m), in each cell."""
    prior = tendency.prior
    found = [process_step(distance, length) for length in prior.lengths.tolist()]
    by_curvature = np.tile([step[place, 2] for step, _ in found], len(prior.sizes))
    noise = np.multiply.outer(prior.sizes**2, np.array([noise[place, place] for _, noise in found]))
    return by_curvature, noise.ravel()


def root_of(covs: Array) -> Array:
    """Symmetric roots of covariances (..., 2, 2). Source: Levinger, Math. Mag. 53 (1980): the root in closed form."""
    det = np.sqrt(np.maximum(covs[..., 0, 0] * covs[..., 1, 1] - covs[..., 0, 1] * covs[..., 1, 0], 0.0))
    trace = np.sqrt(np.maximum(covs[..., 0, 0] + covs[..., 1, 1] + 2.0 * det, 0.0))
    whole = covs + det[..., None, None] * np.eye(2)
    return np.asarray(whole / np.where(trace > 0.0, trace, 1.0)[..., None, None])
