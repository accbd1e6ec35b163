"""What the toe of a hole asks of its directions, linear functionals in metres a radian, and what looks make of both."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.looks import OF_TUBE, TURN

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]


def toe_weights(found: Adjusted) -> Array:
    """Change (s + 1, 2, 3) of the toe to north, east and down, m, for one radian of each direction across its axes.

    Every leg goes along the mean of the directions at its ends (balanced tangential method).
    """
    return leg_weights(found.path.md)[:, None, None] * found.linear.bases


def leg_weights(md: Array) -> Array:
    """Length (s + 1,) of the hole, m, that each direction stands for."""
    half = 0.5 * np.diff(md)
    return np.asarray(np.concatenate([half, [0.0]]) + np.concatenate([[0.0], half]))


def moved_looks(found: Adjusted, states: Array, common: Array, rows: Places | None = None) -> Array:
    """Change A x (n, 3, r) of all or some looks for unknowns x: states (s + 1, 4, r) and what is in common (p, r)."""
    looks, jacobians, further = found.looks, found.linear.jacobians, found.extra.columns
    if rows is not None:
        looks, jacobians, further = looks.part(rows), jacobians[rows], further[rows]
    count = OF_TUBE * found.string.count
    tubes = common[:count].reshape(found.string.count, OF_TUBE, -1)[looks.tube]
    tubes[:, TURN] += common[count + 1 + looks.make_up]
    moved = jacobians[:, :, :2] @ states[looks.station, :2] + jacobians[:, :, 2:8] @ tubes
    moved += jacobians[:, :, 8:9] * common[count] + further @ common[found.string.width :]
    return np.asarray(moved)
