"""Trajectory methods against known answers and against themselves."""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from groundstation.errors import SurveyError
from groundstation.survey.bearings import wrap_angle
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.well.methods import (
    Method,
    dogleg,
    dogleg_severity,
    horizontal_closure,
    leg_displacement,
    ratio_factor,
    sinc,
    station_positions,
    station_tangents,
    vertical_section,
)
from groundstation.survey.well.trajectory import Trajectory

DEG = math.pi / 180.0
ARCS = [Method.MINIMUM_CURVATURE, Method.RADIUS_OF_CURVATURE]
BOTH_ENDS = [method for method in Method if method is not Method.TANGENTIAL]
Well = tuple[np.ndarray, np.ndarray, np.ndarray]

ROWS = st.lists(
    st.tuples(st.floats(0.1, 30.0), st.floats(0.01, 1.5), st.floats(-7.0, 7.0)),
    min_size=2,
    max_size=12,
)


def of_rows(rows: list[tuple[float, float, float]]) -> Well:
    lengths, inclination, azimuth = np.array(rows).T
    return np.cumsum(lengths), inclination, azimuth


def lean_of(inclination: float, azimuth: float) -> Direction:
    lean = np.array([math.sin(inclination) * math.cos(azimuth), math.sin(inclination) * math.sin(azimuth)])
    return Direction(lean, math.cos(inclination), 1e-6 * np.eye(2), np.zeros((2, 0)))


def turned(position: np.ndarray, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return position @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("method", ARCS)
@pytest.mark.parametrize("azimuth_deg", [0.0, 30.0, 137.0, 271.5, 359.9])
def test_a_quarter_circle_in_a_vertical_plane_ends_one_radius_out_and_one_down(
    method: Method, azimuth_deg: float
) -> None:
    radius, azimuth = 250.0, azimuth_deg * DEG
    angle = np.linspace(0.0, 0.5 * math.pi, 10)
    position = station_positions(method, radius * angle, angle, np.full(10, azimuth))
    expected = radius * np.stack(
        [(1 - np.cos(angle)) * math.cos(azimuth), (1 - np.cos(angle)) * math.sin(azimuth), np.sin(angle)], axis=-1
    )
    np.testing.assert_allclose(position, expected, atol=1e-11)


@pytest.mark.parametrize("method", ARCS)
def test_one_leg_of_a_quarter_circle_is_enough(method: Method) -> None:
    quarter = station_positions(method, np.array([0.0, 0.5 * math.pi]), np.array([0.0, 0.5 * math.pi]), np.zeros(2))
    np.testing.assert_allclose(quarter[-1], [1.0, 0.0, 1.0], atol=1e-15)


@pytest.mark.parametrize("method", ARCS)
def test_a_quarter_circle_in_the_horizontal_plane_ends_one_radius_ahead_and_one_aside(method: Method) -> None:
    azimuth = np.linspace(350.0, 440.0, 4) * DEG
    position = station_positions(
        method, 100.0 * (azimuth - azimuth[0]), np.full(4, 0.5 * math.pi), np.mod(azimuth, math.tau)
    )
    np.testing.assert_allclose(turned(position[-1], -azimuth[0]), [100.0, 100.0, 0.0], atol=1e-11)


@pytest.mark.parametrize("method", Method)
@pytest.mark.parametrize(("inclination", "azimuth"), [(0.0, 0.0), (0.3, 5.0), (0.5 * math.pi, 1.0), (math.pi, 0.0)])
def test_a_straight_hole_is_straight(method: Method, inclination: float, azimuth: float) -> None:
    md = np.array([2.0, 2.5, 30.0, 31.0, 700.0])
    position = station_positions(method, md, np.full(5, inclination), np.full(5, azimuth))
    direction = [
        math.sin(inclination) * math.cos(azimuth),
        math.sin(inclination) * math.sin(azimuth),
        math.cos(inclination),
    ]
    np.testing.assert_allclose(position, np.outer(md - 2.0, direction), atol=1e-12 * 700.0)


def test_balanced_tangential_gives_the_printed_steps_of_the_thesis() -> None:
    inclination, azimuth = np.array([0.0, 1.0, 1.0]) * DEG, np.array([0.0, 120.0, 120.0]) * DEG
    steps_cm = 100.0 * np.diff(
        station_positions(Method.BALANCED_TANGENTIAL, np.array([0.0, 2.0, 4.0]), inclination, azimuth), axis=0
    )
    np.testing.assert_array_equal(np.round(steps_cm[:, :2], 3), [[-0.873, 1.511], [-1.745, 3.023]])
    # the print cuts 199.985 and has 199.97 twice
    np.testing.assert_allclose(steps_cm[:, 2], [199.985, 199.970], atol=5e-4)


@pytest.mark.parametrize(
    ("method", "expected"),
    [
        (Method.TANGENTIAL, (8.885944, 5.130302, 28.190779)),
        (Method.BALANCED_TANGENTIAL, (7.008123, 2.112846, 28.867506)),
        (Method.AVERAGE_ANGLE, (7.646610, 1.348304, 28.977775)),
    ],
)
def test_one_leg_across_north_gives_what_the_textbook_gives(
    method: Method, expected: tuple[float, float, float]
) -> None:
    got = leg_displacement(math, method, 30.0, 10.0 * DEG, 350.0 * DEG, 20.0 * DEG, 30.0 * DEG)
    np.testing.assert_allclose(got, expected, atol=1e-6)


def test_radius_of_curvature_gives_the_textbook_formula_across_north() -> None:
    i1, a1, i2, a2 = 10.0 * DEG, -10.0 * DEG, 20.0 * DEG, 30.0 * DEG
    radial = 30.0 * (math.cos(i1) - math.cos(i2)) / ((i2 - i1) * (a2 - a1))
    expected = [
        radial * (math.sin(a2) - math.sin(a1)),
        radial * (math.cos(a1) - math.cos(a2)),
        30.0 * (math.sin(i2) - math.sin(i1)) / (i2 - i1),
    ]
    got = leg_displacement(math, Method.RADIUS_OF_CURVATURE, 30.0, i1, 350.0 * DEG, i2, a2)
    np.testing.assert_allclose(got, expected, rtol=1e-13)


@given(ROWS, st.floats(-7.0, 7.0), st.sampled_from(Method))
def test_turning_all_azimuths_turns_the_hole(
    rows: list[tuple[float, float, float]], angle: float, method: Method
) -> None:
    md, inclination, azimuth = of_rows(rows)
    # half a turn within a leg has two sides and rounding chooses one
    assume(np.all(np.abs(np.abs(wrap_angle(np.diff(azimuth))) - math.pi) > 1e-6))
    before = station_positions(method, md, inclination, azimuth)
    after = station_positions(method, md, inclination, np.mod(azimuth + angle, math.tau))
    np.testing.assert_allclose(after, turned(before, angle), atol=1e-9)


@given(ROWS, st.sampled_from(BOTH_ENDS))
def test_a_hole_walked_backwards_ends_where_it_began(rows: list[tuple[float, float, float]], method: Method) -> None:
    md, inclination, azimuth = of_rows(rows)
    assume(np.all(np.abs(np.abs(wrap_angle(np.diff(azimuth))) - math.pi) > 1e-6))
    there = station_positions(method, md, inclination, azimuth)
    back = station_positions(method, md[-1] - md[::-1], math.pi - inclination[::-1], azimuth[::-1] + math.pi)
    np.testing.assert_allclose(there[::-1] - there[-1], back, atol=1e-9)


@given(ROWS, st.sampled_from(Method))
def test_no_leg_is_longer_than_its_measured_length(rows: list[tuple[float, float, float]], method: Method) -> None:
    md, inclination, azimuth = of_rows(rows)
    chords = np.linalg.norm(np.diff(station_positions(method, md, inclination, azimuth), axis=0), axis=1)
    assert np.all(chords <= np.diff(md) * (1.0 + 1e-12) + 1e-12 * md[-1])


@given(ROWS, st.sampled_from(Method), st.integers(0, 10), st.floats(-1e-7, 1e-7), st.floats(-1e-7, 1e-7))
def test_a_little_change_of_one_reading_moves_the_toe_a_little(
    rows: list[tuple[float, float, float]], method: Method, at: int, more_i: float, more_a: float
) -> None:
    md, inclination, azimuth = of_rows(rows)
    assume(np.all(np.abs(np.abs(wrap_angle(np.diff(azimuth))) - math.pi) > 0.1))
    before = station_positions(method, md, inclination, azimuth)
    inclination[at % len(md)] += more_i
    azimuth[at % len(md)] += more_a
    after = station_positions(method, md, inclination, azimuth)
    # an arc of three radians, short of turning back, multiplies a change by its ratio factor squared
    assert float(np.max(np.abs(after - before))) <= 200.0 * 1e-7 * (md[-1] - md[0]) + 1e-9


@given(st.floats(0.001, 3.0), st.floats(0.0, math.tau), st.floats(-1e-3, 1e-3), st.floats(-1e-3, 1e-3))
def test_series_and_closed_form_meet(inclination: float, azimuth: float, more_i: float, more_a: float) -> None:
    for method in Method:
        other = (inclination + more_i, azimuth + more_a)
        assume(other[0] > 0.0)
        number = leg_displacement(math, method, 30.0, inclination, azimuth, *other)
        array = [np.array([x]) for x in (inclination, azimuth, *other)]
        whole = leg_displacement(np, method, np.array([30.0]), *array)
        np.testing.assert_allclose(np.concatenate(whole), number, atol=1e-13 * 30.0)


@given(st.floats(-0.2, 0.2) | st.floats(-2e-4, 2e-4))
@example(9.9e-5)
@example(1.01e-4)
@example(0.0)
def test_sinc_and_ratio_factor_are_exact_when_small(x: float) -> None:
    series = 1.0 - x**2 / 6.0 + x**4 / 120.0 - x**6 / 5040.0
    assert sinc(math, x) == pytest.approx(series, abs=1e-11 if abs(x) > 1e-2 else 1e-15)
    assert sinc(np, np.array([x]))[0] == pytest.approx(sinc(math, x), abs=1e-15)
    bend = abs(x)
    series = 1.0 + bend**2 / 12.0 + bend**4 / 120.0 + 17.0 * bend**6 / 20160.0 + 31.0 * bend**8 / 362880.0
    assert ratio_factor(math, bend) == pytest.approx(series, abs=1e-11 if bend > 1e-2 else 1e-15)
    assert ratio_factor(np, np.array([bend]))[0] == pytest.approx(ratio_factor(math, bend), abs=1e-15)


@given(st.floats(-1e3, 1e3))
def test_a_wrapped_angle_points_the_same_way(angle: float) -> None:
    got = wrap_angle(angle)
    assert -math.pi <= got < math.pi
    assert math.cos(got - angle) == pytest.approx(1.0)


@given(st.floats(0.0, math.pi), st.floats(-7.0, 7.0), st.floats(0.0, math.pi), st.floats(-7.0, 7.0))
def test_the_dogleg_is_the_angle_between_the_tangents(i1: float, a1: float, i2: float, a2: float) -> None:
    one, other = station_tangents(np.array([i1, i2]), np.array([a1, a2]))
    expected = math.atan2(float(np.linalg.norm(np.cross(one, other))), float(one @ other))
    assert dogleg(math, i1, a1, i2, a2) == pytest.approx(expected, abs=3e-8)
    if expected < 3.0:
        assert dogleg(math, i1, a1, i2, a2) == pytest.approx(expected, abs=1e-14)
        assert dogleg(np, *(np.array([x]) for x in (i1, a1, i2, a2)))[0] == pytest.approx(expected, abs=1e-14)


def test_a_dogleg_of_a_billionth_is_seen() -> None:
    assert dogleg(math, 1.0, 2.0, 1.0 + 1e-9, 2.0) == pytest.approx(1e-9, rel=1e-6)
    assert dogleg(math, 1.0, 2.0, 1.0, 2.0 + 1e-9) == pytest.approx(1e-9 * math.sin(1.0), rel=1e-6)


def test_dogleg_severity_is_angle_over_length() -> None:
    severity = dogleg_severity(np.array([0.0, 30.0, 40.0]), np.array([0.0, 3.0, 3.0]) * DEG, np.array([0.0, 0.0, 1.0]))
    assert severity[0] == pytest.approx(3.0 * DEG / 30.0)
    assert severity[1] == pytest.approx(2.0 * math.asin(math.sin(3.0 * DEG) * math.sin(0.5)) / 10.0)


def test_closure_is_distance_and_bearing_from_the_collar() -> None:
    distance, direction = horizontal_closure(
        np.array([[3.0, 4.0, 9.0], [-3.0, 0.0, 1.0], [0.0, -2.0, 1.0], [1.0, -1e-30, 0.0]])
    )
    np.testing.assert_allclose(distance, [5.0, 3.0, 2.0, 1.0])
    np.testing.assert_allclose(direction[:3], [math.atan2(4.0, 3.0), math.pi, 1.5 * math.pi])
    assert np.all((direction >= 0.0) & (direction < math.tau))


@given(st.floats(-100.0, 100.0), st.floats(-100.0, 100.0), st.floats(-7.0, 7.0))
def test_vertical_section_is_the_part_of_the_closure_along_its_azimuth(
    north: float, east: float, azimuth: float
) -> None:
    position = np.array([[north, east, 5.0]])
    distance, direction = horizontal_closure(position)
    expected = distance * np.cos(direction - azimuth)
    np.testing.assert_allclose(vertical_section(position, azimuth), expected, atol=1e-11)


@given(ROWS, st.sampled_from(Method))
def test_appending_one_by_one_gives_the_whole_hole(rows: list[tuple[float, float, float]], method: Method) -> None:
    md, inclination, azimuth = of_rows(rows)
    assume(np.all(np.abs(np.abs(wrap_angle(np.diff(azimuth))) - math.pi) > 1e-6))
    trajectory = Trajectory(method, lean_of(inclination[0], azimuth[0]), float(md[0]))
    for row in zip(md[1:], inclination[1:], azimuth[1:], strict=True):
        trajectory.append(float(row[0]), lean_of(float(row[1]), float(row[2])))
    got = np.array([point.position for point in trajectory.points])
    np.testing.assert_allclose(got, station_positions(method, md, inclination, azimuth), atol=1e-10)


@given(ROWS, st.floats(-7.0, 7.0), st.sampled_from(Method))
@pytest.mark.slow
def test_turning_a_hole_below_a_vertical_collar_turns_its_trajectory(
    rows: list[tuple[float, float, float]], angle: float, method: Method
) -> None:
    md, inclination, azimuth = of_rows(rows)
    assume(np.all(np.abs(np.abs(wrap_angle(np.diff(azimuth))) - math.pi) > 1e-6))
    one, other = Trajectory(method), Trajectory(method)
    for row in zip(md, inclination, azimuth, strict=True):
        one.append(float(row[0]), lean_of(float(row[1]), float(row[2])))
        other.append(float(row[0]), lean_of(float(row[1]), float(row[2]) + angle))
    for a, b in zip(one.points, other.points, strict=True):
        np.testing.assert_allclose(b.position, turned(a.position, angle), atol=1e-9)


@pytest.mark.parametrize("method", Method)
def test_a_straight_lean_from_a_vertical_collar_stays_in_its_plane(method: Method) -> None:
    trajectory = Trajectory(method)
    for md in (2.0, 4.0, 6.0):
        trajectory.append(md, lean_of(2.0 * DEG, 120.0 * DEG))
    north, east, _ = trajectory.points[-1].position
    assert math.degrees(math.atan2(east, north)) == pytest.approx(120.0, abs=1e-9)


@given(ROWS, st.floats(0.0, 1.0))
def test_between_stations_the_interpolated_point_lies_on_the_arc(
    rows: list[tuple[float, float, float]], f: float
) -> None:
    md, inclination, azimuth = of_rows(rows)
    trajectory = Trajectory(Method.MINIMUM_CURVATURE, lean_of(inclination[0], azimuth[0]), float(md[0]))
    for row in zip(md[1:], inclination[1:], azimuth[1:], strict=True):
        trajectory.append(float(row[0]), lean_of(float(row[1]), float(row[2])))
    at = min(float(md[0] + f * (md[-1] - md[0])), float(md[-1]))  # the sum may round beyond the end
    point = trajectory.at(at)
    upper = max((p for p in trajectory.points if p.md <= at), key=lambda p: p.md)
    assert point.md == pytest.approx(at)
    assert np.linalg.norm(point.tangent) == pytest.approx(1.0, abs=1e-9)
    across = float(np.linalg.norm(np.cross(upper.tangent, point.tangent)))
    bend = math.atan2(across, float(upper.tangent @ point.tangent))
    along = 0.5 * (at - upper.md) * ratio_factor(math, bend) * (upper.tangent + point.tangent)
    np.testing.assert_allclose(point.position, upper.position + along, atol=1e-8)


@pytest.mark.parametrize("method", Method)
def test_many_wells_at_once_give_what_each_gives(method: Method) -> None:
    rng = np.random.default_rng(22)
    md = np.cumsum(rng.uniform(0.1, 30.0, (3, 4, 20)), axis=-1)
    inclination, azimuth = rng.uniform(0.0, 2.0, (3, 4, 20)), rng.uniform(0.0, math.tau, (3, 4, 20))
    together = station_positions(method, md, inclination, azimuth)
    severity = dogleg_severity(md, inclination, azimuth)
    assert together.shape == (3, 4, 20, 3)
    for well in np.ndindex(3, 4):
        alone = station_positions(method, md[well], inclination[well], azimuth[well])
        np.testing.assert_allclose(together[well], alone, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(severity[well], dogleg_severity(md[well], inclination[well], azimuth[well]))


@pytest.mark.parametrize("method", Method)
@pytest.mark.parametrize(
    ("md", "inclination", "azimuth", "message"),
    [
        ([0, 1], [0, 0, 0], [0, 0], "as many depths as inclinations and azimuths, got 2, 3 and 2"),
        ([0, 1], [0, 0], [0], "as many depths as inclinations and azimuths, got 2, 2 and 1"),
        ([0, math.nan, 2], [0, 0, 0], [0, 0, 0], "station 1: expected a finite measured depth, got nan m"),
        ([0, 1, math.inf], [0, 0, 0], [0, 0, 0], "station 2: expected a finite measured depth, got inf m"),
        ([0, 1], [0, math.nan], [0, 0], r"station 1: expected an inclination of 0\.\.180 deg, got nan deg"),
        ([0, 1], [-1.0 * DEG, 0], [0, 0], r"station 0: expected an inclination of 0\.\.180 deg, got -1 deg"),
        ([0, 1], [0, 181.0 * DEG], [0, 0], r"station 1: expected an inclination of 0\.\.180 deg, got 181 deg"),
        ([0, 1], [0, 0], [0, math.inf], "station 1: expected a finite azimuth, got inf deg"),
        ([0, 2, 1], [0, 0, 0], [0, 0, 0], "station 2: expected a depth beyond 2 m, got 1 m"),
        ([0, 2, 2], [0, 0, 0], [0, 0, 0], "station 2: expected a depth beyond 2 m, got 2 m"),
    ],
)
def test_what_is_no_survey_is_refused_by_every_method(
    method: Method, md: list[float], inclination: list[float], azimuth: list[float], message: str
) -> None:
    with pytest.raises(SurveyError, match=message):
        station_positions(method, np.array(md, float), np.array(inclination, float), np.array(azimuth, float))


def test_a_bad_station_is_named_within_many_wells() -> None:
    md = np.tile([0.0, 1.0, 2.0], (4, 1))
    md[2, 2] = 0.5
    with pytest.raises(SurveyError, match=r"station 2: expected a depth beyond 1 m, got 0\.5 m"):
        station_positions(Method.TANGENTIAL, md, np.zeros((4, 3)), np.zeros((4, 3)))


@given(st.floats(0.0, math.pi), st.floats(0.0, math.tau))
def test_an_arc_that_turns_straight_back_is_refused(inclination: float, azimuth: float) -> None:
    md = np.array([0.0, 10.0])
    there_and_back = np.array([inclination, math.pi - inclination]), np.array([azimuth, azimuth + math.pi])
    with pytest.raises(SurveyError, match="station 1: the hole turns straight back on itself"):
        station_positions(Method.MINIMUM_CURVATURE, md, *there_and_back)


@given(st.floats(0.0, math.pi), st.floats(0.0, math.tau))
def test_an_appended_arc_that_turns_straight_back_is_refused(inclination: float, azimuth: float) -> None:
    trajectory = Trajectory(Method.MINIMUM_CURVATURE, lean_of(inclination, azimuth), 5.0)
    with pytest.raises(SurveyError, match="turns back on itself between 5 and 7 m"):
        trajectory.append(7.0, lean_of(math.pi - inclination, azimuth + math.pi))
    assert len(trajectory.points) == 1


@pytest.mark.parametrize("md", [2.0, 1.0, math.nan, math.inf])
def test_a_trajectory_takes_no_depth_that_is_none_and_stays_as_it_was(md: float) -> None:
    trajectory, twin = Trajectory(), Trajectory()
    for one in (trajectory, twin):
        one.append(2.0, lean_of(0.1, 1.0))
    with pytest.raises(SurveyError, match="beyond 2 m"):
        trajectory.append(md, lean_of(0.2, 1.0))
    after, expected = (one.append(4.0, lean_of(0.2, 2.0)) for one in (trajectory, twin))
    np.testing.assert_array_equal(after.position, expected.position)
    np.testing.assert_array_equal(after.cov, expected.cov)
