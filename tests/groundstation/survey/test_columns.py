"""Deviation of a column from its design axis: tolerances, rotations, levels, dominant angle."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from groundstation.errors import SurveyError
from groundstation.survey.fusion.resolve import Direction, direction_angles
from groundstation.survey.wall.column_deviation import (
    PRESETS,
    ColumnDesign,
    Deviation,
    Deviations,
    lateral_errors,
    parse_tolerance,
    point_deviation,
)
from groundstation.survey.well.trajectory_rows import TrajectoryPoint

DEG = math.pi / 180.0
COV = np.array([[4e-4, 1e-4, 2e-5], [1e-4, 1e-4, -3e-5], [2e-5, -3e-5, 2.5e-5]])
Vector = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-5.0, 30.0))


def point_at(
    position: np.ndarray, tangent: np.ndarray | None = None, cov: np.ndarray = COV, md: float = 10.0
) -> TrajectoryPoint:
    down = np.array([0.0, 0.0, 1.0])
    return TrajectoryPoint(md, down if tangent is None else tangent, np.asarray(position, float), cov, np.zeros((3, 0)))


def about_vertical(angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def about_axis(axis: np.ndarray, angle: float) -> np.ndarray:
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross


def lean_of(inclination: float, azimuth: float, cov: np.ndarray) -> Direction:
    lean = np.array([math.sin(inclination) * math.cos(azimuth), math.sin(inclination) * math.sin(azimuth)])
    return Direction(lean, math.cos(inclination), cov, np.zeros((2, 0)))


@pytest.mark.parametrize(
    ("name", "head", "toe"),
    [("en-12716", 0.05, 0.65), ("5-cm", 0.05, 0.05), ("0.27-deg", 0.0, 0.14137)],
)
def test_presets_allow_what_their_source_allows(name: str, head: float, toe: float) -> None:
    assert parse_tolerance(name).name == name
    assert parse_tolerance(name).at(0.0) == pytest.approx(head)
    assert parse_tolerance(name).at(30.0) == pytest.approx(toe, abs=1e-5)


def test_an_unknown_tolerance_is_refused_and_told_the_known_ones() -> None:
    with pytest.raises(SurveyError, match=r"en-12716, 5-cm, 0\.27-deg, got 'en-1'"):
        parse_tolerance("en-1")


@pytest.mark.parametrize(
    ("text", "start", "growth"),
    [
        ("1:200", 0.0, 0.005),
        ("50 mm + 1:200", 0.05, 0.005),
        ("75 mm at 20 m", 0.0, 0.075 / 20.0),
        ("5 cm+1.5 %", 0.05, 0.015),
        ("0.3 deg", 0.0, math.tan(math.radians(0.3))),
    ],
)
def test_a_tolerance_of_a_project_is_a_sum_of_parts(text: str, start: float, growth: float) -> None:
    found = parse_tolerance(text)
    assert (found.start, found.growth) == pytest.approx((start, growth))


@pytest.mark.parametrize("text", ["1:0", "-5 cm", "50", "50 mm +", "", "0 deg"])
def test_a_tolerance_that_nothing_meets_or_that_has_no_unit_is_refused(text: str) -> None:
    with pytest.raises(SurveyError, match="tolerance"):
        parse_tolerance(text)


def test_the_deviation_of_a_vertical_column_is_north_and_east() -> None:
    found = point_deviation(point_at([0.03, -0.04, 10.0]), ColumnDesign())
    np.testing.assert_allclose(found.offset, [0.03, -0.04], atol=1e-15)
    assert found.size == pytest.approx(0.05)
    assert found.along == pytest.approx(10.0)
    assert found.limit == pytest.approx(0.25)
    assert found.ratio == pytest.approx(0.2)
    np.testing.assert_allclose(found.cov, COV[:2, :2])
    unit = np.array([0.6, -0.8])
    assert found.std == pytest.approx(math.sqrt(unit @ COV[:2, :2] @ unit))


def test_the_deviation_is_from_the_head_of_the_column() -> None:
    found = point_deviation(point_at([1.03, 2.0, 10.5]), ColumnDesign(head=(1.0, 2.0, 0.5)))
    np.testing.assert_allclose(found.offset, [0.03, 0.0], atol=1e-12)
    assert found.along == pytest.approx(10.0)


def test_a_column_inclined_to_the_north_lies_low_where_it_is_too_far_south() -> None:
    design = ColumnDesign(inclination=30.0 * DEG)
    found = point_deviation(point_at([5.0, 0.2, 10.0 * math.cos(30.0 * DEG) + 0.1]), design)
    np.testing.assert_allclose(found.offset, [-0.1 * math.sin(30.0 * DEG), 0.2], atol=1e-12)
    assert found.along == pytest.approx(10.0 + 0.1 * math.cos(30.0 * DEG))


@given(st.floats(0.0, math.pi), st.floats(-7.0, 7.0), st.floats(-2.0, 40.0), Vector)
def test_a_point_on_the_axis_has_no_deviation(inclination: float, azimuth: float, along: float, head: tuple) -> None:
    design = ColumnDesign(head=head, inclination=inclination, azimuth=azimuth)
    found = point_deviation(point_at(np.array(head) + along * design.axis), design)
    assert found.size == pytest.approx(0.0, abs=1e-13 * (1.0 + abs(along) + float(np.linalg.norm(head))))
    assert found.along == pytest.approx(along, abs=1e-12)


def test_a_point_above_the_head_has_the_limit_of_the_head() -> None:
    assert point_deviation(point_at([0.0, 0.0, -3.0]), ColumnDesign()).limit == pytest.approx(0.05)


@given(st.floats(0.0, 1.5), st.floats(-7.0, 7.0), st.floats(-7.0, 7.0), Vector)
def test_turning_everything_about_the_vertical_turns_the_offset(
    inclination: float, azimuth: float, angle: float, position: tuple
) -> None:
    turn = about_vertical(angle)
    before = point_deviation(point_at(position), ColumnDesign(inclination=inclination, azimuth=azimuth))
    turned = point_at(turn @ position, cov=turn @ COV @ turn.T)
    after = point_deviation(turned, ColumnDesign(inclination=inclination, azimuth=azimuth + angle))
    np.testing.assert_allclose(after.offset, turn[:2, :2] @ before.offset, atol=1e-12)
    np.testing.assert_allclose(after.cov, turn[:2, :2] @ before.cov @ turn[:2, :2].T, atol=1e-15)
    assert after.size == pytest.approx(before.size, abs=1e-12)
    assert after.along == pytest.approx(before.along, abs=1e-12)


@given(st.floats(0.0, 1.5), st.floats(-3.0, 3.0), Vector, Vector, st.floats(-3.0, 3.0))
def test_turning_everything_anyhow_changes_no_size(
    inclination: float, azimuth: float, position: tuple, axis: tuple, angle: float
) -> None:
    assume(np.linalg.norm(axis) > 0.1)
    turn, design = about_axis(np.array(axis), angle), ColumnDesign(inclination=inclination, azimuth=azimuth)
    before = point_deviation(point_at(position), design)
    assume(before.size > 1e-3)
    turned_axis = turn @ design.axis
    new_inclination, new_azimuth = direction_angles(turned_axis[:2], float(turned_axis[2]))
    after = point_deviation(
        point_at(turn @ position, cov=turn @ COV @ turn.T),
        ColumnDesign(inclination=new_inclination, azimuth=new_azimuth),
    )
    assert after.size == pytest.approx(before.size, abs=1e-9)
    assert after.along == pytest.approx(before.along, abs=1e-9)
    assert after.std == pytest.approx(before.std, rel=1e-6)
    np.testing.assert_allclose(np.linalg.eigvalsh(after.cov), np.linalg.eigvalsh(before.cov), rtol=1e-6)


@pytest.mark.parametrize(
    ("used", "level"),
    [(0.0, 0.0), (0.499, 0.0), (0.5, 0.5), (0.799, 0.5), (0.801, 0.8), (0.999, 0.8), (1.0, 1.0), (7.0, 1.0)],
)
def test_levels_are_reached_at_50_80_and_100_percent(used: float, level: float) -> None:
    found = point_deviation(point_at([0.05 * used, 0.0, 10.0]), ColumnDesign(tolerance=PRESETS["5-cm"]))
    assert found.ratio == pytest.approx(used)
    assert found.level == level


def test_where_no_deviation_is_allowed_any_is_too_much() -> None:
    design = ColumnDesign(tolerance=PRESETS["0.27-deg"])
    assert point_deviation(point_at([0.0, 0.0, 0.0]), design).ratio == 0.0
    off = point_deviation(point_at([0.001, 0.0, 0.0]), design)
    assert off.ratio == math.inf
    assert off.level == 1.0


def test_without_a_deviation_its_uncertainty_is_that_of_the_worst_direction() -> None:
    found = Deviation(10.0, 10.0, np.zeros(2), np.array([[5.0, 3.0], [3.0, 5.0]]) * 1e-4, 0.25)
    assert found.std == pytest.approx(math.sqrt(8e-4))


def with_angle_stds(inclination: float, std_i: float, std_a: float) -> Direction:
    """Leaning north, with standard deviations of inclination and azimuth."""
    s, c = math.sin(inclination), math.cos(inclination)
    return lean_of(inclination, 0.0, np.diag([(c * std_i) ** 2, (s * std_a) ** 2]))


def test_at_a_third_of_a_degree_a_third_of_a_degree_of_azimuth_is_a_millimetre() -> None:
    found = lateral_errors(with_angle_stds(0.3 * DEG, 0.02 * DEG, 0.36 * DEG), 30.0)
    assert found.by_azimuth == pytest.approx(0.001, abs=2e-5)
    assert found.by_inclination == pytest.approx(30.0 * 0.02 * DEG, rel=1e-3)
    assert found.name == "inclination"


def test_in_a_flat_hole_the_azimuth_dominates() -> None:
    found = lateral_errors(with_angle_stds(60.0 * DEG, 0.2 * DEG, 0.2 * DEG), 30.0)
    assert found.name == "azimuth"
    assert found.by_azimuth / found.by_inclination == pytest.approx(math.tan(60.0 * DEG))


def test_in_a_vertical_hole_the_azimuth_is_nothing() -> None:
    found = lateral_errors(lean_of(0.0, 0.0, 1e-6 * np.eye(2)), 30.0)
    assert found.name == "inclination"
    assert found.by_azimuth == 0.0
    assert found.by_inclination == pytest.approx(0.03)


@given(
    st.lists(
        st.tuples(
            st.sampled_from([0.0, 0.1, 0.3]) | st.floats(-1.0, 1.0),
            st.floats(-1.0, 1.0),
            st.sampled_from([0.0, 0.1, 0.2]),
        ),
        max_size=8,
    ),
    st.integers(0, 3),
)
def test_the_worst_of_many_deviations_is_the_worst_of_each(rows: list[tuple[float, float, float]], first: int) -> None:
    table = np.array(rows).reshape(-1, 3)
    md, covs = np.arange(float(len(rows))), np.broadcast_to(np.eye(2), (len(rows), 2, 2))
    found = Deviations(md, md, table[:, :2], covs, table[:, 2])
    each = list(found)
    assert [one.md for one in each] == md.tolist() == [found[k].md for k in range(len(found))]
    expected = max(each[first:], key=lambda one: one.ratio, default=None)
    worst = found.worst(first)
    assert (worst is None) == (expected is None)
    if worst is not None and expected is not None:
        assert (worst.md, worst.ratio) == (expected.md, expected.ratio)


@given(st.floats(0.0, 1.4), st.floats(0.0, 6.28), st.floats(1.0, 60.0))
def test_the_end_of_a_design_is_the_target_of_its_axis(inclination: float, azimuth: float, length: float) -> None:
    design = ColumnDesign(head=(1.0, -2.0, 0.5), inclination=inclination, azimuth=azimuth, length=length)
    end = design.end
    there = point_deviation(point_at(end.point), design)
    assert there.along == pytest.approx(length, abs=1e-9)
    assert there.size == pytest.approx(0.0, abs=1e-9)
    assert end.limit == pytest.approx(there.limit) == pytest.approx(0.05 + 0.02 * length)
    axes = np.vstack([end.across, end.tangent])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
