"""What an adjustment came to: directions with their covariance, tubes, and what the looks leave."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.kernels.observations import take_step
from groundstation.survey.adjustment.kernels.path_elimination import path_covariances, reduce_right, substitute_path
from groundstation.survey.adjustment.linear_solution import LinearSolution
from groundstation.survey.adjustment.looks import (
    FurtherEffects,
    Looks,
    PathPrior,
    StartingPoint,
    StringPrior,
)

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Linearised:
    """Looks where the unknowns stood: see ``linearise_looks``; ``squares`` (n,) of their residuals before.

    ``tilts`` (n, 3, 2) is their change by the tilt of a tube, also where those unknowns are left out; ``places`` (m, 6)
    and ``gravity_at`` are those of tubes and gravity among what stations have in common.
    """

    bases: Array
    jacobians: Array
    weights: Array
    residuals: Array
    squares: Array
    tilts: Array
    places: Places
    gravity_at: int


@dataclass(frozen=True)  # with a dictionary, for what is worked out once
class Adjusted:
    """A hole that was adjusted.

    Parameters
    ----------
    looks, string, path, extra : what it was made of
    now : where the unknowns stand; it is where the next adjustment begins
    linear, solution : the last linear equations
    known : (p, p), information on what stations have in common before any look
    """

    looks: Looks
    string: StringPrior
    path: PathPrior
    extra: FurtherEffects
    now: StartingPoint
    linear: Linearised
    solution: LinearSolution
    known: Array

    @cached_property
    def forces_of_tubes(self) -> tuple[Array, Places]:
        """Mean force (m, 3), m/s^2, of the looks of every tube, and how many (m,) there are."""
        tube, count = self.looks.tube, self.string.count
        counts = np.bincount(tube, minlength=count)
        sums = np.stack([np.bincount(tube, one, minlength=count) for one in self.looks.force.T], axis=1)
        return sums / np.maximum(counts, 1)[:, None], counts

    def without_looks(self) -> Adjusted:
        """Directions and their covariance alone: what is kept of looks (n,) where no look is asked about any more."""
        of_looks = ("jacobians", "weights", "residuals", "squares", "tilts")
        none = {name: getattr(self.linear, name)[:0].copy() for name in of_looks}
        return replace(self, linear=replace(self.linear, **none))

    @property
    def bases(self) -> Array:
        """Two unit vectors (s + 1, 2, 3) across the direction at collar and stations, in which their errors are."""
        return self.linear.bases

    @property
    def common_cov(self) -> Array:
        """Covariance (p, p) of what stations have in common."""
        return self.solution.cov

    @cached_property
    def by_common(self) -> Array:
        """Change of every state (s + 1, 4, p) for one unit of what stations have in common."""
        if self.solution.by_common is not None:
            return self.solution.by_common
        right = -self.solution.coupled
        substitute_path(self.solution.diagonal, self.solution.tied, right)
        return right

    @cached_property
    def own_covs(self) -> Array:
        """Covariances (s + 1, 4, 4) of the states were all that stations have in common known."""
        covs = np.empty_like(self.solution.diagonal)
        path_covariances(self.solution.diagonal, self.solution.tied, covs)
        return covs

    @cached_property
    def columns(self) -> Array:
        """Change of every state (s + 1, 4, p) for one standard deviation of independent errors in common."""
        if (sparse := self.solution.sparse) is not None:
            return self.solution.rooted_columns(sparse)
        flat = self.by_common.reshape(-1, self.by_common.shape[2])
        return self.solution.in_common.times_root(flat).reshape(self.by_common.shape)

    @cached_property
    def direction_columns(self) -> Array:
        """Change of every direction (s + 1, 2, p), likewise: half of the work, where curvatures are not asked for."""
        if "columns" in self.__dict__ or self.solution.sparse is not None:
            return np.ascontiguousarray(self.columns[:, :2])
        width = self.by_common.shape[2]
        flat = np.ascontiguousarray(self.by_common[:, :2]).reshape(-1, width)
        return self.solution.in_common.times_root(flat).reshape(-1, 2, width)

    @cached_property
    def common_root(self) -> Array:
        """Triangular root (p, p) of that covariance, see ``InCommon``."""
        return self.solution.in_common.root

    @cached_property
    def common_vars(self) -> Array:
        """Variances (p,) of what stations have in common."""
        return self.solution.in_common.variances

    @cached_property
    def covs(self) -> Array:
        """Covariances (s + 1, 4, 4) of direction and curvature at collar and stations."""
        return np.asarray(self.own_covs + self.columns @ np.swapaxes(self.columns, 1, 2))

    def cov_at(self, place: int) -> Array:
        """Covariance (4, 4) of direction and curvature at one place from the collar down."""
        columns = self.by_common[place] @ self.common_root
        return np.asarray(self.own_covs[place] + columns @ columns.T)

    @cached_property
    def left(self) -> Array:
        """What the looks leave (n, 3), m/s^2: read less adjusted."""
        return self._left_of(self.looks, self.linear.jacobians, self.linear.residuals, self.extra.columns)

    def left_of(self, rows: Places) -> Array:
        """The same of some looks (r,)."""
        linear = self.linear
        return self._left_of(
            self.looks.part(rows), linear.jacobians[rows], linear.residuals[rows], self.extra.columns[rows]
        )

    def _left_of(self, looks: Looks, jacobians: Array, residuals: Array, further: Array) -> Array:
        left = np.empty((len(looks), 3))
        take_step(
            looks.station, looks.tube, looks.make_up, jacobians, residuals, further, self.linear.places,
            self.linear.gravity_at, self.solution.states, self.solution.common, left,
        )  # fmt: skip
        return left

    def cofactor(self, directions: Array, common: Array) -> tuple[Array, Array]:
        """Covariance of all unknowns times columns: of directions (s + 1, 2, r) and of what is in common (p, r).

        Returns the same shapes, the former as states (s + 1, 4, r).
        """
        right = np.zeros((*self.solution.diagonal.shape[:2], directions.shape[2]))
        right[:, :2] = directions
        reduce_right(self.solution.diagonal, self.solution.tied, right)
        width = right.shape[2]
        of_path = self.solution.coupled.reshape(-1, len(common)).T @ right.reshape(-1, width)
        substitute_path(self.solution.diagonal, self.solution.tied, right)
        found = self.solution.in_common.times_cov(common - of_path)
        states = right + (self.by_common.reshape(-1, len(found)) @ found).reshape(right.shape)
        return states, found

    def spread_of(self, weights: Array) -> tuple[Array, Array]:
        """Covariance of all unknowns with functionals (s + 1, 2, r) of directions, as ``cofactor``; each is kept."""
        kept: dict[bytes, tuple[Array, Array]] = self.__dict__.setdefault("spreads", {})
        asked = weights.tobytes()
        if asked not in kept:
            kept[asked] = self.cofactor(weights, np.zeros((len(self.known), weights.shape[2])))
        return kept[asked]

    def covs_with_collar(self, count: int) -> Array:
        """Covariances (at most ``count``, 4, 2) of the first states with the direction at the collar, as ``cofactor``.

        No station below pulls at it, so the chain is solved from the collar down, no further than that.
        """
        solution, first = self.solution, slice(count)
        right = np.zeros((len(solution.diagonal[first]), 4, 2))
        right[0, :2] = np.eye(2)
        reduce_right(solution.diagonal[:1], solution.tied[:1], right[:1])
        found = solution.in_common.times_cov(-(solution.coupled[0].T @ right[0]))
        substitute_path(solution.diagonal[first], solution.tied[first], right)
        return np.asarray(right + self.by_common[first] @ found)

    def free_parts(self, rows: Places) -> Array:
        """Part P_k (r, 3, 3) of the inverse covariance of some looks that is free to contradict: W - W J Q J^T W."""
        kept: dict[bytes, Array] = self.__dict__.setdefault("parts", {})
        asked = rows.tobytes()
        if asked not in kept:
            kept[asked] = self._free_parts(rows)
        return kept[asked]

    def _free_parts(self, rows: Places) -> Array:
        from groundstation.survey.adjustment.kernels.free_parts import free_parts

        looks, size = self.looks.part(rows), len(self.common_cov)
        seen, station = np.unique(looks.station, return_inverse=True)
        columns = self.direction_columns[seen]
        of_direction = self.own_covs[seen, :2, :2] + columns @ np.swapaxes(columns, 1, 2)
        with_common = (self.by_common[seen, :2].reshape(-1, size) @ self.common_cov).reshape(columns.shape)
        found = np.empty((len(rows), 3, 3))
        free_parts(
            station.astype(np.intp), looks.tube, looks.make_up, self.linear.jacobians[rows], self.linear.weights[rows],
            self.extra.columns[rows], self.linear.gravity_at, of_direction, with_common, self.common_cov, found,
        )  # fmt: skip
        return found

    @cached_property
    def squares(self) -> float:
        """Weighted sum of squares of what the looks leave."""
        return float(np.einsum("ka,kab,kb->", self.left, self.linear.weights, self.left))

    @cached_property
    def redundancy(self) -> float:
        """What that sum is to be."""
        told = self.solution.told_by(self.own_covs[:, :2, :2], self.direction_columns, self.known)
        return float(self.linear.residuals.size - told)
