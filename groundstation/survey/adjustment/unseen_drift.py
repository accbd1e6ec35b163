"""What an encoder that slips a little at every stop may do to a hole without being found.

Each stop turns all readings alike, by more at each. Directions and joints take up most of that, and what they take up
moves the hole: with the change H of the looks by one radian a stop, the unknowns move by x = Q A^T W H and leave
H - A x to tell it, N = H^T W (H - A x). One is found from the non-centrality d^2 N on; below, the hole is off by d x,
which is told beside the sigma. Source: Baarda 1968, external reliability, as in ``reliability``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.least_found import LARGEST, possible_drift
from groundstation.survey.adjustment.reliability import least_noncentrality
from groundstation.survey.adjustment.run_of_stops import RunOfStops
from groundstation.survey.adjustment.scores import UNTOLD, columns_together, pulled_unknowns
from groundstation.survey.adjustment.toe_weights import moved_looks

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class UnseenDrift:
    """A drift of the encoder that is just not found.

    Parameters
    ----------
    a_stop : rad
    tangents, positions : (s + 1, 3), by how much it moves directions, and places, m, of the collar and every station
    """

    a_stop: float
    tangents: Array
    positions: Array

    @property
    def toe(self) -> float:
        """By how much (m) the toe is off, level."""
        return math.hypot(*self.positions[-1, :2].tolist())


def drift_unseen(found: Adjusted, run: RunOfStops, chance: float) -> UnseenDrift | None:
    """The largest drift that is not found, none larger than its kind may be; None before the third stop.

    Parameters
    ----------
    found, run : the hole, adjusted
    chance : of a false alarm of one test, see ``measure_reliability``
    """
    if not (drift := possible_drift(found.looks)):
        return None
    rows, columns = columns_together(found, run, drift)
    turned = columns[:, :, 0]
    weighed = found.linear.weights[rows] @ turned
    states, common = found.cofactor(*pulled_unknowns(found, rows, weighed))
    whole = float(np.sum(weighed * turned))
    free = float(np.sum(weighed * (turned - moved_looks(found, states, common, rows))))
    largest = LARGEST[BlunderKind.ENCODER_DRIFTS]
    is_told = free > UNTOLD * max(whole, 1e-300)
    a_stop = min(math.sqrt(least_noncentrality(1, chance) / free), largest) if is_told else largest
    tangents = a_stop * np.einsum("sai,sa->si", found.linear.bases, states[:, :2, 0])
    return UnseenDrift(a_stop, tangents, places_moved(found.path.md, tangents))


def places_moved(md: Array, tangents: Array) -> Array:
    """Change (s + 1, 3) of places, m, by a change of directions: legs go along the mean of those at their ends."""
    legs = 0.5 * np.diff(md)[:, None] * (tangents[1:] + tangents[:-1])
    return np.concatenate([np.zeros((1, 3)), np.cumsum(legs, axis=0)])
