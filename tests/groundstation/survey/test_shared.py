"""Errors that readings share, by name, and the covariance they claim against a string with drawn errors."""

import math
import tracemalloc
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from groundstation.survey.fusion.fusion import fuse_by_bayes
from groundstation.survey.fusion.packed import Packed
from groundstation.survey.fusion.resolve import Direction, Resolved, resolve_direction
from groundstation.survey.fusion.shared import KIND_NAMES, SharedErrors, add_shared_errors, widen_shared_errors
from groundstation.survey.fusion.sphere_direction import SphereDirection
from groundstation.survey.well.ellipsoid import coverage_radius
from groundstation.survey.well.methods import Method
from groundstation.survey.well.trajectory import Trajectory

G = 9.81
DEG = math.pi / 180.0


def force_at_rest(inclination: float, azimuth: float, yaw: float) -> np.ndarray:
    """Specific force of a tube at rest: up, in the body's axes."""
    s = math.sin(inclination)
    return G * np.array([s * math.cos(azimuth - yaw), s * math.sin(azimuth - yaw), -math.cos(inclination)])


def stop(inclination: float = 0.2, azimuth: float = 1.0, yaw: float = 0.4) -> Resolved:
    return resolve_direction(force_at_rest(inclination, azimuth, yaw), np.eye(3) * 1e-6, yaw, 1e-6)


def common_yaw_var(one: Direction, other: Direction) -> float:
    """Variance (rad^2) of the yaw error that two readings of the same stop have in common."""
    by_yaw = stop().by_yaw
    columns, others = (padded[:, : min(one.width, other.width)] for padded in (one.shared, other.shared))
    return float(by_yaw[:2] @ (columns @ others.T) @ by_yaw[:2])


def yaw_only(errors: SharedErrors, tube: int, above: list[int] | None, joints: float, mount: float = 0.0) -> Direction:
    """Reading whose yaw errors are so large in unit of its slope that the common variance reads in rad^2."""
    size = float(stop().by_yaw @ stop().by_yaw)
    return errors.direction_of(stop(), tube, above, (joints + mount) / size**2, mount / size**2, 0.0)


def by_kind(errors: SharedErrors, shared: np.ndarray) -> dict[str, np.ndarray]:
    """Variances of what has these columns, by the kind of error."""
    return dict(zip(KIND_NAMES, errors.variances(shared[None])[0], strict=True))


def test_joints_are_shared_by_the_tubes_below_them() -> None:
    errors = SharedErrors()
    bottom = yaw_only(errors, 3, [2, 1], joints=3.0, mount=1.0)
    middle = yaw_only(errors, 2, [1], joints=2.0, mount=1.0)
    top = yaw_only(errors, 1, [], joints=1.0, mount=1.0)
    assert common_yaw_var(bottom, middle) == pytest.approx(2.0)
    assert common_yaw_var(bottom, top) == pytest.approx(1.0)
    assert common_yaw_var(middle, top) == pytest.approx(1.0)
    assert common_yaw_var(bottom, bottom) == pytest.approx(4.0)
    assert common_yaw_var(top, bottom) == pytest.approx(common_yaw_var(bottom, top))


def test_the_drive_joint_differs_by_the_tube_on_top_and_closed_joints_stay() -> None:
    errors = SharedErrors()
    before = yaw_only(errors, 3, [2], joints=2.0)
    after = yaw_only(errors, 3, [2, 1], joints=3.0)
    again = yaw_only(errors, 3, [2, 1], joints=3.0)
    alone = yaw_only(errors, 3, [], joints=1.0)
    assert common_yaw_var(before, after) == pytest.approx(1.0)
    assert common_yaw_var(alone, before) == pytest.approx(0.0, abs=1e-15)
    assert common_yaw_var(after, again) == pytest.approx(3.0)


def test_a_joint_belongs_to_both_of_its_tubes() -> None:
    errors = SharedErrors()
    one = yaw_only(errors, 1, [3], joints=2.0)
    swapped = yaw_only(errors, 2, [3], joints=2.0)
    elsewhere = yaw_only(errors, 1, [4], joints=2.0)
    assert common_yaw_var(one, swapped) == pytest.approx(1.0)  # the drive joint alone
    assert common_yaw_var(one, elsewhere) == pytest.approx(0.0, abs=1e-15)


def test_a_mount_goes_with_its_tube_and_with_no_other() -> None:
    errors = SharedErrors()
    one = yaw_only(errors, 1, [2], joints=0.0, mount=5.0)
    elsewhere = yaw_only(errors, 1, [4, 9], joints=0.0, mount=5.0)
    other = yaw_only(errors, 2, [], joints=0.0, mount=5.0)
    assert common_yaw_var(one, elsewhere) == pytest.approx(5.0)
    assert common_yaw_var(one, other) == pytest.approx(0.0, abs=1e-15)


def test_an_unknown_order_is_one_error_that_all_share() -> None:
    errors = SharedErrors()
    one, other = yaw_only(errors, 1, None, joints=4.0), yaw_only(errors, 2, None, joints=4.0)
    known = yaw_only(errors, 1, [2], joints=4.0)
    assert common_yaw_var(one, other) == pytest.approx(4.0)
    assert common_yaw_var(one, known) == pytest.approx(0.0, abs=1e-15)


def test_biases_of_an_accelerometer_are_those_of_its_tube() -> None:
    errors, resolved, std = SharedErrors(), stop(), 3e-3
    one, again = (errors.direction_of(resolved, 1, [2], 0.0, 0.0, std) for _ in range(2))
    other = errors.direction_of(resolved, 2, [], 0.0, 0.0, std)
    np.testing.assert_allclose(
        one.shared @ one.shared.T, std**2 * (resolved.by_force @ resolved.by_force.T)[:2, :2], rtol=1e-12
    )
    np.testing.assert_array_equal(one.shared, again.shared)
    assert not np.any(one.shared @ other.shared[:, : one.shared.shape[1]].T)


def test_a_reading_met_again_needs_no_new_columns() -> None:
    errors = SharedErrors()
    first = errors.direction_of(stop(), 1, [2, 3], 1e-4, 1e-5, 1e-3)
    count = errors.count
    assert first.shared.shape == (2, count)
    errors.direction_of(stop(), 1, [2, 3], 2e-4, 1e-5, 1e-3)
    assert errors.count == count
    later = errors.direction_of(stop(), 2, [3], 1e-4, 1e-5, 1e-3)
    assert later.shared.shape == (2, errors.count)
    assert errors.count > count


@given(
    systematic_var=st.floats(0.0, 1e-2),
    mount_var=st.floats(0.0, 1e-2),
    above=st.none() | st.lists(st.integers(2, 20), max_size=8, unique=True),
    yaw=st.floats(-7.0, 7.0),
)
def test_the_constant_yaw_variance_of_a_reading_is_all_there_and_no_more(
    systematic_var: float, mount_var: float, above: list[int] | None, yaw: float
) -> None:
    resolved, errors = stop(0.3, 2.0, yaw), SharedErrors()
    lean = errors.direction_of(resolved, 1, above, systematic_var, mount_var, 0.0)
    expected = systematic_var * np.outer(resolved.by_yaw, resolved.by_yaw)[:2, :2]
    np.testing.assert_allclose(lean.shared @ lean.shared.T, expected, rtol=1e-9, atol=1e-20)
    np.testing.assert_array_equal(lean.lean, resolved.direction.lean)
    np.testing.assert_array_equal(lean.cov, resolved.direction.cov)


@given(
    st.lists(
        st.tuples(
            st.integers(1, 5),
            st.none() | st.lists(st.integers(6, 9), max_size=3, unique=True),
            st.floats(0.0, 1e-2),
            st.floats(0.0, 1e-2),
            st.floats(0.0, 1e-2),
        ),
        min_size=1,
        max_size=8,
    )
)
@pytest.mark.slow
def test_the_kinds_add_up_to_the_whole(readings: list[tuple[int, list[int] | None, float, float, float]]) -> None:
    errors = SharedErrors()
    leans = [errors.direction_of(stop(), *reading) for reading in readings]
    fused = fuse_by_bayes(leans)
    for shared in (leans[0].shared, leans[-1].shared, fused.shared):
        kinds = by_kind(errors, shared)
        assert set(kinds) == {"mounts", "joints", "accelerometer_bias", "depth"}
        assert not kinds["depth"].any()
        whole = np.diagonal(shared @ shared.T)
        np.testing.assert_allclose(sum(kinds.values()), whole, atol=1e-12 * float(whole.sum()))


def test_each_kind_holds_what_is_of_its_kind() -> None:
    errors, resolved = SharedErrors(), stop()
    yaw = resolved.by_yaw[:2] ** 2
    kinds = by_kind(errors, errors.direction_of(resolved, 1, [2, 3], 5e-4, 2e-4, 1e-3).shared)
    np.testing.assert_allclose(kinds["mounts"], 2e-4 * yaw, rtol=1e-9)
    np.testing.assert_allclose(kinds["joints"], 3e-4 * yaw, rtol=1e-9)
    biases = 1e-6 * (resolved.by_force[:2] ** 2).sum(axis=1)
    np.testing.assert_allclose(kinds["accelerometer_bias"], biases, rtol=1e-9)


@given(
    arrays(
        np.float64,
        st.tuples(st.integers(1, 3), st.integers(0, 40)),
        elements=st.one_of(st.just(0.0), st.floats(-1.0, 1.0)),
    )
)
def test_packed_columns_are_the_same_when_they_are_unpacked(columns: np.ndarray) -> None:
    np.testing.assert_array_equal(Packed(columns).columns(), columns)


def test_many_columns_of_which_few_are_known_take_little_room() -> None:
    columns = np.zeros((2, 70_000))
    columns[:, [3, 69_999]] = [[1.0, 2.0], [3.0, 4.0]]
    np.testing.assert_array_equal(SphereDirection(np.eye(3)[2], np.eye(3), Packed(columns)).shared, columns)
    tracemalloc.start()
    kept = [Packed(columns) for _ in range(100)]
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert held < len(kept) * 1000  # bytes; all of them would be a megabyte each


def test_columns_met_later_are_zero_for_those_before() -> None:
    one, other = np.array([[1.0], [2.0]]), np.array([[10.0, 20.0, 30.0], [40.0, 50.0, 60.0]])
    np.testing.assert_array_equal(widen_shared_errors(one, 3), [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    for total in (add_shared_errors(one, other), add_shared_errors(other, one)):
        np.testing.assert_array_equal(total, [[11.0, 20.0, 30.0], [42.0, 50.0, 60.0]])


MDS = (2.0, 4.0, 6.0, 8.0)
TRUE = [(4.0 * DEG, 20.0 * DEG), (8.0 * DEG, 80.0 * DEG), (12.0 * DEG, 150.0 * DEG), (9.0 * DEG, 230.0 * DEG)]
JOINT_STD, MOUNT_STD, YAW_STD = 0.25 * DEG, 0.3 * DEG, 0.1 * DEG
BIAS_STD, FORCE_STD = 8e-3, 5e-3  # m/s^2
DRAWS = (1000, 4000)  # in `make test` and in `make study`


@dataclass
class Drawn:
    """Errors of one string, drawn once each; all zero for the truth."""

    generator: np.random.Generator | None

    def __post_init__(self) -> None:
        self.known: dict[tuple[str | int, ...], np.ndarray] = {}

    def noise(self, std: float, count: int = 1) -> np.ndarray:
        return np.zeros(count) if self.generator is None else std * self.generator.standard_normal(count)

    def constant(self, std: float, *name: str | int, count: int = 1) -> np.ndarray:
        if name not in self.known:
            self.known[name] = self.noise(std, count)
        return self.known[name]

    def yaw_error(self, tube: int, above: list[int]) -> float:
        """Mount, every closed joint up to the top tube, and the joint of that one to the drive head."""
        chain = [tube, *above]
        error = self.constant(MOUNT_STD, "mount", tube) + self.constant(JOINT_STD, "drive", chain[-1])
        for lower, upper in pairwise(chain):
            error = error + self.constant(JOINT_STD, "joint", lower, upper)
        return float(error[0])


def surveyed(drawn: Drawn, errors: SharedErrors) -> Trajectory:
    """Four tubes pass four stations: at stop t tube 1 is at station t and tube t, on top, at the first."""
    readings: list[list[Direction]] = [[] for _ in MDS]
    for stop_number in range(1, 5):
        for tube in range(1, stop_number + 1):
            station, above = stop_number - tube, list(range(tube + 1, stop_number + 1))
            yaw = 0.7 * tube + 1.3 * stop_number
            force = force_at_rest(*TRUE[station], yaw)
            force = force + drawn.constant(BIAS_STD, "bias", tube, count=3) + drawn.noise(FORCE_STD, 3)
            told = yaw + drawn.yaw_error(tube, above) + float(drawn.noise(YAW_STD)[0])
            resolved = resolve_direction(force, FORCE_STD**2 * np.eye(3), told, YAW_STD**2)
            systematic_var = MOUNT_STD**2 + (len(above) + 1) * JOINT_STD**2
            readings[station].append(errors.direction_of(resolved, tube, above, systematic_var, MOUNT_STD**2, BIAS_STD))
    trajectory = Trajectory(Method.BALANCED_TANGENTIAL)  # whose Jacobian is that of the errors
    for md, found in zip(MDS, readings, strict=True):
        trajectory.append(md, fuse_by_bayes(found))
    return trajectory


@dataclass(frozen=True)
class Campaign:
    """Many strings down the same hole."""

    claimed: Trajectory
    errors: np.ndarray  # (draws, stations, 3) m
    claims: np.ndarray  # (draws, 3, 3) m^2, what each string claims at the toe


@pytest.fixture(scope="module", params=[DRAWS[0], pytest.param(DRAWS[1], marks=pytest.mark.statistical)])
def campaign(request: pytest.FixtureRequest) -> Campaign:
    generator, names = np.random.default_rng(5), SharedErrors()
    claimed = surveyed(Drawn(None), names)
    true = np.array([point.position for point in claimed.points[1:]])
    found = [surveyed(Drawn(generator), names) for _ in range(request.param)]
    errors = np.array([[point.position for point in trajectory.points[1:]] for trajectory in found]) - true
    return Campaign(claimed, errors, np.array([trajectory.points[-1].cov for trajectory in found]))


@pytest.mark.slow
@pytest.mark.parametrize("station", range(4))
def test_the_claimed_covariance_of_a_position_is_that_of_drawn_strings(campaign: Campaign, station: int) -> None:
    axes = 2 if station == 0 else 3  # the depth of a single station follows from its place in plan
    cov = campaign.claimed.points[station + 1].cov[:axes, :axes]
    whitened = np.linalg.solve(np.linalg.cholesky(cov), campaign.errors[:, station, :axes].T)
    draws = len(campaign.errors)
    sample = whitened @ whitened.T / draws
    # the variance of one number is uncertain by sqrt(2/n), a covariance of two by sqrt(1/n); five of these
    limit = 5.0 / math.sqrt(draws) * (np.ones((axes, axes)) + (math.sqrt(2.0) - 1.0) * np.eye(axes))
    assert np.all(np.abs(sample - np.eye(axes)) < limit), sample


def inside_95(errors: np.ndarray, covs: np.ndarray) -> float:
    squared = np.einsum("ni,ni->n", errors, np.linalg.solve(covs, errors[..., None])[..., 0])
    return float(np.mean(squared <= coverage_radius(0.95, 2) ** 2))


def test_the_plan_ellipse_of_95_percent_covers_as_often_as_it_says(campaign: Campaign) -> None:
    assert inside_95(campaign.errors[:, -1, :2], campaign.claims[:, :2, :2]) == pytest.approx(0.95, abs=0.015)


def test_without_the_shared_errors_the_ellipse_would_cover_far_too_little(campaign: Campaign) -> None:
    point = campaign.claimed.points[-1]
    random = (point.cov - point.shared @ point.shared.T)[:2, :2]
    assert inside_95(campaign.errors[:, -1, :2], np.broadcast_to(random, campaign.claims[:, :2, :2].shape)) < 0.7
