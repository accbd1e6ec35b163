"""What a perfect sensor in a tube would read in the field: the motion of the grid, and the frame of a shaft.

A shaft without twist carries its frame along the hole by parallel transport: in a bent hole the yaw against the
smallest rotation is that of the head and ``gamma = integral of (1 - cos I) dA`` down to the tube, which the head does
not show. Source: R. L. Bishop, "There is more than one way to frame a curve", Am. Math. Monthly 82 (1975) 246.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from sim.world.borehole import Borehole
from sim.world.truth import TubeTruth

Array = npt.NDArray[np.float64]
TRANSPORT_STEPS = 4000  # along the hole


class RoughTruth(TubeTruth):
    """Perfect readings of one tube's IMU.

    Parameters
    ----------
    grid, angle : (n,) s and rad, rig time and angle of the tube against its joints
    given : what ``TubeTruth`` takes
    """

    def __init__(self, grid: Array, angle: Array, *given: Any) -> None:
        super().__init__(*given)
        step = float(grid[1] - grid[0])
        rate = np.gradient(angle, step)
        self._grid, self._course = grid, (angle, rate, np.gradient(rate, step))

    def turned(self, t: Array) -> tuple[Array, Array, Array]:
        """Angle (rad, unwrapped, without the joints), rate and acceleration of the tube about its axis, (n,) each."""
        if t is self._grid:
            return self._course
        angle, rate, acceleration = (np.interp(t, self._grid, values) for values in self._course)
        return angle, rate, acceleration


def transported(hole: Borehole, depths: Array) -> Array:
    """Gamma (n,) rad at the depths (n,) m: what parallel transport turns against the smallest rotation from down."""
    md = np.linspace(0.0, hole.length, TRANSPORT_STEPS)
    tangent, slope = hole.tangent(md)
    turning = (tangent[:, 0] * slope[:, 1] - tangent[:, 1] * slope[:, 0]) / (1.0 + tangent[:, 2])
    area = np.concatenate([[0.0], np.cumsum(0.5 * (turning[1:] + turning[:-1]) * np.diff(md))])
    return np.asarray(np.interp(depths, md, area))
