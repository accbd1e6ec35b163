"""What a string that is carried parallel along a bent hole turns by, from the surveys of the hole above.

A shaft without twist carries its frame by parallel transport (R. L. Bishop, Am. Math. Monthly 82 (1975) 246): at a
depth its yaw is that of the head and gamma, the integral of (1 - cos I) dA from the head down. A node follows the
encoder, so the azimuth of its survey lacks gamma. It depends on the hole alone: all tubes at one depth lack the same.

With the lean as a complex number p = tan(I/2) exp(iA), the stereographic image of the tangent, gamma grows along an
arc of a great circle (minimum curvature) from p to r by its solid angle E = 2 arg(1 + p* r). As measured the leans are
p and r turned back by the gamma of their depths, q and s, so that p* r = q* s exp(iE). That is solved by
E = 2 arg(1 - q s*): gamma grows by two neighbours as they were measured. Nothing that was corrected is used again, so
an error of one survey does not grow from station to station, and no order of arrival matters.

At 90 degrees 1 - q s* vanishes: a hole that turns in the horizontal moves neither its yaw against the head nor gravity
in its tubes. On the way there errors grow by 1 / cos I.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.shared import stack_shared_errors
from groundstation.survey.fusion.sphere_direction import UNKNOWN_YAW_VAR

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
LEAST = 0.1  # of |1 - q s*|, below which surveys say nothing of a turn: beyond 85 deg of inclination
UPWARD = 1e-9  # of 1 + cos I, where a lean has no image
LEVEL = 1e-6  # of |cos I|, as ``tangents.tangent_jacobian`` takes it
STRAIGHT = 1e-9  # rad, of two legs that bend nowhere
UNKNOWN_BEND = 1.0  # rad, how far the one leg there is may bend out of its arc


@dataclass(frozen=True, slots=True)
class Carried:
    """Direction of a station corrected for the transport, and the transport angle with its standard deviation (rad)."""

    direction: Direction
    gamma: float
    std: float


@dataclass(frozen=True, slots=True)
class Legs:
    """Growth of gamma along every leg (n,), rad, and its change by the leans as measured at either end (n, 2)."""

    turned: Array
    by_upper: Array
    by_lower: Array
    unseen: npt.NDArray[np.bool_]  # legs of which surveys say nothing


def carry_directions(head: Direction, measured: Sequence[Direction], places: Sequence[int]) -> list[Carried]:
    """Directions of stations in the hole, from those that their tubes measured with the yaw of the head.

    What the random errors of a station do to all stations below it is one column, so that covariances of positions
    are exact for the weights that were used; what is left of them is random.

    Parameters
    ----------
    head : direction of the hole where the encoder is; it has no shared errors
    measured : of the stations (n), from the head down
    places : (n + 1,) of the columns for what lies between stations, for the head and for every station but the last
    """
    leans = np.array([head.lean, *(one.lean for one in measured)])
    downs = np.array([head.down, *(one.down for one in measured)])
    covs = np.array([head.cov, *(one.cov for one in measured)])
    legs = gamma_increments(leans, downs)
    gammas = np.concatenate([[0.0], np.cumsum(legs.turned)])
    turns = _turns(gammas)
    carried = (turns @ leans[:, :, None])[:, :, 0]
    here = np.concatenate([np.zeros((1, 2)), legs.by_lower])  # what its lean does to gamma at a station
    below = here[:-1] + legs.by_upper  # and at those below
    sizes = np.sqrt(np.maximum(_squares(below, covs[:-1]), 0.0))
    shared = stack_shared_errors(measured, max([1 + max(places), *(one.width for one in measured)]))
    by_columns = _by_columns(legs, shared)
    by_columns[:, places[0]] = np.cumsum(gamma_bend_stds(np.column_stack([carried, downs]), legs.unseen))
    by_columns[:, list(places[1:])] = np.tril(np.tile(sizes, (len(sizes), 1)))
    stds = np.sqrt(_squares(here, covs)[1:] + np.sum(by_columns**2, axis=1))
    across = np.stack([-carried[1:, 1], carried[1:, 0]], axis=1)  # change of the lean for one rad of gamma
    columns = turns[1:] @ shared + across[:, :, None] * by_columns[:, None, :]
    acted = turns[1:] + across[:, :, None] * here[1:, None, :]
    found = acted @ covs[1:] @ acted.transpose(0, 2, 1)
    for k in np.flatnonzero(sizes[1:] > 0.0).tolist():
        in_common = acted[k] @ covs[k + 1] @ below[k + 1] / sizes[k + 1]
        columns[k, :, places[k + 2]] = in_common
        found[k] -= np.outer(in_common, in_common)
    directions = map(Direction, carried[1:], downs[1:].tolist(), found, columns)
    return [Carried(*row) for row in zip(directions, gammas[1:].tolist(), stds.tolist(), strict=True)]


def gamma_increments(leans: Array, downs: Array) -> Legs:
    """Return the growth of gamma between stations, from measured leans (n + 1, 2) and vertical parts (n + 1,)."""
    base = np.maximum(1.0 + downs, UPWARD)
    level = np.copysign(np.maximum(np.abs(downs), LEVEL), downs)
    lean = leans[:, 0] + 1j * leans[:, 1]
    q = lean / base
    by_lean = np.array([1.0, 1j]) / base[:, None] + lean[:, None] * leans / (level * base**2)[:, None]
    left = 1.0 - q[:-1] * q[1:].conj()
    unseen = np.abs(left) < LEAST
    left = np.where(unseen, 1.0, left)
    by_upper = -2.0 * (by_lean[:-1] * (q[1:].conj() / left)[:, None]).imag
    by_lower = -2.0 * (by_lean[1:].conj() * (q[:-1] / left)[:, None]).imag
    seen = ~unseen[:, None]
    return Legs(np.angle(left**2), by_upper * seen, by_lower * seen, unseen)


def gamma_bend_stds(tangents: Array, unseen: npt.NDArray[np.bool_]) -> Array:
    """Standard deviation (rad) of gamma over each leg (n,) between tangents (n + 1, 3), as legs are not great circles.

    A path that bends out of its arc evenly, as legs bend against each other, encloses c^2 / 12 of the angle by which it
    bends with an arc of length c: that is one standard deviation, to one side in all legs of a hole that goes on alike.
    """
    normals = np.cross(tangents[:-1], tangents[1:])
    lengths = np.arctan2(np.linalg.norm(normals, axis=1), np.sum(tangents[:-1] * tangents[1:], axis=1))
    sines = np.sum(np.cross(normals[:-1], normals[1:]) * tangents[1:-1], axis=1)
    bends = np.arctan2(sines, np.sum(normals[:-1] * normals[1:], axis=1))
    each = 2.0 * bends / np.maximum(lengths[:-1] + lengths[1:], STRAIGHT)  # of every rad along the path
    around = np.concatenate([each[:1], each, each[-1:]])
    inside = 0.5 * lengths * (around[:-1] + around[1:]) if len(bends) else np.array([UNKNOWN_BEND])
    return np.where(unseen, math.sqrt(UNKNOWN_YAW_VAR), lengths**2 / 12.0 * inside)


def _turns(angles: Array) -> Array:
    """Rotations (n, 2, 2) of the plane by angles (n,)."""
    c, s = np.cos(angles), np.sin(angles)
    return np.moveaxis(np.array([[c, -s], [s, c]]), -1, 0)


def _squares(vectors: Array, matrices: Array) -> Array:
    """v^T M v (n,)."""
    return np.asarray(np.einsum("ni,nij,nj->n", vectors, matrices, vectors))


def _by_columns(legs: Legs, shared: Array) -> Array:
    """Change of gamma (n, s) for one standard deviation of every error that stations (n, 2, s) share."""
    grown_by = (legs.by_lower[:, None] @ shared)[:, 0]
    grown_by[1:] += (legs.by_upper[1:, None] @ shared[:-1])[:, 0]
    return np.asarray(np.cumsum(grown_by, axis=0))
