"""Regions of a stated confidence against an independent distribution, against sampling and against themselves."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.errors import SurveyError
from groundstation.survey.well.ellipsoid import (
    check_covariance,
    coverage_radius,
    ellipse_outline,
    ellipsoid_axes,
    plan_ellipse,
    probability_of,
)

ENTRIES = st.lists(st.floats(-3.0, 3.0), min_size=9, max_size=9)


def covariance(entries: list[float], size: int = 3) -> np.ndarray:
    half = np.array(entries[: size * size]).reshape(size, size)
    return half @ half.T + 1e-3 * np.eye(size)


@pytest.mark.parametrize("dimensions", [1, 2, 3])
@pytest.mark.parametrize("probability", [1e-6, 1e-3, 0.1, 0.3934693402873666, 0.5, 0.68, 0.9, 0.95, 0.99, 0.9999999])
def test_the_radius_is_the_root_of_the_chi_square_quantile(probability: float, dimensions: int) -> None:
    from scipy.stats import chi2  # half a second, for those who need it

    expected = math.sqrt(chi2.ppf(probability, dimensions))
    assert coverage_radius(probability, dimensions) == pytest.approx(expected, rel=1e-8)


def test_the_radii_that_everybody_quotes() -> None:
    assert [round(coverage_radius(0.95, d), 4) for d in (1, 2, 3)] == [1.96, 2.4477, 2.7955]
    assert [round(100 * probability_of(1.0, d), 2) for d in (1, 2, 3)] == [68.27, 39.35, 19.87]
    assert [round(100 * probability_of(2.0, d), 2) for d in (1, 2, 3)] == [95.45, 86.47, 73.85]


@given(st.floats(0.0, 8.0), st.sampled_from([1, 2, 3]))
def test_the_probability_is_that_of_the_chi_square(sigma: float, dimensions: int) -> None:
    from scipy.stats import chi2

    assert probability_of(sigma, dimensions) == pytest.approx(chi2.cdf(sigma**2, dimensions), abs=1e-14)


@given(st.floats(1e-4, 0.999999), st.sampled_from([1, 2, 3]))
def test_radius_and_probability_undo_each_other(probability: float, dimensions: int) -> None:
    assert probability_of(coverage_radius(probability, dimensions), dimensions) == pytest.approx(probability, rel=1e-9)


@pytest.mark.parametrize("dimensions", [1, 2, 3])
@pytest.mark.parametrize("probability", [0.3, 0.68, 0.95])
def test_as_many_samples_lie_inside_as_the_confidence_says(probability: float, dimensions: int) -> None:
    rng = np.random.default_rng(40)
    count = 100_000
    half = np.array([[2.0, 0.0, 0.0], [0.7, 0.5, 0.0], [-0.3, 0.2, 0.1]])[:dimensions, :dimensions]
    samples = rng.standard_normal((count, dimensions)) @ half.T
    sizes, directions = ellipsoid_axes(half @ half.T, coverage_radius(probability, dimensions))
    inside = np.mean(np.sum((samples @ directions.T / sizes) ** 2, axis=1) <= 1.0)
    assert inside == pytest.approx(probability, abs=5.0 * math.sqrt(probability * (1.0 - probability) / count))


@pytest.mark.parametrize(
    ("probability", "dimensions"),
    [(0.0, 2), (1.0, 2), (-0.1, 3), (1.5, 1), (95.0, 2), (math.nan, 2), (math.inf, 2), (0.95, 0), (0.95, 4)],
)
def test_a_confidence_that_is_none_is_refused(probability: float, dimensions: int) -> None:
    with pytest.raises(SurveyError, match=rf"expected 0\.\.1 in 1, 2 or 3 dimensions, got .* in {dimensions}"):
        coverage_radius(probability, dimensions)


@pytest.mark.parametrize("dimensions", [0, 4, -1])
def test_a_probability_in_other_dimensions_is_refused(dimensions: int) -> None:
    with pytest.raises(SurveyError, match="1, 2 or 3 dimensions"):
        probability_of(2.0, dimensions)


@given(ENTRIES, st.floats(0.1, 4.0))
def test_every_point_of_an_outline_lies_on_the_ellipse(entries: list[float], sigma: float) -> None:
    cov = covariance(entries, 2)
    points = ellipse_outline(cov, sigma, 37)
    assert points.shape == (37, 2)
    np.testing.assert_allclose(points[0], points[-1], atol=1e-9)
    distance = np.einsum("ni,ij,nj->n", points, np.linalg.inv(cov), points)
    np.testing.assert_allclose(distance, sigma**2, rtol=1e-6)


@given(ENTRIES, st.floats(0.1, 4.0))
def test_the_plan_ellipse_is_the_outline_of_the_covariance_in_plan(entries: list[float], sigma: float) -> None:
    cov = covariance(entries)
    ellipse = plan_ellipse(cov, sigma)
    radii = np.linalg.norm(ellipse_outline(cov[:2, :2], sigma, 721), axis=1)
    assert ellipse.major == pytest.approx(float(radii.max()), rel=1e-4)
    assert ellipse.minor == pytest.approx(float(radii.min()), rel=1e-2)
    assert ellipse.major >= ellipse.minor > 0.0
    assert 0.0 <= ellipse.azimuth < math.pi
    direction = np.array([math.cos(ellipse.azimuth), math.sin(ellipse.azimuth)])
    assert sigma**2 * direction @ cov[:2, :2] @ direction == pytest.approx(ellipse.major**2, rel=1e-9)


@given(st.floats(-1e-15, 1e-15))
def test_an_ellipse_along_north_has_an_azimuth_within_half_a_turn(skew: float) -> None:
    azimuth = plan_ellipse(np.array([[2.0, skew], [skew, 1.0]])).azimuth
    assert 0.0 <= azimuth < math.pi
    assert abs(math.sin(azimuth)) < 1e-12


@pytest.mark.parametrize(("azimuth_deg"), [0.0, 30.0, 90.0, 135.0, 179.0])
def test_the_larger_axis_points_where_the_covariance_was_stretched(azimuth_deg: float) -> None:
    c, s = math.cos(math.radians(azimuth_deg)), math.sin(math.radians(azimuth_deg))
    turn = np.array([[c, -s], [s, c]])
    ellipse = plan_ellipse(turn @ np.diag([9.0, 4.0]) @ turn.T, 2.0)
    assert (ellipse.major, ellipse.minor) == (pytest.approx(6.0), pytest.approx(4.0))
    assert math.cos(2.0 * (ellipse.azimuth - math.radians(azimuth_deg))) == pytest.approx(1.0)


@given(ENTRIES, st.floats(0.1, 4.0))
def test_axes_put_together_are_the_covariance(entries: list[float], sigma: float) -> None:
    cov = covariance(entries)
    sizes, directions = ellipsoid_axes(cov, sigma)
    assert np.all(np.diff(sizes) <= 0.0)
    np.testing.assert_allclose(directions @ directions.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(directions.T @ np.diag((sizes / sigma) ** 2) @ directions, cov, atol=1e-10 * cov.max())


def test_a_flat_region_has_an_axis_of_zero() -> None:
    sizes, _ = ellipsoid_axes(np.diag([4.0, 0.0, 1.0]))
    np.testing.assert_array_equal(sizes, [2.0, 1.0, 0.0])
    ellipse = plan_ellipse(np.array([[1.0, 1.0], [1.0, 1.0 - 1e-16]]))
    assert ellipse.minor == pytest.approx(0.0, abs=1e-7)


@given(ENTRIES)
def test_a_covariance_is_accepted(entries: list[float]) -> None:
    cov = covariance(entries)
    check_covariance(cov, "station 3")
    check_covariance(cov * 1e-12, "station 3")
    with pytest.raises(SurveyError, match="station 3: the covariance is singular"):
        check_covariance(-cov, "station 3")


@pytest.mark.parametrize(
    ("cov", "message"),
    [
        (np.full((2, 2), np.nan), "wall: expected a finite covariance"),
        (np.diag([1.0, np.inf]), "wall: expected a finite covariance"),
        (np.array([[1.0, 0.2], [0.1, 1.0]]), "wall: expected a symmetric covariance"),
        (np.zeros((2, 2)), "wall: the covariance is singular"),
        (np.zeros((3, 3)), "wall: the covariance is singular"),
        (np.diag([1.0, 0.0]), r"wall: the covariance is singular, its variances along its axes are 0, 1 m\^2"),
        (np.array([[1.0, 1.0], [1.0, 1.0]]), "wall: the covariance is singular"),
        (np.array([[1.0, 2.0], [2.0, 1.0]]), "wall: the covariance is singular, .* are -1, 3"),
        (-np.eye(3), "wall: the covariance is singular"),
    ],
)
def test_what_is_no_covariance_is_refused_with_its_place(cov: np.ndarray, message: str) -> None:
    with pytest.raises(SurveyError, match=message):
        check_covariance(cov, "wall")
