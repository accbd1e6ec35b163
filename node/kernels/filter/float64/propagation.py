"""Propagation of the error covariance: P- = F P F^T + G Q G^T, written out for the few terms of F that are not zero.

Source: thesis eqs. 3.22-3.28, 4.14 and 4.15 (the factors A and B), with a scale-factor and a time-stamp state added.
"""

from __future__ import annotations

import math
from typing import Any

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.record.filter_record import STATES, Err

TX, TY, PSI = kernel_constant(Err.TILT_X), kernel_constant(Err.TILT_Y), kernel_constant(Err.YAW)
BX, BY, BZ = kernel_constant(Err.BIAS_X), kernel_constant(Err.BIAS_Y), kernel_constant(Err.BIAS_Z)
S, D = kernel_constant(Err.SCALE), kernel_constant(Err.STAMP)


@kernel
def propagate_covariance(P: Array, wz: float, dt: float, turning: float, config: Any) -> None:
    """Covariance ``P`` (8, 8) in place over ``dt`` (s) at the spin ``wz`` (rad/s).

    ``turning`` is 1 while the gyroscope is integrated and 0 while still, when the rates are zero by knowledge.
    """
    c, s = math.cos(wz * dt * turning), math.sin(wz * dt * turning)
    step = dt * turning
    fx = math.exp(-dt / config.bias_tau[0])
    fy = math.exp(-dt / config.bias_tau[1])
    fz = math.exp(-dt / config.bias_tau[2])
    for j in range(STATES):
        tx, ty = P[TX, j], P[TY, j]
        P[TX, j] = c * tx + s * ty - step * P[BX, j]
        P[TY, j] = -s * tx + c * ty - step * P[BY, j]
        P[PSI, j] -= step * (P[BZ, j] + wz * P[S, j])
        P[BX, j] *= fx
        P[BY, j] *= fy
        P[BZ, j] *= fz
    for i in range(STATES):
        tx, ty = P[i, TX], P[i, TY]
        P[i, TX] = c * tx + s * ty - step * P[i, BX]
        P[i, TY] = -s * tx + c * ty - step * P[i, BY]
        P[i, PSI] -= step * (P[i, BZ] + wz * P[i, S])
        P[i, BX] *= fx
        P[i, BY] *= fy
        P[i, BZ] *= fz
    add_process_noise(P, dt, turning, fx, fy, fz, config)
    symmetrise_covariance(P)


@kernel
def add_process_noise(P: Array, dt: float, turning: float, fx: float, fy: float, fz: float, config: Any) -> None:
    """G Q G^T on the diagonal: Q = diag(sigma_w^2, 2 sigma_b^2 / tau), discretised exactly for the biases."""
    still = (1.0 - turning) * config.still_walk * config.still_walk * dt
    a = config.attitude_factor * config.attitude_factor * dt * turning
    b = config.bias_factor * config.bias_factor
    P[TX, TX] += a * config.gyro_noise[0] ** 2 + still
    P[TY, TY] += a * config.gyro_noise[1] ** 2 + still
    P[PSI, PSI] += a * config.gyro_noise[2] ** 2 + still
    P[BX, BX] += b * (1.0 - fx * fx) * config.bias_std[0] ** 2
    P[BY, BY] += b * (1.0 - fy * fy) * config.bias_std[1] ** 2
    P[BZ, BZ] += b * (1.0 - fz * fz) * config.bias_std[2] ** 2
    if config.stamp_std > 0.0:
        P[D, D] += config.stamp_walk * config.stamp_walk * dt


@kernel
def symmetrise_covariance(P: Array) -> None:
    """Make ``P`` (8, 8) symmetric to the last bit."""
    for i in range(STATES):
        for j in range(i):
            mean = 0.5 * (P[i, j] + P[j, i])
            P[i, j] = mean
            P[j, i] = mean
