"""Directions with their errors on the sphere, not in the plane of the lean."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.shared import Packed, packed_of

Array = npt.NDArray[np.float64]
LEVEL = np.eye(3)[:2]  # the lean of a unit vector


class SphereDirection(Direction):
    """Direction of a station with covariance and shared columns of its unit vector.

    It is regular at every inclination: that of a level hole moves up and down, which its lean does not show.
    """

    __slots__ = ("own", "packed")
    own: Array  # (3, 3), covariance of the unit vector that no other station shares
    packed: Packed  # (3, s) of the unit vector

    def __init__(self, tangent: Array, own: Array, packed: Packed) -> None:
        named = {"lean": tangent[:2], "down": float(tangent[2]), "cov": own[:2, :2], "own": own, "packed": packed}
        for name, value in named.items():
            object.__setattr__(self, name, value)

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


def tangent_errors(direction: Direction, jacobian: Array) -> tuple[Array, Packed, Array]:
    """Errors of the unit vector of any direction: own covariance (3, 3), lean columns, and vertical part (c,) of these.

    ``jacobian`` (3, 2) is that of the lean, for directions whose errors lie in its plane.
    """
    if isinstance(direction, SphereDirection):
        columns = direction.packed
        return direction.own, columns.under(LEVEL), columns.values[2].copy()
    columns = packed_of(direction)
    return jacobian @ direction.cov @ jacobian.T, columns, (jacobian @ columns.values)[2].copy()
