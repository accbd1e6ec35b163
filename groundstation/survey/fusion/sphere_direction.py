"""Directions with their errors on the sphere, not in the plane of the lean.

An error of the yaw turns a direction about the vertical, so it errs along a circle and not along the straight line that
a variance describes: its azimuth is off, its inclination is not. Were the yaw e off, the lean l would be off by
l (cos e - 1) along it. Of a normal e with the variance v the second moment of that is l^2 (3/2 - 2 exp(-v/2) +
exp(-2 v)/2), which begins as 3/4 v^2 l^2; of a yaw that may be any it is 3/2 l^2. A position errs by that too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import attrgetter

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.packed import Packed
from groundstation.survey.fusion.resolve import UPRIGHT, Direction
from groundstation.survey.fusion.tangents import tangent_jacobian

Array = npt.NDArray[np.float64]
UNKNOWN_YAW_VAR = math.pi**2 / 3.0  # rad^2, uniform on the circle, as nodes say it (``telemetry.messages``)
AS_A_CIRCLE = 1.5  # of the squared lean, second moment along it of a yaw that may be any
SURE: Array = np.zeros((3, 3))
TANGENT, OWN, YAW_VARS, PACKED = map(attrgetter, ("tangent", "own", "yaw_vars", "packed"))


class SphereDirection(Direction):
    """Direction with covariance and shared columns of its unit vector.

    It is regular at every inclination: that of a level hole moves up and down, which its lean does not show.
    ``yaw_vars`` (rad^2) are what of the covariance, and of the columns, is of a yaw.
    """

    __slots__ = ("bow", "own", "packed", "tangent", "yaw_vars")
    tangent: Array  # (3,), unit vector
    own: Array  # (3, 3), covariance of the unit vector that no other shares
    packed: Packed  # (3, s) of the unit vector
    yaw_vars: tuple[float, float]
    bow: Array  # (3, 3), what its circle adds in space

    def __init__(
        self, tangent: Array, own: Array, packed: Packed, yaw_vars: tuple[float, float] = (0.0, 0.0), bow: Array = SURE
    ) -> None:
        put = object.__setattr__  # one by one: a long hole makes hundreds at every stop
        put(self, "lean", tangent[:2])
        put(self, "down", float(tangent[2]))
        put(self, "cov", own[:2, :2])
        put(self, "own", own)
        put(self, "packed", packed)
        put(self, "tangent", tangent)
        put(self, "yaw_vars", yaw_vars)
        put(self, "bow", bow)

    @property
    def shared(self) -> Array:
        """Columns (2, s) of the lean, made anew."""
        return self.packed.columns()[:2]

    @property
    def width(self) -> int:
        """Number s of shared columns."""
        return self.packed.width

    def fill(self, columns: Array) -> None:
        """Write the shared columns of the lean into ``columns``, zeros (2, >= s)."""
        columns[:, self.packed.places] = self.packed.values[:2]

    @property
    def tangent_cov(self) -> Array:
        """Covariance (3, 3) of the unit vector, with the shared errors in it."""
        values = self.packed.values
        return np.asarray(self.own + values @ values.T)


def bare_direction(tangent: Array, cov: Array, yaw_var: float = 0.0) -> SphereDirection:
    """Direction (3,) with the covariance (3, 3) of its unit vector, which shares nothing; of its yaw, rad^2."""
    return SphereDirection(tangent, cov, Packed(np.zeros((3, 0))), (yaw_var, 0.0))


def on_sphere(direction: Direction) -> SphereDirection:
    """Any direction, its errors as those of its unit vector."""
    if isinstance(direction, SphereDirection):
        return direction
    tangent = np.array([*direction.lean, direction.down])
    jacobian = tangent_jacobian(tangent)
    return SphereDirection(tangent, jacobian @ direction.cov @ jacobian.T, Packed(direction.shared).under(jacobian))


def tangent_errors(direction: Direction, tangent: Array) -> tuple[Array, Packed]:
    """Errors of the unit vector of any direction: own covariance (3, 3), and columns (3, s).

    ``tangent`` (3,) is that unit vector, for directions whose errors lie in the plane of the lean.
    """
    if isinstance(direction, SphereDirection):
        return direction.own if direction.bow is SURE else direction.own + direction.bow, direction.packed
    lean, jacobian = Packed(direction.shared), tangent_jacobian(tangent)
    values = np.concatenate([lean.values, (jacobian @ lean.values)[2:]])
    return jacobian @ direction.cov @ jacobian.T, Packed.of_values(values, lean.places, lean.width)


def polar_variances(tangents: Array, covs: Array) -> tuple[Array, Array, Array]:
    """Variances of the inclination and across it, and squared leans (n,), of directions (n, 3) with covariances."""
    x, y, z = tangents.T
    squares = x * x + y * y
    axes = np.zeros((len(tangents), 2, 3))  # down along the inclination, and level
    axes[:, 0, 0], axes[:, 0, 1], axes[:, 0, 2] = x * z, y * z, -squares
    axes[:, 1, 0], axes[:, 1, 1] = -y, x
    axes /= np.sqrt(np.maximum(squares, UPRIGHT**2))[:, None, None]
    found = np.maximum(axes @ covs @ axes.transpose(0, 2, 1), 0.0)
    return found[:, 0, 0], found[:, 1, 1], squares


def stds_of_angles(tangents: Array, covs: Array) -> list[tuple[float, float]]:
    """Standard deviations (rad) of inclination and azimuth; the latter is at most pi, where nothing is known."""
    along, across, squares = polar_variances(tangents, covs)
    traces = 0.5 * np.trace(covs, axis1=1, axis2=2)
    found = []
    for row in zip(along.tolist(), across.tolist(), squares.tolist(), traces.tolist(), strict=True):
        inclination, level, square, trace = row
        if square < UPRIGHT**2:
            found.append((math.sqrt(trace), math.pi))
        else:
            found.append((math.sqrt(inclination), min(math.sqrt(level / square), math.pi)))
    return found


def stds_of_directions(directions: Sequence[Direction]) -> list[tuple[float, float]]:
    """Return ``stds_of_angles`` of directions."""
    found = [*map(on_sphere, directions)]
    return stds_of_angles(np.array([*map(TANGENT, found)]), np.array([one.tangent_cov for one in found]))


def yaw_variances(tangents: Array, covs: Array) -> Array:
    """What of covariances (n, 3, 3) is of a yaw (n,), rad^2: a force knows both axes across a tube alike."""
    along, across, squares = polar_variances(tangents, covs)
    found = np.maximum(across - along, 0.0) / np.maximum(squares, UPRIGHT**2)
    return np.minimum(found * (squares >= UPRIGHT**2), UNKNOWN_YAW_VAR)


def bows_of(tangents: Array, yaw_vars: Array) -> Array:
    """What a direction errs in space (n, 3, 3) as a yaw turns it on a circle; variances (n,), rad^2."""
    lean = tangents * [1.0, 1.0, 0.0]
    a = np.expm1(-0.5 * yaw_vars)  # without a difference of equals
    moment = np.minimum(a * a * (3.0 + 2.0 * a + 0.5 * a * a), AS_A_CIRCLE)
    return np.asarray(moment[:, None, None] * lean[:, :, None] * lean[:, None, :])
