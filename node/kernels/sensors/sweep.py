"""Running sums over slow turns of the tube, of each IMU: gravity's direction against the angle turned.

Gravity's direction is u = -f / |f|. The sums are in the place of the samples, so a turn of any length takes the same
memory; ``node.kernels.sensors.alignment`` finds the middle of the circle in them. What is complex is two numbers, real
part and imaginary part.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.circular import spin_of
from node.kernels.arithmetic.formats import ANGLE_Q, PRODUCT_Q, SQUARE_Q, VECTOR_Q, Array
from node.kernels.arithmetic.integers import rounded_shift
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import bounded_ratio, by_type, times_factor, vector_length

FREEDOMS: Final = 6  # of the circle: middle, radius and phase, and their drift
LEAST_WEIGHT: Final = 0.2  # of that of as many samples without a turn: half a turn has less
MOST_SAMPLES: Final = 1 << 13  # the sums of the integers hold as many, of 20 turns


@by_type(lambda a, b: rounded_shift(a * b, 2 * VECTOR_Q - PRODUCT_Q))
def fine_product(a: float, b: float) -> float:
    """Product of two numbers up to 1; integers in Q46, so that what noise leaves of a sum of them is not lost."""
    return a * b


def _angle_square(angle: int) -> int:
    part = rounded_shift(angle, ANGLE_Q - 24)
    return rounded_shift(part * part, 48 - SQUARE_Q)


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
    size = vector_length(force[0], force[1], force[2])
    spin = spin_of(angle)
    first = sweep.samples == 0
    sweep.samples += 1
    sweep.sum_angle += angle
    sweep.sum_angle_squares += angle_square(angle)
    for k in range(2):
        sweep.sum_spin[k] += spin[k]
        sweep.sum_angle_spin[k] += times_factor(angle, spin[k])
    for i in range(3):
        u[i] = bounded_ratio(-force[i], size)
        sweep.sum[i] += u[i]
        for k in range(2):
            sweep.sum_back[i, k] += fine_product(u[i], spin[k])
            sweep.sum_angle_back[i, k] += times_factor(times_factor(angle, u[i]), spin[k])
    for i in range(3):
        for j in range(3):
            sweep.sum_products[i, j] += fine_product(u[i], u[j])
    for i in range(2):
        sweep.least[i] = u[i] if first else min(sweep.least[i], u[i])
        sweep.largest[i] = u[i] if first else max(sweep.largest[i], u[i])
