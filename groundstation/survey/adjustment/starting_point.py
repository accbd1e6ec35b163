"""Where an adjustment begins: directions and turns as the looks alone tell them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.looks import OF_TUBE, TURN, Looks, PathPrior, StartingPoint, StringPrior

Array = npt.NDArray[np.float64]
KNOWN_TURN = 0.3  # rad, standard deviation of a turn up to which it is used as it is told


def first_start(looks: Looks, string: StringPrior, path: PathPrior) -> StartingPoint:
    """Directions from the looks whose yaw is known best; turns that nobody knows from what others saw there.

    Where a station has no look it goes on as the one above it.
    """
    tubes = np.zeros((string.count, OF_TUBE))
    tubes[:, TURN] = string.turn
    stds = np.sqrt(np.diag(string.turn_cov))
    is_known = stds <= max(KNOWN_TURN, 1.000001 * float(stds.min(initial=np.inf)))
    by_known = np.where(is_known[looks.tube], 1.0, 0.0)
    tangents = _mean_directions(looks, tubes, path, by_known)
    for tube in np.flatnonzero(~is_known).tolist():
        own = (looks.tube == tube) & (_counts(looks, path, by_known)[looks.station] > 0.0)
        seen = looks.force[own, 0] + 1j * looks.force[own, 1]
        there = (tangents[looks.station[own], 0] + 1j * tangents[looks.station[own], 1]) * np.exp(-1j * looks.yaw[own])
        turn = -np.angle(np.sum(seen * there.conj()))
        tubes[tube, TURN] = string.turn[tube] + np.angle(np.exp(1j * (turn - string.turn[tube])))
    if not is_known.all():
        tangents = _mean_directions(looks, tubes, path, np.ones(len(looks)))
    return StartingPoint(tangents, np.zeros((len(path.md), 2)), tubes, string.gravity, string.play_std**2)


def _counts(looks: Looks, path: PathPrior, weights: Array) -> Array:
    return np.asarray(np.bincount(looks.station, weights, minlength=len(path.md)), np.float64)


def _mean_directions(looks: Looks, tubes: Array, path: PathPrior, weights: Array) -> Array:
    """Weighted mean directions (s + 1, 3) of the looks at each station."""
    psi = looks.yaw - tubes[looks.tube, TURN]
    turned = (looks.force[:, 0] + 1j * looks.force[:, 1]) * np.exp(1j * psi)
    units = np.stack([turned.real, turned.imag, -looks.force[:, 2]], axis=1)
    units /= np.linalg.norm(units, axis=1, keepdims=True)
    trusted = weights / (np.sin(np.sqrt(np.minimum(looks.yaw_var, 2.0))) ** 2 + 1e-8)
    sums = np.stack([np.bincount(looks.station, trusted * one, minlength=len(path.md)) for one in units.T], axis=1)
    tangents = np.empty_like(sums)
    tangents[0] = path.collar
    for k in range(1, len(sums)):
        size = float(np.linalg.norm(sums[k]))
        tangents[k] = sums[k] / size if size > 0.0 else tangents[k - 1]
    return tangents
