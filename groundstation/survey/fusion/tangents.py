"""Downhole unit vectors of directions, and how they follow from the lean. Frame: north, east, down."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.resolve import Direction

Array = npt.NDArray[np.float64]
LEAN, DOWN = map(attrgetter, ("lean", "down"))


def tangents_of(directions: Sequence[Direction]) -> Array:
    """Downhole unit vectors (n, 3)."""
    tangents = np.empty((len(directions), 3))
    if directions:
        tangents[:, :2], tangents[:, 2] = [*map(LEAN, directions)], [*map(DOWN, directions)]
    return tangents


def tangent_jacobians(tangents: Array) -> Array:
    """D tangent / d lean (n, 3, 2); the vertical part follows from the unit length."""
    down = np.copysign(np.maximum(np.abs(tangents[:, 2]), 1e-6), tangents[:, 2])
    jacobians = np.zeros((len(tangents), 3, 2))
    jacobians[:, 0, 0] = jacobians[:, 1, 1] = 1.0
    jacobians[:, 2] = -tangents[:, :2] / down[:, None]
    return jacobians
