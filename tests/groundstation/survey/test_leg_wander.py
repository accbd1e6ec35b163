"""What a curvature does to a hole between stations, against sums over its covariance and against its limits."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.survey.path.leg_wander import LegWander
from groundstation.survey.well.kernels.position_errors import follow_legs
from groundstation.survey.well.trajectory_rows import ROW

PLACES = 1201


def gathered_by(wander: LegWander, legs: list[float]) -> np.ndarray:
    """Variance that each leg adds (m^2)."""
    count, lengths = len(legs), np.array(legs)
    rows, down = np.zeros(count + 1, ROW), np.column_stack([0.0 * lengths, 0.0 * lengths, lengths])
    rows["md"][1:] = np.cumsum(lengths)
    follow_legs(rows, down, wander.moments(lengths), wander.std, np.empty((count, 3, 3)))
    path = rows["path"]
    assert not path[:, 2, 2].any()
    return np.diff(path[:, 0, 0])


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
    gathered, covariance = np.cumsum(gathered_by(LegWander(1.0, length), legs)), moments_by_sums(legs, length)
    for count in range(1, len(legs) + 1):
        assert gathered[count - 1] == pytest.approx(float(covariance[:count, :count].sum()), rel=2e-3)


def test_a_short_leg_has_its_limit_and_a_long_hole_gathers_a_sixth_of_it() -> None:
    std, length, leg = 2e-3, 40.0, 0.5
    gathered = gathered_by(LegWander(std, length), [leg] * 4000)
    assert gathered[0] == pytest.approx(std**2 * leg**5 / (60.0 * length), rel=0.01)
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
