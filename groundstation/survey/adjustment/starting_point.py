"""Where an adjustment begins: directions and turns as the looks alone tell them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.looks import OF_TUBE, TURN, Looks, PathPrior, StartingPoint, StringPrior

Array = npt.NDArray[np.float64]
Truths = npt.NDArray[np.bool_]
KNOWN_TURN = 0.3  # rad, standard deviation of a turn beside that of the best up to which it is used as it is told


def first_start(looks: Looks, string: StringPrior, path: PathPrior) -> StartingPoint:
    """Directions from the looks whose yaw is known best; turns that are not known from what others saw there.

    Where a station has no look it goes on as the one above it.
    """
    turns = string.turn.copy()
    vars_of_looks = _vars_of_turns(looks, string)
    is_known = vars_of_looks <= KNOWN_TURN**2 + float(vars_of_looks.min(initial=np.inf))
    yaws = looks.yaw - turns_of_looks(looks, string, turns)
    tangents = mean_directions(looks, yaws, path, is_known.astype(np.float64))
    if not is_known.all():
        seen_there = np.bincount(looks.station[is_known], minlength=len(path.md)) > 0
        _find_turns(looks, string, turns, tangents, ~is_known & seen_there[looks.station])
        tangents = mean_directions(looks, looks.yaw - turns_of_looks(looks, string, turns), path, np.ones(len(looks)))
    tubes = np.zeros((string.count, OF_TUBE))
    tubes[:, TURN], make_ups = turns[: string.count], turns[string.count :]
    curvatures = np.zeros((len(path.md), 2))
    bends = path.curvature_std**2
    legs = np.full(len(path.md) - 1, bends)
    return StartingPoint(tangents, curvatures, tubes, make_ups, string.gravity, string.play_std**2, bends, legs)


def turns_of_looks(looks: Looks, string: StringPrior, turns: Array) -> Array:
    """Turn (n,), rad, of every look, of tubes and make-ups (m + u,)."""
    return turns[looks.tube] + turns[string.count + looks.make_up]


def _vars_of_turns(looks: Looks, string: StringPrior) -> Array:
    """Variance (n,), rad^2, of the turn of every look before."""
    cov, tube, make_up = string.turn_cov, looks.tube, string.count + looks.make_up
    return np.asarray(cov[tube, tube] + cov[make_up, make_up] + 2.0 * cov[tube, make_up])


def _find_turns(looks: Looks, string: StringPrior, turns: Array, tangents: Array, unknown: Truths) -> None:
    """Turn first tubes and then make-ups whose turn is wide so that some looks agree with the directions there."""
    seen = looks.force[:, 0] + 1j * looks.force[:, 1]
    there = (tangents[looks.station, 0] + 1j * tangents[looks.station, 1]) * np.exp(-1j * looks.yaw)
    wide = np.diag(string.turn_cov) > KNOWN_TURN**2
    for place in np.flatnonzero(wide).tolist():
        own = unknown & ((looks.tube == place) | (string.count + looks.make_up == place))
        others = np.exp(1j * turns_of_looks(looks, string, turns)[own])
        turns[place] += np.angle(np.sum(seen[own] * (there[own] * others).conj()))


def mean_directions(looks: Looks, yaws: Array, path: PathPrior, weights: Array) -> Array:
    """Weighted mean directions (s + 1, 3) of the looks at each station, with these yaws (n,) of their tubes."""
    turned = (looks.force[:, 0] + 1j * looks.force[:, 1]) * np.exp(1j * yaws)
    units = np.stack([turned.real, turned.imag, -looks.force[:, 2]], axis=1)
    units /= np.linalg.norm(units, axis=1, keepdims=True)
    trusted = weights / (np.sin(np.sqrt(np.minimum(looks.yaw_var, 2.0))) ** 2 + 1e-8)
    count = len(path.md)
    sums: Array = np.stack([np.bincount(looks.station, trusted * one, minlength=count) for one in units.T], axis=1)
    tangents: Array = np.empty_like(sums)
    tangents[0] = path.collar
    for k in range(1, len(sums)):
        size = float(np.linalg.norm(sums[k]))
        tangents[k] = sums[k] / size if size > 0.0 else tangents[k - 1]
    return tangents
