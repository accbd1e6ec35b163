"""A turn of many degrees before it is sought: as the same stations show it in the looks with it and in those without.

From a turn that is far off a linear search need not come home, above all where a tilt is sought beside it: looks that
contradict each other count less, and some other turn with a large play may seem to fit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.hypotheses import BY_TURN, Hypothesis, effect_amplitudes
from groundstation.survey.adjustment.looks import Looks, PathPrior, StringPrior
from groundstation.survey.adjustment.run_of_stops import RunOfStops
from groundstation.survey.adjustment.starting_point import mean_directions, turns_of_looks

Array = npt.NDArray[np.float64]
Truths = npt.NDArray[np.bool_]
LARGE = 0.35  # rad, from which on a turn is not left to the search alone
FEWEST = 3  # looks at stations that others saw too
ALIKE = 0.9  # of what they come to one by one that they come to in sum, or they do not say one turn


def coarse_turns(
    looks: Looks, string: StringPrior, path: PathPrior, run: RunOfStops, sought: Sequence[Hypothesis]
) -> list[float]:
    """Turn (rad) of each blunder that is sought, zero where it is none, or none that is large and told."""
    found, yaw = [0.0] * len(sought), looks.yaw - turns_of_looks(looks, string, string.turn)
    amplitudes = [effect_amplitudes(one, looks, run) for one in sought]
    is_turn = [one.kind in BY_TURN for one in sought]
    is_spoilt = np.zeros(len(looks), bool)  # by something that is no turn
    for amplitude, turns in zip(amplitudes, is_turn, strict=True):
        is_spoilt |= (amplitude != 0.0) & (not turns)
    for place in np.flatnonzero(is_turn).tolist():
        found[place] = _turn_between(looks, yaw, path, amplitudes[place], is_spoilt)
        yaw -= found[place] * amplitudes[place]
    return found


def _turn_between(looks: Looks, yaw: Array, path: PathPrior, amplitude: Array, is_spoilt: Truths) -> float:
    """Turn (rad) by which looks with an amplitude (n,) of one, either way, stand off those without.

    Looks that are spoilt (n,) say it only where no others do.
    """
    is_turned = amplitude != 0.0
    if not is_turned.any() or not np.all(np.abs(amplitude[is_turned]) == 1.0):
        return 0.0
    is_seen = np.zeros(len(path.md), bool)
    is_seen[looks.station[~is_turned]] = True
    rows = np.flatnonzero(is_turned & is_seen[looks.station])
    if np.sum(~is_spoilt[rows]) >= FEWEST:
        rows = rows[~is_spoilt[rows]]
    if len(rows) < FEWEST:
        return 0.0
    tangents = mean_directions(looks, yaw, path, np.where(is_turned, 0.0, 1.0))[looks.station[rows]]
    seen = (looks.force[rows, 0] + 1j * looks.force[rows, 1]) * np.exp(1j * yaw[rows])
    turned = seen * (tangents[:, 0] - 1j * tangents[:, 1])
    turned = np.where(amplitude[rows] > 0.0, turned, turned.conj())
    whole = complex(turned.sum())
    turn = float(np.angle(whole))
    return turn if abs(turn) > LARGE and abs(whole) > ALIKE * float(np.abs(turned).sum()) else 0.0
