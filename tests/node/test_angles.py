import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.arithmetic.angles import advance_binary, from_binary, to_binary, wrap_angle, wrap_positive

ANGLES = st.floats(-1e4, 1e4)


@given(ANGLES)
def test_wrap_stays_in_the_half_open_turn_and_keeps_the_direction(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


@given(ANGLES)
def test_wrap_positive(angle: float) -> None:
    assert 0.0 <= wrap_positive(angle) < 2.0 * math.pi
    assert wrap_angle(wrap_positive(angle) - angle) == pytest.approx(0.0, abs=1e-9)


def test_wrap_at_its_border() -> None:
    assert wrap_angle(math.pi) == math.pi
    assert wrap_angle(-math.pi) == math.pi


@given(st.floats(0.0, 2.0 * math.pi, exclude_max=True))
def test_binary_angle_round_trip_is_within_half_a_count(angle: float) -> None:
    assert abs(wrap_angle(from_binary(to_binary(angle)) - angle)) <= math.pi / 2**32 * 1.01


def test_binary_yaw_of_a_hundred_thousand_steps_does_not_drift() -> None:
    steps = np.random.default_rng(1).normal(math.radians(37.368421), math.radians(0.01), 100_000)
    binary, single = 0, np.float32(0.0)
    for step in steps:
        binary = advance_binary(binary, step)
        single += np.float32(step)
    truth = math.fsum(steps)
    assert abs(math.degrees(wrap_angle(from_binary(binary) - truth))) < 5e-5
    assert abs(math.degrees(float(single) - truth)) > 1.0  # what an unwrapped float32 would have done
