"""The direction at the collar as it was told, beside what the stations below say of it.

No tube looks at the collar, and the hole may bend down to the first station as any path does. What the stations say of
it is their directions, carried up by what is known of the path; against that what was told is one more reading.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.equations import KNOWN
from groundstation.survey.adjustment.looks import PathPrior
from groundstation.survey.adjustment.scores import UNTOLD, best_sizes
from groundstation.survey.adjustment.sphere import bends_between

Array = npt.NDArray[np.float64]
WIDE_COLLAR = 0.5  # rad, of a collar that was told wrong, before the stations tell it


@dataclass(frozen=True, slots=True)
class CollarDeparture:
    """By how much (2,), rad, what was told stands off what the stations say, with its covariance (2, 2).

    ``squares`` is chi-square of two degrees of freedom in an honest hole, or zero of none where ``told`` is: nothing
    beside it tells the collar.
    """

    size: Array
    cov: Array
    squares: float
    told: int


def collar_departure(found: Adjusted) -> CollarDeparture:
    """Departure of the collar as it was told, in the axes of the collar of an adjustment."""
    bases = found.bases[0]
    ends = np.stack([found.now.tangents[0], found.path.collar])
    off = bends_between(ends, bases[None].repeat(2, axis=0))[0] - found.solution.states[0, :2]
    known = np.linalg.inv(bases @ found.path.collar_cov @ bases.T + KNOWN * np.eye(2))
    free = known - known @ found.covs[0, :2, :2] @ known
    sizes, _, told, squares = best_sizes((known @ off)[None], known[None], free[None])
    size = float(np.trace(known))
    cov = np.linalg.pinv(free, rcond=UNTOLD * size / max(float(np.trace(free)), 1e-300))
    return CollarDeparture(sizes[0], np.asarray(cov, np.float64), float(squares[0]), int(told[0]))


def untold_collar(path: PathPrior) -> PathPrior:
    """What is known of a path without what was told of its collar."""
    across = np.eye(3) - np.outer(path.collar, path.collar)
    return replace(path, collar_cov=path.collar_cov + WIDE_COLLAR**2 * across)
