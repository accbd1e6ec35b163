"""Plans in three dimensions: closed forms of arcs, sums along fine curves, the nearest point by looking at all."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.errors import SurveyError
from groundstation.survey.bearings import planes_across
from groundstation.survey.fusion.resolve import known_direction
from groundstation.survey.path.curvature_prior import CurvaturePrior
from groundstation.survey.path.curvature_tendency import learn_curvature
from groundstation.survey.wall.column_deviation import (
    PRESETS,
    ColumnDesign,
    axis_deviations,
)
from groundstation.survey.wall.projected_end import project_to_target
from groundstation.survey.well.trajectory_rows import TrajectoryPoint
from groundstation.survey.well.well_plan import PlanLeg, WellPlan

DEG = math.pi / 180.0
LEGS = st.lists(
    st.builds(
        PlanLeg,
        st.floats(0.5, 20.0),
        st.floats(-3.0 * DEG, 3.0 * DEG),
        st.floats(-5.0 * DEG, 5.0 * DEG),
        st.none(),
    ),
    min_size=1,
    max_size=4,
)


def summed(inclination: float, azimuth: float, legs: list[PlanLeg], step: float = 1e-3) -> np.ndarray:
    """Points (k, 3) along legs of even rates by the midpoint rule."""
    points, place = [np.zeros(3)], np.zeros(3)
    for leg in legs:
        count = math.ceil(leg.length / step)
        width = leg.length / count
        middle = (np.arange(count) + 0.5) * width
        i, a = inclination + leg.build * middle, azimuth + leg.turn * middle
        steps = width * np.stack([np.sin(i) * np.cos(a), np.sin(i) * np.sin(a), np.cos(i)], axis=1)
        points.extend(place + np.cumsum(steps, axis=0))
        place = points[-1]
        inclination, azimuth = inclination + leg.build * leg.length, azimuth + leg.turn * leg.length
    return np.array(points)


@settings(max_examples=30, deadline=None)
@given(st.floats(0.8, 2.2), st.floats(0.0, 6.28), LEGS)
def test_legs_of_even_rates_end_where_their_sum_does(inclination: float, azimuth: float, legs: list[PlanLeg]) -> None:
    try:
        plan = WellPlan.of_legs(inclination, azimuth, legs)
    except SurveyError:
        return  # through the vertical
    along = sum(leg.length for leg in legs)
    assert plan.length == pytest.approx(along)
    np.testing.assert_allclose(plan.positions[-1], summed(inclination, azimuth, legs)[-1], atol=7e-6 * along)


@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.0, 2.5),
    st.floats(0.0, 6.28),
    LEGS,
    st.tuples(*[st.floats(-8.0, 8.0)] * 3),
    st.floats(0.0, 1.0),
)
def test_the_nearest_point_is_none_but_the_nearest(
    inclination: float, azimuth: float, legs: list[PlanLeg], off: tuple[float, float, float], share: float
) -> None:
    try:
        plan = WellPlan.of_legs(inclination, azimuth, legs)
    except SurveyError:
        return
    place = plan.points_at(np.array([share * plan.length])).points[0] + np.array(off)
    found = plan.nearest(place[None])
    along = np.linspace(-12.0, plan.length + 12.0, 40_001)
    curve = plan.points_at(along).points
    least = float(np.min(np.linalg.norm(curve - place, axis=1)))
    distance = float(np.linalg.norm(found.points[0] - place))
    assert distance <= least + 1e-9
    assert least**2 - distance**2 <= (along[1] - along[0]) ** 2  # between two of those that were looked at
    np.testing.assert_allclose(plan.points_at(found.along).points, found.points, atol=1e-9)
    if distance > 1e-6:  # its offset is across the plan, unless it sits at a corner that two arcs make
        assert abs(float((place - found.points[0]) @ found.tangents[0])) <= 1e-6 * max(distance, 1.0)


def test_a_build_to_the_horizontal_is_a_quarter_of_a_circle() -> None:
    radius = 30.0
    plan = WellPlan.of_legs(0.0, 0.5, [PlanLeg(10.0), PlanLeg(0.5 * math.pi * radius, 1.0 / radius), PlanLeg(20.0)])
    out = np.array([math.cos(0.5), math.sin(0.5)])
    np.testing.assert_allclose(plan.positions[-1], [*((radius + 20.0) * out), 10.0 + radius], atol=1e-9)
    centre = np.array([*(radius * out), 10.0])
    angle = 0.7
    for away in (0.8, 1.0, 1.3):
        place = centre + away * radius * np.array([*(-math.cos(angle) * out), math.sin(angle)])
        found = plan.nearest(place[None])
        assert found.along[0] == pytest.approx(10.0 + angle * radius, abs=1e-9)
        assert np.linalg.norm(found.points[0] - place) == pytest.approx(abs(away - 1.0) * radius, abs=1e-9)


def test_an_arc_to_a_direction_is_one_circle_and_its_stations_give_it_again() -> None:
    target = (60.0 * DEG, 100.0 * DEG)
    by_leg = WellPlan.of_legs(20.0 * DEG, 10.0 * DEG, [PlanLeg(30.0, to=target)])
    by_file = WellPlan.of_stations(
        np.array([0.0, 30.0]), np.array([20.0 * DEG, target[0]]), np.array([10.0 * DEG, target[1]])
    )
    np.testing.assert_array_equal(by_leg.positions, by_file.positions)
    bend = math.acos(float(by_leg.tangents[0] @ by_leg.tangents[1]))
    middle = by_leg.points_at(np.array([15.0]))
    chord = 2.0 * 30.0 / bend * math.sin(0.25 * bend)
    assert np.linalg.norm(middle.points[0]) == pytest.approx(chord)


@given(st.floats(0.0, 3.0), st.floats(0.0, 6.28), st.floats(-5.0, 50.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_a_plan_that_goes_straight_is_the_straight_design(
    inclination: float, azimuth: float, along: float, first: float, second: float
) -> None:
    head, limit = (1.0, -2.0, 0.5), PRESETS["en-12716"]
    straight = ColumnDesign("one", head, inclination, azimuth, 30.0, 0.6, limit)
    plan = WellPlan.of_legs(inclination, azimuth, [PlanLeg(12.0), PlanLeg(18.0)])
    planned = ColumnDesign.of_plan("one", plan, head, 0.6, limit)
    place = np.array(head) + along * straight.axis + np.array([first, second]) @ straight.across
    root = np.arange(9.0).reshape(3, 3) / 9.0 + np.eye(3)
    one, other = (
        axis_deviations(np.array([7.0]), place[None], (root @ root.T)[None], design) for design in (straight, planned)
    )
    for name in ("along", "offset", "cov", "limit"):
        np.testing.assert_allclose(getattr(other, name), getattr(one, name), rtol=1e-11, atol=1e-11)
    for name in ("point", "tangent", "across", "limit"):
        np.testing.assert_allclose(getattr(planned.end, name), getattr(straight.end, name), rtol=1e-11, atol=1e-11)


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-0.9, 1.0))
def test_planes_lie_across_and_are_north_and_east_of_the_vertical(x: float, y: float, z: float) -> None:
    size = math.sqrt(x * x + y * y + z * z)
    if size < 1e-3 or z / size < -0.99:
        return
    tangent = np.array([x, y, z]) / size
    axes = np.vstack([planes_across(tangent), tangent])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    np.testing.assert_array_equal(planes_across(np.array([0.0, 0.0, 1.0])), np.eye(3)[:2])


def test_the_limit_grows_with_the_length_along_a_plan() -> None:
    plan = WellPlan.of_legs(0.0, 0.0, [PlanLeg(10.0), PlanLeg(30.0, 2.0 * DEG)])
    design = ColumnDesign.of_plan("bent", plan, (0.0, 0.0, 0.0), 0.6, PRESETS["en-12716"])
    along = np.array([0.0, 5.0, 20.0, 40.0])
    points = plan.points_at(along).points + 0.3 * np.array([0.0, 1.0, 0.0])
    found = axis_deviations(along, points, np.tile(np.eye(3), (4, 1, 1)), design)
    np.testing.assert_allclose(found.along, along, atol=1e-9)
    np.testing.assert_allclose(found.offset, [[0.0, 0.3]] * 4, atol=1e-9)
    np.testing.assert_allclose(found.limit, 0.05 + 0.02 * along, atol=1e-9)
    assert design.end.limit == pytest.approx(0.85)


def test_a_hole_on_its_plan_is_projected_to_its_end() -> None:
    plan = WellPlan.of_legs(0.0, 0.0, [PlanLeg(10.0), PlanLeg(30.0, 1.0 * DEG), PlanLeg(10.0)])
    design = ColumnDesign.of_plan("bent", plan, (3.0, 0.0, 0.0), 0.6, PRESETS["en-12716"])
    at = plan.points_at(np.array([44.0]))
    point = TrajectoryPoint(
        44.0, at.tangents[0], at.points[0] + np.array([3.0, 0.0, 0.0]), 1e-6 * np.eye(3), np.zeros((3, 0))
    )
    straight = np.tile(at.tangents[0], (6, 1))
    prior = CurvaturePrior(np.array([1e-9]), np.array([400.0]), np.ones((1, 1)), np.zeros(1), np.ones(1), 1e-9, 1e6)
    tendency = learn_curvature(2.0 * np.arange(6), straight, np.zeros((6, 3, 3)), prior)
    found = project_to_target(point, known_direction(30.0 * DEG, 0.0), tendency, design).ends
    assert found.md == pytest.approx(50.0)
    assert found.along == pytest.approx(50.0)
    assert found.size == pytest.approx(0.0, abs=1e-9)
    assert found.limit == pytest.approx(1.05)


@pytest.mark.parametrize(
    ("legs", "message"),
    [
        ([], "at least one leg"),
        ([PlanLeg(10.0), PlanLeg(0.0)], r"leg 2: expected a length above 0 m, got 0 m"),
        ([PlanLeg(math.nan)], "leg 1: expected a length above 0 m, got nan m"),
        ([PlanLeg(100.0, 2.0 * DEG)], "leg 1: it turns back: 200 deg in one leg"),
        ([PlanLeg(5.0, -1.0 * DEG)], r"leg 1: expected an inclination of 0\.\.180 deg at its end, got -5 deg"),
        ([PlanLeg(5.0, to=(math.pi, 0.0))], "turns back on itself between 0 and 5 m"),
    ],
)
def test_legs_that_are_no_plan_are_refused_by_number(legs: list[PlanLeg], message: str) -> None:
    with pytest.raises(SurveyError, match=message):
        WellPlan.of_legs(0.0, 0.0, legs)


@pytest.mark.parametrize(
    ("md", "message"),
    [
        ([5.0, 10.0], "it begins at 5 m; expected its head at 0 m, without a gap"),
        ([0.0], "at least two stations, got 1"),
        ([0.0, 10.0, 10.0], "a station beyond 10 m, got 10 m: a leg has a length"),
        ([0.0, 10.0, 5.0], "a station beyond 10 m, got 5 m"),
        ([0.0, math.inf], "finite depths"),
    ],
)
def test_stations_that_are_no_plan_are_refused(md: list[float], message: str) -> None:
    with pytest.raises(SurveyError, match=message):
        WellPlan.of_stations(np.array(md), np.full(len(md), 0.1), np.zeros(len(md)))
