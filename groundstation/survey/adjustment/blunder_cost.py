"""What a blunder that was found costs at the toe: how far off it would be without it, and what leaving it open adds.

The adjustment has a blunder v as a further unknown. Without it the estimate is that under the condition v = 0, so the
toe x moves by C_xv C_vv^-1 v, and its covariance is smaller by C_xv C_vv^-1 C_vx.
Source: Koch, "Parameter Estimation and Hypothesis Testing in Linear Models", Springer (1999), 3.2.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.blunders import Blunder, Examination
from groundstation.survey.adjustment.taken_in import places_among_further
from groundstation.survey.adjustment.toe_weights import toe_weights

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class BlunderCost:
    """Of one blunder, to north, east and down.

    Parameters
    ----------
    moved : (3,) m, from where the toe would be told to be were it not known, to where it is told to be
    variances : (3,) m^2, that the toe has more because its size is not known
    """

    moved: Array
    variances: Array


def cost_blunders(examination: Examination) -> list[BlunderCost | None]:
    """Cost of every blunder that was found; None of one that is no further unknown.

    That is what has a known size, and a collar that was told wrong.
    """
    if not examination.blunders:
        return []
    found = examination.adjusted
    _, common = found.spread_of(toe_weights(found))
    taken_in, width = examination.taken_in, found.string.width
    places = dict(zip(taken_in, places_among_further(taken_in), strict=True))
    shared, cov = common[width:], found.common_cov[width:, width:]
    found_at = [[places[open_] for open_ in one.taken_in] for one in examination.blunders]
    return [
        _cost_of(one, np.concatenate([np.arange(at.start, at.stop) for at in own]), shared, cov)
        for one, own in zip(examination.blunders, found_at, strict=True)
    ]


def _cost_of(blunder: Blunder, at: Places, shared: Array, cov: Array) -> BlunderCost | None:
    """Cost of a blunder at these further unknowns: its own first, then those of the second of a doubt."""
    width = len(blunder.best.size)
    if not width or len(at) < width or blunder.best.hypothesis.kind is BlunderKind.COLLAR_WRONG:
        return None
    by_size = np.linalg.solve(cov[np.ix_(at, at)], shared[at])
    size = np.zeros(len(at))
    size[:width] = blunder.best.size
    return BlunderCost(size @ by_size, np.einsum("qr,qr->r", shared[at], by_size))
