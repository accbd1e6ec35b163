"""Operations on quantities, for two arithmetics: the source around the filter is one, and numba takes these by type.

For floats each is the plain expression, to the last bit. For integers it is what stands beside it in integers, in the
formats of ``node.kernels.arithmetic.quantity``; an argument beyond its range is held, so that nothing overflows.

What it buys is that of ``node.kernels.arithmetic.quantity``: one source, and no speed. A call that numba takes by type
is the code of the function taken.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final, TypeVar

from numba import types
from numba.extending import overload

from node.kernels.arithmetic.compiler import NO_WRAPPER
from node.kernels.arithmetic.formats import ANGLE_Q, CEILING, PERIOD, RATE_Q, TIME_Q, VECTOR_Q, Array
from node.kernels.arithmetic.integers import mean_of, multiply_q31, quotient_q30, root_of, rounded_shift
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.quantity import NO_NUMBER
from node.kernels.arithmetic.trigonometry import TURN, counts_difference, counts_to_radians, radians_to_counts

Function = TypeVar("Function", bound=Callable[..., Any])
OPTIONS: Final[Any] = {"error_model": "numpy", **NO_WRAPPER}
LARGEST: Final = 1 << 61
TWO: Final = 1 << 31
UNITY: Final = 1 << VECTOR_Q
LARGEST_SQUARED: Final = 1 << 42  # 4 rad, or 3.6 deg/s
FASTEST: Final = 1024 << RATE_Q
LONGEST: Final = 1 << 40  # s, Q28, of a turn
SHORTEST: Final = 1 << (TIME_Q - 10)  # s, 1 ms, of a quotient
STAMP_CEILING: Final = CEILING >> 12
SCALE_CEILING: Final = CEILING >> 8
PERIOD_FIXED: Final = round(PERIOD * 2.0**TIME_Q)


def taken_where(holds: Callable[..., bool], integers: Callable[..., Any]) -> Callable[[Function], Function]:
    """Have numba take ``integers`` in the place of a function where the types of its arguments say so."""
    own = getattr(integers, "py_func", integers)  # of a kernel, which numba would not take

    def declare(plain: Function) -> Function:
        overload(plain, strict=False, jit_options=OPTIONS)(lambda *given: own if holds(*given) else plain)
        return plain

    return declare


def by_type(integers: Callable[..., Any]) -> Callable[[Function], Function]:
    """Have numba take ``integers`` in the place of a function where none of its arguments is a float."""
    return taken_where(lambda *given: not any(isinstance(kind, types.Float) for kind in given), integers)


def holds_integers(kind: Any, *_: Any) -> bool:
    """Whether a configuration, or the record of a node that holds one, is that of the integers."""
    if not isinstance(kind, types.Record):
        return False
    return "bias_var" in kind.fields or ("config" in kind.fields and holds_integers(kind.fields["config"].type))


def by_record(integers: Callable[..., Any]) -> Callable[[Function], Function]:
    """Have numba take ``integers`` in the place of a function where its first argument is of the integers."""
    return taken_where(holds_integers, integers)


@by_type(lambda a, f: multiply_q31(a, f) << 1)
def times_factor(a: float, f: float) -> float:
    """A quantity times a factor."""
    return a * f


@by_type(quotient_q30)
def over_factor(a: float, f: float) -> float:
    """A quantity by a factor above 0."""
    return a / f


def _ratio(a: int, b: int) -> int:
    if abs(a) >> 31 >= b:
        return LARGEST if a > 0 else -LARGEST
    return quotient_q30(a, b)


@by_type(_ratio)
def quantity_ratio(a: float, b: float) -> float:
    """A factor: one quantity by another one of its kind, above 0; integers are held at 2^31."""
    return a / b


def _fraction(a: int, b: int) -> int:
    if abs(a) >> 1 >= b:
        return TWO if a > 0 else -TWO
    return quotient_q30(a, b)


_fraction_of = kernel(_fraction)


@by_type(_fraction)
def bounded_ratio(a: float, b: float) -> float:
    """As ``quantity_ratio``, to multiply by: integers are held at 2."""
    return a / b


@by_type(lambda a, part, whole: multiply_q31(a, _fraction_of(part, whole)) << 1)
def proportional_share(a: float, part: float, whole: float) -> float:
    """A quantity times a part of a whole, of one kind; integers hold the part at twice the whole."""
    return a * part / whole


def _turn(w: int, dt: int) -> int:
    if -(1 << 31) <= dt <= 1 << 31:
        return rounded_shift(multiply_q31(w, dt), RATE_Q + TIME_Q - 31 - ANGLE_Q)
    return multiply_q31(w, max(min(dt, LONGEST), -LONGEST) >> 9) << (9 - (RATE_Q + TIME_Q - 31 - ANGLE_Q))


@by_type(_turn)
def turned_angle(w: float, dt: float) -> float:
    """The angle of a rate over a time; integers: of at most 4096 s."""
    return w * dt


def _speed(turned: int, dt: int) -> int:
    time = max(dt, SHORTEST)
    if abs(turned) >> (ANGLE_Q - TIME_Q + 10) >= time:
        return FASTEST if turned > 0 else -FASTEST
    return quotient_q30(turned, time) << (RATE_Q - ANGLE_Q + TIME_Q - 30)


@by_type(_speed)
def turning_rate(turned: float, dt: float) -> float:
    """The rate of an angle over a time above 0; integers: over at least 1 ms, held at 1024 rad/s."""
    return turned / dt


def _square(a: int) -> int:
    held = rounded_shift(min(abs(a), LARGEST_SQUARED), 12)
    return held * held


@by_type(_square)
def angular_square(a: float) -> float:
    """The variance of an angle or of a rate; integers are held at 16 rad^2, or at (3.6 deg/s)^2."""
    return a * a


@by_type(root_of)
def angular_root(a: float) -> float:
    """The angle or the rate of a variance."""
    return math.sqrt(a)


def _product(a: int, b: int) -> int:
    return rounded_shift(max(min(a, LARGEST_SQUARED), -LARGEST_SQUARED), 12) * rounded_shift(
        max(min(b, LARGEST_SQUARED), -LARGEST_SQUARED), 12
    )


@by_type(_product)
def angular_product(a: float, b: float) -> float:
    """The covariance of two angles, as ``angular_square``."""
    return a * b


@by_type(lambda a: rounded_shift(a, 9))
def coarse_rate(a: float) -> float:
    """A rate whose square fits: integers in Q37."""
    return a


@by_type(lambda a: rounded_shift(root_of(a), 12))
def time_root(a: float) -> float:
    """The time of a variance of a clock (s^2)."""
    return math.sqrt(a)


@by_type(lambda a: min(a * a, STAMP_CEILING) << 12)
def stamp_square(a: float) -> float:
    """The variance of a time stamp that is off by a time of up to 8 s; integers in unit^2, at most their ceiling."""
    return a * a


@by_type(lambda stamp, later: stamp - (later << (RATE_Q - TIME_Q)))
def stamp_before(stamp: float, later: float) -> float:
    """The error of a time stamp that is dated by a time ``later`` than it was."""
    return stamp - later


@by_type(lambda stamp: rounded_shift(stamp, RATE_Q - TIME_Q))
def stamp_time(stamp: float) -> float:
    """The error of a time stamp as a time."""
    return stamp


@by_type(lambda drift, time: rounded_shift(rounded_shift(drift, 16) * min(time, LONGEST), RATE_Q - 16))
def clock_drift_offset(drift: float, time: float) -> float:
    """By how much (s) a clock is off by its ``drift`` (s/s) after a ``time``, in integers of up to 4096 s."""
    return drift * time


@by_type(lambda f: min(f * f, SCALE_CEILING) << 8)
def scale_square(f: float) -> float:
    """The variance of a scale that is off by a factor; integers in unit^2, at most their ceiling."""
    return f * f


@by_type(lambda a: min(a, CEILING))
def bounded_variance(a: float) -> float:
    """A variance as the filter may have it."""
    return a


@by_type(lambda w, scale: w + multiply_q31(w, rounded_shift(scale, RATE_Q - 31)))
def indicated_rate(w: float, scale: float) -> float:
    """What a gyroscope of a ``scale`` error shows of a rate."""
    return w * (1.0 + scale)


@by_type(lambda w, scale: quotient_q30(w, max(UNITY + rounded_shift(scale, RATE_Q - VECTOR_Q), 1)))
def true_rate(w: float, scale: float) -> float:
    """The rate of which a gyroscope of a ``scale`` error shows ``w``."""
    return w / (1.0 + scale)


def _length(x: int, y: int, z: int) -> int:
    a, b, c = x >> 3, y >> 3, z >> 3
    return rounded_shift(root_of(a * a + b * b + c * c), 9)


@by_type(_length)
def vector_length(x: float, y: float, z: float) -> float:
    """Length of a vector; integers: each at most 32 g."""
    return math.sqrt(x * x + y * y + z * z)


def _factor_of(a: int, q: int) -> int:
    limit = 1 << (q + 1)
    return rounded_shift(max(min(a, limit), -limit), q - VECTOR_Q)


@by_type(_factor_of)
def factor_of(a: float, q: int) -> float:
    """A quantity in Q``q`` as a factor; integers are held at 2."""
    return a


@by_type(mean_of)
def mean_of_total(total: float, count: int) -> float:
    """A sum by its count."""
    return total / count


@by_type(lambda a: a >> 1)
def half_of(a: float) -> float:
    """Half of it."""
    return 0.5 * a


@by_type(lambda a: max(min(a, 1 << 28), -(1 << 28)))
def bounded_deviation(a: float) -> float:
    """A deviation of a force; integers are held at 4 g, so that 64 squares fit."""
    return a


@by_type(lambda a: a)
def as_number(a: float) -> float:
    """The number itself: for a checker of types, which does not know what a record holds."""
    return a


@by_type(lambda like, cycles: cycles * PERIOD_FIXED)
def time_of_cycles(like: float, cycles: int) -> float:
    """The time of so many cycles, in the form of ``like``."""
    return cycles * PERIOD


@by_type(lambda angle: radians_to_counts(angle, ANGLE_Q) & TURN)
def kept_angle(angle: float) -> float:
    """An angle as the filter keeps a measured yaw and the offset of joints: integers as a binary angle."""
    return angle


@by_type(lambda a: counts_to_radians(counts_difference(int(a), 0)))
def offset_angle(a: float) -> float:
    """An offset of joints as an angle; the integers hold it as a binary angle."""
    return a


@by_type(lambda a: abs(a) < NO_NUMBER)
def is_number(a: float) -> bool:
    """Whether it is a finite number."""
    return math.isfinite(a)


@kernel
def are_numbers(rate: Array, force: Array) -> bool:
    """Whether a reading, ``rate`` (3) and ``force`` (3), is all finite numbers."""
    found = 0
    for k in range(3):
        found += 1 if is_number(rate[k]) and is_number(force[k]) else 0
    return found == 3


@by_type(lambda like, binary: counts_to_radians(int(binary)))
def angle_of(like: float, binary: int) -> float:
    """Angle (rad) in [0, 2 pi) of a binary angle, in the form of ``like``."""
    return float(binary) * (2.0 * math.pi / 4294967296.0)


@by_type(lambda angle, binary: (int(binary) + radians_to_counts(angle, ANGLE_Q)) & TURN)
def turned_binary(angle: float, binary: int) -> int:
    """A binary angle turned by an angle (rad)."""
    return (int(binary) + math.floor(angle / (2.0 * math.pi) * 4294967296.0 + 0.5)) & 0xFFFFFFFF
