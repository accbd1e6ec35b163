"""From directions at measured depths to positions with their covariance, one station appended at a time.

A station enters two legs, so its weight in the position is half their summed length, and half the last leg for the last
station (the Jacobian of the balanced tangential method, used for every method as the industry's error model does).
Its errors are kept by running sums in a compiled loop: appending costs the same however many stations there are. What
stations share may become more columns as the hole grows; the columns of a point are those known when it was added.
Source: thesis 2.1-2.3 and eqs. I.1-I.12. Frame: north, east, down.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.methods import OPPOSITE, Method, dogleg, leg, ratio_factor
from groundstation.survey.resolve import Direction, angles
from groundstation.survey.shared import added, widened

Array = npt.NDArray[np.float64]
BLOCK = 64  # stations, whose columns are held at a time


@dataclass(frozen=True, slots=True)
class Point:
    """One station of a trajectory."""

    md: float  # m
    tangent: Array  # (3,)
    position: Array  # (3,) m, north east down
    cov: Array  # (3, 3) m^2, random and shared
    shared: Array  # (3, s) m, change for one standard deviation of every shared error, or what is kept of that


def tangents_of(directions: Sequence[Direction]) -> Array:
    """Downhole unit vectors (n, 3)."""
    return np.array([(*direction.lean.tolist(), direction.down) for direction in directions])


def tangent_jacobians(tangents: Array) -> Array:
    """D tangent / d lean (n, 3, 2); the vertical part follows from the unit length."""
    down = np.copysign(np.maximum(np.abs(tangents[:, 2]), 1e-6), tangents[:, 2])
    jacobians = np.zeros((len(tangents), 3, 2))
    jacobians[:, 0, 0] = jacobians[:, 1, 1] = 1.0
    jacobians[:, 2] = -tangents[:, :2] / down[:, None]
    return jacobians


class Trajectory:
    """Positions of stations in order of depth, one appended at a time.

    Parameters
    ----------
    method : of the legs
    collar : direction at the first depth, known: vertical by default
    start_md : m
    keep : makes of the shared columns (n, 3, s) of n points what these keep of them, a row each: all by default, which
        of a string of fifty tubes is 750 numbers a point
    """

    def __init__(
        self,
        method: Method = Method.BALANCED_TANGENTIAL,
        collar: Direction | None = None,
        start_md: float = 0.0,
        keep: Callable[[Array], Array] = np.asarray,
    ) -> None:
        self._method = method
        self._keep = keep
        first = collar or Direction(np.zeros(2), 1.0, np.zeros((2, 2)), np.zeros((2, 0)))
        tangents = tangents_of([first])
        jacobian = tangent_jacobians(tangents)[0]
        self._last_cov, self._last_shared = jacobian @ first.cov @ jacobian.T, jacobian @ first.shared  # of the tangent
        self._length = 0.0
        self._own, self._passed = np.zeros((3, 3)), np.zeros((3, 0))  # running sums, see the kernel
        self.points = [Point(start_md, tangents[0], np.zeros(3), np.zeros((3, 3)), keep(np.zeros((1, 3, 0)))[0])]

    def append(self, md: float, direction: Direction) -> Point:
        """Add the station at ``md`` (m).

        Raises
        ------
        SurveyError
            When the depth does not grow, or the two directions are opposite.
        """
        self.extend([(md, direction)])
        return self.points[-1]

    def extend(self, stations: Sequence[tuple[float, Direction]]) -> None:
        """Add stations (m, direction); the same bit for bit as one after the other, and several times as fast.

        Raises
        ------
        SurveyError
            When a depth does not grow, or two directions are opposite; then none is added.
        """
        if not stations:
            return
        before = self.points[-1]
        mds, directions = zip(*stations, strict=True)
        lengths = np.diff([before.md, *mds])
        for n, length in enumerate(lengths.tolist()):
            if not 0.0 < length < math.inf:
                raise SurveyError(f"trajectory: expected a depth beyond {[before.md, *mds][n]:g} m, got {mds[n]:g} m")
        tangents = np.concatenate([before.tangent[None], tangents_of(directions)])
        legs = self._legs(lengths, [before.md, *mds], tangents, directions)
        positions = np.add.accumulate([before.position, *legs])
        for first in range(0, len(mds), BLOCK):
            block = slice(first, first + BLOCK)
            jacobians = tangent_jacobians(tangents[1:][block])
            own = np.array([direction.cov for direction in directions[block]])
            covs = jacobians @ own @ jacobians.transpose(0, 2, 1)
            columns = [jacobian @ one.shared for jacobian, one in zip(jacobians, directions[block], strict=True)]
            rows = zip(mds[block], tangents[1:][block], positions[1:][block], strict=True)
            for row, errors in zip(rows, self._follow(lengths[block], covs, columns), strict=True):
                self.points.append(Point(*row, *errors))

    def _follow(self, lengths: Array, covs: Array, columns: list[Array]) -> list[tuple[Array, Array]]:
        """Covariance (3, 3) of each position at the ends of legs (n,), m, and what is kept of its shared columns.

        From those of their tangents, (n, 3, 3) and (3, s) each.
        """
        from groundstation.survey.kernels.position_errors import add_stations  # whoever only reads needs no compiler

        known = max(self._last_shared.shape[1], self._passed.shape[1])
        widths = list(itertools.accumulate((own.shape[1] for own in columns), max, initial=known))
        tangents = np.zeros((len(columns) + 1, 3, widths[-1]))
        for n, own in enumerate((self._last_shared, *columns)):
            tangents[n, :, : own.shape[1]] = own
        of_tangents = np.concatenate([self._last_cov[None], covs])
        ends = 0.5 * lengths
        weights = ends.copy()  # of the station before each, which has both its legs now
        weights[0] += 0.5 * self._length
        weights[1:] += ends[:-1]
        passed, shared, out = widened(self._passed, widths[-1]), np.empty_like(tangents[1:]), np.empty_like(covs)
        add_stations(weights, ends, tangents, of_tangents, passed, self._own, shared, out)
        self._passed, self._length = passed, float(lengths[-1])
        self._last_cov, self._last_shared = covs[-1], columns[-1]
        points: list[tuple[Array, Array]] = []
        for width, same in itertools.groupby(widths[1:]):
            run = slice(len(points), len(points) + len(list(same)))
            known_here = shared[run, :, :width]
            points += zip(out[run] + known_here @ known_here.transpose(0, 2, 1), self._keep(known_here), strict=True)
        return points

    def _legs(self, lengths: Array, mds: Sequence[float], tangents: Array, directions: Sequence[Direction]) -> Array:
        """Displacements (n, 3) from station to station."""
        if self._method is Method.BALANCED_TANGENTIAL:
            return np.asarray((0.5 * lengths)[:, None] * (tangents[:-1] + tangents[1:]))
        return np.array(
            [
                self._leg(md, tangent, length, direction)
                for md, tangent, length, direction in zip(mds, tangents, lengths.tolist(), directions, strict=False)
            ]
        )

    def _leg(self, md: float, tangent: Array, length: float, direction: Direction) -> Array:
        i1, a1 = angles(tangent[:2], float(tangent[2]))
        i2, a2 = angles(direction.lean, direction.down)
        if self._method is Method.MINIMUM_CURVATURE and dogleg(math, i1, a1, i2, a2) > math.pi - OPPOSITE:
            raise SurveyError(f"trajectory: the hole turns back on itself between {md:g} and {md + length:g} m")
        return np.array(leg(math, self._method, length, i1, a1, i2, a2))


def interpolate(points: list[Point], md: float) -> Point:
    """Point on the arc between two stations at ``md`` (m); its covariance is interpolated between theirs.

    Raises
    ------
    SurveyError
        When ``md`` is outside the trajectory.
    """
    if not points[0].md <= md <= points[-1].md:
        raise SurveyError(f"trajectory: expected a depth of {points[0].md:g}..{points[-1].md:g} m, got {md:g} m")
    for upper, lower in itertools.pairwise(points):
        if md <= lower.md:
            return on_arc(upper, lower, (md - upper.md) / (lower.md - upper.md))
    return points[-1]


def on_arc(upper: Point, lower: Point, f: float) -> Point:
    """Fraction ``f`` of a leg along its arc, bent evenly so that it ends where the method put the lower station."""
    angle = math.atan2(
        float(np.linalg.norm(np.cross(upper.tangent, lower.tangent))), float(upper.tangent @ lower.tangent)
    )
    if angle < 1e-9:
        tangent = upper.tangent + f * (lower.tangent - upper.tangent)
    else:
        tangent = (math.sin((1.0 - f) * angle) * upper.tangent + math.sin(f * angle) * lower.tangent) / math.sin(angle)
    half = 0.5 * (lower.md - upper.md)
    arc = half * f * ratio_factor(math, f * angle) * (upper.tangent + tangent)
    whole = half * ratio_factor(math, angle) * (upper.tangent + lower.tangent)
    position = upper.position + arc + f * (lower.position - upper.position - whole)
    cov = (1.0 - f) * upper.cov + f * lower.cov
    shared = added((1.0 - f) * upper.shared, f * lower.shared)
    return Point(upper.md + f * (lower.md - upper.md), tangent, position, cov, shared)
