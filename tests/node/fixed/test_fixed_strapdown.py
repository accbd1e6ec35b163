"""The integer attitude against closed-form motion and the float64 kernel, at every inclination."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.arithmetic.formats import RATE_Q, TIME_Q, VECTOR_Q
from node.kernels.filter.fixed.strapdown import half_turn, normalise_down, rotate_down, yaw_rate
from node.kernels.filter.float64 import strapdown

ONE = 2.0**VECTOR_Q


def down_of(inclination: float, yaw: float) -> np.ndarray:
    flat = math.sin(inclination)
    return np.array([-flat * math.cos(yaw), flat * math.sin(yaw), math.cos(inclination)])


def fixed_down(down: np.ndarray) -> np.ndarray:
    return np.rint(down * ONE).astype(np.int64)


@pytest.mark.slow
@given(
    st.floats(0.0, math.pi),
    st.floats(-math.pi, math.pi),
    st.tuples(*[st.floats(-30.0, 30.0)] * 3),
    st.floats(1e-4, 8.0),
)
def test_one_step_agrees_at_every_inclination(
    inclination: float, yaw: float, rate: tuple[float, float, float], dt: float
) -> None:
    down = down_of(inclination, yaw)
    fixed = fixed_down(down)
    w = [round(x * 2.0**RATE_Q) for x in rate]
    found = yaw_rate(fixed, *w) * 2.0**-RATE_Q
    steepness = 1.0 / max(1.0 + down[2], 1e-3)
    assert found == pytest.approx(strapdown.yaw_rate(down, *rate), abs=1e-7 * (1.0 + steepness) * steepness)
    strapdown.rotate_down(down, *rate, 0.5 * dt)
    rotate_down(fixed, *half_turn(*w, round(dt * 2.0**TIME_Q)))
    angle = 0.5 * dt * math.hypot(*rate)
    np.testing.assert_allclose(fixed / ONE, down, rtol=0.0, atol=1.5e-7 + 5e-9 * angle)


@pytest.mark.parametrize("inclination", range(0, 181, 5))
def test_ten_thousand_turns_neither_grow_nor_shrink_the_tilt(inclination: int) -> None:
    fixed = fixed_down(down_of(math.radians(inclination), 0.3))
    step = half_turn(0, 0, round(math.radians(71.0) * 2.0**RATE_Q), round(2.0**TIME_Q / 1.9))
    for _ in range(20_000):
        rotate_down(fixed, *step)
    # sine and cosine of 30 bits have s^2 + c^2 = 1 to 1e-9, which the same step taken again and again adds up
    assert fixed[2] / ONE == pytest.approx(math.cos(math.radians(inclination)), abs=4e-6)
    assert np.linalg.norm(fixed / ONE) == pytest.approx(1.0, abs=1e-8)


@given(st.tuples(*[st.integers(-(2**33), 2**33)] * 3).filter(any))
def test_any_vector_is_made_a_unit_vector(vector: tuple[int, int, int]) -> None:
    found = np.array(vector, np.int64)
    normalise_down(found)
    length = np.linalg.norm(np.array(vector, float))
    np.testing.assert_allclose(found / ONE, np.array(vector) / length, atol=3e-9 + 2.0 / min(length, 2**29))


def test_no_rate_is_no_turn_and_no_vector_points_down() -> None:
    assert half_turn(0, 0, 0, 2**29)[3:] == (0, 2**VECTOR_Q)
    nothing = np.zeros(3, np.int64)
    normalise_down(nothing)
    assert nothing.tolist() == [0, 0, 2**VECTOR_Q]
