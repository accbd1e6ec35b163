"""What a hole's directions say of its curvature, and where it goes, against brute force on a fine grid of depths."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import multivariate_normal

from groundstation.errors import SurveyError
from groundstation.survey.path.curvature_prior import STATED, CurvaturePrior, carry_over
from groundstation.survey.path.curvature_tendency import COLLAR_STD, LEAST_STD, LOOKED_BACK, learn_curvature
from groundstation.survey.path.path_ahead import PathAhead

DEG = math.pi / 180.0
FINE = 0.025  # m
NEVER = (1e-9, 1e6)  # jumps that are expected, in so many m
SURELY = 1e4  # jumps, of which a rate is known as well as if it were told


def one_cell(size: float, length: float) -> CurvaturePrior:
    """A prior that knows size and length, without jumps."""
    return CurvaturePrior(np.array([size]), np.array([length]), np.ones((1, 1)), np.zeros(1), np.ones(1), *NEVER)


def brute_force(depths: np.ndarray, ahead: float, size: float, length: float) -> np.ndarray:
    """Covariance of the directions at depths, and of offset and direction ahead: by sums on a fine grid.

    The curvature has the covariance size^2 exp(-|s - t| / length); the direction at the first depth is known.
    """
    first, last = depths[0], depths[-1]
    places = np.arange(first, last + ahead - 1e-9, FINE) + 0.5 * FINE
    kernel = size**2 * np.exp(-np.abs(places[:, None] - places) / length)
    rows = [np.where(places < depth, FINE, 0.0) for depth in depths]
    end = last + ahead
    rows.append(np.where(places < last, ahead, end - places) * FINE)  # offset beyond the last depth
    rows.append(np.full(len(places), FINE))
    whole = np.array(rows)
    return np.asarray(whole @ kernel @ whole.T)


def directions_of(angles: np.ndarray) -> np.ndarray:
    """Tangents of small angles from the vertical."""
    tangents = np.column_stack([angles, np.sqrt(1.0 - (angles**2).sum(axis=1))])
    return np.asarray(tangents)


@pytest.mark.parametrize(("size", "length"), [(0.1 * DEG, 5.0), (0.05 * DEG, 40.0), (0.3 * DEG, 3.0)])
def test_it_is_the_conditional_normal_of_the_process(size: float, length: float) -> None:
    """Two axes at once, of directions with covariances of any shape, at depths of any distance."""
    random, ahead = np.random.default_rng(5), 7.0
    depths = np.array([0.0, 2.0, 3.5, 6.0, 8.0])
    count = len(depths)
    roots = 0.05 * DEG * random.normal(size=(count, 2, 2))
    covs = roots @ roots.transpose(0, 2, 1)
    angles = 0.2 * DEG * random.normal(size=(count, 2))
    tangents = directions_of(angles)
    space = np.zeros((count, 3, 3))
    space[:, :2, :2] = covs
    tendency = replace(learn_curvature(depths, tangents, space, one_cell(size, length)), last_leg=0.0)  # it lies known

    cov = brute_force(depths, ahead, size, length)
    noise = covs + np.eye(2) * np.array([COLLAR_STD**2] + [LEAST_STD**2] * (count - 1))[:, None, None]
    # unknowns: (direction at the first depth is that depth's own measurement) directions, offset and direction ahead
    known = np.kron(cov[:count, :count], np.eye(2))
    prior_of_first = 1e4 * np.kron(np.ones((count, count)), np.eye(2)) * DEG**2
    seen = known + prior_of_first
    for k in range(count):
        seen[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] += noise[k]
    # what is sought: offset and direction beyond, relative to the direction measured last; the first one is anywhere
    anywhere = 1e4 * DEG**2
    for row, by_first in ((count, ahead), (count + 1, 1.0)):
        cross = np.kron(cov[row, :count] + by_first * anywhere, np.eye(2))
        gain = cross @ np.linalg.inv(seen)
        mean = gain @ angles.ravel()
        own = np.eye(2) * (cov[row, row] + by_first**2 * anywhere)
        spread = own - gain @ cross.T
        path = PathAhead(tendency, np.zeros((2, 2)), np.zeros((2, 2)))
        found = path.offsets(ahead) if row == count else path.directions(ahead)
        assert found.mean + by_first * angles[-1] == pytest.approx(mean, rel=1e-3, abs=1e-5)
        assert found.cov == pytest.approx(spread, rel=2e-3, abs=1e-9)


def test_the_weights_are_prior_times_marginal_likelihood() -> None:
    """Of six cells, by the density of all directions but the first under each."""
    random = np.random.default_rng(8)
    depths = np.arange(6) * 2.0
    angles = np.cumsum(0.15 * DEG * random.normal(size=(6, 2)), axis=0)
    sizes, lengths = np.array([0.02, 0.08, 0.3]) * DEG, np.array([4.0, 30.0])
    weights = random.dirichlet(np.ones(6)).reshape(3, 2)
    prior = CurvaturePrior(sizes, lengths, weights, np.zeros(1), np.ones(1), *NEVER)
    found = learn_curvature(depths, directions_of(angles), np.zeros((6, 3, 3)), prior).weights
    expected = np.zeros((3, 2))
    for a, size in enumerate(sizes):
        for b, length in enumerate(lengths):
            cov = brute_force(depths, 1.0, size, length)[:6, :6]
            changes = cov[1:, 1:] + COLLAR_STD**2 + LEAST_STD**2 * np.eye(5)  # the first one's error is in all
            logs = [
                multivariate_normal(np.zeros(5), changes).logpdf(angles[1:, axis] - angles[0, axis]) for axis in (0, 1)
            ]
            expected[a, b] = math.log(weights[a, b]) + sum(logs)
    expected = np.exp(expected - expected.max())
    assert found == pytest.approx(expected / expected.sum(), rel=0.02, abs=1e-6)


def test_a_jump_in_a_leg_has_its_moments() -> None:
    """Direction and curvature after a leg with a jump somewhere, and what is made of the direction there, by draws."""
    jump, leg, count = 0.2 * DEG, 2.0, 400_000
    random = np.random.default_rng(2)
    size = random.normal(size=count) * jump
    left = leg * random.uniform(size=count)
    turned, bent = size * left, size
    prior = CurvaturePrior(
        np.array([1e-9]), np.array([400.0]), np.ones((1, 1)), np.array([jump]), np.ones(1), SURELY, 10.0
    )
    covs = np.zeros((2, 3, 3))
    covs[1] = 0.3 * DEG**2 * np.diag([1.0, 1.0, 0.0])  # read badly, so that the moments are those beforehand
    seen = 0.1 * DEG
    tendency = learn_curvature(np.array([0.0, leg]), directions_of(np.array([[0.0, 0.0], [seen, 0.0]])), covs, prior)
    # best linear estimate from the drawn moments
    moments = np.cov(np.stack([turned, bent]))
    var = moments[0, 0] + COLLAR_STD**2 + LEAST_STD**2 + 0.3 * DEG**2
    assert tendency.means[0, 2] == pytest.approx(moments[0, 1] / var * seen, rel=0.01)
    assert tendency.blocks[0, 2, 0, 0] == pytest.approx(moments[1, 1] - moments[0, 1] ** 2 / var, rel=0.01)


@given(st.integers(0, 10_000), st.tuples(*[st.floats(-3.0, 3.0)] * 3), st.integers(2, 12))
def test_the_whole_hole_may_be_turned_in_space(seed: int, by: tuple[float, float, float], count: int) -> None:
    """Weights, spread and size of what is expected are the same at any inclination and azimuth."""
    random, turn = np.random.default_rng(seed), Rotation.from_rotvec(by)
    steps = np.cumsum(0.3 * DEG * random.normal(size=(count, 2)), axis=0)
    tangents = directions_of(steps)
    roots = 0.02 * DEG * random.normal(size=(count, 3, 3))
    covs = roots @ roots.transpose(0, 2, 1)
    md, matrix = np.arange(count) * 2.0, turn.as_matrix()
    here = learn_curvature(md, tangents, covs)
    there = learn_curvature(md, turn.apply(tangents), matrix @ covs @ matrix.T)
    assert there.weights == pytest.approx(here.weights, rel=1e-5, abs=1e-9)
    assert there.axes.T @ there.curvature == pytest.approx(matrix @ here.axes.T @ here.curvature, rel=1e-5, abs=1e-9)


@given(st.floats(0.02, 0.4), st.floats(0.0, 6.2))
def test_an_even_build_is_found(build_deg: float, azimuth: float) -> None:
    md = np.arange(8) * 2.0
    angles = build_deg * DEG * md[:, None] * np.array([math.cos(azimuth), math.sin(azimuth)])
    tendency = learn_curvature(md, directions_of(angles), np.zeros((8, 3, 3)))
    assert math.hypot(*tendency.curvature) == pytest.approx(build_deg * DEG, rel=0.1)


def test_a_straight_hole_is_taken_for_ever_straighter() -> None:
    sizes, radii = [], []
    for count in range(2, 16):
        md = np.arange(count) * 2.0
        tendency = learn_curvature(md, directions_of(np.zeros((count, 2))), np.zeros((count, 3, 3)))
        sizes.append(tendency.size)
        path = PathAhead(tendency, np.zeros((2, 2)), np.zeros((2, 2)))
        radii.append(path.offsets(10.0).half_width_of(0.9))
    assert np.all(np.diff(sizes) < 0.0)
    assert np.all(np.diff(radii) < 0.0)


def test_what_lies_far_above_is_not_looked_at() -> None:
    random = np.random.default_rng(1)
    count = LOOKED_BACK + 40
    angles = np.cumsum(0.02 * DEG * random.normal(size=(count, 2)), axis=0)
    md = np.arange(count) * 2.0
    whole = learn_curvature(md, directions_of(angles), np.zeros((count, 3, 3)))
    part = learn_curvature(
        md[-LOOKED_BACK:], directions_of(angles)[-LOOKED_BACK:], np.zeros((LOOKED_BACK, 3, 3)), from_collar=False
    )
    assert whole.weights == pytest.approx(part.weights, rel=1e-9)
    assert whole.means == pytest.approx(part.means, rel=1e-6, abs=1e-12)


def test_a_site_with_crooked_holes_makes_the_next_one_crooked_beforehand() -> None:
    """Weights of earlier holes count as holes beside the two of the stated prior, and come to 1."""
    crooked = np.zeros_like(STATED.weights)
    crooked[-2, 1] = 1.0
    site = carry_over(STATED, [crooked] * 6)
    assert site.weights.sum() == pytest.approx(1.0)
    assert site.weights[-2, 1] == pytest.approx((6.0 + 2.0 * STATED.weights[-2, 1]) / 8.0)
    assert carry_over(STATED, []).weights == pytest.approx(STATED.weights)
    md, still = np.array([0.0, 2.0]), directions_of(np.zeros((2, 2)))
    spreads = [
        PathAhead(learn_curvature(md, still, np.zeros((2, 3, 3)), prior), np.zeros((2, 2)), np.zeros((2, 2)))
        .offsets(20.0)
        .radius_of(0.95, np.zeros(2))
        for prior in (STATED, site)
    ]
    assert spreads[1] > 1.3 * spreads[0]


def test_the_stated_prior_is_a_probability() -> None:
    assert STATED.weights.sum() == pytest.approx(1.0)
    assert STATED.weights.min() > 0.0
    assert STATED.jump_shares.sum() == pytest.approx(1.0)


def test_a_jump_ahead_is_foreseen_by_its_draws() -> None:
    """Of a straight hole in ground with one kind of layer: the spread ahead by draws of when it comes, and of none."""
    prior = CurvaturePrior(
        np.array([1e-9]), np.array([400.0]), np.ones((1, 1)), np.array([0.2 * DEG]), np.ones(1), SURELY, SURELY * 25.0
    )
    tendency = learn_curvature(np.arange(9) * 2.0, directions_of(np.zeros((9, 2))), np.zeros((9, 3, 3)), prior)
    # what is known of the present is taken away
    tendency = replace(tendency, means=np.zeros((1, 4)), blocks=np.zeros((1, 3, 2, 2)))
    mixture = PathAhead(tendency, np.zeros((2, 2)), np.zeros((2, 2))).offsets(12.0)
    random, count = np.random.default_rng(3), 200_000
    comes = random.uniform(size=count) < 1.0 - math.exp(-12.0 / 25.0)
    left = 12.0 * random.uniform(size=count)
    ends = np.where(comes[:, None], 0.2 * DEG * random.normal(size=(count, 2)) * (0.5 * left**2)[:, None], 0.0)
    for radius in (0.02, 0.1, 0.2, 0.4):
        assert mixture.chance_within(radius) == pytest.approx(np.mean(np.hypot(*ends.T) < radius), abs=0.01)


def test_a_hole_that_turns_back_is_refused() -> None:
    with pytest.raises(SurveyError, match="do not turn back"):
        learn_curvature(np.array([0.0, 2.0]), np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]), np.zeros((2, 3, 3)))
