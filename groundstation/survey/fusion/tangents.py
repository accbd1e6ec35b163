"""Downhole unit vectors of directions, and how they follow from the lean. Frame: north, east, down."""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import attrgetter

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.resolve import Direction

Array = npt.NDArray[np.float64]
LEAST_DOWN = 1e-6  # of a level direction, whose lean does not show its errors up and down
LEAN, DOWN = map(attrgetter, ("lean", "down"))


def tangents_of(directions: Sequence[Direction]) -> Array:
    """Downhole unit vectors (n, 3)."""
    tangents = np.empty((len(directions), 3))
    if directions:
        tangents[:, :2], tangents[:, 2] = [*map(LEAN, directions)], [*map(DOWN, directions)]
    return tangents


def tangent_jacobian(tangent: Array) -> Array:
    """D tangent / d lean (3, 2) of a unit vector (3,); the vertical part follows from the unit length."""
    north, east, vertical = tangent.tolist()
    down = math.copysign(max(abs(vertical), LEAST_DOWN), vertical)
    return np.array([[1.0, 0.0], [0.0, 1.0], [-north / down, -east / down]])
