"""What a curvature does to a hole between stations, against sums over its covariance and against its limits."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.survey.path.leg_wander import LegWander, carry_memory

PLACES = 1201


def moments_by_sums(legs: list[float], length: float) -> np.ndarray:
    """Covariance (k, k) of the moments of legs one below the other, by double sums over exp(-|s - t| / l)."""
    begins = np.concatenate([[0.0], np.cumsum(legs)])
    weights, places = [], []
    for begin, leg in zip(begins, legs, strict=False):
        u = np.linspace(0.0, leg, PLACES)
        trapezoid = np.full(PLACES, leg / (PLACES - 1))
        trapezoid[[0, -1]] *= 0.5
        weights.append(trapezoid * (0.5 * leg - u))
        places.append(begin + u)
    return np.array(
        [
            [w @ np.exp(-np.abs(s[:, None] - t[None]) / length) @ v for v, t in zip(weights, places, strict=True)]
            for w, s in zip(weights, places, strict=True)
        ]
    )


@pytest.mark.parametrize("length", [0.5, 5.0, 40.0])
@pytest.mark.parametrize("legs", [[2.0] * 4, [1.0, 3.0, 2.0], [6.0]])
def test_what_a_path_gathers_is_what_sums_over_its_covariance_give(legs: list[float], length: float) -> None:
    wander, memory, gathered = LegWander(1.0, length), 0.0, 0.0
    covariance = moments_by_sums(legs, length)
    for count, leg in enumerate(legs, 1):
        moment = wander.moment(leg)
        gathered += moment.variance + 2.0 * moment.with_start * memory
        memory = carry_memory(memory, moment)
        assert gathered == pytest.approx(float(covariance[:count, :count].sum()), rel=2e-3)


def test_a_short_leg_has_its_limit_and_a_long_hole_gathers_a_sixth_of_it() -> None:
    std, length, leg = 2e-3, 40.0, 0.5
    wander, memory, gathered = LegWander(std, length), 0.0, []
    assert wander.grown(0.0, wander.moment(leg)) == pytest.approx(std**2 * leg**5 / (60.0 * length), rel=0.01)
    for _ in range(4000):
        moment = wander.moment(leg)
        gathered.append(wander.grown(memory, moment))
        memory = carry_memory(memory, moment)
    assert gathered[-1] == pytest.approx(std**2 * leg**5 / (360.0 * length), rel=0.02)


@given(st.floats(0.1, 30.0), st.floats(0.5, 100.0), st.floats(0.0, 1.0))
def test_a_variance_is_none_at_the_upper_station_and_never_negative(leg: float, length: float, share: float) -> None:
    wander = LegWander(1e-3, length)
    assert wander.grown(0.0, wander.moment(leg, 0.0)) == 0.0
    assert wander.grown(0.0, wander.moment(leg, share)) >= 0.0
    assert wander.moment(leg).kept == pytest.approx(math.exp(-leg / length), rel=1e-5)


def test_a_path_that_does_not_wander_has_no_variance() -> None:
    still = LegWander(0.0, 5.0)
    assert still.grown(1.0, still.moment(2.0)) == 0.0
