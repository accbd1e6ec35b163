"""Resolution, fusion and trajectory against known answers and against sampling."""

import math
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.errors import SurveyError
from groundstation.survey.fusion import StationFusion
from groundstation.survey.resolve import Lean, Quality, angle_stds, angles, check, combine_imus, resolve
from groundstation.survey.trajectory import Method, Trajectory, interpolate

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


def lean_of(inclination: float, azimuth: float, std: float = 1e-3, systematic: float = 0.0) -> Lean:
    lean = np.array([math.sin(inclination) * math.cos(azimuth), math.sin(inclination) * math.sin(azimuth)])
    return Lean(lean, math.cos(inclination), std**2 * np.eye(2), systematic * np.array([-lean[1], lean[0]]))


@pytest.mark.parametrize(("azimuth_deg", "expected_deg"), [(0.0, 0.0), (90.0, 90.0), (180.0, 180.0), (270.0, 270.0)])
def test_a_tube_leaning_north_has_azimuth_zero_and_leaning_east_ninety(azimuth_deg: float, expected_deg: float) -> None:
    force = force_at_rest(2.0 * DEG, azimuth_deg * DEG, yaw=0.0)
    direction = resolve(force, np.eye(3) * 1e-9, 0.0, 0.0, 0.0)
    inclination, azimuth = angles(direction.lean, direction.down)
    assert inclination == pytest.approx(2.0 * DEG)
    assert azimuth == pytest.approx(expected_deg * DEG, abs=1e-9)


@given(
    inclination=st.floats(1e-4, math.pi - 1e-4),
    azimuth=st.floats(0.0, 2.0 * math.pi - 1e-6),
    yaw=st.floats(-20.0, 20.0),
)
def test_direction_comes_back_whatever_the_yaw(inclination: float, azimuth: float, yaw: float) -> None:
    direction = resolve(force_at_rest(inclination, azimuth, yaw), np.eye(3) * 1e-9, yaw, 0.0, 0.0)
    got = angles(direction.lean, direction.down)
    assert got[0] == pytest.approx(inclination, abs=1e-9)
    assert math.cos(got[1] - azimuth) == pytest.approx(1.0, abs=1e-12)


def test_a_vertical_tube_has_a_lean_of_zero_and_no_azimuth() -> None:
    direction = resolve(np.array([0.0, 0.0, -G]), np.eye(3) * 1e-6, 1.0, 1e-4, 1e-4)
    assert np.all(direction.lean == 0.0)
    _, sigma_azimuth = angle_stds(direction.lean, direction.down, direction.cov)
    assert sigma_azimuth == math.pi
    assert np.all(np.isfinite(direction.cov))


def test_covariance_of_the_lean_is_what_sampling_gives() -> None:
    generator = np.random.default_rng(1)
    inclination, azimuth, yaw = 3.0 * DEG, 70.0 * DEG, 200.0 * DEG
    force, force_std, yaw_std, joint_std = force_at_rest(inclination, azimuth, yaw), 3e-3, 0.3 * DEG, 0.2 * DEG
    claimed = resolve(force, np.eye(3) * force_std**2, yaw, yaw_std**2, joint_std**2)
    both = claimed.cov + np.outer(claimed.systematic, claimed.systematic)
    samples = np.array(
        [
            resolve(
                force + force_std * generator.standard_normal(3),
                np.eye(3),
                yaw + yaw_std * generator.standard_normal() + joint_std * generator.standard_normal(),
                0.0,
                0.0,
            ).lean
            for _ in range(20_000)
        ]
    )
    np.testing.assert_allclose(np.cov(samples.T), both, rtol=0.05, atol=0.03 * float(np.trace(both)))
    sampled = np.array([angles(lean, claimed.down) for lean in samples])
    np.testing.assert_allclose(sampled.std(axis=0), angle_stds(claimed.lean, claimed.down, both), rtol=0.03)


@pytest.mark.parametrize("force", [np.zeros(3), np.array([math.nan, 0.0, 1.0])])
def test_no_force_is_no_survey(force: np.ndarray) -> None:
    with pytest.raises(SurveyError, match="specific force"):
        resolve(force, np.eye(3), 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "cov",
    [
        np.zeros((3, 3)),
        np.array([[1e-6, 5.0, 0.0], [5.0, 1e-6, 0.0], [0.0, 0.0, 1e-6]]),
        np.array([[1e-6, 1e-7, 0.0], [-1e-7, 1e-6, 0.0], [0.0, 0.0, 1e-6]]),
    ],
    ids=["zero", "indefinite", "asymmetric"],
)
def test_what_is_no_covariance_is_no_survey(cov: np.ndarray) -> None:
    with pytest.raises(SurveyError, match="force covariance"):
        combine_imus(np.array([[0.0, 0.0, -G]]), cov[None])


def test_a_direction_without_uncertainty_across_the_lean_is_no_survey() -> None:
    with pytest.raises(SurveyError, match="lean"):
        resolve(np.array([G, 0.0, 0.0]), np.eye(3) * 1e-6, 0.0, 1e-6, 0.0, bias_var=0.0)


def test_quality_names_what_is_wrong() -> None:
    good, cov = force_at_rest(2.0 * DEG, 1.0, 0.0)[None, :], (np.eye(3) * (0.0034**2 / 32))[None, :, :]
    assert check(good, cov, G, 32, 19.0, 0.0034) == Quality.GOOD
    assert check(good * 1.01, cov, G, 32, 19.0, 0.0034) == Quality.GRAVITY
    assert check(good, cov * 20.0, G, 32, 19.0, 0.0034) == Quality.MOTION
    assert check(good, cov, G, 32, 3.0, 0.0034) == Quality.SETTLE
    two = np.concatenate([good, good + np.array([0.02, 0.0, 0.0])])
    assert Quality.SPREAD in check(two, np.concatenate([cov, cov]), G, 32, 19.0, 0.0034)


def test_imus_of_a_cluster_weigh_by_their_inverse_variance() -> None:
    forces = np.array([[1.0, 0.0, 0.0], [4.0, 0.0, 0.0]])
    mean, cov = combine_imus(forces, np.array([np.eye(3), 2.0 * np.eye(3)]))
    np.testing.assert_allclose(mean, [2.0, 0.0, 0.0])
    np.testing.assert_allclose(cov, np.eye(3) * 2.0 / 3.0)


def test_two_equal_readings_halve_the_variance_and_leave_the_joint_error_alone() -> None:
    fusion = StationFusion()
    reading = lean_of(2.0 * DEG, 1.0, 1e-3, systematic=1e-2)
    fusion.add(reading)
    fusion.add(reading)
    fused = fusion.fused()
    np.testing.assert_allclose(fused.lean, reading.lean)
    np.testing.assert_allclose(fused.cov, reading.cov / 2.0)
    np.testing.assert_allclose(fused.systematic, reading.systematic)
    assert fused.down == pytest.approx(reading.down)


@settings(max_examples=50)
@given(
    st.lists(
        st.tuples(st.floats(0.001, 0.5), st.floats(0.0, 6.28), st.floats(1e-5, 1e-2), st.floats(0.0, 0.02)),
        min_size=2,
        max_size=12,
    ),
    st.randoms(),
)
def test_fusion_takes_any_order_and_never_averages_the_systematic_error(
    readings: list[tuple[float, float, float, float]], shuffler: random.Random
) -> None:
    leans = [lean_of(*reading) for reading in readings]
    shuffled = leans[:]
    shuffler.shuffle(shuffled)
    one, other = StationFusion(), StationFusion()
    for a, b in zip(leans, shuffled, strict=True):
        one.add(a)
        other.add(b)
    first, second = one.fused(), other.fused()
    np.testing.assert_allclose(first.lean, second.lean, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(first.cov, second.cov, rtol=1e-9)
    assert np.trace(first.cov) <= min(np.trace(lean.cov) for lean in leans) * (1.0 + 1e-9)
    same = StationFusion()
    for _ in readings:
        same.add(lean_of(0.1, 1.0, 1e-3, 0.01))
    np.testing.assert_allclose(same.fused().systematic, lean_of(0.1, 1.0, 1e-3, 0.01).systematic)


def test_balanced_tangential_gives_the_printed_steps_of_table_4_29() -> None:
    trajectory = Trajectory()
    for md in (2.0, 4.0):
        trajectory.append(md, lean_of(1.0 * DEG, 120.0 * DEG))
    steps_cm = 100.0 * np.diff([p.position for p in trajectory.points], axis=0)
    np.testing.assert_allclose(steps_cm[0], [-0.873, 1.511, 199.985], atol=5e-4 * 2)
    np.testing.assert_allclose(steps_cm[1], [-1.745, 3.023, 199.97], atol=5e-4 * 2)


@given(
    st.lists(st.tuples(st.floats(0.1, 30.0), st.floats(0.0, 1.0), st.floats(0.0, 6.28)), min_size=1, max_size=10),
    st.sampled_from(Method),
)
def test_appending_gives_what_the_whole_hole_gives_at_once(
    rows: list[tuple[float, float, float]], method: Method
) -> None:
    trajectory = Trajectory(method)
    mds = np.cumsum([length for length, _, _ in rows])
    leans = [lean_of(inclination, azimuth, 1e-3, 5e-3) for _, inclination, azimuth in rows]
    for count, (md, lean) in enumerate(zip(mds, leans, strict=True), 1):
        point = trajectory.append(float(md), lean)
        again = Trajectory(method)
        for earlier_md, earlier in zip(mds[:count], leans[:count], strict=True):
            again.append(float(earlier_md), earlier)
        np.testing.assert_array_equal(point.position, again.points[-1].position)
        np.testing.assert_allclose(point.cov, covariance_at_once(mds[:count], leans[:count]), rtol=1e-9, atol=1e-18)


def covariance_at_once(mds: np.ndarray, leans: list[Lean]) -> np.ndarray:
    """Covariance of the last position from every station's weight in it: no running sum."""
    ends = np.concatenate([[0.0], mds, mds[-1:]])
    random, systematic = np.zeros((3, 3)), np.zeros(3)
    for k, lean in enumerate(leans, 1):
        weight = 0.5 * (ends[k + 1] - ends[k - 1])
        jacobian = weight * np.array([[1.0, 0.0], [0.0, 1.0], -lean.lean / lean.down])
        random = random + jacobian @ lean.cov @ jacobian.T
        systematic = systematic + jacobian @ lean.systematic
    return random + np.outer(systematic, systematic)


def test_minimum_curvature_follows_a_circle() -> None:
    radius, azimuth = 30.0, 0.7
    trajectory = Trajectory(Method.MINIMUM_CURVATURE)
    for angle in (0.3, 0.8, 1.5):
        trajectory.append(radius * angle, lean_of(angle, azimuth))
    outward = radius * (1.0 - math.cos(1.5))
    expected = [outward * math.cos(azimuth), outward * math.sin(azimuth), radius * math.sin(1.5)]
    np.testing.assert_allclose(trajectory.points[-1].position, expected, atol=1e-9)


def test_interpolation_runs_on_the_arc() -> None:
    radius = 30.0
    trajectory = Trajectory(Method.MINIMUM_CURVATURE)
    trajectory.append(radius * 1.2, lean_of(1.2, 0.0))
    point = interpolate(trajectory.points, radius * 0.5)
    np.testing.assert_allclose(point.position, [radius * (1.0 - math.cos(0.5)), 0.0, radius * math.sin(0.5)], atol=1e-9)
    for end in trajectory.points:
        np.testing.assert_allclose(interpolate(trajectory.points, end.md).position, end.position, atol=1e-12)
    with pytest.raises(SurveyError, match=r"0\.\.36 m"):
        interpolate(trajectory.points, 40.0)


def test_a_depth_that_does_not_grow_is_refused() -> None:
    trajectory = Trajectory()
    trajectory.append(2.0, lean_of(0.01, 0.0))
    with pytest.raises(SurveyError, match="beyond 2 m"):
        trajectory.append(2.0, lean_of(0.01, 0.0))


def test_covariance_of_the_position_is_what_sampling_gives() -> None:
    generator = np.random.default_rng(2)
    mds, azimuths = [2.0, 4.0, 7.0, 8.0], [0.3, 0.5, 1.0, 1.1]
    inclinations = [0.02, 0.05, 0.3, 0.4]
    std, joint_std = 1e-3, 5e-3
    claimed = Trajectory()
    for md, inclination, azimuth in zip(mds, inclinations, azimuths, strict=True):
        claimed.append(md, lean_of(inclination, azimuth, std, joint_std))
    toes = []
    for _ in range(20_000):
        joint = joint_std * generator.standard_normal()
        sampled = Trajectory()
        for md, inclination, azimuth in zip(mds, inclinations, azimuths, strict=True):
            lean = lean_of(inclination, azimuth + joint).lean + std * generator.standard_normal(2)
            sampled.append(md, Lean(lean, math.sqrt(1.0 - float(lean @ lean)), np.zeros((2, 2)), np.zeros(2)))
        toes.append(sampled.points[-1].position)
    expected = np.cov(np.array(toes).T)
    np.testing.assert_allclose(claimed.points[-1].cov, expected, rtol=0.06, atol=0.03 * float(np.trace(expected)))
