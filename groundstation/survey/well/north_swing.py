"""What a north that is off does to a position beside moving it across: it goes on an arc, and so comes inward too.

A position at a distance p from the axis of the collar goes, for a turn psi of all azimuths, by p sin(psi) across and by
p (1 - cos(psi)), about p psi^2 / 2, inward. The second is no normal error, and where north is known to a degree or two
it is larger than all else along that direction. As one more column with the standard deviation ``INWARD`` p sigma^2 the
region of 95 % holds 93.4 % of positions that err by north alone, and more of all others; with the root mean square of
the inward way, 0.87 p sigma^2, it would hold 92 %.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
INWARD = 1.05  # of sigma^2


def inward_std(north_std: float) -> float:
    """Standard deviation of the inward way, in parts of the distance, of a north of a standard deviation (rad)."""
    return min(INWARD * north_std**2, 1.0)


def inward_covs(positions: Array, north_std: float) -> Array:
    """Covariances (..., 3, 3), m^2, of positions (..., 3), m, from the collar: along each, and level."""
    level = positions * np.array([1.0, 1.0, 0.0])
    return np.asarray(inward_std(north_std) ** 2 * level[..., :, None] * level[..., None, :])
