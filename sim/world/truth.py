"""What a perfect sensor in a tube would read: body rates and specific force, derived from hole and motion.

The attitude of a tube is ``R_ned_from_body = R_min(tangent) R_z(psi)`` with psi the drive head's angle plus the joint
angles above, less the twist of the string; its body rate is ``psi' z - (1 - cos I) A' z + R^T (t x t')`` and its
specific force ``R^T (a - g)``.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from sim.world.borehole import Borehole
from sim.world.motion import Motion
from sim.world.moved_hole import MovedHole

Array = npt.NDArray[np.float64]
Along = tuple[Array, Array, Array]  # tangent, its time derivative, acceleration
Twist = Callable[[Array], tuple[Array, Array, Array]]
GAUSS_X, GAUSS_W = np.polynomial.legendre.leggauss(8)


def lean_rotation(tangent: Array) -> Array:
    """R_min (n, 3, 3): the smallest rotation that takes down to the tangents (n, 3)."""
    tx, ty, tz = tangent[:, 0], tangent[:, 1], tangent[:, 2]
    c = 1.0 / (1.0 + tz)
    rows = [
        [1.0 - c * tx * tx, -c * tx * ty, tx],
        [-c * tx * ty, 1.0 - c * ty * ty, ty],
        [-tx, -ty, tz],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def imu_frame(pitch: float, roll: float) -> Array:
    """R_imu_from_tube (3, 3) of an IMU that reads pitch and roll (rad) in a plumb tube; no turn about the axis."""
    axis = np.array([np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)])
    return np.asarray(lean_rotation(axis[None])[0])


class TubeTruth:
    """Perfect readings of one tube's IMU.

    Parameters
    ----------
    hole, motion : where and how it moves
    below : m of string below this node
    joint_angle : rad, constant part of psi in the IMU's frame
    radius : m, IMU off the axis along its x
    gravity : m/s^2
    twist : rad by which the tube lags the drive head at rig times (n,), with two derivatives; a rigid string has none
    unseen : rad by which the tube has slipped at rig times (n,), in jumps that no gyroscope sees
    moved : what becomes of the hole at a rig time, in a jump that no gyroscope sees
    """

    def __init__(
        self,
        hole: Borehole,
        motion: Motion,
        below: float,
        joint_angle: float,
        radius: float,
        gravity: float,
        twist: Twist | None = None,
        unseen: Callable[[Array], Array] | None = None,
        moved: MovedHole | None = None,
    ) -> None:
        self._hole, self._moved = hole, moved
        self._motion = motion
        self._below = below
        self._joint_angle = joint_angle
        self._radius = radius
        self._gravity = gravity
        self._twist = twist
        self._unseen = unseen

    def turned(self, t: Array) -> tuple[Array, Array, Array]:
        """Angle (rad, unwrapped, without the joints), rate and acceleration of the tube about its axis, (n,) each."""
        drive = self._motion.drive(t)
        if self._twist is None:
            return drive
        lag = self._twist(t)
        return drive[0] - lag[0], drive[1] - lag[1], drive[2] - lag[2]

    def yaw(self, t: Array) -> Array:
        """Psi of the IMU's frame (rad, unwrapped) at rig times (n,)."""
        slipped = 0.0 if self._unseen is None else self._unseen(t)
        return np.asarray(self.turned(t)[0] + self._joint_angle + slipped)

    def attitude(self, t: Array) -> Array:
        """R_ned_from_body (n, 3, 3)."""
        return self._attitude(t, self._along(t)[0])

    def rate(self, t: Array) -> Array:
        """Body rate (n, 3, rad/s)."""
        along = self._along(t)
        return self._rate(t, along, self._attitude(t, along[0]))

    def force(self, t: Array) -> Array:
        """Specific force (n, 3, m/s^2): gravity, motion along the path and the circle around the axis."""
        along = self._along(t)
        return self._force(t, along, self._attitude(t, along[0]))

    def rate_and_force(self, t: Array) -> tuple[Array, Array]:
        """Both at once: body rate (rad/s) and specific force (m/s^2), (n, 3) each."""
        along = self._along(t)
        attitude = self._attitude(t, along[0])
        return self._rate(t, along, attitude), self._force(t, along, attitude)

    def _attitude(self, t: Array, tangent: Array) -> Array:
        return np.asarray(lean_rotation(tangent) @ _turn(self.yaw(t)))

    def _rate(self, t: Array, along: Along, attitude: Array) -> Array:
        tangent, dtangent, _ = along
        turning = self.turned(t)[1]
        across = np.cross(tangent, dtangent)
        body: Array = np.einsum("nji,nj->ni", attitude, across)
        twist = (tangent[:, 0] * dtangent[:, 1] - tangent[:, 1] * dtangent[:, 0]) / (1.0 + tangent[:, 2])
        body[:, 2] = turning - twist
        return body

    def _force(self, t: Array, along: Along, attitude: Array) -> Array:
        acceleration = along[2] - np.array([0.0, 0.0, self._gravity])
        body: Array = np.einsum("nji,nj->ni", attitude, acceleration)
        _, rate, angular = self.turned(t)
        body[:, 0] -= self._radius * rate**2
        body[:, 1] += self._radius * angular
        return body

    def cycle_means(self, ends: Array, period: float) -> tuple[Array, Array]:
        """Mean rate and specific force (n, 3) over the cycles that end at ``ends`` (n,); the yaw increment is exact."""
        half = 0.5 * period
        nodes = (ends[:, None] - half + half * GAUSS_X[None, :]).ravel()
        weights = 0.5 * GAUSS_W
        along = self._along(nodes)
        attitude = self._attitude(nodes, along[0])
        rates, forces = self._rate(nodes, along, attitude), self._force(nodes, along, attitude)
        rate = np.einsum("ngk,g->nk", rates.reshape(len(ends), -1, 3), weights)
        force = np.einsum("ngk,g->nk", forces.reshape(len(ends), -1, 3), weights)
        spin = self.turned(nodes)[1].reshape(len(ends), -1) @ weights
        increment = self.turned(ends)[0] - self.turned(ends - period)[0]
        rate[:, 2] += increment / period - spin
        return rate, force

    def _along(self, t: Array) -> Along:
        """Tangent, its time derivative and the acceleration of the tube, each (n, 3)."""
        bit, speed, thrust = self._motion.depth(t)
        inside = bit > self._below  # before, the tube waits upright at the collar
        md = np.where(inside, bit - self._below, 0.0)
        tangent, curvature = self._hole.tangent(md)
        if self._moved is not None:
            later = t > self._moved.at
            tangent[later], curvature[later] = self._moved.hole.tangent(md[later])
        speed, thrust = speed * inside, thrust * inside
        acceleration = thrust[:, None] * tangent + speed[:, None] ** 2 * curvature
        return tangent, speed[:, None] * curvature, acceleration


def _turn(psi: Array) -> Array:
    c, s, zero = np.cos(psi), np.sin(psi), np.zeros_like(psi)
    return np.moveaxis(np.array([[c, -s, zero], [s, c, zero], [zero, zero, zero + 1.0]]), -1, 0)
