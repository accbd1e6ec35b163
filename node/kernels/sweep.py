"""Running sums over slow turns of the tube, of each IMU: gravity's direction against the angle turned.

Gravity's direction is u = -f / |f|. The sums are in the place of the samples, so a turn of any length takes the same
memory; ``node.kernels.alignment`` finds the middle of the circle in them. What is complex is two numbers, real part
and imaginary part.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from node.kernels.circular import spin_of
from node.kernels.fixed.arithmetic import shift
from node.kernels.fixed.layout import ANGLE_Q, VECTOR_Q
from node.kernels.jit import kernel
from node.kernels.layout import Array
from node.kernels.numbers import by_type, fraction, length, times

FREEDOMS: Final = 6  # of the circle: middle, radius and phase, and their drift
LEAST_WEIGHT: Final = 0.2  # of that of as many samples without a turn: half a turn has less
MOST_SAMPLES: Final = 1 << 13  # the sums of the integers hold as many, of 20 turns
PRODUCT_Q: Final = 46  # of products of directions, in integers
SQUARE_Q: Final = 32  # of squares of angles, rad^2

SWEEP: Final = np.dtype(
    [
        ("samples", "i8"),  # cycles taken in
        ("sum", "f8", (3,)),  # sum of u, gravity's direction
        ("sum_products", "f8", (3, 3)),  # sum of u u^T
        ("sum_angle", "f8"),  # rad, sum of the angles turned
        ("sum_angle_squares", "f8"),  # rad^2, sum of their squares
        ("sum_spin", "f8", (2,)),  # sum of exp(i angle)
        ("sum_angle_spin", "f8", (2,)),  # sum of angle exp(i angle)
        ("sum_back", "f8", (3, 2)),  # sum of u exp(i angle)
        ("sum_angle_back", "f8", (3, 2)),  # sum of angle u exp(i angle)
        ("least", "f8", (2,)),  # least u_x and u_y
        ("largest", "f8", (2,)),  # largest u_x and u_y
        # work space
        ("u", "f8", (3,)),  # direction of gravity
        ("across", "f8", (3, 2)),  # row that gives what of a vector lies across the axis
    ],
    align=True,
)
OFFSET: Final = np.dtype(
    [
        ("axis", "f8", (3,)),  # unit vector, of the tube's axis in the IMU's frame
        ("pitch", "f8"),  # rad, of the offset
        ("roll", "f8"),  # rad, likewise
        ("pitch_std", "f8"),  # rad, standard error of the pitch
        ("roll_std", "f8"),  # rad, likewise of the roll
        ("lean", "f8"),  # rad, of the axis against the vertical
        ("lean_std", "f8"),  # rad, standard error of that
        ("noise", "f8"),  # rad, of one sample
    ],
    align=True,
)


@by_type(lambda a, b: shift(a * b, 2 * VECTOR_Q - PRODUCT_Q))
def fine_product(a: float, b: float) -> float:
    """Product of two numbers up to 1; integers in Q46, so that what noise leaves of a sum of them is not lost."""
    return a * b


def _angle_square(angle: int) -> int:
    part = shift(angle, ANGLE_Q - 24)
    return shift(part * part, 48 - SQUARE_Q)


@by_type(_angle_square)
def angle_square(angle: float) -> float:
    """The square of an angle of up to 20 turns."""
    return angle * angle


@kernel
def clear_sweep(sweep: Any) -> None:
    """Begin anew; the extremes begin with the first sample."""
    sweep.samples = 0
    sweep.sum_angle, sweep.sum_angle_squares = 0, 0
    for k in range(2):
        sweep.sum_spin[k], sweep.sum_angle_spin[k] = 0, 0
    for i in range(3):
        sweep.sum[i] = 0
        for k in range(2):
            sweep.sum_back[i, k], sweep.sum_angle_back[i, k] = 0, 0
        for j in range(3):
            sweep.sum_products[i, j] = 0


@kernel
def add_to_sweep(sweep: Any, force: Array, angle: float) -> None:
    """Take one mean specific force (3, m/s^2, IMU's frame), ``angle`` (rad) the turn so far in the middle of its cycle.

    With u = -f / |f|: sums of u, u u^T, and of the products of 1 and u with exp(i angle) and angle exp(i angle).
    """
    u = sweep.u
    size = length(force[0], force[1], force[2])
    spin = spin_of(angle)
    first = sweep.samples == 0
    sweep.samples += 1
    sweep.sum_angle += angle
    sweep.sum_angle_squares += angle_square(angle)
    for k in range(2):
        sweep.sum_spin[k] += spin[k]
        sweep.sum_angle_spin[k] += times(angle, spin[k])
    for i in range(3):
        u[i] = fraction(-force[i], size)
        sweep.sum[i] += u[i]
        for k in range(2):
            sweep.sum_back[i, k] += fine_product(u[i], spin[k])
            sweep.sum_angle_back[i, k] += times(times(angle, u[i]), spin[k])
    for i in range(3):
        for j in range(3):
            sweep.sum_products[i, j] += fine_product(u[i], u[j])
    for i in range(2):
        sweep.least[i] = u[i] if first else min(sweep.least[i], u[i])
        sweep.largest[i] = u[i] if first else max(sweep.largest[i], u[i])
