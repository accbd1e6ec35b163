"""Angles of directions in one turn, for numbers and arrays alike, and axes across directions; rad."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
TINY = 1e-300  # of a squared lean, of a direction that is straight up


def wrap_angle(angle: Any) -> Any:
    """Angle in [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def wrap_azimuth(angle: Any) -> Any:
    """Angle in [0, 2 pi)."""
    turned = np.mod(angle, math.tau)
    return np.where(turned < math.tau, turned, 0.0)


def planes_across(tangents: Array) -> Array:
    """Two unit vectors (..., 2, 3) across directions (..., 3): north and east, tilted with the direction.

    They are high side and right turned back by the azimuth, so that they stay as they are where a plan passes the
    vertical. Straight up they are north and east again, and turn with the azimuth all about it.
    """
    x, y, z = tangents[..., 0], tangents[..., 1], tangents[..., 2]
    # 1 + z; beside straight up it is the small difference of numbers that are not, and the lean tells it whole
    apart = np.where(z < -0.5, np.maximum(x * x + y * y, TINY) / (1.0 - np.minimum(z, 0.0)), 1.0 + z)
    found = np.empty((*tangents.shape[:-1], 2, 3))
    found[..., 0, 0], found[..., 1, 1] = 1.0 - x * x / apart, 1.0 - y * y / apart
    found[..., 0, 1] = found[..., 1, 0] = -x * y / apart
    found[..., 0, 2], found[..., 1, 2] = -x, -y
    return found
