"""What stands on the lowest tube's last look alone: no other tube has read the last station yet.

A sensor that was knocked since its stop before last moves that direction and nothing speaks against it, but that holes
do not bend so. How far it may be off without being found is the external reliability of that one look (Baarda), and
is told beside the sigma, which is of honest sensors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.hypotheses import Hypothesis
from groundstation.survey.adjustment.least_found import LARGEST
from groundstation.survey.adjustment.reliability import measure_reliability
from groundstation.survey.adjustment.run_of_stops import RunOfStops
from groundstation.survey.adjustment.toe_weights import toe_weights

Array = npt.NDArray[np.float64]
OF_LOOK = (BlunderKind.BIAS_STEPPED, BlunderKind.TILT_SLIPPED, BlunderKind.MOUNT_TURNED)


@dataclass(frozen=True, slots=True)
class LastLook:
    """By how much a mistake of the tube that read the last station alone may move it without being found.

    Parameters
    ----------
    tube : its place
    md : m, of the station
    direction : rad, across its axis
    toe : m, level
    """

    tube: int
    md: float
    direction: float
    toe: float


def look_alone(found: Adjusted, run: RunOfStops, chance: float) -> LastLook | None:
    """What stands on one look alone at the last station; None where another tube has read it too.

    Parameters
    ----------
    found, run : the hole, adjusted
    chance : of a false alarm of one test, see ``measure_reliability``
    """
    looks, last = found.looks, len(found.path.md) - 1
    tubes = np.unique(looks.tube[looks.station == last])
    if len(tubes) != 1:
        return None
    tube = int(tubes[0])
    stop = int(looks.stop[(looks.station == last) & (looks.tube == tube)].min())
    weights = np.zeros((last + 1, 2, 5))
    weights[:, :, :3] = toe_weights(found)
    weights[last, [0, 1], [3, 4]] = 1.0
    possible = [Hypothesis(kind, (tube,), stop) for kind in OF_LOOK]
    told = measure_reliability(found, run, possible, weights, LARGEST, chance)
    north, east, _, first, second = np.max([one.unfound for one in told], axis=0).tolist()
    return LastLook(tube, float(found.path.md[last]), math.hypot(first, second), math.hypot(north, east))
