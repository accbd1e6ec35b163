"""Direction of a stop from its specific force and yaw, against known answers and against sampling."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from groundstation.errors import SurveyError
from groundstation.survey.fusion.packed import Packed
from groundstation.survey.fusion.resolve import (
    Direction,
    Quality,
    angle_stds,
    check_all,
    combine_imus,
    direction_angles,
    is_covariance,
    resolve_direction,
)
from groundstation.survey.fusion.sphere_direction import SphereDirection, stds_of_directions

G = 9.81
DEG = math.pi / 180.0


def force_at_rest(inclination: float, azimuth: float, yaw: float) -> np.ndarray:
    """Specific force of a tube at rest: up, in the body's axes."""
    return G * np.array(
        [
            math.sin(inclination) * math.cos(azimuth - yaw),
            math.sin(inclination) * math.sin(azimuth - yaw),
            -math.cos(inclination),
        ]
    )


def direction_of(force: np.ndarray, yaw: float) -> Direction:
    return resolve_direction(force, np.eye(3) * 1e-9, yaw, 0.0).direction


def tangent_of(force: np.ndarray, yaw: float) -> np.ndarray:
    direction = direction_of(force, yaw)
    return np.array([*direction.lean, direction.down])


@pytest.mark.parametrize("azimuth_deg", [0.0, 90.0, 180.0, 270.0])
def test_a_tube_leaning_north_has_azimuth_zero_and_leaning_east_ninety(azimuth_deg: float) -> None:
    direction = direction_of(force_at_rest(2.0 * DEG, azimuth_deg * DEG, yaw=0.0), 0.0)
    inclination, azimuth = direction_angles(direction.lean, direction.down)
    assert inclination == pytest.approx(2.0 * DEG)
    assert azimuth == pytest.approx(azimuth_deg * DEG, abs=1e-9)


@given(
    inclination=st.floats(1e-4, math.pi - 1e-4),
    azimuth=st.floats(0.0, 2.0 * math.pi - 1e-6),
    yaw=st.floats(-20.0, 20.0),
)
def test_direction_comes_back_whatever_the_yaw(inclination: float, azimuth: float, yaw: float) -> None:
    direction = direction_of(force_at_rest(inclination, azimuth, yaw), yaw)
    got = direction_angles(direction.lean, direction.down)
    assert got[0] == pytest.approx(inclination, abs=1e-9)
    assert math.cos(got[1] - azimuth) == pytest.approx(1.0, abs=1e-12)


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_an_azimuth_is_never_a_whole_turn(north: float, east: float, down: float) -> None:
    inclination, azimuth = direction_angles(np.array([north, east]), down)
    assert 0.0 <= azimuth < 2.0 * math.pi
    assert 0.0 <= inclination <= math.pi


def test_an_azimuth_a_hair_west_of_north_is_north() -> None:
    assert direction_angles(np.array([1.0, -1e-300]), 0.0)[1] == 0.0


def test_a_vertical_tube_has_a_lean_of_zero_and_no_azimuth() -> None:
    direction = resolve_direction(np.array([0.0, 0.0, -G]), np.eye(3) * 1e-6, 1.0, 1e-4).direction
    assert np.all(direction.lean == 0.0)
    _, sigma_azimuth = angle_stds(direction.lean, direction.down, direction.cov)
    assert stds_of_directions([direction])[0][1] == math.pi
    assert sigma_azimuth == math.pi
    assert np.all(np.isfinite(direction.cov))


@given(
    inclination=st.floats(0.0, math.pi),
    azimuth=st.floats(0.0, 6.28),
    yaw=st.floats(-7.0, 7.0),
    size=st.floats(0.5, 20.0),
)
def test_what_an_error_does_is_the_slope_of_the_direction(
    inclination: float, azimuth: float, yaw: float, size: float
) -> None:
    force, step = force_at_rest(inclination, azimuth, yaw) * size / G, 1e-5
    found = resolve_direction(force, np.eye(3), yaw, 0.0)
    by_yaw = (tangent_of(force, yaw + step) - tangent_of(force, yaw - step)) / (2.0 * step)
    np.testing.assert_allclose(found.by_yaw, by_yaw, atol=1e-8)
    for axis, unit in enumerate(np.eye(3) * step):
        slope = (tangent_of(force + unit, yaw) - tangent_of(force - unit, yaw)) / (2.0 * step)
        np.testing.assert_allclose(found.by_force[:, axis], slope, atol=1e-8)


@pytest.mark.slow
def test_covariance_of_the_lean_is_what_sampling_gives() -> None:
    generator = np.random.default_rng(1)
    inclination, azimuth, yaw = 3.0 * DEG, 70.0 * DEG, 200.0 * DEG
    force, force_std, yaw_std, joint_std = force_at_rest(inclination, azimuth, yaw), 3e-3, 0.3 * DEG, 0.2 * DEG
    resolved = resolve_direction(force, np.eye(3) * force_std**2, yaw, yaw_std**2)
    claimed = SphereDirection(resolved.tangent, resolved.cov, Packed(joint_std * resolved.by_yaw[:, None]))
    samples = np.array(
        [
            direction_of(
                force + force_std * generator.standard_normal(3),
                yaw + yaw_std * generator.standard_normal() + joint_std * generator.standard_normal(),
            ).lean
            for _ in range(20_000)
        ]
    )
    both = claimed.total_cov
    np.testing.assert_allclose(np.cov(samples.T), both, rtol=0.05, atol=0.03 * float(np.trace(both)))
    sampled = np.array([direction_angles(lean, claimed.down) for lean in samples])
    np.testing.assert_allclose(sampled.std(axis=0), angle_stds(claimed.lean, claimed.down, both), rtol=0.03)


def test_a_direction_keeps_its_random_part_apart_from_what_it_shares() -> None:
    resolved = resolve_direction(force_at_rest(0.1, 1.0, 2.0), np.eye(3) * 1e-6, 2.0, 1e-6)
    assert resolved.direction.shared.shape == (2, 0)
    shared = np.array([[1e-3, 0.0], [0.0, 2e-3], [0.0, 0.0]])
    lean = SphereDirection(resolved.tangent, resolved.cov, Packed(shared))
    np.testing.assert_array_equal(lean.cov, resolved.direction.cov)
    np.testing.assert_allclose(lean.total_cov - lean.cov, np.diag([1e-6, 4e-6]), atol=1e-18)


@pytest.mark.parametrize("force", [np.zeros(3), np.array([math.nan, 0.0, 1.0]), np.array([math.inf, 0.0, 1.0])])
def test_no_force_is_no_survey(force: np.ndarray) -> None:
    with pytest.raises(SurveyError, match="specific force"):
        resolve_direction(force, np.eye(3), 0.0, 0.0)


@pytest.mark.parametrize("yaw", [math.nan, math.inf, -math.inf])
def test_a_yaw_that_is_no_number_is_no_survey(yaw: float) -> None:
    with pytest.raises(SurveyError, match="yaw"):
        resolve_direction(np.array([0.0, 0.0, -G]), np.eye(3), yaw, 0.0)


@pytest.mark.parametrize(
    "cov",
    [
        np.zeros((3, 3)),
        np.array([[1e-6, 5.0, 0.0], [5.0, 1e-6, 0.0], [0.0, 0.0, 1e-6]]),
        np.array([[1e-6, 1e-7, 0.0], [-1e-7, 1e-6, 0.0], [0.0, 0.0, 1e-6]]),
        np.diag([1e-6, math.nan, 1e-6]),
    ],
    ids=["zero", "indefinite", "asymmetric", "nan"],
)
def test_what_is_no_covariance_is_no_survey(cov: np.ndarray) -> None:
    assert not is_covariance(cov)
    with pytest.raises(SurveyError, match="force covariance"):
        combine_imus(np.array([[0.0, 0.0, -G]]), cov[None])


def test_one_bad_covariance_among_good_ones_is_found() -> None:
    good = np.eye(3) * 1e-6
    assert is_covariance(np.array([good, good]))
    assert not is_covariance(np.array([good, -good]))


@given(
    st.integers(2, 3),
    st.lists(st.floats(-3.0, 3.0), min_size=9, max_size=9),
    st.floats(-160.0, 160.0),
    st.floats(0.0, 1.0),
)
@example(3, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], 150.0, 0.0)
@example(3, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], -8.0, 0.0)
def test_a_matrix_alone_is_judged_as_among_many(k: int, entries: list[float], exponent: float, share: float) -> None:
    """Few are looked at by their determinants, many by their eigenvalues; hostile sizes raise in neither."""
    root = np.array(entries).reshape(3, 3)[:k, :k]
    cov = (root @ root.T - 0.3 * share * np.eye(k) + 1e-12 * share * np.triu(root, 1)) * 10.0**exponent
    assert is_covariance(cov) == is_covariance(np.repeat(cov[None], 100, axis=0))


def test_a_direction_without_uncertainty_across_the_tube_is_no_survey() -> None:
    with pytest.raises(SurveyError, match="across the tube"):
        resolve_direction(force_at_rest(0.5, 0.0, 0.0), np.zeros((3, 3)), 0.0, 1e-6)


@pytest.mark.parametrize("inclination_deg", [0.5, 30.0, 89.999, 90.0, 90.001, 135.0, 179.5])
def test_the_sigma_of_an_inclination_is_that_of_the_force_at_every_inclination(inclination_deg: float) -> None:
    """An accelerometer's noise over gravity, whatever the yaw; the azimuth's is the yaw's where the tube lies flat."""
    force = force_at_rest(inclination_deg * DEG, 2.0, 0.3)
    found = resolve_direction(force, np.eye(3) * 1e-6, 0.3, (7.0 * DEG) ** 2).direction
    ((inclination, azimuth),) = stds_of_directions([found])
    assert inclination == pytest.approx(1e-3 / G, rel=1e-9)
    across = 1e-3 / G / math.sin(inclination_deg * DEG)
    assert azimuth == pytest.approx(math.hypot(7.0 * DEG, across), rel=1e-9)


def test_quality_names_what_is_wrong() -> None:
    good, cov = force_at_rest(2.0 * DEG, 1.0, 0.0)[None, :], (np.eye(3) * (0.0034**2 / 32))[None, :, :]

    def judged(forces: np.ndarray, covs: np.ndarray, settle_time: float) -> Quality:
        mean, cov = combine_imus(forces, covs)
        return check_all(forces[None], covs[None], (mean[None], cov[None]), G, [32], [settle_time], 0.0034)[0]

    assert judged(good, cov, 19.0) == Quality.GOOD
    assert judged(good * 1.01, cov, 19.0) == Quality.GRAVITY
    assert judged(good, cov * 20.0, 19.0) == Quality.MOTION
    assert judged(good, cov, 3.0) == Quality.SETTLE
    two = np.concatenate([good, good + np.array([0.02, 0.0, 0.0])])
    assert Quality.SPREAD in judged(two, np.concatenate([cov, cov]), 19.0)


def test_imus_of_a_cluster_weigh_by_their_inverse_variance() -> None:
    forces = np.array([[1.0, 0.0, 0.0], [4.0, 0.0, 0.0]])
    mean, cov = combine_imus(forces, np.array([np.eye(3), 2.0 * np.eye(3)]))
    np.testing.assert_allclose(mean, [2.0, 0.0, 0.0])
    np.testing.assert_allclose(cov, np.eye(3) * 2.0 / 3.0)
