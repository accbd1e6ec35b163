"""Products, quotients and roots of 64-bit integers, from 64-bit operations only.

A wide number (up to 62 bits) meets a factor of 31 bits: the product is taken in two halves and nothing is lost but
the last bit. Quotients and roots go through a normalised mantissa.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from node.kernels.arithmetic.jit import kernel

LOW31: Final = (1 << 31) - 1
HALF31: Final = 1 << 30
ROOTS: Final = np.array([0] * 64 + [round(2.0**30 / math.sqrt((k + 0.5) / 256.0)) for k in range(64, 256)], np.int64)


@kernel
def multiply_q31(wide: int, factor: int) -> int:
    """A k 2^-31 to the nearest, |a| < 2^62, |k| <= 2^31."""
    return (wide >> 31) * factor + (((wide & LOW31) * factor + HALF31) >> 31)


@kernel
def rounded_shift(value: int, right: int) -> int:
    """A 2^-right to the nearest; a negative ``right`` (at least -62) shifts left, and the result must fit."""
    if right <= 0:
        return value << -right
    if right > 62:
        return 0
    return (value + (1 << (right - 1))) >> right


@kernel
def clamp_and_count(record: Any, value: int, limit: int) -> int:
    """``value`` held within -limit..limit; what did not fit is counted in ``record.overflows``."""
    if value > limit:
        record.overflows += 1
        return limit
    if value < -limit:
        record.overflows += 1
        return -limit
    return value


@kernel
def bit_length(value: int) -> int:
    """Number of bits of ``value`` >= 0, 0 of 0."""
    count = 0
    for step in (32, 16, 8, 4, 2, 1):
        if value >> step != 0:
            value >>= step
            count += step
    return count + (1 if value != 0 else 0)


@kernel
def reciprocal_parts(value: int) -> tuple[int, int]:
    """Mantissa m in (2^30, 2^31] and exponent e with 1 / value = m 2^(-61 - e), value > 0."""
    exponent = bit_length(value) - 31
    return (1 << 61) // shift_down(value, exponent), exponent


@kernel
def shift_down(value: int, right: int) -> int:
    """A 2^-right, cut off, of either sign of ``right``: the exponent it was given stays exact."""
    return value >> right if right > 0 else value << -right


@kernel
def quotient_q30(wide: int, divisor: int) -> int:
    """A 2^30 / d to 30 bits, d > 0: the quotient by a Q30 number, in the format of ``wide``."""
    mantissa, exponent = reciprocal_parts(divisor)
    return rounded_shift(multiply_q31(wide, mantissa), exponent)


@kernel
def inverse_root(value: int) -> tuple[int, int]:
    """Mantissa m in [2^30, 2^31] and exponent e with 1 / sqrt(value) = m 2^(-61 - e), 0 < value < 2^62.

    y <- y (3 - x y^2) / 2, twice, from a table of 192 (8 bits, then 16, then 30).
    """
    exponent = (bit_length(value) - 61) >> 1
    x = value << (-2 * exponent)
    y = ROOTS[x >> 54]
    for _ in range(2):
        xyy = ((x >> 31) * ((y * y + HALF31 // 2) >> 30) + HALF31) >> 31
        y = (y * ((3 << 30) - xyy) + HALF31) >> 31
    return y, exponent


@kernel
def root_of(value: int) -> int:
    """Root of a variance (Q56) in Q40, below 2^62; of one that is not above 0 it is 0."""
    if value <= 0:
        return 0
    root, exponent = inverse_root(value)
    return rounded_shift(multiply_q31(value << (-2 * exponent), root), 18 - exponent)


@kernel
def mean_of(total: int, count: int) -> int:
    """A sum by its count, to the nearest."""
    return (total + (count >> 1)) // count
