"""Sine, cosine and exponential by table and a short series, angles by CORDIC; radians and binary angles."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from node.kernels.arithmetic.integers import LOW31, bit_length, multiply_q31, rounded_shift, shift_down
from node.kernels.arithmetic.jit import kernel

STEPS: Final = 1024  # of the table of sines, a turn
SINES: Final = np.array(
    [round(2.0**30 * math.sin(2.0 * math.pi * k / STEPS)) for k in range(STEPS + STEPS // 4)], np.int64
)
POWERS: Final = np.array([round(2.0 ** (31.0 - k / 256.0)) for k in range(256)], np.int64)
LN2: Final = round(math.log(2.0) * 2.0**31)
COUNTS_PER_RAD: Final = round(2.0**33 / (2.0 * math.pi))  # Q1
RAD_PER_COUNT: Final = round(2.0 * math.pi * 2.0**28)  # Q60
SIXTH: Final = round(2.0**31 / 6.0)
TURN: Final = 0xFFFFFFFF
ARCS: Final = np.array([round(math.atan(2.0**-k) * 2.0**60) for k in range(48)], np.int64)  # Q60
HALF_TURN: Final = round(math.pi * 2.0**60)
SHORTER: Final = round(2.0**31 * math.prod(1.0 / math.sqrt(1.0 + 4.0**-k) for k in range(48)))  # every turn lengthens


@kernel
def radians_to_counts(angle: int, q: int) -> int:
    """Binary increment, 2^32 a turn, of an ``angle`` (rad, Q``q``, q >= 33)."""
    right = q - 30
    return (multiply_q31(angle, COUNTS_PER_RAD) + (1 << (right - 1))) >> right


@kernel
def counts_difference(a: int, b: int) -> int:
    """A - b of two binary angles, in -2^31..2^31 - 1."""
    return ((int(a) - int(b) + 0x80000000) & TURN) - 0x80000000


@kernel
def counts_to_radians(binary: int) -> int:
    """Angle (rad, Q40) of a binary difference (counts, signed)."""
    return (binary * RAD_PER_COUNT + (1 << 19)) >> 20


@kernel
def sine_cosine(binary: int) -> tuple[int, int]:
    """Sine and cosine (Q30) of a binary angle: sin(a + d) = sin a (1 - d^2/2) + cos a (d - d^3/6), |d| <= pi/1024."""
    nearest = (binary + (1 << 21)) >> 22
    d = counts_to_radians(binary - (nearest << 22)) >> 4  # Q36
    dd = (d * d) >> 36
    cd = (1 << 30) - ((dd + 64) >> 7)  # Q30
    sd = d - ((((d * dd) >> 36) * SIXTH) >> 31)  # Q36
    k = nearest & (STEPS - 1)
    s, c = SINES[k], SINES[k + STEPS // 4]
    sine = (s * cd + ((c * sd) >> 6) + (1 << 29)) >> 30
    cosine = (c * cd - ((s * sd) >> 6) + (1 << 29)) >> 30
    return sine, cosine


@kernel
def exponential_decay(rate: int, dt: int) -> int:
    """2^(-rate dt), Q31: ``rate`` 1/s in Q42 and at least 0, ``dt`` s in Q28, 0..8 s."""
    y = multiply_q31(rate, dt)  # Q39
    whole = y >> 39
    if whole > 31:
        return 0
    x = (((y & LOW31) * LN2) + (1 << 30)) >> 31  # Q39, below ln 2 / 256
    xx = (x * x) >> 39
    series = (1 << 39) - x + (xx >> 1) - ((((xx * x) >> 39) * SIXTH) >> 31)
    power = int(POWERS[(y >> 31) & 255])
    return (power * (series >> 8)) >> (31 + whole)


@kernel
def polar_coordinates(x: int, y: int) -> tuple[int, int]:
    """Angle (rad, Q40) of the point (x, y) from x in -pi..pi, and its distance, in the format of both (below 2^61).

    CORDIC: turns of arctan 2^-k towards the axis, shifts and sums alone. Source: Volder, IRE Trans. EC-8 (1959) 330.
    """
    if x == 0 and y == 0:
        return 0, 0
    room = 58 - bit_length(max(abs(x), abs(y)))
    a, b, angle = shift_down(x, -room), shift_down(y, -room), 0
    if a < 0:
        angle = -HALF_TURN if b < 0 else HALF_TURN
        a, b = -a, -b
    for k in range(ARCS.shape[0]):
        if b > 0:
            a, b, angle = a + (b >> k), b - (a >> k), angle + ARCS[k]
        else:
            a, b, angle = a - (b >> k), b + (a >> k), angle - ARCS[k]
    return (angle + (1 << 19)) >> 20, rounded_shift(multiply_q31(a, SHORTER), room)
