"""How far a hole may have left the arcs between its stations, anywhere along it: what ``leg_wander`` comes to in sum.

The stations' directions do not show it, so it is beside what their errors make. Each way across the hole alike.
Source: as ``leg_wander``; m.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.path.leg_wander import LegWander

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
NODES = 33  # along a leg, between which a standard deviation is blended


class HoleWander:
    """Variances of the path of a hole with stations at measured depths (n,), m.

    Parameters
    ----------
    md : of its stations, the first of which lies on the path
    wander : curvature of the path
    """

    def __init__(self, md: Array, wander: LegWander) -> None:
        self._shares = np.linspace(0.0, 1.0, NODES)
        self._stds = np.zeros((len(md) - 1, NODES))
        if wander.std == 0.0:
            return
        gathered = memory = 0.0
        for own, leg in zip(self._stds, np.diff(md).tolist(), strict=True):
            moments = [wander.moment(leg, share) for share in self._shares.tolist()]
            own[:] = np.sqrt([gathered + wander.grown(memory, moment) for moment in moments])
            gathered = float(own[-1]) ** 2
            memory = moments[-1].kept * memory + moments[-1].with_end

    def variances(self, leg: Indices, fraction: Array) -> Array:
        """Variance (k,) each way across the hole at fractions (k,) of legs."""
        place = fraction * (NODES - 1)
        node = np.clip(place.astype(np.intp), 0, NODES - 2)
        f = place - node
        return np.asarray(((1.0 - f) * self._stds[leg, node] + f * self._stds[leg, node + 1]) ** 2)
