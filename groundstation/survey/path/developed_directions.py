"""Directions of a hole rolled out into a plane, so that a curvature on two axes has a meaning at any inclination.

A frame of two axes across the hole is carried along it without turning about it. In that frame the change of the
direction from station to station is an angle on two axes, and their sum is the direction rolled out: its derivative is
the curvature of the hole, its length that of the dogleg.
Source: Bishop, "There is more than one way to frame a curve", Am. Math. Monthly 82 (1975). rad.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class DevelopedDirections:
    """Angles (n, 2) from the first station on, their covariances (n, 2, 2), and the axes (2, 3) at the last station."""

    angles: Array
    covs: Array
    axes: Array


def develop_directions(tangents: Array, covs: Array) -> DevelopedDirections:
    """Roll out the directions of a hole.

    Parameters
    ----------
    tangents, covs : (n, 3) unit vectors down the hole, and (n, 3, 3) the covariance of each

    Raises
    ------
    SurveyError
        Where the hole turns back on itself from one station to the next.
    """
    from groundstation.survey.path.kernels.frame_along import roll_out  # reading alone needs no compiler

    count = len(tangents)
    angles, across, axes = np.zeros((count, 2)), np.empty((count, 2, 2)), axes_across(tangents[0])
    if not roll_out(tangents, covs, axes, angles, across):
        raise SurveyError("path: expected directions that do not turn back on themselves from station to station")
    return DevelopedDirections(angles, across, axes)


def axes_across(tangent: Array) -> Array:
    """Two axes (2, 3) across a direction: north and east turned with it from straight down, north and west from up."""
    down = 1.0 if tangent[2] >= 0.0 else -1.0
    sense = np.array([0.0, 0.0, down])
    return (
        np.array([[1.0, 0.0, 0.0], [0.0, down, 0.0]])
        @ shortest_turn(np.cross(sense, tangent), float(sense @ tangent)).T
    )


def shortest_turn(turned: Array, cosine: float) -> Array:
    """Rotation (3, 3) by the shortest way, of the cross product (3,) of two unit vectors and their cosine."""
    x, y, z = turned.tolist()
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + skew + skew @ skew / (1.0 + cosine))
