"""A mixture of normals in the plane: what is foreseen where one normal would be too sure of itself. m and m^2."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
CONFIDENCE = 0.95  # of a cone and of a half width
LEFT_OUT = 1e-5  # of all weight, that the lightest parts may have together
NOWHERE: Final = np.zeros(2)
NO_SIZE = 1e-9  # m, below which an offset has no direction


@dataclass(frozen=True)  # with a dictionary, for what is worked out once
class NormalMixture:
    """Parts with their weights (c,), which come to 1, means (c, 2) and covariances (c, 2, 2)."""

    weights: Array
    means: Array
    covs: Array

    @cached_property
    def mean(self) -> Array:
        """Mean (2,)."""
        return np.asarray(self.weights @ self.means)

    @cached_property
    def cov(self) -> Array:
        """Covariance (2, 2): of the parts, and of their means."""
        apart = self.means - self.mean
        found = np.einsum("c,cij->ij", self.weights, self.covs) + (self.weights * apart.T) @ apart
        return np.asarray(found)

    def through(self, matrix: Array, shift: Array) -> NormalMixture:
        """What becomes of it under a linear map (2, 2) and a shift (2,)."""
        return NormalMixture(self.weights, self.means @ matrix.T + shift, matrix @ self.covs @ matrix.T)

    def without_lightest(self) -> NormalMixture:
        """The same without the parts that weigh next to nothing."""
        order = np.argsort(self.weights, kind="stable")
        kept = np.sort(order[np.cumsum(self.weights[order]) > LEFT_OUT])
        return NormalMixture(self.weights[kept] / self.weights[kept].sum(), self.means[kept], self.covs[kept])

    def chance_within(self, radius: float, centre: Array = NOWHERE) -> float:
        """Chance of being within a radius (m) of a centre (2,)."""
        from groundstation.survey.path.kernels.mixture_chances import chance_in_circle

        return min(chance_in_circle(self.weights, self.means, self.covs, centre, radius), 1.0)

    def radius_of(self, chance: float, centre: Array) -> float:
        """Radius (m) of the circle about a centre (2,) that has a chance."""
        from groundstation.survey.path.kernels.mixture_chances import reach_of_chance

        return reach_of_chance(self.weights, self.means, self.covs, centre, NOWHERE, chance)

    def half_width_of(self, chance: float) -> float:
        """Half width (m) along the mean: so near to its size the distance is, by that chance."""
        from groundstation.survey.path.kernels.mixture_chances import reach_of_chance

        return reach_of_chance(self.weights, self.means, self.covs, self.mean, self._along, chance)

    @cached_property
    def _along(self) -> Array:
        """Unit vector (2,) of the mean; of the widest direction where the mean has none."""
        size = math.hypot(*self.mean.tolist())
        return np.linalg.eigh(self.cov)[1][:, -1].copy() if size < NO_SIZE else self.mean / size
