"""A joint of two columns: how thick it is, what may deviate, and how probable it is that it is too thin."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.special import ndtr

from groundstation.errors import SurveyError
from groundstation.survey.wall.column_joint import joint_thickness, largest_distance, probability_beyond, shift_margin

DEG = math.pi / 180.0
RADIUS, SPACING, REQUIRED, LENGTH = 0.60, 0.75, 0.80, 30.0
LIMIT = 2.0 * math.sqrt(RADIUS**2 - 0.25 * REQUIRED**2)  # 0.894 m


def rotation(angle: float) -> np.ndarray:
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


def cov_of(std_a: float, std_b: float, angle: float = 0.0) -> np.ndarray:
    turn = rotation(angle)
    return turn @ np.diag([std_a**2, std_b**2]) @ turn.T


def beyond(mean: np.ndarray, cov: np.ndarray, limit: float) -> float:
    return float(probability_beyond(mean, cov, limit))


def along_the_wide_axis(mean: np.ndarray, std_a: float, std_b: float, limit: float) -> float:
    """The same probability by a fine trapezoid along the axis of ``std_b``, the other one in closed form."""
    a, b = mean
    low, high = max(-limit, b - 12.0 * std_b), min(limit, b + 12.0 * std_b)
    if low >= high:
        return 1.0
    angle = np.linspace(math.asin(low / limit), math.asin(high / limit), 100_001)
    reach, chord = limit * np.sin(angle), limit * np.cos(angle)
    density = np.exp(-0.5 * ((reach - b) / std_b) ** 2) / (std_b * math.sqrt(math.tau))
    tails = ndtr((-chord - a) / std_a) + ndtr((a - chord) / std_a)
    outside = ndtr((-limit - b) / std_b) + ndtr((b - limit) / std_b)
    return float(outside + np.trapezoid(density * tails * chord, angle))


def test_the_margin_of_the_published_wall() -> None:
    shift, angle = shift_margin(RADIUS, REQUIRED, SPACING, LENGTH)
    assert shift == pytest.approx(0.1444, abs=5e-5)
    assert math.degrees(angle) == pytest.approx(0.276, abs=5e-4)


def test_half_the_margin_is_left_to_each_when_both_deviate() -> None:
    shift, _ = shift_margin(RADIUS, REQUIRED, SPACING, LENGTH)
    for each in (0.5 * shift, 0.5 * shift + 1e-6):
        both = joint_thickness(np.array([SPACING + each + each]), RADIUS)[0]
        assert both == pytest.approx(REQUIRED, abs=1e-5)
        assert bool(both >= REQUIRED - 1e-9) is (each <= 0.5 * shift)


def test_a_column_that_deviates_too_little_to_begin_with_has_a_negative_margin() -> None:
    shift, angle = shift_margin(RADIUS, REQUIRED, 1.0, LENGTH)
    assert shift == pytest.approx(LIMIT - 1.0)
    assert angle < 0.0


@pytest.mark.parametrize(
    ("distance", "expected"),
    [(0.0, 1.2), (SPACING, 2.0 * math.sqrt(0.36 - 0.140625)), (LIMIT, 0.8), (1.2, 0.0), (1.3, -0.1), (3.0, -1.8)],
)
def test_a_joint_is_as_thick_as_its_lens_is_long_and_a_gap_is_negative(distance: float, expected: float) -> None:
    assert joint_thickness(np.array([distance]), RADIUS)[0] == pytest.approx(expected, abs=1e-12)


@given(st.floats(0.1, 3.0), st.floats(0.0, 0.999))
def test_the_largest_distance_makes_a_joint_of_just_the_thickness(radius: float, share: float) -> None:
    required = 2.0 * radius * share
    distance = largest_distance(radius, required)
    assert joint_thickness(np.array([distance]), radius)[0] == pytest.approx(required, abs=1e-6)


@pytest.mark.parametrize("required", [1.2, 1.3, -0.1, math.nan])
def test_a_joint_that_columns_never_make_is_refused(required: float) -> None:
    with pytest.raises(SurveyError, match=r"below the diameter of 1\.2 m"):
        largest_distance(0.6, required)


@pytest.mark.slow
@pytest.mark.parametrize("std", [0.0009, 0.003, 0.01, 0.03, 0.1, 0.5, 3.0])
@pytest.mark.parametrize("direction", [0.0, 0.05, 0.3, 0.25 * math.pi, 1.53, 2.5, -3.1])
def test_alike_in_all_directions_the_probability_is_the_noncentral_chi(std: float, direction: float) -> None:
    from scipy.stats import ncx2  # half a second, for those who need it

    checked = 0
    for distance in [*np.linspace(0.0, 1.2, 13), *(LIMIT + std * np.linspace(-6.5, 3.0, 20))]:
        expected = float(ncx2.sf((LIMIT / std) ** 2, 2, (distance / std) ** 2))
        if distance >= 0.0 and 1e-12 < expected <= 1.0:
            mean = distance * np.array([math.cos(direction), math.sin(direction)])
            assert beyond(mean, cov_of(std, std), LIMIT) == pytest.approx(expected, rel=1e-6, abs=0.0), distance
            checked += 1
    assert checked > 10


@pytest.mark.parametrize("std", [0.05, 0.1, 0.127])
def test_about_the_centre_the_probability_is_rayleigh(std: float) -> None:
    expected = math.exp(-0.5 * (LIMIT / std) ** 2)
    assert beyond(np.zeros(2), cov_of(std, std), LIMIT) == pytest.approx(expected, rel=1e-9, abs=1e-19)


@pytest.mark.parametrize(
    ("mean", "std_a", "std_b", "angle"),
    [
        ((0.75, 0.0), 0.045, 0.020, 0.0),
        ((0.60, 0.30), 0.030, 0.080, -1.0),
        ((0.0, -0.50), 0.020, 0.125, 0.1),
        ((0.80, 0.10), 0.033, 0.008, -0.4),
    ],
)
def test_unlike_in_its_directions_it_is_what_sampling_gives(
    mean: tuple[float, float], std_a: float, std_b: float, angle: float
) -> None:
    generator = np.random.default_rng(6)
    draws = generator.standard_normal((400_000, 2)) * [std_a, std_b] @ rotation(angle).T + mean
    sampled = float(np.mean(np.hypot(draws[:, 0], draws[:, 1]) > LIMIT))
    assert 3e-4 < sampled < 1e-2
    assert beyond(np.array(mean), cov_of(std_a, std_b, angle), LIMIT) == pytest.approx(sampled, rel=0.2)


def in_study(*values: float) -> list[Any]:
    """The values between, which are tried in `make study`."""
    return [pytest.param(value, marks=pytest.mark.statistical) for value in values]


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [1.0, 10.0, 1000.0, *in_study(2.0, 100.0)])
@pytest.mark.parametrize("wide", [0.0009, 0.01, 1.0, *in_study(0.003, 0.1)])
def test_whatever_the_shape_of_the_region_it_is_the_integral(ratio: float, wide: float) -> None:
    generator = np.random.default_rng(7)
    checked = 0
    for _ in range(30):
        narrow, turn = wide / ratio, generator.uniform(0.0, math.tau)
        towards = generator.choice([generator.uniform(0.0, math.tau), *generator.normal([0.0, 0.5 * math.pi], 0.1)])
        size = LIMIT + generator.normal(0.0, 3.0) * wide
        mean = size * np.array([math.cos(towards), math.sin(towards)])
        expected = along_the_wide_axis(mean, narrow, wide, LIMIT)
        if expected > 1e-11:
            found = beyond(rotation(turn) @ mean, cov_of(narrow, wide, turn), LIMIT)
            assert found == pytest.approx(expected, rel=1e-4, abs=0.0), (mean, turn)
            checked += 1
    assert checked > 10


@pytest.mark.parametrize(("mean", "expected"), [(0.75, 0.0), (1.0, 1.0), (-1.0, 1.0)])
def test_without_uncertainty_a_joint_is_thin_or_not(mean: float, expected: float) -> None:
    for at in ([mean, 0.0], [0.0, mean]):
        assert beyond(np.array(at), np.zeros((2, 2)), LIMIT) == expected


def test_uncertain_in_one_direction_only_it_is_the_tail_of_one_number() -> None:
    for angle in (0.0, 0.6, 2.0):
        mean = rotation(angle) @ np.array([0.0, 0.75])
        found = beyond(mean, cov_of(0.0, 0.05, angle), LIMIT)
        assert found == pytest.approx(float(ndtr((0.75 - LIMIT) / 0.05)), rel=1e-6)


Std = st.floats(1e-3, 1.0)
Offset = st.floats(-1.5, 1.5)


@example(0.89, 0.05, 0.001, 0.001, 0.5, 0.894)
@example(0.87, 0.08, 0.003, 0.003, 1.0, 0.894)
@given(Offset, Offset, Std, Std, st.floats(-4.0, 4.0), st.floats(0.05, 2.0))
def test_turning_everything_changes_no_probability(
    north: float, east: float, std_a: float, std_b: float, angle: float, limit: float
) -> None:
    mean, turn = np.array([north, east]), rotation(angle)
    before = beyond(mean, cov_of(std_a, std_b), limit)
    after = beyond(turn @ mean, turn @ cov_of(std_a, std_b) @ turn.T, limit)
    assert 0.0 <= before <= 1.0
    assert after == pytest.approx(before, rel=1e-4, abs=1e-12)


@given(Offset, Offset, Std, Std, st.floats(-4.0, 4.0), st.floats(0.05, 2.0), st.floats(1.0, 2.0))
def test_a_larger_limit_is_passed_less_often(
    north: float, east: float, std_a: float, std_b: float, angle: float, limit: float, factor: float
) -> None:
    mean, cov = np.array([north, east]), cov_of(std_a, std_b, angle)
    assert beyond(mean, cov, limit * factor) <= beyond(mean, cov, limit) * (1.0 + 1e-6) + 1e-12


def test_many_joints_at_once_are_those_one_by_one() -> None:
    generator = np.random.default_rng(8)
    means = generator.normal(0.6, 0.2, (3, 5, 2))
    roots = generator.normal(0.0, 0.1, (3, 5, 2, 2))
    covs = roots @ np.swapaxes(roots, -1, -2)
    together = probability_beyond(means, covs, LIMIT)
    assert together.shape == (3, 5)
    for at in np.ndindex(3, 5):
        assert together[at] == pytest.approx(beyond(means[at], covs[at], LIMIT), rel=1e-12)
