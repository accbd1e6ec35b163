"""Positions and their covariance: printed steps, circles, one station at a time, sampling."""

import math
from dataclasses import replace
from operator import itemgetter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.errors import SurveyError
from groundstation.survey.fusion.packed import Packed
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.tangents import tangent_jacobian
from groundstation.survey.tools.instruments import PropagationMode, Term, load_tool
from groundstation.survey.well.analysis import analyse_survey
from groundstation.survey.well.depth_errors import StationDepth
from groundstation.survey.well.error_sources import Site
from groundstation.survey.well.kernels.position_errors import add_stations, warm_up
from groundstation.survey.well.methods import Method
from groundstation.survey.well.trajectory import BLOCK, Trajectory
from groundstation.survey.well.well_record import SurveyRecord

DEG = math.pi / 180.0


def lean_of(inclination: float, azimuth: float, std: float = 1e-3, shared: np.ndarray | None = None) -> Direction:
    lean = np.array([math.sin(inclination) * math.cos(azimuth), math.sin(inclination) * math.sin(azimuth)])
    return Direction(lean, math.cos(inclination), std**2 * np.eye(2), np.zeros((2, 0)) if shared is None else shared)


def turned(inclination: float, azimuth: float, std: float, yaw_stds: list[float]) -> Direction:
    """A direction with one shared yaw error a column."""
    lean = lean_of(inclination, azimuth, std)
    shared = np.outer([-lean.lean[1], lean.lean[0]], yaw_stds)
    return Direction(lean.lean, lean.down, lean.cov, shared)


@pytest.mark.parametrize("inclination_deg", [20.0, 120.0])
def test_the_vertical_of_a_direction_follows_its_lean_on_both_sides_of_level(inclination_deg: float) -> None:
    direction, small = lean_of(inclination_deg * DEG, 0.7), 1e-6
    side = math.copysign(1.0, direction.down)

    def vertical(*step: float) -> float:
        return side * math.sqrt(1.0 - float(np.sum((direction.lean + step) ** 2)))

    slopes = [
        (vertical(small, 0.0) - vertical(-small, 0.0)) / (2.0 * small),
        (vertical(0.0, small) - vertical(0.0, -small)) / (2.0 * small),
    ]
    jacobian = tangent_jacobian(np.array([*direction.lean, direction.down]))
    np.testing.assert_allclose(jacobian, [[1.0, 0.0], [0.0, 1.0], slopes], rtol=1e-8)


def test_an_error_of_a_depth_goes_on_by_the_kink_there_below_stations_whose_depths_are_exact() -> None:
    trajectory, error = Trajectory(), 0.01
    trajectory.append(2.0, lean_of(0.0, 0.0, 0.0))
    trajectory.append(4.0, lean_of(30.0 * DEG, 0.3, 0.0), StationDepth(Packed(np.array([[error]])), 0.0))
    for md in (6.0, 8.0):
        trajectory.append(md, lean_of(10.0 * md * DEG, 0.3, 0.0))
    along = np.diff(trajectory.positions, axis=0) / 2.0
    moved = [error * along[1], error * (along[1] - along[2]), error * (along[1] - along[2])]
    np.testing.assert_allclose(trajectory.covs[2:], [np.outer(one, one) for one in moved], rtol=1e-9, atol=1e-18)


def test_balanced_tangential_gives_the_printed_steps_of_table_4_29() -> None:
    trajectory = Trajectory(Method.BALANCED_TANGENTIAL)
    for md in (2.0, 4.0):
        trajectory.append(md, lean_of(1.0 * DEG, 120.0 * DEG))
    steps_cm = 100.0 * np.diff([p.position for p in trajectory.points], axis=0)
    np.testing.assert_allclose(steps_cm[0], [-0.873, 1.511, 199.985], atol=5e-4 * 2)
    np.testing.assert_allclose(steps_cm[1], [-1.745, 3.023, 199.97], atol=5e-4 * 2)


@given(
    st.lists(
        st.tuples(
            st.floats(0.1, 30.0),
            st.floats(0.0, 1.0),
            st.floats(0.0, 6.28),
            st.lists(st.floats(0.0, 0.02), min_size=0, max_size=4),
        ),
        min_size=1,
        max_size=10,
    ),
    st.sampled_from(Method),
)
def test_appending_gives_what_the_whole_hole_gives_at_once(
    rows: list[tuple[float, float, float, list[float]]], method: Method
) -> None:
    trajectory = Trajectory(method)
    mds = np.cumsum([row[0] for row in rows])
    leans = [turned(inclination, azimuth, 1e-3, yaw_stds) for _, inclination, azimuth, yaw_stds in rows]
    for count, (md, lean) in enumerate(zip(mds, leans, strict=True), 1):
        point = trajectory.append(float(md), lean)
        again = Trajectory(method)
        again.extend(list(zip(mds[:count].tolist(), leans[:count], strict=True)))
        for one, other in zip(trajectory.points, again.points, strict=True):
            np.testing.assert_array_equal(one.position, other.position)
            np.testing.assert_array_equal(one.cov, other.cov)
            np.testing.assert_array_equal(one.shared, other.shared)
        random, shared = parts_at_once(mds[:count], leans[:count])
        np.testing.assert_allclose(point.cov, random + shared @ shared.T, rtol=1e-9, atol=1e-18)
        np.testing.assert_allclose(point.shared, shared[:, : point.shared.shape[1]], rtol=1e-9, atol=1e-15)
        assert not np.any(shared[:, point.shared.shape[1] :])


@pytest.mark.parametrize("method", Method)
def test_a_long_hole_at_once_is_the_same_as_station_by_station(method: Method) -> None:
    """Columns are held a block at a time; the borders of the blocks must not show."""
    count = 2 * BLOCK + 3
    mds = np.arange(1.0, count + 1.0).tolist()
    leans = [turned(0.3 + 1e-3 * k, 0.01 * k, 1e-3, [1e-3] * (1 + k // 50)) for k in range(count)]
    one, other = Trajectory(method), Trajectory(method)
    for station in zip(mds, leans, strict=True):
        one.append(*station)
    other.extend(list(zip(mds, leans, strict=True)))
    assert len(other.points) == count + 1
    for appended, extended in zip(one.points, other.points, strict=True):
        np.testing.assert_array_equal(appended.position, extended.position)
        np.testing.assert_array_equal(appended.cov, extended.cov)
        np.testing.assert_array_equal(appended.shared, extended.shared)


@pytest.mark.parametrize("count", [1, BLOCK - 1, BLOCK, 2 * BLOCK + 3])
def test_a_hole_whose_stations_change_is_as_one_that_is_drawn_anew(count: int) -> None:
    """Stations that change, come between others and below, at the borders of the blocks and within."""
    stations = {float(k): turned(0.3 + 1e-3 * k, 0.01 * k, 1e-3, [1e-3] * (1 + k // 50)) for k in range(1, count + 1)}
    put = Trajectory()
    put.put(reversed(stations.items()))
    for number, place in enumerate(sorted({1, count // 2 + 1, min(BLOCK, count), count})):
        other = [turned(0.2, number + 0.1 * k, 2e-3, [1e-3] * (4 + number)) for k in range(4)]
        for changed in (
            {float(place): other[0]},
            {place - 0.5: other[0], float(place): other[1]},
            {count + 1.0 + number: other[2], 0.25 + 0.1 * number: other[3]},
        ):
            stations |= changed
            put.put([*changed.items(), (float(place), stations[place])])
            anew = Trajectory()
            anew.extend(sorted(stations.items(), key=itemgetter(0)))
            assert len(put) == len(anew) == len(stations) + 1
            for one, drawn in zip(put.points, anew.points, strict=True):
                assert one.md == drawn.md
                np.testing.assert_array_equal(one.tangent, drawn.tangent)
                np.testing.assert_array_equal(one.position, drawn.position)
                np.testing.assert_array_equal(one.cov, drawn.cov)
                np.testing.assert_array_equal(one.shared, drawn.shared)
            np.testing.assert_array_equal(put.md, [one.md for one in anew.points])
            np.testing.assert_array_equal(put.positions, [one.position for one in anew.points])
            np.testing.assert_array_equal(put.covs, [one.cov for one in anew.points])
            shown = [columns for some in put.columns() for columns in some]
            for columns, point in zip(shown, anew.points, strict=True):
                np.testing.assert_array_equal(columns, point.shared)


def test_a_station_above_the_collar_is_refused() -> None:
    trajectory = Trajectory(start_md=1.0)
    for md in (0.5, 1.0, math.nan, math.inf):
        with pytest.raises(SurveyError, match="expected a depth beyond 1 m"):
            trajectory.put([(2.0, lean_of(0.1, 0.0)), (md, lean_of(0.1, 0.0))])
    assert len(trajectory) == 1


def test_points_that_keep_no_columns_are_the_same() -> None:
    whole, bare = Trajectory(), Trajectory(keeps_columns=False)
    for trajectory in (whole, bare):
        trajectory.extend([(2.0 * k, turned(0.1, 0.2, 1e-3, [1e-3] * (1 + k // 2))) for k in range(1, 6)])
    for one, other in zip(whole.points, bare.points, strict=True):
        np.testing.assert_array_equal(one.position, other.position)
        np.testing.assert_array_equal(one.cov, other.cov)
        assert other.shared.shape == (3, 0)
    for columns, one in zip((row for some in bare.columns() for row in some), whole.points, strict=True):
        np.testing.assert_array_equal(columns, one.shared)


def parts_at_once(mds: np.ndarray, leans: list[Direction]) -> tuple[np.ndarray, np.ndarray]:
    """Random covariance and shared columns of the last position from every station's weight in it: no running sum."""
    ends = np.concatenate([[0.0], mds, mds[-1:]])
    random, shared = np.zeros((3, 3)), np.zeros((3, 4))
    for k, lean in enumerate(leans, 1):
        weight = 0.5 * (ends[k + 1] - ends[k - 1])
        jacobian = weight * np.array([[1.0, 0.0], [0.0, 1.0], -lean.lean / lean.down])
        random = random + jacobian @ lean.cov @ jacobian.T
        shared[:, : lean.shared.shape[1]] += jacobian @ lean.shared
    return random, shared


def test_what_is_warmed_is_what_a_trajectory_runs() -> None:
    warm_up()
    before = list(add_stations.signatures)
    trajectory = Trajectory(collar=turned(0.1, 0.0, 1e-3, [1e-3]))
    trajectory.append(2.0, turned(0.1, 0.0, 1e-3, []))
    trajectory.extend([(md, turned(0.1, 0.2, 1e-3, [1e-3] * 4)) for md in (4.0, 6.0)])
    assert add_stations.signatures == before


def test_errors_that_stations_share_add_up_and_others_do_not() -> None:
    def at_toe(columns: list[list[float]]) -> float:
        trajectory = Trajectory()
        for md, stds in zip((2.0, 4.0, 6.0, 8.0), columns, strict=True):
            trajectory.append(md, turned(0.1, 0.0, 0.0, stds))
        return math.sqrt(float(trajectory.points[-1].cov[1, 1]))

    one = at_toe([[0.01]] * 4)
    own = at_toe([[0.01 if k == n else 0.0 for k in range(4)] for n in range(4)])
    across = 0.01 * math.sin(0.1)
    assert one == pytest.approx(across * (2.0 + 2.0 + 2.0 + 1.0))
    assert own == pytest.approx(across * math.sqrt(4.0 + 4.0 + 4.0 + 1.0))


def test_the_collar_is_known_and_a_given_one_counts_with_half_the_first_leg() -> None:
    way = Method.BALANCED_TANGENTIAL
    vertical, leaning = Trajectory(way), Trajectory(way, lean_of(0.1, 0.0, 1e-3))
    for trajectory in (vertical, leaning):
        trajectory.append(2.0, lean_of(0.1, 0.0, 1e-3))
    assert vertical.points[-1].position[0] == pytest.approx(math.sin(0.1))
    assert leaning.points[-1].position[0] == pytest.approx(2.0 * math.sin(0.1))
    assert vertical.points[-1].cov[0, 0] == pytest.approx(1e-6)
    assert leaning.points[-1].cov[0, 0] == pytest.approx(2e-6)


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
    point = trajectory.at(radius * 0.5)
    np.testing.assert_allclose(point.position, [radius * (1.0 - math.cos(0.5)), 0.0, radius * math.sin(0.5)], atol=1e-9)
    np.testing.assert_allclose(point.tangent, [math.sin(0.5), 0.0, math.cos(0.5)], atol=1e-12)
    for end in trajectory.points:
        np.testing.assert_allclose(trajectory.at(end.md).position, end.position, atol=1e-12)
    with pytest.raises(SurveyError, match=r"0\.\.36 m"):
        trajectory.at(40.0)


@pytest.mark.parametrize("method", Method)
def test_interpolation_meets_the_stations_of_every_method(method: Method) -> None:
    trajectory = Trajectory(method)
    for md, inclination, azimuth in [(2.0, 0.02, 1.0), (5.0, 0.3, 1.5), (9.0, 0.5, 2.5)]:
        trajectory.append(md, lean_of(inclination, azimuth))
    for end in trajectory.points:
        np.testing.assert_allclose(trajectory.at(end.md).position, end.position, atol=1e-12)
        before, after = (trajectory.at(min(max(end.md + d, 0.0), 9.0)) for d in (-1e-9, 1e-9))
        np.testing.assert_allclose(before.position, after.position, atol=1e-8)


def test_interpolation_in_a_straight_leg_is_the_straight_line() -> None:
    trajectory = Trajectory(collar=lean_of(0.2, 1.0))
    end = trajectory.append(10.0, lean_of(0.2, 1.0))
    point = trajectory.at(2.5)
    np.testing.assert_allclose(point.position, 0.25 * end.position, atol=1e-12)
    np.testing.assert_allclose(point.tangent, end.tangent, atol=1e-12)


@pytest.mark.parametrize("md", [2.0, 1.0, math.nan])
def test_a_depth_that_does_not_grow_is_refused(md: float) -> None:
    trajectory = Trajectory()
    trajectory.append(2.0, lean_of(0.01, 0.0))
    with pytest.raises(SurveyError, match="beyond 2 m"):
        trajectory.append(md, lean_of(0.01, 0.0))
    assert len(trajectory.points) == 2


def test_a_hole_that_turns_back_on_itself_has_no_arc() -> None:
    trajectory = Trajectory(Method.MINIMUM_CURVATURE)
    trajectory.append(2.0, lean_of(0.5, 0.0))
    back = Direction(np.array([-math.sin(0.5), 0.0]), -math.cos(0.5), 1e-6 * np.eye(2), np.zeros((2, 0)))
    with pytest.raises(SurveyError, match="between 2 and 4 m"):
        trajectory.append(4.0, back)


@pytest.mark.slow
@pytest.mark.parametrize("draws", [4000, pytest.param(20_000, marks=pytest.mark.statistical)])
def test_covariance_of_the_position_is_what_sampling_gives(draws: int) -> None:
    generator = np.random.default_rng(2)
    mds, azimuths = [2.0, 4.0, 7.0, 8.0], [0.3, 0.5, 1.0, 1.1]
    inclinations = [0.02, 0.05, 0.3, 0.4]
    std, joint_std = 1e-3, 5e-3
    claimed = Trajectory()
    for md, inclination, azimuth in zip(mds, inclinations, azimuths, strict=True):
        claimed.append(md, turned(inclination, azimuth, std, [joint_std]))
    toes = []
    for _ in range(draws):
        joint = joint_std * generator.standard_normal()
        sampled = Trajectory()
        for md, inclination, azimuth in zip(mds, inclinations, azimuths, strict=True):
            lean = lean_of(inclination, azimuth + joint).lean + std * generator.standard_normal(2)
            sampled.append(md, Direction(lean, math.sqrt(1.0 - float(lean @ lean)), np.zeros((2, 2)), np.zeros((2, 0))))
        toes.append(sampled.points[-1].position)
    expected = np.cov(np.array(toes).T)
    np.testing.assert_allclose(claimed.points[-1].cov, expected, rtol=0.06, atol=0.03 * float(np.trace(expected)))


def test_the_stations_of_the_service_and_the_record_of_the_command_have_one_region() -> None:
    """Stations appended one by one, as the service does, against the model of the command, where both say the same."""
    md = np.array([0.0, 4.0, 9.0, 15.0, 22.0])
    inclination, azimuth = np.radians([0.0, 3.0, 5.0, 8.0, 9.0]), np.radians([0.0, 40.0, 55.0, 60.0, 48.0])
    sizes = {"I": 2e-3, "A": 7e-3, "YAW": 0.02, "LEAN": 1e-3}
    terms = (
        Term("I", sizes["I"], "rad", PropagationMode.RANDOM, ("0", "1", "0")),
        Term("A", sizes["A"], "rad", PropagationMode.RANDOM, ("0", "0", "1")),
        Term("YAW", sizes["YAW"], "rad", PropagationMode.SYSTEMATIC, ("0", "0", "1")),
        Term("LEAN", sizes["LEAN"], "rad", PropagationMode.SYSTEMATIC, ("0", "1", "0")),
    )
    tool = replace(load_tool("relay"), terms=terms)
    record = SurveyRecord(md, inclination, azimuth, list(range(len(md))), {})
    whole = analyse_survey(record, Method.BALANCED_TANGENTIAL, tool, Site())
    trajectory = Trajectory(Method.BALANCED_TANGENTIAL)
    for depth, i, a in zip(md[1:].tolist(), inclination[1:].tolist(), azimuth[1:].tolist(), strict=True):
        ci, si, ca, sa = math.cos(i), math.sin(i), math.cos(a), math.sin(a)
        by_inclination, by_azimuth = np.array([ci * ca, ci * sa]), np.array([-si * sa, si * ca])
        random = np.stack([sizes["I"] * by_inclination, sizes["A"] * by_azimuth], axis=1)
        shared = np.stack([sizes["YAW"] * by_azimuth, sizes["LEAN"] * by_inclination], axis=1)
        trajectory.append(depth, Direction(np.array([si * ca, si * sa]), ci, random @ random.T, shared))
    np.testing.assert_allclose([p.position for p in trajectory.points], whole.positions, atol=1e-12)
    np.testing.assert_allclose([p.cov for p in trajectory.points], whole.uncertainty.cov, rtol=1e-9, atol=1e-15)
