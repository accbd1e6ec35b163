"""Angles of directions in one turn, for numbers and arrays alike; rad."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def wrap_angle(angle: Any) -> Any:
    """Angle in [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def wrap_azimuth(angle: Any) -> Any:
    """Angle in [0, 2 pi)."""
    turned = np.mod(angle, math.tau)
    return np.where(turned < math.tau, turned, 0.0)
