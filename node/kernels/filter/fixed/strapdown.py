"""Integration of the body rates in integers; its reasons are in ``float64.strapdown``."""

from __future__ import annotations

from typing import Final

from node.kernels.arithmetic.formats import STEP_Q, VECTOR_Q, Array
from node.kernels.arithmetic.integers import inverse_root, multiply_q31, quotient_q30, rounded_shift
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.trigonometry import TURN, radians_to_counts, sine_cosine

ONE: Final = 1 << VECTOR_Q
HALF: Final = 1 << (VECTOR_Q - 1)
HALVED: Final = STEP_Q + 1 - VECTOR_Q  # from rad to half of it in Q30
LEAST: Final = round(1e-3 * 2.0**VECTOR_Q)  # of 1 + uz


@kernel
def half_turn(wx: int, wy: int, wz: int, dt: int) -> tuple[int, int, int, int, int]:
    """Axis (3, Q30) and sine and cosine (Q30) of the rotation by w dt/2.

    Parameters
    ----------
    wx, wy, wz : rad/s, Q46, up to 32
    dt : s, Q28, up to 8
    """
    x, y, z = (
        rounded_shift(multiply_q31(wx, dt), HALVED),
        rounded_shift(multiply_q31(wy, dt), HALVED),
        rounded_shift(multiply_q31(wz, dt), HALVED),
    )
    q = 30
    while max(abs(x), abs(y), abs(z)) >= ONE:
        x, y, z, q = x >> 1, y >> 1, z >> 1, q - 1
    square = x * x + y * y + z * z
    if square == 0:
        return 0, 0, ONE, 0, ONE
    root, exponent = inverse_root(square)
    binary = radians_to_counts(rounded_shift(multiply_q31(square, root), exponent + q - 15), 45)
    sine, cosine = sine_cosine(binary & TURN)
    right = 31 + exponent
    return rounded_shift(x * root, right), rounded_shift(y * root, right), rounded_shift(z * root, right), sine, cosine


@kernel
def rotate_down(down: Array, ax: int, ay: int, az: int, s: int, c: int) -> None:
    """Turn ``down`` (3, Q30) in place: u' = c u - s (a x u) + (1 - c) (a . u) a, Rodrigues' formula.

    Parameters
    ----------
    ax, ay, az : axis, Q30
    s, c : sine and cosine of the angle, Q30
    """
    ux, uy, uz = down[0], down[1], down[2]
    along = (((ax * ux + ay * uy + az * uz + HALF) >> 30) * (ONE - c) + HALF) >> 30
    down[0] = (c * ux - s * ((ay * uz - az * uy + HALF) >> 30) + along * ax + HALF) >> 30
    down[1] = (c * uy - s * ((az * ux - ax * uz + HALF) >> 30) + along * ay + HALF) >> 30
    down[2] = (c * uz - s * ((ax * uy - ay * ux + HALF) >> 30) + along * az + HALF) >> 30
    square = (down[0] * down[0] + down[1] * down[1] + down[2] * down[2] + HALF) >> 30
    scale = (3 * ONE - square) >> 1  # 1 / |u| to second order: a rotation leaves |u| at 1 but for rounding
    for k in range(3):
        down[k] = (down[k] * scale + HALF) >> 30


@kernel
def normalise_down(down: Array) -> None:
    """Make ``down`` (3, below 2^30 each by a shift) a unit vector in Q30."""
    largest = max(abs(down[0]), abs(down[1]), abs(down[2]))
    while largest >= ONE:
        largest >>= 1
        for k in range(3):
            down[k] >>= 1
    square = down[0] * down[0] + down[1] * down[1] + down[2] * down[2]
    if square == 0:
        down[2] = ONE
        return
    root, exponent = inverse_root(square)
    for k in range(3):
        down[k] = rounded_shift(down[k] * root, 31 + exponent)


@kernel
def yaw_rate(down: Array, wx: int, wy: int, wz: int) -> int:
    """Psi' = wz + (wx ux + wy uy) / (1 + uz), rad/s in Q46, with ``down`` (3) in Q30."""
    across = multiply_q31(wx, down[0] << 1) + multiply_q31(wy, down[1] << 1)
    return wz + quotient_q30(across, max(ONE + down[2], LEAST))
