"""What the toe of a hole asks of its directions, linear functionals in metres a radian, and what looks make of both."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.kernels.observations import take_step

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
    looks, linear, further = found.looks, found.linear, found.extra.columns
    jacobians = linear.jacobians
    if rows is not None:
        looks, jacobians, further = looks.part(rows), jacobians[rows], further[rows]
    left, nothing = np.empty((common.shape[1], len(looks), 3)), np.zeros((len(looks), 3))
    for place, (own, its_common) in enumerate(zip(np.moveaxis(states, 2, 0), common.T, strict=True)):
        take_step(
            looks.station, looks.tube, looks.make_up, jacobians, nothing, further, linear.places, linear.gravity_at,
            np.ascontiguousarray(own), np.ascontiguousarray(its_common), left[place],
        )  # fmt: skip
    return np.ascontiguousarray(-np.moveaxis(left, 0, 2))
