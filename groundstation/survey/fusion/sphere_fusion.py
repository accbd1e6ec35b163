"""Readings of one direction as one, on the sphere: whatever the inclination, and however poorly yaws are known.

An error of a reading's yaw turns it about the vertical. What that turn is most likely is estimated reading by reading,
so that a yaw which is hardly known puts a reading on its circle and not on a straight line; what is left is linear in
the plane across the direction, and weighed by the inverse of all that the reading does not know. So an inclination does
not depend on its yaw.
Source: Gauss and Newton's method; information filter, as thesis eqs. 3.39-3.42. Frame: north, east, down; rad.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
import numpy.typing as npt

from groundstation.survey.bearings import planes_across
from groundstation.survey.fusion.packed import Packed
from groundstation.survey.fusion.sphere_direction import SphereDirection, bows_of, polar_variances, yaw_variances

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
STEPS = 30  # at the most
SETTLED = 1e-16  # of the square of a step in standard deviations
TINY = 1e-300
WIDTH = attrgetter("width")


@dataclass(frozen=True, slots=True)
class Stack:
    """Directions side by side, unit vectors with their errors: (n, 3), (n, 3, 3) and (n, 3, s).

    ``yaw_vars`` (n, 2), rad^2, are what of these is of a yaw: random, and shared.
    """

    tangents: Array
    covs: Array
    shared: Array
    yaw_vars: Array


def fuse_on_sphere(
    tangents: Array, covs: Array, packed: Sequence[Packed], yaw_vars: Array, begin: Places
) -> list[SphereDirection]:
    """Directions of several stations (k), of each from its readings; the same bit for bit as of one after the other.

    Parameters
    ----------
    tangents, covs : (n, 3) and (n, 3, 3), readings with what is random in each
    packed : (n) of (3, s), what they share with others
    yaw_vars : (n, 2) rad^2, what of the former and of the latter is of a yaw
    begin : (k + 1,) first reading of each station, and the end

    Raises
    ------
    numpy.linalg.LinAlgError
        When a reading cannot be weighed.
    """
    counts = np.diff(begin)
    station = np.repeat(np.arange(len(counts)), counts)
    totals, all_yaws = covs + np.array([one.values @ one.values.T for one in packed]), yaw_vars.sum(axis=1)
    along, _, _ = polar_variances(tangents, totals)
    alone = yaw_vars[:, 0] * np.repeat(1.0 - 1.0 / counts, counts)  # a reading by itself is not too long
    now = _first_directions(tangents, totals, begin)
    moving = np.ones(len(now), np.bool_)
    for _ in range(STEPS):
        across = planes_across(now)
        seen = _Seen(now[station], across[station], tangents, all_yaws, along, alone)
        step, information = _solved(seen, seen.covs(totals, all_yaws), begin)
        # a station that has settled stays: what it comes to does not depend on others that have not
        now = np.where(moving[:, None], _stepped(now, across, step), now)
        moving &= (step[:, None] @ information @ step[:, :, None])[:, 0, 0] > SETTLED
        if not moving.any():
            break
    across = planes_across(now)
    seen = _Seen(now[station], across[station], tangents, all_yaws, along, alone)
    weights = np.linalg.inv(seen.covs(totals, all_yaws))
    gains = np.linalg.inv(np.add.reduceat(weights, begin[:-1]))[station] @ weights
    steady = _steady_shares(now, along, begin)[station]
    random = gains @ seen.covs(covs, yaw_vars[:, 0], steady) @ gains.transpose(0, 2, 1)
    return _directions(now, across, np.add.reduceat(random, begin[:-1]), gains @ seen.turned, packed, begin)


class _Seen:
    """Readings (n) as they are seen from directions (n, 3): turned back by the error of each yaw.

    Parameters
    ----------
    axes : (n, 2, 3) across the directions
    yaw_vars, along : (n,) rad^2, of the yaw of each, and of its inclination
    alone : (n,) rad^2, of the part of the yaw that is of each alone, as far as the direction is that of others

    Attributes
    ----------
    turned : (n, 2, 3), an error of a reading, turned back, in the axes
    apart : (n, 2) from the direction to the reading, with the error of its yaw as it is linear
    level : (n, 2) what a rad of yaw moves the direction by
    """

    def __init__(
        self, now: Array, axes: Array, tangents: Array, yaw_vars: Array, along: Array, alone: Array | float = 0.0
    ) -> None:
        x, y = now[:, 0], now[:, 1]
        u, v = tangents[:, 0], tangents[:, 1]
        sine, cosine = x * v - y * u, x * u + y * v  # of the angle between the leans, times both
        strength = yaw_vars / np.maximum(along, TINY)
        full = np.arctan2(sine, cosine)
        lever = np.hypot(sine, cosine) * strength
        error = full * lever / (1.0 + lever)
        for _ in range(3):  # the likeliest: where error / yaw_vars pulls as much as the force does
            left = full - error
            error -= (error - lever * np.sin(left)) / (1.0 + lever * np.maximum(np.cos(left), 0.0))
        squares = x * x + y * y
        # the error that fits best takes a part of the force's own error with it, and so makes the lean too long
        share = squares * strength / (1.0 + squares * strength)
        longer = alone * (1.0 - share) * (1.0 - 0.5 * share)
        c, s = np.cos(error), np.sin(error)
        back = np.zeros((len(now), 3, 3))
        back[:, 0, 0] = back[:, 1, 1] = c
        back[:, 0, 1], back[:, 1, 0], back[:, 2, 2] = s, -s, 1.0
        self.turned = axes @ back
        x, y, u, v = x[:, None], y[:, None], u[:, None], v[:, None]
        self.level = axes[:, :, 1] * x - axes[:, :, 0] * y
        self._there = self.turned[:, :, 1] * u - self.turned[:, :, 0] * v
        seen = (back @ tangents[:, :, None])[:, :, 0]
        across = (axes @ seen[:, :, None])[:, :, 0]
        size = np.sqrt((across**2).sum(axis=1))
        angle = np.arctan2(size, (seen * now).sum(axis=1))
        across *= ((angle + TINY) / (size + TINY))[:, None]
        outward = axes[:, :, 0] * x + axes[:, :, 1] * y
        self.apart = across + error[:, None] * self.level - np.expand_dims(longer, 1) * outward

    def covs(self, covs: Array, yaw_vars: Array, steady: Array | float = 1.0) -> Array:
        """Covariances (n, 2, 2) of readings: what is of a yaw (rad^2) moves the direction and not what was read.

        ``steady`` (n,) is the part of the squared lean of the direction that is not noise.
        """
        here = np.expand_dims(steady, (-2, -1)) * (self.level[:, :, None] * self.level[:, None])
        there = self._there[:, :, None] * self._there[:, None]
        return self.turned @ covs @ self.turned.transpose(0, 2, 1) + yaw_vars[:, None, None] * (here - there)


def _first_directions(tangents: Array, totals: Array, begin: Places) -> Array:
    """The best reading (k, 3) of each station."""
    sizes = np.trace(totals, axis1=1, axis2=2)
    first = [int(a + np.argmin(sizes[a:b])) for a, b in zip(begin[:-1].tolist(), begin[1:].tolist(), strict=True)]
    return tangents[first]


def _steady_shares(now: Array, along: Array, begin: Places) -> Array:
    """What of the squared leans (k,) of directions is not noise; ``along`` (n,) rad^2 is that of the inclinations read.

    A yaw turns the true lean. That which was found is longer by the noise, its square by two variances in the mean.
    """
    squares = now[:, 0] ** 2 + now[:, 1] ** 2
    noise = 1.0 / np.add.reduceat(1.0 / np.maximum(along, TINY), begin[:-1])
    return np.asarray(squares / (squares + 2.0 * noise))


def _solved(seen: _Seen, covs: Array, begin: Places) -> tuple[Array, Array]:
    """Step (k, 2) of each station, and the information (k, 2, 2) on it, from covariances (n, 2, 2) of its readings."""
    weights = np.linalg.inv(covs)
    information = np.add.reduceat(weights, begin[:-1])
    right = np.add.reduceat((weights @ seen.apart[:, :, None])[:, :, 0], begin[:-1])
    return np.linalg.solve(information, right[:, :, None])[:, :, 0], information


def _stepped(now: Array, across: Array, step: Array) -> Array:
    """Directions (k, 3) after steps (k, 2) in the axes (k, 2, 3) across them, along great circles."""
    size = np.sqrt((step**2).sum(axis=1))[:, None]
    toward = (step[:, None] @ across)[:, 0] * np.sinc(size / np.pi)
    moved = np.cos(size) * now + toward
    return np.asarray(moved / np.sqrt((moved**2).sum(axis=1))[:, None])


def _directions(
    now: Array, across: Array, covs: Array, acted: Array, packed: Sequence[Packed], begin: Places
) -> list[SphereDirection]:
    """Directions (k, 3) with their covariances (k, 2, 2) and columns, from what a reading's errors (n, 2, 3) do."""
    back = across.transpose(0, 2, 1)
    own = back @ covs @ across
    found = []
    for k, (a, b) in enumerate(zip(begin[:-1].tolist(), begin[1:].tolist(), strict=True)):
        columns = np.zeros((3, max(map(WIDTH, packed[a:b]))))
        for matrix, one in zip(back[k] @ acted[a:b], packed[a:b], strict=True):
            columns[:, one.places] += matrix @ one.values
        shared = Packed(columns)
        total = own[k] + shared.values @ shared.values.T
        left = yaw_variances(now[k : k + 1], total[None])
        bow = bows_of(now[k : k + 1], left)[0]
        found.append(SphereDirection(now[k].copy(), own[k].copy(), shared, (float(left[0]), 0.0), bow))
    return found


def off_direction(directions: Stack, others: Stack) -> tuple[Array, Array]:
    """By how much (n, 2) other directions are off some, and the covariance (n, 2, 2) of that, across the latter.

    What both share, the same columns, cancels.
    """
    along = np.zeros(len(directions.tangents))
    for side in (directions, others):
        along += polar_variances(side.tangents, side.covs + side.shared @ side.shared.transpose(0, 2, 1))[0]
    yaw_vars = (directions.yaw_vars + others.yaw_vars).sum(axis=1)
    axes = planes_across(directions.tangents)
    between = _Seen(directions.tangents, axes, others.tangents, yaw_vars, along)
    apart = between.turned @ others.shared - axes @ directions.shared
    random = between.turned @ others.covs @ between.turned.transpose(0, 2, 1)
    random += axes @ directions.covs @ axes.transpose(0, 2, 1)
    return between.apart, random + apart @ apart.transpose(0, 2, 1)
