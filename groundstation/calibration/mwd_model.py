"""Model of the MWD tool: voltages and temperature to gravity, magnetic field, tilt and azimuth, with its derivatives.

Axes: C runs down the hole, A and B across it; X, Y, Z lie along A, B, C. A and B carry the specific force (up), C is
flipped, so (G_A, G_B, G_C) = (sin I cos t, -sin I sin t, cos I) at inclination I and tool face t, and tilt is 0..pi.
Source: drilling-tool paper, eqs. (1)-(12); in (12) the sign between the products inside the bracket is plus: the
printed minus makes azimuth depend on the tool face.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
REFERENCE_TEMPERATURE = 30.0  # C, Tc
POWERS = 4  # of the temperature polynomials
ROW = np.array([0, 0, 1, 1, 2, 2])  # of the misalignments m_AB, m_AC, m_BA, m_BC, m_CA, m_CB
COLUMN = np.array([1, 2, 0, 2, 0, 1])
LOCAL = 12  # quantities of one reading: sigma (3), beta (3), m (6)
ACCELEROMETER_AXES = "ABC"
MAGNETOMETER_AXES = "XYZ"


@dataclass(frozen=True, slots=True)
class Triad:
    """Thirty coefficients of three sensors.

    ``axes`` is ABC (accelerometers, g) or XYZ (magnetometers, microtesla); ``scale`` (3, 4) V per unit and C^p,
    ``bias`` (3, 4) unit per C^p, ``cross`` (6,) misalignments in the order AB AC BA BC CA CB. With twelve parameters
    only the first columns are filled.
    """

    axes: str
    scale: Array
    bias: Array
    cross: Array

    @property
    def signs(self) -> Array:
        """Signs of the three outputs: C of the accelerometers is flipped."""
        return axis_signs(self.axes)

    def coefficients(self) -> dict[str, float]:
        """The thirty values by name."""
        values = np.concatenate([self.scale.ravel(), self.bias.ravel(), self.cross])
        return dict(zip(coefficient_names(self.axes), values.tolist(), strict=True))

    @classmethod
    def of(cls, axes: str, coefficients: Mapping[str, float]) -> Triad:
        """Triad from its coefficients by name; an absent temperature coefficient is 0.

        Raises
        ------
        CalibrationError
            When one of the twelve is missing or a name is unknown.
        """
        known = coefficient_names(axes)
        unknown = sorted(set(coefficients) - set(known))
        missing = [name for name in coefficient_names(axes, LOCAL) if name not in coefficients]
        if unknown or missing:
            raise CalibrationError(f"coefficients of {axes}: missing {missing}, unknown {unknown}")
        values = np.array([coefficients.get(name, 0.0) for name in known])
        return cls(axes, values[:12].reshape(3, 4), values[12:24].reshape(3, 4), values[24:])


@dataclass(frozen=True, slots=True)
class Readings:
    """Calibrated readings: ``gravity`` (n, 3) g, ``field`` (n, 3), G_L, H_L, tilt and azimuth (n,) rad."""

    gravity: Array
    field: Array
    gravity_size: Array
    field_size: Array
    tilt: Array
    azimuth: Array


def axis_signs(axes: str) -> Array:
    """(3,) signs of the outputs of a triad. Source: eqs. (3)-(8)."""
    return np.array([1.0, 1.0, -1.0 if axes == ACCELEROMETER_AXES else 1.0])


def coefficient_names(axes: str, parameters: int = 30) -> list[str]:
    """Names of the 12 or 30 coefficients of a triad, ``SF_A0 .. SF_C3 B_A0 .. B_C3 m_AB .. m_CB``."""
    powers = range(1 if parameters == LOCAL else POWERS)
    polynomials = [f"{kind}_{axis}{p}" for kind in ("SF", "B") for axis in axes for p in powers]
    return polynomials + [f"m_{axes[i]}{axes[j]}" for i, j in zip(ROW, COLUMN, strict=True)]


def nominal_triad(axes: str, volts_per_unit: float) -> Triad:
    """Triad of the nominal tool: one scale factor, no bias, no misalignment."""
    scale = np.zeros((3, POWERS))
    scale[:, 0] = volts_per_unit
    return Triad(axes, scale, np.zeros((3, POWERS)), np.zeros(6))


def temperature_powers(temperature: Array, powers: int = POWERS) -> Array:
    """(n, powers) of (T - Tc)^p. Source: eqs. (1), (2)."""
    return np.asarray(np.vander(temperature - REFERENCE_TEMPERATURE, powers, increasing=True))


def mixing_matrix(cross: Array, sign: Array) -> Array:
    """(3, 3) matrix of G = mixing u: unit diagonal, minus the misalignments, rows times sign. Source: eqs. (3)-(8)."""
    matrix = np.eye(3, dtype=cross.dtype)
    matrix[ROW, COLUMN] = -cross
    return sign[:, None] * matrix


def vectors_of_volts(triad: Triad, volts: Array, temperature: Array) -> Array:
    """Gravity or field (n, 3) of voltages (n, 3) at temperatures (n,) C. Source: eqs. (1)-(8)."""
    t = temperature_powers(temperature)
    u = volts / (t @ triad.scale.T) - t @ triad.bias.T
    return np.asarray(u @ mixing_matrix(triad.cross, triad.signs).T)


def volts_of(triad: Triad, vector: Array, temperature: Array) -> Array:
    """Voltages (n, 3) a tool would show; the inverse of ``vectors_of_volts``."""
    t = temperature_powers(temperature)
    u = np.linalg.solve(mixing_matrix(triad.cross, triad.signs), vector.T).T
    return np.asarray((t @ triad.scale.T) * (u + t @ triad.bias.T))


def turned_triad(triad: Triad, angle: float) -> Triad:
    """The triad whose outputs are turned by ``angle`` (rad) from its first towards its second axis.

    The model is closed under this turn: with R the rotation and D = diag(R mixing) the misalignments become those of
    R mixing D^-1, SF -> SF / D, B -> D B. It is the freedom that tilt and |G| leave open.
    """
    c, s = np.cos(angle), np.sin(angle)
    sign = triad.signs
    mixed = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ mixing_matrix(triad.cross, sign)
    d = sign * np.diag(mixed)
    cross = -sign[ROW] * (mixed / d)[ROW, COLUMN]
    return Triad(triad.axes, triad.scale / d[:, None], triad.bias * d[:, None], cross)


def gravity_inclination(gravity: Array) -> Array:
    """Inclination (n,) in [0, pi] of gravity (n, 3). Source: eq. (11)."""
    return np.asarray(np.arctan2(np.hypot(gravity[:, 0], gravity[:, 1]), gravity[:, 2]))


def tool_face(gravity: Array) -> Array:
    """Angle (n,) of A from the high side, clockwise looking down the hole."""
    return np.asarray(np.arctan2(-gravity[:, 1], gravity[:, 0]))


def vertical_directions(gravity: Array) -> Array:
    """Unit vectors (n, 3) of the vertical in the body's axes X, Y, Z."""
    flipped = gravity * np.array([-1.0, -1.0, 1.0])
    return np.asarray(flipped / np.linalg.norm(gravity, axis=1)[:, None])


def magnetic_azimuth(gravity: Array, field: Array) -> Array:
    """Azimuth (n,) in [0, 2 pi) from magnetic north. Source: eq. (12), inner sign plus."""
    ga, gb, gc = gravity.T
    hx, hy, hz = field.T
    east = np.linalg.norm(gravity, axis=1) * (hx * gb - hy * ga)
    north = gc * (hx * ga + hy * gb) + hz * (ga * ga + gb * gb)
    angle = np.arctan2(east, north) % (2.0 * np.pi)
    return np.asarray(np.where(angle < 2.0 * np.pi, angle, 0.0))


def magnetic_dip(gravity: Array, field: Array) -> Array:
    """Angle (n,) of the field below the horizontal."""
    along = np.einsum("nk,nk->n", vertical_directions(gravity), field)
    return np.asarray(np.arctan2(along, np.linalg.norm(np.cross(vertical_directions(gravity), field), axis=1)))


def tool_readings(
    accelerometers: Triad, magnetometers: Triad, gravity_volts: Array, field_volts: Array, temperature: Array
) -> Readings:
    """Calibrated readings of voltages (n, 3) and temperatures (n,) C. Source: eqs. (1)-(12)."""
    gravity = vectors_of_volts(accelerometers, gravity_volts, temperature)
    field = vectors_of_volts(magnetometers, field_volts, temperature)
    sizes = np.linalg.norm(gravity, axis=1), np.linalg.norm(field, axis=1)
    return Readings(gravity, field, *sizes, gravity_inclination(gravity), magnetic_azimuth(gravity, field))


@dataclass(frozen=True, slots=True)
class LocalModel:
    """One reading's G as a function of its twelve local quantities z = (sigma_i, beta_i, m).

    u_i = w_i / (1 + sigma_i) - beta_i, where w = V / nominal, SF_i(T) = nominal (1 + sigma_i) and B_i(T) = beta_i;
    G = mixing(m) u. ``u``, ``slope`` = du_i/dsigma_i, ``bend`` = d2u_i/dsigma_i2 and ``vector`` are (n, 3);
    du_i/dbeta_i is -1 and every other derivative of u vanishes.
    """

    u: Array
    slope: Array
    bend: Array
    vector: Array
    matrix: Array
    sign: Array

    @classmethod
    def at(cls, w: Array, sigma: Array, beta: Array, cross: Array, sign: Array) -> LocalModel:
        """Values at w, sigma, beta (n, 3) and cross (6,)."""
        inverse = 1.0 / (1.0 + sigma)
        ratio = w * inverse
        matrix = mixing_matrix(cross, sign)
        u = ratio - beta
        return cls(u, -ratio * inverse, 2.0 * ratio * inverse * inverse, u @ matrix.T, matrix, sign)

    def jacobian(self) -> Array:
        """dG/dz (n, 3, 12)."""
        jacobian = np.zeros((len(self.u), 3, LOCAL), dtype=self.u.dtype)
        jacobian[:, :, :3] = self.matrix * self.slope[:, None, :]
        jacobian[:, :, 3:6] = -self.matrix
        jacobian[:, ROW, 6 + np.arange(6)] = -self.sign[ROW] * self.u[:, COLUMN]
        return jacobian

    def curvature(self, weight: Array) -> Array:
        """Sum over k of weight_k d2G_k/dz2 (n, 12, 12) for weights (n, 3)."""
        second = np.zeros((len(self.u), LOCAL, LOCAL), dtype=self.u.dtype)
        axis, cross = np.arange(3), 6 + np.arange(6)
        second[:, axis, axis] = (weight @ self.matrix) * self.bend
        pull = self.sign[ROW] * weight[:, ROW]
        second[:, cross, COLUMN] = second[:, COLUMN, cross] = -pull * self.slope[:, COLUMN]
        second[:, cross, 3 + COLUMN] = second[:, 3 + COLUMN, cross] = pull
        return second
