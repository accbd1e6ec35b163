"""What the toe of a hole asks of its directions: linear functionals, in metres a radian."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted

Array = npt.NDArray[np.float64]


def toe_weights(found: Adjusted) -> Array:
    """Change (s + 1, 2, 3) of the toe to north, east and down, m, for one radian of each direction across its axes.

    Every leg goes along the mean of the directions at its ends (balanced tangential method).
    """
    return leg_weights(found.path.md)[:, None, None] * found.linear.bases


def leg_weights(md: Array) -> Array:
    """Length (s + 1,) of the hole, m, that each direction stands for."""
    half = 0.5 * np.diff(md)
    return np.asarray(np.concatenate([half, [0.0]]) + np.concatenate([[0.0], half]))
