"""Integration of the body rates: gravity's direction in the body and the yaw about the tube axis.

The attitude is ``R_ned_from_body = R_min(I, A) R_z(psi)``: the smallest rotation that leans the axis, then the yaw.
It is regular at every inclination below 180 degrees, and its yaw is what the encoder turns. Source: thesis eq. 3.21
and Appendix II give the same kinematics in Euler angles, which are singular at 90 degrees and, stepped explicitly at
71 deg/s, grow by 19 % a step; docs/equations.md has the derivation.
"""

from __future__ import annotations

import math

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel


@kernel
def rotate_down(down: Array, wx: float, wy: float, wz: float, dt: float) -> None:
    """Turn gravity's direction ``down`` (3, unit, body frame) in place by the step of a body turning at w (rad/s).

    u' = -w x u, solved exactly over ``dt`` (s) by Rodrigues' formula, so that the spin neither grows nor shrinks it.
    """
    rate = math.sqrt(wx * wx + wy * wy + wz * wz)
    angle = rate * dt
    if angle < 1e-12:
        return
    ax, ay, az = wx / rate, wy / rate, wz / rate
    c, s = math.cos(angle), math.sin(angle)
    ux, uy, uz = down[0], down[1], down[2]
    along = (ax * ux + ay * uy + az * uz) * (1.0 - c)
    down[0] = c * ux - s * (ay * uz - az * uy) + along * ax
    down[1] = c * uy - s * (az * ux - ax * uz) + along * ay
    down[2] = c * uz - s * (ax * uy - ay * ux) + along * az
    norm = math.sqrt(down[0] ** 2 + down[1] ** 2 + down[2] ** 2)
    down[0] /= norm
    down[1] /= norm
    down[2] /= norm


@kernel
def yaw_rate(down: Array, wx: float, wy: float, wz: float) -> float:
    """Psi' = wz + (wx ux + wy uy) / (1 + uz), the rate (rad/s) of the yaw about the tube axis."""
    return float(wz + (wx * down[0] + wy * down[1]) / max(1.0 + down[2], 1e-3))
