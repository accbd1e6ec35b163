"""Euler angles phi, theta, psi by explicit Euler steps, and their six error states. Source: thesis eqs. 3.21-3.25.

An explicit step turns the tilt pair by w dt and lengthens it by sqrt(1 + (w dt)^2), 19 % at 71 deg/s, and its Jacobian
does the same to the variances. The angles are singular at theta = 90 degrees.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.filter.float64.propagation import BX, BY, BZ, PSI, TX, TY, symmetrise_covariance

# sin phi, cos phi, tan theta, 1 / cos theta, and the rates (rad/s) about the level axis and along the slope
Geometry: TypeAlias = tuple[float, float, float, float, float, float]
ATTITUDE = 3
ERRORS = 6


@kernel
def tilt_of(down: Array) -> tuple[float, float]:
    """Phi and theta (rad) of gravity's direction ``down`` (3, unit, body frame)."""
    return math.atan2(down[1], down[2]), math.asin(max(-1.0, min(-down[0], 1.0)))


@kernel
def point_down(down: Array, phi: float, theta: float) -> None:
    """Gravity's direction (3, unit, body frame) of phi and theta (rad), into ``down``."""
    down[0] = -math.sin(theta)
    down[1] = math.sin(phi) * math.cos(theta)
    down[2] = math.cos(phi) * math.cos(theta)


@kernel
def geometry_of(phi: float, theta: float, wy: float, wz: float) -> Geometry:
    """What rates and Jacobians have in common."""
    s, c = math.sin(phi), math.cos(phi)
    return s, c, math.tan(theta), 1.0 / math.cos(theta), wy * c - wz * s, wy * s + wz * c


@kernel
def euler_rates(wx: float, at: Geometry) -> tuple[float, float, float]:
    """Phi' = wx + (wy sin phi + wz cos phi) tan theta, theta', psi' (rad/s)."""
    _, _, tangent, secant, q, r = at
    return wx + r * tangent, q, r * secant


@kernel
def error_rates(phi: float, theta: float, bx: float, by: float, bz: float, at: Geometry) -> tuple[float, float, float]:
    """Rates of the errors of phi, theta and psi, linear in those of phi, theta (rad) and the three biases (rad/s)."""
    s, c, tangent, secant, q, r = at
    level = s * by + c * bz
    return (
        q * tangent * phi + r * secant * secant * theta - bx - tangent * level,
        -r * phi - (c * by - s * bz),
        secant * (q * phi + r * tangent * theta - level),
    )


@kernel
def propagate_covariance(P: Array, dt: float, at: Geometry, config: Any) -> None:
    """P- = F P F^T + G Q G^T in place over ``dt`` (s), on the six published states of ``P`` (8, 8).

    F = I + dt J with J the Jacobian of ``error_rates``, biases decay; G holds A on the rows of the attitude and B on
    those of the biases. Source: thesis eqs. 3.22-3.25, 4.14 and 4.15.
    """
    for j in range(ERRORS):
        a, b, c = error_rates(P[TX, j], P[TY, j], P[BX, j], P[BY, j], P[BZ, j], at)
        P[TX, j] += dt * a
        P[TY, j] += dt * b
        P[PSI, j] += dt * c
        for k in range(ATTITUDE):
            P[BX + k, j] *= math.exp(-dt / config.bias_tau[k])
    for i in range(ERRORS):
        a, b, c = error_rates(P[i, TX], P[i, TY], P[i, BX], P[i, BY], P[i, BZ], at)
        P[i, TX] += dt * a
        P[i, TY] += dt * b
        P[i, PSI] += dt * c
        for k in range(ATTITUDE):
            P[i, BX + k] *= math.exp(-dt / config.bias_tau[k])
    for k in range(ATTITUDE):
        g = error_rates(0.0, 0.0, 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0, at)
        walk = (config.attitude_factor * config.gyro_noise[k]) ** 2 * dt
        for i in range(ATTITUDE):
            for j in range(ATTITUDE):
                P[i, j] += walk * g[i] * g[j]
        decay = math.exp(-dt / config.bias_tau[k])
        P[BX + k, BX + k] += (config.bias_factor * config.bias_std[k]) ** 2 * (1.0 - decay * decay)
    symmetrise_covariance(P)
