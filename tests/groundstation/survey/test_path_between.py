"""How far a hole is off the arc between two stations, against sums over a fine grid and against draws."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.survey.path.curvature_prior import CurvaturePrior
from groundstation.survey.path.curvature_tendency import learn_curvature
from groundstation.survey.path.path_between import path_between, tendency_between

DEG = math.pi / 180.0


def by_sums(leg: float, length: float, part: float, count: int = 2000) -> float:
    """Variance of int_0^s (s - u) k du - s^2 / 2h int_0^h k du for a curvature of covariance exp(-|u - v| / length)."""
    places = (np.arange(count) + 0.5) * leg / count
    at = part * leg
    weights = (np.maximum(at - places, 0.0) - at**2 / (2.0 * leg)) * leg / count
    return float(weights @ np.exp(-np.abs(places[:, None] - places) / length) @ weights)


@pytest.mark.parametrize("part", [0.25, 0.5, 0.8, 1.0])
@pytest.mark.parametrize(("leg", "length"), [(2.0, 4.0), (2.0, 400.0), (10.0, 3.0), (30.0, 40.0)])
def test_the_variance_is_that_of_the_process(leg: float, length: float, part: float) -> None:
    found = path_between(np.array([leg]), 0.1 * DEG, length, part)[0]
    assert found == pytest.approx((0.1 * DEG) ** 2 * by_sums(leg, length, part), rel=5e-3)


@given(st.floats(0.5, 40.0), st.floats(3.0, 300.0), st.floats(1e-5, 1e-2))
def test_it_grows_with_the_square_of_the_size_and_is_nothing_at_the_upper_station(
    leg: float, length: float, size: float
) -> None:
    legs = np.array([leg, 0.5 * leg, leg])
    assert path_between(legs, size, length) == pytest.approx(size**2 * path_between(legs, 1.0, length), rel=1e-9)
    assert path_between(legs, size, length, 0.0).tolist() == [0.0, 0.0, 0.0]
    found = path_between(legs, 1.0, length)
    assert found[0] == found[2] > found[1] >= 0.0


def test_an_even_bend_is_the_arc() -> None:
    """The longer a curvature is kept, the less is off minimum curvature: in the end by the leg over its length."""
    found = [path_between(np.array([10.0]), 1.0, length)[0] for length in (100.0, 1000.0, 10_000.0)]
    assert np.divide(found[:-1], found[1:]) == pytest.approx([10.0, 10.0], rel=0.05)


def test_of_a_hole_it_is_the_mean_over_what_is_probable_jumps_included() -> None:
    """By draws of wandering curvatures that jump once in a leg, with the directions at both ends known."""
    jump, size, length, leg, every = 0.3 * DEG, 0.05 * DEG, 6.0, 8.0, 20.0
    prior = CurvaturePrior(
        np.array([size]), np.array([length]), np.ones((1, 1)), np.array([jump]), np.ones(1), 1.0, every
    )
    tendency = learn_curvature(np.array([0.0, leg]), np.tile([0.0, 0.0, 1.0], (2, 1)), np.zeros((2, 3, 3)), prior)
    tendency = replace(tendency, jumped=1.0 - math.exp(-leg / every), looked=leg)  # as often as it is drawn below
    random, count, steps = np.random.default_rng(11), 20_000, 160
    step = leg / steps
    places = (np.arange(steps) + 0.5) * step
    keeps = math.exp(-step / length)
    curvature = np.empty((steps, count))
    curvature[0] = size * random.normal(size=count)
    for k in range(1, steps):
        curvature[k] = keeps * curvature[k - 1] + size * math.sqrt(1.0 - keeps**2) * random.normal(size=count)
    comes = np.where(
        random.uniform(size=count) < 1.0 - math.exp(-leg / every), leg * random.uniform(size=count), np.inf
    )
    curvature += np.where(places[:, None] > comes, jump * random.normal(size=count), 0.0)
    for part in (0.5, 1.0):
        at = part * leg
        off = (np.maximum(at - places, 0.0) - at**2 / (2.0 * leg)) @ curvature * step
        assert tendency_between(tendency, np.array([leg]), part)[0] == pytest.approx(np.mean(off**2), rel=0.05)
