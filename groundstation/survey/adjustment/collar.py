"""The direction at the collar as it was told, beside what the stations below say of it.

No tube looks at the collar, and the hole may bend down to the first station as any path does. What the stations say of
it is their directions, carried up by what is known of the path; against that what was told is one more reading.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.curvature_size import curvature_below
from groundstation.survey.adjustment.equations import KNOWN, STATE, leg_steps
from groundstation.survey.adjustment.looks import PathPrior
from groundstation.survey.adjustment.scores import best_sizes
from groundstation.survey.adjustment.sphere import bends_between
from groundstation.survey.path.leg_wander import CollarTie

Array = npt.NDArray[np.float64]
TIED_LEGS = 8  # with which the direction at the collar goes; of those below nothing is left
WIDE_COLLAR = 0.5  # rad, of a collar that was told wrong, before the stations tell it


@dataclass(frozen=True, slots=True)
class CollarDeparture:
    """By how much (2,), rad, what was told stands off what the stations say, and what is free (2, 2) to tell it.

    ``squares`` is chi-square of two degrees of freedom in an honest hole, or zero of none where ``told`` is: nothing
    beside it tells the collar. Its variance is that of how the hole bends and of what was told of mounts, and not one
    that the looks leave: two looks, which leave nothing, contradict a collar as well as twenty.
    """

    size: Array
    free: Array
    squares: float
    told: int

    @property
    def cov(self) -> Array:
        """Covariance (2, 2), rad^2."""
        return np.asarray(np.linalg.pinv(self.free), np.float64)

    def log_chance(self) -> float:
        """Logarithm of the chance that an honest hole departs as far, by how sharply holes bend."""
        return -0.5 * self.squares  # of two degrees of freedom


def collar_departure(found: Adjusted) -> CollarDeparture:
    """Departure of the collar as it was told, in the axes of the collar of an adjustment.

    What the first station says, direction and curvature, is compared with what the collar leads to down a leg that
    bends as the legs below it do: were it taken to bend as sharply as it seems to, no collar would ever be wrong, and
    as is stated beforehand, that of every hole in a sharper ground.
    """
    bases, now = found.bases, found.now
    if len(now.tangents) < 2:
        return CollarDeparture(np.zeros(2), np.eye(2), 0.0, 0)
    go, rigid = leg_steps(found.path)
    at_collar = np.zeros((STATE, STATE))
    at_collar[:2, :2] = bases[0] @ found.path.collar_cov @ bases[0].T + KNOWN * np.eye(2)
    bends = max(curvature_below(found), found.path.curvature_std**2)
    at_collar[2:, 2:] = bends * np.eye(2)
    led_to, by_leg = go[0] @ at_collar @ go[0].T, np.asarray(np.linalg.inv(rigid[0]), np.float64)
    known = np.asarray(np.linalg.inv(found.cov_at(1)), np.float64)
    ends = np.stack([now.tangents[0], found.path.collar, now.tangents[0], now.tangents[1]])
    to_told, _, to_station = bends_between(ends, bases[:1].repeat(4, axis=0))
    pulled = known @ np.concatenate([to_station - to_told, now.curvatures[1]])
    # the station without what it has from the collar, which leads to no bend and no curvature
    own = known - np.linalg.inv(led_to + now.leg_vars[0] * by_leg)
    weight = np.linalg.inv(np.eye(STATE) + own @ (led_to + bends * by_leg))
    down = go[0][:, :2]
    free = down.T @ weight @ own @ down
    sizes, _, told, squares = best_sizes(-(down.T @ weight @ pulled)[None], free[None], free[None])
    return CollarDeparture(sizes[0], free, float(squares[0]), int(told[0]))


def collar_ties(found: Adjusted) -> tuple[CollarTie, ...]:
    """How the direction at the collar of an adjustment goes with the curvature of its first legs, leg by leg."""
    states = found.covs_with_collar(TIED_LEGS + 1)
    departs = states[1:] - leg_steps(found.path)[0][:TIED_LEGS] @ states[:-1]
    parts = (states[:-1, 2:], departs[:, :2], departs[:, 2:])
    return tuple(itertools.starmap(CollarTie, zip(*(_each_way(part) for part in parts), strict=True)))


def _each_way(parts: Array) -> list[float]:
    """Means over both axes of blocks (n, 2, 2)."""
    return [0.5 * float(np.trace(part)) for part in parts]


def untold_collar(path: PathPrior) -> PathPrior:
    """What is known of a path without what was told of its collar."""
    across = np.eye(3) - np.outer(path.collar, path.collar)
    return replace(path, collar_cov=path.collar_cov + WIDE_COLLAR**2 * across)
