"""What a perfect sensor in a tube would read in the field: the motion of the grid, and the frame of a shaft.

A shaft without twist carries its frame along the hole by parallel transport: in a bent hole the yaw against the
smallest rotation is that of the head and ``gamma = integral of (1 - cos I) dA`` down to the tube, which the head does
not show. Source: R. L. Bishop, "There is more than one way to frame a curve", Am. Math. Monthly 82 (1975) 246.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.jit import kernel
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

    def rate_and_force(self, t: Array) -> tuple[Array, Array]:
        """Both at once: body rate (rad/s) and specific force (m/s^2), (n, 3) each; on the grid in one pass."""
        if t is not self._grid:
            return super().rate_and_force(t)
        rates, forces = np.empty((len(t), 3)), np.empty((len(t), 3))
        fill_rates_and_forces(
            self.yaw(t), *self._course[1:], *self._along(t), self._radius, self._gravity, rates, forces
        )
        return rates, forces


@kernel
def fill_rates_and_forces(
    yaw: Array,
    turning: Array,
    angular: Array,
    tangents: Array,
    slopes: Array,
    accelerations: Array,
    radius: float,
    gravity: float,
    rates: Array,
    forces: Array,
) -> None:
    """Fill ``rates`` and ``forces`` (n, 3) as ``TubeTruth`` has them: ``R^T v = R_z(psi)^T (R_min^T v)``.

    Parameters
    ----------
    yaw, turning, angular : (n,) psi, rad, and what the tube turns about its axis by, rad/s and rad/s^2
    tangents, slopes, accelerations : (n, 3) along the path, see ``TubeTruth``
    """
    for n in range(yaw.shape[0]):
        c, s = math.cos(yaw[n]), math.sin(yaw[n])
        x, y, z = tangents[n, 0], tangents[n, 1], tangents[n, 2]
        dx, dy, dz = slopes[n, 0], slopes[n, 1], slopes[n, 2]
        lean = 1.0 / (1.0 + z)
        across = (y * dz - z * dy, z * dx - x * dz, x * dy - y * dx)
        felt = (accelerations[n, 0], accelerations[n, 1], accelerations[n, 2] - gravity)
        for k, v in enumerate((across, felt)):
            out = rates if k == 0 else forces
            u = lean * (x * v[0] + y * v[1]) + v[2]
            a, b = v[0] - x * u, v[1] - y * u
            out[n, 0], out[n, 1] = c * a + s * b, c * b - s * a
            out[n, 2] = x * v[0] + y * v[1] + z * v[2]
        rates[n, 2] = turning[n] - across[2] * lean
        forces[n, 0] -= radius * turning[n] ** 2
        forces[n, 1] += radius * angular[n]


def transport_angle(hole: Borehole, depths: Array) -> Array:
    """Gamma (n,) rad at the depths (n,) m: what parallel transport turns against the smallest rotation from down."""
    md = np.linspace(0.0, hole.length, TRANSPORT_STEPS)
    tangent, slope = hole.tangent(md)
    turning = (tangent[:, 0] * slope[:, 1] - tangent[:, 1] * slope[:, 0]) / (1.0 + tangent[:, 2])
    area = np.concatenate([[0.0], np.cumsum(0.5 * (turning[1:] + turning[:-1]) * np.diff(md))])
    return np.asarray(np.interp(depths, md, area))
