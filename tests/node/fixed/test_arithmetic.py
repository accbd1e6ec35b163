"""Integer products, quotients, roots and functions against exact or float64 values."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.arithmetic.integers import (
    bit_length,
    clamp_and_count,
    inverse_root,
    multiply_q31,
    quotient_q30,
    reciprocal_parts,
    rounded_shift,
)
from node.kernels.arithmetic.trigonometry import (
    counts_difference,
    counts_to_radians,
    exponential_decay,
    radians_to_counts,
    sine_cosine,
)
from node.kernels.record.integer_filter import FIXED_STATE

WIDE = st.integers(-(2**62) + 1, 2**62 - 1)
TURN = 2**32


@given(WIDE, st.integers(-(2**31), 2**31))
def test_a_product_is_exact_to_its_last_bit(wide: int, factor: int) -> None:
    assert abs(multiply_q31(wide, factor) - wide * factor / 2**31) <= 0.5 + abs(wide * factor / 2**31) * 2**-52
    assert 2 * abs(multiply_q31(wide, factor) * 2**31 - wide * factor) <= 2**31


@given(st.integers(1, 2**62 - 1))
def test_reciprocal_and_root_are_good_to_thirty_bits(value: int) -> None:
    mantissa, exponent = reciprocal_parts(value)
    assert mantissa * 2.0 ** (-61 - exponent) * value == pytest.approx(1.0, rel=2**-29)
    mantissa, exponent = inverse_root(value)
    assert mantissa * 2.0 ** (-61 - exponent) * math.sqrt(value) == pytest.approx(1.0, rel=3e-9)
    assert bit_length(value) == value.bit_length()


@given(st.integers(-(2**52), 2**52), st.integers(2**20, 2**36))
def test_quotient(wide: int, divisor: int) -> None:
    exact = Fraction(wide * 2**30, divisor)
    of_mantissa, of_product = abs(exact) / 2**29, 1 + Fraction(2**30, divisor)  # the two errors add up
    assert abs(quotient_q30(wide, divisor) - exact) <= of_mantissa + of_product


@given(st.integers(-(2**40), 2**40), st.integers(-20, 62))
def test_shift_rounds_to_the_nearest(value: int, right: int) -> None:
    assert abs(rounded_shift(value, right) - value * 2.0**-right) <= 0.5


def test_what_does_not_fit_is_held_and_counted() -> None:
    record = np.zeros(1, FIXED_STATE)[0]
    assert [clamp_and_count(record, value, 100) for value in (100, -100, 0)] == [100, -100, 0]
    assert record["overflows"] == 0
    assert [clamp_and_count(record, value, 100) for value in (101, -(2**60))] == [100, -100]
    assert record["overflows"] == 2


@pytest.mark.parametrize(("degrees", "sine", "cosine"), [(0, 0, 1), (90, 1, 0), (180, 0, -1), (270, -1, 0)])
def test_known_angles_are_exact(degrees: int, sine: int, cosine: int) -> None:
    assert sine_cosine(degrees * TURN // 360) == (sine << 30, cosine << 30)


def test_sine_and_cosine_over_the_whole_turn() -> None:
    angles = np.arange(0, TURN, 104729)
    found = np.array([sine_cosine(int(angle)) for angle in angles]) * 2.0**-30
    exact = angles * (2.0 * math.pi / TURN)
    np.testing.assert_allclose(found, np.column_stack([np.sin(exact), np.cos(exact)]), atol=2.5e-9)


@given(st.integers(0, TURN - 1))
def test_sine_and_cosine_of_any_angle(angle: int) -> None:
    sine, cosine = sine_cosine(angle)
    exact = angle * (2.0 * math.pi / TURN)
    assert sine * 2.0**-30 == pytest.approx(math.sin(exact), abs=2.5e-9)
    assert cosine * 2.0**-30 == pytest.approx(math.cos(exact), abs=2.5e-9)


@given(st.integers(-(2**31), 2**31 - 1))
def test_binary_angles_and_radians(binary: int) -> None:
    angle = counts_to_radians(binary)
    assert angle * 2.0**-40 == pytest.approx(binary * 2.0 * math.pi / TURN, rel=1e-9, abs=2.0**-40)
    assert abs(radians_to_counts(angle, 40) - binary) <= 1 + abs(binary) * 1e-9


@given(st.integers(0, TURN - 1), st.integers(-(2**31), 2**31 - 1))
def test_the_difference_of_binary_angles_wraps(a: int, step: int) -> None:
    assert counts_difference((a + step) % TURN, a) == step


@given(st.floats(0.05, 1e7), st.floats(1e-6, 8.0))
def test_exponential(tau: float, dt: float) -> None:
    rate, step = round(math.log2(math.e) / tau * 2**42), round(dt * 2**28)
    assert exponential_decay(rate, step) * 2.0**-31 == pytest.approx(2.0 ** -(rate * step * 2.0**-70), abs=2e-9)
