"""What an encoder that slips a little at every stop may do to a hole without being found.

Each stop turns all readings alike, by more at each. Directions and joints take up most of that, and what they take up
moves the hole: with the change H of the looks by one radian a stop, the unknowns move by x = Q A^T W H and leave
N = H^T W (H - A x) to tell it. One is found from the non-centrality d^2 N on; below, the hole is off by d x, which is
told beside the sigma. Source: Baarda 1968, external reliability, as in ``reliability``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.hypotheses import FEWEST_TO_CREEP, turns_of_drift
from groundstation.survey.adjustment.least_found import DRIFT, LARGEST
from groundstation.survey.adjustment.looks import TURN
from groundstation.survey.adjustment.reliability import Reliability, least_noncentrality
from groundstation.survey.adjustment.scores import UNTOLD, pulled_unknowns

Array = npt.NDArray[np.float64]
TURNED = 2 + TURN  # column of a look's change by the turn of its tube: two of its station come before the tube's


@dataclass(frozen=True, slots=True)
class UnseenDrift:
    """A drift of the encoder that is just not found.

    Parameters
    ----------
    a_stop : rad, none larger than its kind may be
    smallest : rad, that is found; inf where nothing tells it
    tangents, positions : (s + 1, 3), by how much it moves directions, and places, m, of the collar and every station
    """

    a_stop: float
    smallest: float
    tangents: Array
    positions: Array

    @property
    def toe(self) -> float:
        """By how much (m) the toe is off, level."""
        return math.hypot(*self.positions[-1, :2].tolist())

    @property
    def reliability(self) -> Reliability:
        """The same as of other mistakes, of the toe to north, east and down."""
        by_one = np.abs(self.positions[-1]) / self.a_stop
        at_toe = by_one * self.smallest if math.isfinite(self.smallest) else np.full(3, np.inf)
        return Reliability(DRIFT, self.smallest, at_toe, by_one * LARGEST[DRIFT.kind])


def drift_unseen(found: Adjusted, chance: float) -> UnseenDrift | None:
    """The largest drift that is not found, none larger than its kind may be; None before the third stop.

    Parameters
    ----------
    found : the hole, adjusted
    chance : of a false alarm of one test, see ``measure_reliability``
    """
    looks, linear = found.looks, found.linear
    if len(np.unique(looks.stop)) <= FEWEST_TO_CREEP:
        return None
    turned = linear.jacobians[:, :, TURNED] * turns_of_drift(looks)[:, None]
    weighed = np.einsum("kab,kb->ka", linear.weights, turned)
    of_path, in_common = pulled_unknowns(found, np.arange(len(looks)), weighed[:, :, None])
    states, common = found.cofactor(of_path, in_common)
    whole = float(np.vdot(weighed, turned))
    free = whole - float(np.vdot(of_path, states[:, :2])) - float(np.vdot(in_common, common))
    is_told = free > UNTOLD * max(whole, 1e-300)
    smallest = math.sqrt(least_noncentrality(1, chance) / free) if is_told else math.inf
    a_stop = min(smallest, LARGEST[DRIFT.kind])
    tangents = a_stop * np.einsum("sai,sa->si", linear.bases, states[:, :2, 0])
    return UnseenDrift(a_stop, smallest, tangents, places_moved(found.path.md, tangents))


def places_moved(md: Array, tangents: Array) -> Array:
    """Change (s + 1, 3) of places, m, by a change of directions: legs go along the mean of those at their ends."""
    legs = 0.5 * np.diff(md)[:, None] * (tangents[1:] + tangents[:-1])
    return np.concatenate([np.zeros((1, 3)), np.cumsum(legs, axis=0)])
