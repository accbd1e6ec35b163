"""From directions at measured depths to positions with their covariance.

Balanced tangential (default): dr = D/2 (t1 + t2). Minimum curvature: the same times (2/b) tan(b/2), b the angle
between the tangents. A station enters two legs, so its weight in the position is half their summed length, and half
the last leg for the last station: both kinds of covariance are kept by two running sums, and appending a station costs
the same however many there are. Source: thesis 2.1-2.3 and eqs. I.1-I.12. Frame: north, east, down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.resolve import Lean

Array = npt.NDArray[np.float64]


class Method(Enum):
    """How a leg follows from the directions at its ends."""

    BALANCED_TANGENTIAL = "balanced-tangential"
    MINIMUM_CURVATURE = "minimum-curvature"


@dataclass(frozen=True, slots=True)
class Point:
    """One station of a trajectory."""

    md: float  # m
    tangent: Array  # (3,)
    position: Array  # (3,) m, north east down
    cov: Array  # (3, 3) m^2, random and systematic


def tangent_of(direction: Lean) -> Array:
    """Downhole unit vector (3,)."""
    return np.array([direction.lean[0], direction.lean[1], direction.down])


def tangent_jacobian(direction: Lean) -> Array:
    """D tangent / d lean (3, 2); the vertical part follows from the unit length."""
    down = math.copysign(max(abs(direction.down), 1e-6), direction.down)
    return np.array([[1.0, 0.0], [0.0, 1.0], [-direction.lean[0] / down, -direction.lean[1] / down]])


def bend(t1: Array, t2: Array) -> float:
    """Angle (rad) between two unit vectors, exact for small ones."""
    return math.atan2(float(np.linalg.norm(np.cross(t1, t2))), float(t1 @ t2))


def ratio_factor(angle: float) -> float:
    """(2/b) tan(b/2) of the minimum curvature method."""
    return 1.0 + angle * angle / 12.0 if angle < 1e-6 else 2.0 / angle * math.tan(0.5 * angle)


class Trajectory:
    """Positions of stations in order of depth, one appended at a time.

    Parameters
    ----------
    method : of the legs
    collar : direction at the first depth, known: vertical by default
    start_md : m
    """

    def __init__(
        self, method: Method = Method.BALANCED_TANGENTIAL, collar: Lean | None = None, start_md: float = 0.0
    ) -> None:
        self._method = method
        first = collar or Lean(np.zeros(2), 1.0, np.zeros((2, 2)), np.zeros(2))
        self._last = first
        self._length = 0.0
        self._interior = np.zeros((3, 3))
        self._interior_systematic = np.zeros(3)
        self.points = [Point(start_md, tangent_of(first), np.zeros(3), np.zeros((3, 3)))]

    def append(self, md: float, direction: Lean) -> Point:
        """Add the station at ``md`` (m).

        Raises
        ------
        SurveyError
            When the depth does not grow, or the two directions are opposite.
        """
        before = self.points[-1]
        length = md - before.md
        if not length > 0.0:
            raise SurveyError(f"trajectory: expected a depth beyond {before.md:g} m, got {md:g} m")
        tangent = tangent_of(direction)
        factor = 1.0
        if self._method is Method.MINIMUM_CURVATURE:
            angle = bend(before.tangent, tangent)
            if angle > math.pi - 1e-6:
                raise SurveyError(f"trajectory: the hole turns back on itself between {before.md:g} and {md:g} m")
            factor = ratio_factor(angle)
        position = before.position + 0.5 * length * factor * (before.tangent + tangent)
        self._interior = self._interior + self._share(self._last, 0.5 * (self._length + length))
        self._interior_systematic = self._interior_systematic + 0.5 * (self._length + length) * (
            tangent_jacobian(self._last) @ self._last.systematic
        )
        systematic = self._interior_systematic + 0.5 * length * (tangent_jacobian(direction) @ direction.systematic)
        cov = self._interior + self._share(direction, 0.5 * length) + np.outer(systematic, systematic)
        self._last, self._length = direction, length
        point = Point(md, tangent, position, cov)
        self.points.append(point)
        return point

    @staticmethod
    def _share(direction: Lean, weight: float) -> Array:
        jacobian = weight * tangent_jacobian(direction)
        return np.asarray(jacobian @ direction.cov @ jacobian.T)


def interpolate(points: list[Point], md: float) -> Point:
    """Point on the arc between two stations at ``md`` (m); its covariance is interpolated between theirs.

    Raises
    ------
    SurveyError
        When ``md`` is outside the trajectory.
    """
    if not points[0].md <= md <= points[-1].md:
        raise SurveyError(f"trajectory: expected a depth of {points[0].md:g}..{points[-1].md:g} m, got {md:g} m")
    for upper, lower in pairwise(points):
        if md <= lower.md:
            return _on_arc(upper, lower, (md - upper.md) / (lower.md - upper.md))
    return points[-1]


def _on_arc(upper: Point, lower: Point, f: float) -> Point:
    """Fraction ``f`` of a leg along its arc, scaled so that the leg ends where its method put the lower station."""
    angle = bend(upper.tangent, lower.tangent)
    if angle < 1e-9:
        tangent = upper.tangent + f * (lower.tangent - upper.tangent)
    else:
        tangent = (math.sin((1.0 - f) * angle) * upper.tangent + math.sin(f * angle) * lower.tangent) / math.sin(angle)
    chord = upper.tangent + lower.tangent
    part = f * ratio_factor(f * angle) / ratio_factor(angle) * (upper.tangent + tangent)
    leg = lower.position - upper.position
    scale = float(np.linalg.norm(leg)) / float(np.linalg.norm(chord))
    position = upper.position + scale * part
    cov = (1.0 - f) * upper.cov + f * lower.cov
    return Point(upper.md + f * (lower.md - upper.md), tangent, position, cov)
