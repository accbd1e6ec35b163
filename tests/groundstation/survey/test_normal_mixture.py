"""A mixture of normals in the plane against non-central chi-square, draws, roots and the definition of its score."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import dblquad, quad
from scipy.optimize import brentq
from scipy.stats import multivariate_normal, ncx2, norm

from groundstation.survey.path.mixture_score import score_forecast
from groundstation.survey.path.normal_mixture import NormalMixture

sizes = st.floats(1e-3, 2.0)


def drawn(seed: int, parts: int = 5) -> NormalMixture:
    """A mixture of some parts with covariances of any shape."""
    random = np.random.default_rng(seed)
    weights = random.dirichlet(np.ones(parts))
    roots = random.normal(size=(parts, 2, 2)) * random.uniform(0.02, 0.4, (parts, 1, 1))
    return NormalMixture(weights, random.normal(0.0, 0.3, (parts, 2)), roots @ roots.transpose(0, 2, 1))


@given(st.floats(0.0, 2.0), sizes, sizes, st.floats(0.0, 6.3))
def test_a_round_normal_within_a_circle_is_non_central_chi_square(
    off: float, std: float, radius: float, towards: float
) -> None:
    mean = off * np.array([np.cos(towards), np.sin(towards)])
    found = NormalMixture(np.ones(1), mean[None], std**2 * np.eye(2)[None]).chance_within(radius)
    assert found == pytest.approx(ncx2.cdf((radius / std) ** 2, 2, (off / std) ** 2), abs=1e-7)


@pytest.mark.parametrize("stds", [(0.3, 0.29), (0.3, 0.1), (0.3, 0.02), (0.05, 0.3)])
@pytest.mark.parametrize("mean", [(0.0, 0.0), (0.4, 0.1), (-0.1, 0.5), (0.35, 0.36)])
def test_a_long_normal_within_a_circle_is_the_integral_of_its_density(
    stds: tuple[float, float], mean: tuple[float, float]
) -> None:
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    cov, radius = turn @ np.diag(np.square(stds)) @ turn.T, 0.5
    density = multivariate_normal(mean, cov).pdf
    expected, _ = dblquad(
        lambda r, angle: r * density((r * np.cos(angle), r * np.sin(angle))), 0.0, 2.0 * np.pi, 0.0, radius, epsabs=1e-8
    )
    assert NormalMixture(np.ones(1), np.array([mean]), cov[None]).chance_within(radius) == pytest.approx(
        expected, abs=1e-6
    )


@given(st.integers(0, 10_000), st.floats(0.05, 1.5))
def test_the_chance_of_a_mixture_is_the_share_of_its_draws(seed: int, radius: float) -> None:
    mixture, random, count = drawn(seed), np.random.default_rng(seed + 1), 4000
    parts = random.choice(len(mixture.weights), count, p=mixture.weights)
    points = (
        mixture.means[parts] + (np.linalg.cholesky(mixture.covs)[parts] @ random.normal(size=(count, 2, 1)))[:, :, 0]
    )
    share = np.mean(np.hypot(points[:, 0] - 0.1, points[:, 1]) <= radius)
    found = mixture.chance_within(radius, np.array([0.1, 0.0]))
    assert share == pytest.approx(found, abs=5.0 * np.sqrt(max(found * (1.0 - found), 1e-3) / count))


@given(st.integers(0, 10_000), st.floats(0.01, 0.999))
def test_the_circle_of_a_chance_has_it(seed: int, chance: float) -> None:
    mixture = drawn(seed)
    radius = mixture.radius_of(chance, mixture.mean)
    assert mixture.chance_within(radius, mixture.mean) == pytest.approx(chance, abs=1e-7)


@given(st.integers(0, 10_000), st.floats(0.01, 0.999))
def test_the_half_width_along_the_mean_has_its_chance(seed: int, chance: float) -> None:
    mixture = drawn(seed)
    unit = mixture.mean / np.linalg.norm(mixture.mean)
    offs, stds = (mixture.means - mixture.mean) @ unit, np.sqrt(unit @ mixture.covs @ unit)

    def missing(width: float) -> float:
        return float(mixture.weights @ (norm.cdf((width - offs) / stds) - norm.cdf((-width - offs) / stds))) - chance

    assert mixture.half_width_of(chance) == pytest.approx(brentq(missing, 0.0, 20.0, xtol=1e-13), rel=1e-5, abs=1e-9)


@given(st.integers(0, 10_000))
def test_its_moments_are_those_of_its_parts(seed: int) -> None:
    mixture = drawn(seed)
    second = np.einsum(
        "c,cij->ij", mixture.weights, mixture.covs + np.einsum("ci,cj->cij", mixture.means, mixture.means)
    )
    assert mixture.cov == pytest.approx(second - np.outer(mixture.mean, mixture.mean), abs=1e-12)


@given(st.integers(0, 10_000))
def test_a_turn_and_a_shift_leave_its_chances(seed: int) -> None:
    mixture, turn, shift = drawn(seed), np.array([[0.6, -0.8], [0.8, 0.6]]), np.array([3.0, -1.0])
    moved = mixture.through(turn, shift)
    assert moved.chance_within(0.4, turn @ mixture.mean + shift) == pytest.approx(
        mixture.chance_within(0.4, mixture.mean), abs=1e-7
    )


def test_what_weighs_next_to_nothing_is_left_out() -> None:
    weights = np.array([0.6, 2e-6, 0.4 - 5e-6, 3e-6])
    kept = NormalMixture(
        weights, np.arange(8.0).reshape(4, 2), np.broadcast_to(np.eye(2), (4, 2, 2))
    ).without_lightest()
    assert kept.means[:, 0].tolist() == [0.0, 4.0]
    assert kept.weights.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("seed", range(6))
def test_the_score_is_the_area_between_the_two_distributions(seed: int) -> None:
    mixture, came = drawn(seed, 3), np.array([0.2, -0.3])
    expected = 0.0
    for axis in (0, 1):
        means, stds = mixture.means[:, axis], np.sqrt(mixture.covs[:, axis, axis])

        def between(x: float, means: np.ndarray = means, stds: np.ndarray = stds, at: float = came[axis]) -> float:
            return float((mixture.weights @ norm.cdf((x - means) / stds) - (x >= at)) ** 2)

        for start, end in ((-6.0, came[axis]), (came[axis], 6.0)):
            expected += 0.5 * quad(between, start, end, limit=400, epsabs=1e-10)[0]
    assert score_forecast(mixture, came) == pytest.approx(expected, abs=1e-7)


def test_the_score_of_one_place_is_its_distance() -> None:
    place = NormalMixture(np.ones(1), np.array([[0.3, -0.1]]), np.zeros((1, 2, 2)))
    assert score_forecast(place, np.array([0.1, 0.3])) == pytest.approx(0.5 * (0.2 + 0.4))
