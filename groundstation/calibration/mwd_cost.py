"""The cost a calibration of the MWD tool makes small, with its gradient, its Hessian and its normal matrix.

E = sum e_g^2 + sum e_T^2, with e_g = |g| - reference size and e_T = angle(g, axis) - reference angle, g in units of
the reference (1 g, or the site's field), so that 1 mG and 1 mrad weigh alike. For the accelerometers the axis is the
tool's and the angle the tilt; for the magnetometers the axis is the vertical that the accelerometers show and the angle
is pi/2 minus the dip. The paper's own (16)-(20) are not at hand; these are the residuals they describe.
Where the reference angle is 0 or pi, e_T is the pair e_T (cos, sin) about the axis: the same square, without the cusp.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from groundstation.calibration.mwd_model import LOCAL, POWERS, LocalModel

Array = npt.NDArray[np.float64]
ON_AXIS = 1e-6  # rad, a reference angle nearer to 0 or pi is taken for it
STEEPEST = 100.0  # cot of the angle where the reference is off the axis but a reading lies on it
SPAN = 50.0  # C, of the reduced temperature theta = (T - Tc) / SPAN


@dataclass(frozen=True, slots=True)
class Terms:
    """Cost (16) and its derivatives by the parameters: gradient (k,), hessian and normal = J^T J (k, k)."""

    value: float
    gradient: Array
    hessian: Array
    normal: Array


@dataclass(frozen=True, slots=True)
class AxisGeometry:
    """Vectors (n, 3) about their axes: size, angle and distance from the axis (n,), unit vectors (n, 3)."""

    size: Array
    angle: Array
    across: Array
    radial: Array
    outward: Array  # from the axis
    tangent: Array  # of growing angle

    @classmethod
    def of(cls, vector: Array, axis: Array) -> AxisGeometry:
        """Spherical coordinates about ``axis`` (n, 3); on the axis itself any outward direction is as good."""
        size, along, outward, across = _split(vector, axis)
        on = across == 0.0
        if np.any(on):
            outward[on], across_or_one = _beside(axis[on]), np.where(on, 1.0, across)
        else:
            across_or_one = across
        outward = outward / across_or_one[:, None]
        tangent = (along[:, None] * outward - across[:, None] * axis) / size[:, None]
        return cls(size, np.arctan2(across, along), across, vector / size[:, None], outward, tangent)

    def around(self, axis: Array) -> Array:
        """(n, 3, 3) projector on the direction about the axis."""
        return np.asarray(np.eye(3) - _outer(axis, axis) - _outer(self.outward, self.outward))


@dataclass(frozen=True, slots=True)
class Problem:
    """Readings and references of one triad.

    ``w`` (n, 3) voltages over nominal scale and reference, ``theta`` (n,) reduced temperature, ``size`` and ``angle``
    (n,) references, ``axis`` (n, 3) unit, ``sign`` (3,) of the outputs, ``powers`` 1 or 4 of the temperature.
    Parameters x: s (3, powers), b (3, powers), m (6,), where sigma_i = sum s_ip theta^p and beta_i = sum b_ip theta^p.
    """

    w: Array
    theta: Array
    size: Array
    angle: Array
    axis: Array
    sign: Array
    powers: int

    def local(self, x: Array) -> LocalModel:
        """The model at parameters x."""
        p = self.powers
        t = np.vander(self.theta, p, increasing=True)
        s, b = x[: 3 * p].reshape(3, p), x[3 * p : 6 * p].reshape(3, p)
        return LocalModel.at(self.w, t @ s.T, t @ b.T, x[6 * p :], self.sign)

    def errors(self, x: Array) -> tuple[Array, Array]:
        """Residuals e_g and e_T (n,)."""
        size, along, _, across = _split(self.local(x).vector, self.axis)
        return size - self.size, np.arctan2(across, along) - self.angle

    def value(self, x: Array) -> float:
        """Cost."""
        e_g, e_t = self.errors(x)
        return float(e_g @ e_g + e_t @ e_t)

    def residuals(self, x: Array) -> Array:
        """Smooth residuals (4 n,) with the same sum of squares: e_g, and e_T or, on the axis, e_T times outward."""
        at = AxisGeometry.of(self.local(x).vector, self.axis)
        e_t = at.angle - self.angle
        three = np.where(self.on_axis()[:, None], at.outward, np.array([1.0, 0.0, 0.0])) * e_t[:, None]
        return np.column_stack([at.size - self.size, three]).ravel()

    def residual_jacobian(self, x: Array) -> Array:
        """Derivative of ``residuals`` (4 n, k)."""
        local = self.local(x)
        at = AxisGeometry.of(local.vector, self.axis)
        on_axis = self.on_axis()[:, None, None]
        lead = np.where(on_axis, at.outward[:, :, None], np.array([1.0, 0.0, 0.0])[:, None])
        turn = (self._swing(at) / at.size)[:, None, None] * at.around(self.axis)
        by_vector = lead * (at.tangent / at.size[:, None])[:, None, :] + np.where(on_axis, turn, 0.0)
        by_local = np.concatenate([at.radial[:, None, :], by_vector], axis=1) @ local.jacobian()
        index, power = parameter_layout(self.powers)
        t = np.vander(self.theta, self.powers, increasing=True)
        return np.asarray((by_local[:, :, index] * t[:, None, power]).reshape(-1, len(index)))

    def terms(self, x: Array) -> Terms:
        """Cost and its exact derivatives."""
        local = self.local(x)
        at = AxisGeometry.of(local.vector, self.axis)
        e_g, e_t = at.size - self.size, at.angle - self.angle
        by_size = _outer(at.radial, at.radial)
        slant = at.tangent / at.size[:, None]
        swing = at.around(self.axis) / at.size[:, None, None] ** 2
        single = by_size + _outer(slant, slant)
        normal = single + np.where(self.on_axis(), self._swing(at) ** 2, 0.0)[:, None, None] * swing
        bend_size = (np.eye(3) - by_size) / at.size[:, None, None]
        mixed = _outer(slant, at.radial) / at.size[:, None, None]
        bend_angle = e_t[:, None, None] * (mixed + np.swapaxes(mixed, 1, 2))
        second = single + e_g[:, None, None] * bend_size - bend_angle + self._lift(at, e_t)[:, None, None] * swing
        first = e_g[:, None] * at.radial + e_t[:, None] * slant
        jacobian = local.jacobian()
        across = np.swapaxes(jacobian, 1, 2)
        return Terms(
            float(e_g @ e_g + e_t @ e_t),
            2.0 * self._gather_first(np.einsum("nk,nka->na", first, jacobian)),
            2.0 * self._gather(across @ second @ jacobian + local.curvature(first)),
            self._gather(across @ normal @ jacobian),
        )

    def on_axis(self) -> npt.NDArray[np.bool_]:
        """Whether the reference angle is 0 or pi."""
        return np.asarray(np.minimum(self.angle, np.pi - self.angle) < ON_AXIS)

    def _swing(self, at: AxisGeometry) -> Array:
        """e_T / sin(angle), which tends to 1 or -1 on the axis."""
        e_t = at.angle - self.angle
        sine = at.across / at.size
        limit = np.where(self.angle < 1.0, 1.0, -1.0)
        return np.where(sine > 1e-8, e_t / np.maximum(sine, 1e-8), limit)

    def _lift(self, at: AxisGeometry, e_t: Array) -> Array:
        """e_T cot(angle), which tends to 1 on the axis and is held off where the cusp remains."""
        sine = at.across / at.size
        cotangent = np.cos(at.angle) / np.maximum(sine, 1.0 / STEEPEST)
        return np.where(self.on_axis(), self._swing(at) * np.cos(at.angle), e_t * cotangent)

    def _gather_first(self, each: Array) -> Array:
        """Sum of gradients (n, 12) by the local quantities as one by the parameters (k,)."""
        index, power = parameter_layout(self.powers)
        moments = np.vander(self.theta, self.powers, increasing=True).T @ each
        return np.asarray(moments[power, index])

    def _gather(self, each: Array) -> Array:
        """Sum of matrices (n, 12, 12) by the local quantities as one by the parameters (k, k).

        A parameter is a local quantity times theta^p, so only the moments sum theta^r h, r = 0..6, are needed.
        """
        index, power = parameter_layout(self.powers)
        t = np.vander(self.theta, 2 * self.powers - 1, increasing=True)
        moments = (t.T @ each.reshape(len(each), -1)).reshape(-1, LOCAL, LOCAL)
        return np.asarray(moments[power[:, None] + power, index[:, None], index])


@cache
def parameter_layout(powers: int = POWERS) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Local quantity and power of theta of each of the 12 or 30 parameters."""
    index = np.concatenate([np.repeat(np.arange(6), powers), 6 + np.arange(6)])
    power = np.concatenate([np.tile(np.arange(powers), 6), np.zeros(6, np.intp)])
    return index, power


def _split(vector: Array, axis: Array) -> tuple[Array, Array, Array, Array]:
    """Size, part along the axis, rest across it (n, 3) and its length."""
    along = np.einsum("nk,nk->n", vector, axis)
    rest = vector - along[:, None] * axis
    across = np.sqrt(np.einsum("nk,nk->n", rest, rest))
    return np.sqrt(np.einsum("nk,nk->n", vector, vector)), along, rest, across


def _outer(a: Array, b: Array) -> Array:
    return np.asarray(a[:, :, None] * b[:, None, :])


def _beside(axis: Array) -> Array:
    """Any unit vectors (n, 3) across the axes."""
    least = np.eye(3)[np.argmin(np.abs(axis), axis=1)]
    beside = np.cross(axis, least)
    return np.asarray(beside / np.linalg.norm(beside, axis=1)[:, None])
