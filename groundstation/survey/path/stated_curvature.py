"""The curvature of a hole of which nothing is known yet, as it is stated beforehand while it is drilled and after."""

from __future__ import annotations

STATED_CURVATURE_DEG = 0.3  # deg/m, standard deviation
STATED_LENGTH = 20.0  # m, over which it is forgotten
