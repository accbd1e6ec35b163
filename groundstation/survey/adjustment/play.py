"""How far tubes lie askew in the hole, as what the looks leave tells it. Source: Foerstner 1979, with a prior."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from groundstation.survey.adjustment.adjusted import Adjusted

PLAY_KNOWN_AS = 4.0  # looks that the play before them counts for
TILTS = slice(5, 7)  # of the unknowns of a look
LEAST, MOST = 1e-14, 0.03  # rad^2


def learnt_play(found: Adjusted, before: float, known_as: float) -> float:
    """Variance (rad^2) of each axis of the play from what an adjustment with another one leaves; a step of iteration.

    Parameters
    ----------
    before, known_as : rad^2, variance before the looks, and the number of looks that this counts for
    """
    var = found.now.play_var
    tilts = found.linear.jacobians[:, :, TILTS]
    pulled = np.einsum("kab,kb->ka", found.linear.weights, found.left)
    seen = float(np.einsum("kai,ka->ki", tilts, pulled).ravel() @ np.einsum("kai,ka->ki", tilts, pulled).ravel())
    free = float(np.einsum("kai,kab,kbi->", tilts, found.redundancies, tilts))
    return float(np.clip((known_as * before + var * var * seen) / (known_as + var * free), LEAST, MOST))
