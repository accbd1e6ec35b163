"""What the scale errors of all gyroscopes have in common is the encoder's: a belt that slips, a disc of other counts.

An encoder that misses a part of every turn looks to one node like a gyroscope that shows too much: it is the same
equation, and no node can tell. Of many nodes each gyroscope errs by its own, so a scale that all share is not theirs.
The median of n scale errors of standard deviation s has one of sqrt(pi / (2 n)) s; one gyroscope that has failed does
not move it. Below ``FEWEST`` nodes nothing is said.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

SCALE_STD = 1e-3  # 1, of a gyroscope after its calibration: the prior of a node's filter
SIGMAS = 5.0
FEWEST = 3  # nodes
MAD_TO_STD = 1.4826  # of a normal distribution


@dataclass(frozen=True, slots=True)
class SharedScale:
    """Part ``by`` of every turn that the encoder counts less than all gyroscopes, its sigma, and their number."""

    by: float
    std: float
    nodes: int


def shared_scale(scales: Sequence[float]) -> SharedScale | None:
    """Return the scale error common to the gyroscopes of all nodes, or None where it is within chance.

    Parameters
    ----------
    scales : 1, of every node that has turned, as its filter estimates it; 0 is of one that has not, and is left out
    """
    learnt = [scale for scale in scales if scale != 0.0 and math.isfinite(scale)]
    if len(learnt) < FEWEST:
        return None
    middle = median(learnt)
    spread = MAD_TO_STD * median(abs(scale - middle) for scale in learnt)
    std = math.sqrt(math.pi / (2.0 * len(learnt))) * max(SCALE_STD, spread)
    return SharedScale(middle, std, len(learnt)) if abs(middle) > SIGMAS * std else None
