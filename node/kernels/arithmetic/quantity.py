"""Quantities in two forms: a constant is a float that knows its integer, and takes the form of what it meets.

What stands around the filter is written once. Compiled over the float64 record a number is in SI units and radians;
compiled over the integers it is in the Q format of what it measures:

==========  =============================  ======  ============================
quantity    of the floats                  Q       range of the integers
==========  =============================  ======  ============================
time        s                              28      2^32 s, and ``NEVER``
rate        rad/s                          46      32 rad/s
angle       rad                            40      2^20 rad; a square to 4 rad
force       m/s^2                          26      32 g; the unit is g
variance    rad^2                          56      12 rad^2
            (rad/s)^2                      68      (3.1 deg/s)^2
            s^2, of a clock                56      16 s^2
factor      1                              30      2, where it multiplies
temperature C                              23      256 C
==========  =============================  ======  ============================

Sums, comparisons and products with small whole numbers are those of the language for both; for products, quotients
and roots of quantities see ``node.kernels.arithmetic.operations``.

What it buys: one source for both arithmetics, and no speed. The modules around the filter (sensors, string, turns,
step) would stand there twice, and a rule be changed in one of them.
"""

from __future__ import annotations

import math
from typing import Any, Final

from numba import types
from numba.extending import typeof_impl

from node.kernels.arithmetic.compiler import ConstantType, is_argument
from node.kernels.arithmetic.formats import ANGLE_Q, FORCE_Q, NEVER, RATE_Q, TIME_Q, VAR_Q, VECTOR_Q

NO_NUMBER: Final = 1 << 60  # in integers, where a float is NaN
RATE_VAR_Q: Final = VAR_Q + 12  # (rad/s)^2
WARMTH_Q: Final = VECTOR_Q - 7  # C
STANDARD_GRAVITY: Final = 9.80665


class Constant(float):
    """A float, and the integer that stands for it in the format of its quantity."""

    fixed: int

    def __new__(cls, value: float, fixed: int) -> Constant:
        """Of a float and its integer."""
        made = super().__new__(cls, value)
        made.fixed = fixed
        return made


@typeof_impl.register(Constant)
def _type_of(value: Constant, context: Any) -> Any:
    """In a kernel it is a constant; Python hands it to one as the float that it is."""
    if is_argument(context):
        return types.float64
    return ConstantType(float(value), value.fixed)


def quantity_in_q(value: float, q: int) -> Constant:
    """A constant in Q``q``."""
    return Constant(value, round(value * 2.0**q))


def time_quantity(value: float) -> Constant:
    """A time."""
    return quantity_in_q(value, TIME_Q)


def rate_quantity(value: float) -> Constant:
    """An angular rate, rad/s."""
    return quantity_in_q(value, RATE_Q)


def angle_quantity(value: float) -> Constant:
    """An angle, rad."""
    return quantity_in_q(value, ANGLE_Q)


def force_quantity(value: float) -> Constant:
    """A specific force, m/s^2; in integers by standard gravity."""
    return Constant(value, round(value / STANDARD_GRAVITY * 2.0**FORCE_Q))


def variance_quantity(value: float) -> Constant:
    """A variance, rad^2, or s^2 of a clock."""
    return quantity_in_q(value, VAR_Q)


def rate_variance_quantity(value: float) -> Constant:
    """A variance of a rate, (rad/s)^2."""
    return quantity_in_q(value, RATE_VAR_Q)


def temperature_quantity(value: float) -> Constant:
    """A temperature, C; in integers it counts 128 C, so that it is a factor."""
    return quantity_in_q(value, WARMTH_Q)


def factor_quantity(value: float) -> Constant:
    """A number without a unit, -2..2 where it multiplies."""
    return quantity_in_q(value, VECTOR_Q)


NONE: Final = Constant(math.nan, NO_NUMBER)  # no number
LONG_AGO: Final = Constant(-math.inf, NEVER)  # a time before all others
NOT_YET: Final = Constant(math.nan, NEVER)  # a time that has not been
ONE: Final = factor_quantity(1.0)
