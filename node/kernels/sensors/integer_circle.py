"""The circle of ``node.kernels.sensors.alignment.fit_along`` in integers, from the same sums.

The sums are taken as means, and angles in a unit of 2^h rad, h such that the mean of their squares is between 1/4 and
1: every number of the fit is then below 4 and in Q38. Nothing is divided before the end, so the determinants stand in
the denominators that they belong to.
"""

from __future__ import annotations

from typing import Any, Final

from numba import types

from node.kernels.arithmetic.formats import ANGLE_Q, PRODUCT_Q, SQUARE_Q, VECTOR_Q, Array
from node.kernels.arithmetic.integers import bit_length, mean_of, quotient_q30, root_of, rounded_shift
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.trigonometry import polar_coordinates
from node.kernels.sensors.sweep import FREEDOMS, LEAST_WEIGHT

FIT_Q: Final = 38
LARGEST: Final = 4 << FIT_Q  # of a factor
HALF_Q: Final = FIT_Q // 2
LOW: Final = (1 << HALF_Q) - 1
FINER: Final = FIT_Q - VECTOR_Q
LEAST_SPREAD: Final = 1 << (FIT_Q - 10)  # of the angles, against the mean of their squares
LEAST_RAISED: Final = -(1 << (VECTOR_Q - 1))  # z of an axis; below it the IMU would stand on its head
LEAST: Final = round(LEAST_WEIGHT * 2.0**FIT_Q)


def holds_integer_sums(sweep: Any, *_: Any) -> bool:
    """Whether a sweep is that of the integers."""
    return isinstance(sweep, types.Record) and isinstance(sweep.fields["sum_angle"].type, types.Integer)


@kernel
def product_q38(a: int, b: int) -> int:
    """Product of two numbers (Q38), each held at 4."""
    one, other = max(min(a, LARGEST), -LARGEST), max(min(b, LARGEST), -LARGEST)
    return rounded_shift(one * (other >> HALF_Q) + ((one * (other & LOW)) >> HALF_Q), HALF_Q)


@kernel
def quotient_q38(a: int, b: int) -> int:
    """The quotient (Q38) of a number by another above 0, held at 4."""
    if abs(a) >> 2 >= b:
        return LARGEST if a > 0 else -LARGEST
    whole = (a << 20) // b
    return (whole << (FIT_Q - 20)) + (((a << 20) - whole * b) << (FIT_Q - 20)) // b


@kernel
def complex_product(a: tuple[int, int], b: tuple[int, int]) -> tuple[int, int]:
    """The complex product a b."""
    return product_q38(a[0], b[0]) - product_q38(a[1], b[1]), product_q38(a[0], b[1]) + product_q38(a[1], b[0])


@kernel
def conjugate_product(a: tuple[int, int], b: tuple[int, int]) -> tuple[int, int]:
    """The complex product a* b."""
    return product_q38(a[0], b[0]) + product_q38(a[1], b[1]), product_q38(a[0], b[1]) - product_q38(a[1], b[0])


@kernel
def complex_combination(s: int, a: tuple[int, int], m: int, b: tuple[int, int]) -> tuple[int, int]:
    """The complex number s a - m b."""
    return product_q38(s, a[0]) - product_q38(m, b[0]), product_q38(s, a[1]) - product_q38(m, b[1])


@kernel
def mean_pair(total: Array, n: int, q: int) -> tuple[int, int]:
    """The mean (Q38) of a sum of complex numbers (2, Q``q``)."""
    return rounded_shift(mean_of(total[0], n), q - FIT_Q), rounded_shift(mean_of(total[1], n), q - FIT_Q)


@kernel
def set_transverse_axes(axis: Array, across: Array) -> None:
    """As ``node.kernels.sensors.alignment.look_along``, Q30."""
    pull = quotient_q30(1 << VECTOR_Q, (1 << VECTOR_Q) + axis[2])
    for k in range(2):
        across[0, k] = -rounded_shift(rounded_shift(pull * axis[0], VECTOR_Q) * axis[k], VECTOR_Q)
        across[1, k] = -rounded_shift(rounded_shift(pull * axis[1], VECTOR_Q) * axis[k], VECTOR_Q)
        across[2, k] = -axis[k]
    across[0, 0] += 1 << VECTOR_Q
    across[1, 1] += 1 << VECTOR_Q


@kernel
def look_at_sums(sweep: Any, n: int, wide: int) -> tuple[tuple[int, int], tuple[int, int], tuple[int, int], int]:
    """Means of q, q exp(i a) and a q exp(i a) across the axis, angles in 2^``wide`` rad, and of |q|^2."""
    across, squares = sweep.across, 0
    total, back, angle_back = (0, 0), (0, 0), (0, 0)
    for i in range(3):
        row = (across[i, 0] << FINER, across[i, 1] << FINER)
        u = mean_of(sweep.sum[i] << FINER, n)
        total = (total[0] + product_q38(row[0], u), total[1] + product_q38(row[1], u))
        own = complex_product(row, mean_pair(sweep.sum_back[i], n, PRODUCT_Q))
        back = (back[0] + own[0], back[1] + own[1])
        own = complex_product(row, mean_pair(sweep.sum_angle_back[i], n, ANGLE_Q + wide))
        angle_back = (angle_back[0] + own[0], angle_back[1] + own[1])
        for j in range(3):
            weight = conjugate_product(row, (across[j, 0] << FINER, across[j, 1] << FINER))[0]
            squares += product_q38(weight, rounded_shift(mean_of(sweep.sum_products[i, j], n), PRODUCT_Q - FIT_Q))
    return total, back, angle_back, squares


@kernel
def fit_in_integers(sweep: Any, offset: Any) -> int:
    """As ``node.kernels.sensors.alignment.fit_along``, with means in the place of sums: its n is 1."""
    n, axis = sweep.samples, offset.axis
    if 2 * n <= FREEDOMS or axis[2] < LEAST_RAISED:
        return 0
    mean_square = mean_of(sweep.sum_angle_squares, n)
    wide = max((bit_length(mean_square) - SQUARE_Q + 1) >> 1, 0)
    m, s = (
        rounded_shift(mean_of(sweep.sum_angle, n), ANGLE_Q + wide - FIT_Q),
        rounded_shift(mean_square, SQUARE_Q + 2 * wide - FIT_Q),
    )
    determinant = s - product_q38(m, m)
    if determinant < LEAST_SPREAD:
        return 0
    spin = (mean_of(sweep.sum_spin[0] << FINER, n), mean_of(sweep.sum_spin[1] << FINER, n))
    angle_spin = mean_pair(sweep.sum_angle_spin, n, ANGLE_Q + wide)
    first, second = (
        complex_combination(s, spin, m, angle_spin),
        complex_combination(1 << FIT_Q, angle_spin, m, spin),
    )  # det B^-1 v
    left_over = determinant - conjugate_product(spin, first)[0] - conjugate_product(angle_spin, second)[0]
    weight = quotient_q38(left_over, determinant)
    if weight <= LEAST:
        return 0
    set_transverse_axes(axis, sweep.across)
    total, back, angle_back, squares = look_at_sums(sweep, n, wide)
    pulled, drifting = conjugate_product(first, back), conjugate_product(second, angle_back)
    middle = (
        quotient_q38(product_q38(determinant, total[0]) - pulled[0] - drifting[0], left_over),
        quotient_q38(product_q38(determinant, total[1]) - pulled[1] - drifting[1], left_over),
    )
    around, around_drift = complex_product(middle, spin), complex_product(middle, angle_spin)
    left = (back[0] - around[0], back[1] - around[1])
    angle_left = (angle_back[0] - around_drift[0], angle_back[1] - around_drift[1])
    scaled, drifted = complex_combination(s, left, m, angle_left), complex_combination(1 << FIT_Q, angle_left, m, left)
    radius = (quotient_q38(scaled[0], determinant), quotient_q38(scaled[1], determinant))
    drift = (quotient_q38(drifted[0], determinant), quotient_q38(drifted[1], determinant))
    explained = (
        conjugate_product(middle, total)[0]
        + conjugate_product(radius, back)[0]
        + conjugate_product(drift, angle_back)[0]
    )
    var = (min(max(squares - explained, 0), LARGEST) * n // (2 * n - FREEDOMS)) << (2 * 28 - FIT_Q)
    offset.noise = root_of(var)
    offset.lean_std = root_of(mean_of(quotient_q30(var, weight >> FINER), n))
    write_circle_offset(
        sweep, offset, n, middle, (radius[0] + product_q38(drift[0], m), radius[1] + product_q38(drift[1], m))
    )
    return 1


@kernel
def write_circle_offset(sweep: Any, offset: Any, n: int, middle: tuple[int, int], radius: tuple[int, int]) -> None:
    """Leave the lean, and the middle as a direction (Q30) in the work space of the sweep."""
    axis, across, along = offset.axis, sweep.across, 0
    for i in range(3):
        along += product_q38(axis[i] << FINER, mean_of(sweep.sum[i] << FINER, n))
    offset.lean = polar_coordinates(abs(along), polar_coordinates(*radius)[1])[0]
    for i in range(3):
        beside = product_q38(middle[0], across[i, 0] << FINER) + product_q38(middle[1], across[i, 1] << FINER)
        sweep.u[i] = rounded_shift(product_q38(along, axis[i] << FINER) + beside, FINER)
