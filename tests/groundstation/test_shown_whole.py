"""What reports, figures and walls say, entry by entry: each unit, each sign, each bound, each unequal error."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from datetime import date
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.patches import Polygon

from groundstation.report.column_report import ColumnRecord, ReportSite, column_report
from groundstation.report.document import Document, Origin
from groundstation.report.plots import survey_figure
from groundstation.report.sheet import column_texts
from groundstation.service.answers.thinning import largest_triangles
from groundstation.service.answers.wall_views import wall_joint
from groundstation.survey.adjustment.reliability import Reliability
from groundstation.survey.fusion.joint_angles import AGREEING, APART, SIGMAS, SLACK, JointAngles, RestingYaw
from groundstation.survey.fusion.shared_scale import FEWEST, shared_scale
from groundstation.survey.tools.instruments import PropagationMode, load_tool
from groundstation.survey.wall.as_built import TOE, Columns
from groundstation.survey.wall.closing import closing_by_day
from groundstation.survey.wall.column_deviation import PRESETS, ColumnDesign, Tolerance
from groundstation.survey.wall.column_errors import shared_name, survey_errors
from groundstation.survey.wall.column_plans import Assumptions, ColumnPlan
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.plane_errors import PlaneErrors
from groundstation.survey.wall.tight_depths import SAME_PLANE, TightRange, asked_depths, tight_depths
from groundstation.survey.wall.wall_errors import WallErrors, add_radius
from groundstation.survey.wall.wall_joints import Detour
from groundstation.survey.well.error_columns import ErrorColumns
from groundstation.survey.well.error_sources import Site, WellSurvey
from groundstation.survey.well.reference_frames import turn_north

ORIGIN = Origin(date(2026, 5, 4), "1.2.3", [])

# reports


def record(**changes: Any) -> ColumnRecord:
    """A column of 10 m, drilled and surveyed to its end, 10 and 40 mm off at 5 and 10 m."""
    design = ColumnDesign("P1", (1.0, 2.0, 0.5), 0.0, 0.0, 10.0, 0.4, PRESETS["5-cm"])
    positions = np.array([[1.0, 2.0, 0.5], [1.01, 2.0, 5.5], [1.0, 2.04, 10.5]])
    stds = np.array([0.0, 0.001, 0.003])
    plain = ColumnRecord(
        design, "surveyed", load_tool("relay"), "R-17", "R-17/2026-031", 0.012, np.array([0.0, 5.0, 10.0]),
        np.radians([0.0, 0.1, 0.2]), np.radians([0.0, -30.0, 390.0]), positions,
        stds[:, None, None] ** 2 * np.eye(3), 10.0, 10.0,
    )  # fmt: skip
    return replace(plain, **changes)


def reported(**changes: Any) -> Document:
    return column_report(record(**changes), ReportSite(), ORIGIN)


@pytest.mark.parametrize("at", ["surveyed_md", "drilled_md"])
@pytest.mark.parametrize(("short", "is_good"), [(0.0, True), (0.049, True), (0.051, False), (0.3, False)])
def test_a_column_may_end_five_centimetres_short_and_no_more(at: str, short: float, is_good: bool) -> None:
    found = reported(**{at: 10.0 - short})
    assert found.good == is_good
    if not is_good:
        assert f"within tolerance to {10.0 - short:g} m; design length 10 m" in found.verdict


def test_the_stations_of_a_column_are_told_in_their_units() -> None:
    document = reported()
    table = next(one for one in document.sections if one.title == "As built against design")
    assert [tuple(row) for row in table.rows] == [
        ("0.00", "0.000", "0.00", "1.000", "2.000", "0.500", "0.0", "0.0", "50.0", "0%"),
        ("5.00", "0.100", "330.00", "1.010", "2.000", "5.500", "10.0", "1.0", "50.0", "20%"),
        ("10.00", "0.200", "30.00", "1.000", "2.040", "10.500", "40.0", "3.0", "50.0", "80%"),
    ]
    facts = dict(next(one for one in document.sections if one.title == "Setting out and design").facts)
    assert facts["Sigma of setting out"] == "12.0 mm north and east"
    assert facts["Head as set out"] == "north 1.000 m, east 2.000 m, down 0.500 m"
    assert facts["Design length and radius"] == "10 m, 0.4 m"
    assert document.verdict == "Column P1 is within tolerance: 80% of it at the most, at 10 m"


@pytest.mark.parametrize("smallest", [-0.4, -1e-9, -0.0, 0.0, 0.4])
def test_a_number_that_rounds_to_nothing_has_no_sign(smallest: float) -> None:
    assert column_texts([smallest, 200.0]) == ["0", "200"]


# figures


def outlines(axes: Any, name: str) -> list[Any]:
    return [patch.get_xy()[:-1] for patch in axes.patches if isinstance(patch, Polygon) and patch.get_gid() == name]


def drawn(design: ColumnDesign | None = None) -> Any:
    """A hole of 3 stations that goes north-east; its errors differ in every direction and with each other."""
    md = np.array([0.0, 5.0, 10.0])
    positions = np.array([[0.0, 0.0, 0.0], [0.2, 0.05, 5.0], [0.5, 0.1, 10.0]])
    root = np.array([[0.02, 0.0, 0.0], [0.01, 0.005, 0.0], [0.03, 0.01, 0.04]])
    covs = np.stack([k**2 * root @ root.T for k in (0.0, 0.5, 1.0)])
    return survey_figure(md, positions, covs, 0.95, "a hole", design), positions, covs


def test_the_ellipses_of_plan_and_sections_are_those_of_their_two_directions() -> None:
    figure, positions, covs = drawn()
    plan, _, north, east = figure.axes
    radius = math.sqrt(-2.0 * math.log(0.05))
    scale = 1.0 if "(m)" in plan.get_xlabel() else 100.0
    for axes, pair, units in (
        (plan, (1, 0), (scale, scale)),
        (north, (0, 2), (scale, 1.0)),
        (east, (1, 2), (scale, 1.0)),
    ):
        which = np.ix_(pair, pair)
        drawn_ = outlines(axes, "ellipse")
        assert len(drawn_) == 2
        for outline, place, cov in zip(drawn_, positions[1:], covs[1:], strict=True):
            off = outline / np.array(units) - place[list(pair)]
            sizes = np.einsum("ki,ij,kj->k", off, np.linalg.inv(cov[which]), off)
            assert sizes == pytest.approx(radius**2, rel=1e-6), pair


def test_the_circle_of_the_tolerance_lies_about_the_end_of_the_design_east_to_the_right() -> None:
    design = ColumnDesign("P1", (0.0, 0.0, 0.0), math.radians(3.0), math.radians(20.0), 10.0, 0.4, PRESETS["5-cm"])
    figure, _, _ = drawn(design)
    plan = figure.axes[0]
    scale = 1.0 if "(m)" in plan.get_xlabel() else 100.0
    (circle,) = outlines(plan, "tolerance")
    toe = 10.0 * math.sin(math.radians(3.0))
    centre = np.array([toe * math.sin(math.radians(20.0)), toe * math.cos(math.radians(20.0))])
    off = circle / scale - centre
    assert np.hypot(*off.T).max() == pytest.approx(0.05, rel=1e-3)
    assert np.hypot(*off.T).min() == pytest.approx(0.05 * math.cos(math.radians(3.0)), rel=1e-3)


@pytest.mark.parametrize("peak", [7, 23, 41, 58])
def test_a_short_peak_stays_on_a_thinned_line(peak: int) -> None:
    y = np.sin(np.linspace(0.0, 2.0, 80))
    y[peak] += 5.0
    assert peak in largest_triangles(np.arange(80.0), y, 12)


# joints of a string


def at_rest(angles: JointAngles, at: float, turn: float, var: float = 1e-8, apart: float = 0.0) -> object:
    """Both tubes of a joint rest; the lower is turned by so much (rad) against the upper."""
    angles.on_yaw([2, 1], RestingYaw(2, at - apart, 0.3, var))
    return angles.on_yaw([2, 1], RestingYaw(1, at, 0.3 + turn, var))


def test_a_joint_has_changed_when_it_says_so_so_often_in_a_row() -> None:
    angles = JointAngles()
    course = [0.0, *([0.5] * (AGREEING - 1)), 0.0, *([0.5] * (AGREEING - 1)), 0.0, *([0.5] * (AGREEING + 2))]
    found = [at_rest(angles, 10.0 * k, turn) is not None for k, turn in enumerate(course)]
    assert [k for k, told in enumerate(found) if told] == [len(course) - 3]
    assert angles.accept() == [(2, 1)]
    assert angles.accept() == []


@pytest.mark.parametrize(("first", "later"), [(1e-3, 1e-8), (1e-8, 1e-3), (4e-4, 9e-4)])
@pytest.mark.parametrize(("of_bound", "departs"), [(0.999, False), (1.001, True)])
def test_a_joint_departs_by_the_errors_of_both_its_readings(
    first: float, later: float, of_bound: float, departs: bool
) -> None:
    angles = JointAngles()
    at_rest(angles, 0.0, 0.1, first)
    by = of_bound * (SIGMAS * math.sqrt(2.0 * first + 2.0 * later) + SLACK)
    told = [at_rest(angles, 10.0 * k, 0.1 + by, later) for k in range(1, AGREEING + 1)]
    assert (told[-1] is not None) == departs


@pytest.mark.parametrize(("apart", "counts"), [(APART - 0.1, True), (APART, True), (APART + 0.1, False)])
def test_two_readings_of_a_joint_are_of_one_moment(apart: float, counts: bool) -> None:
    angles = JointAngles()
    at_rest(angles, 100.0, 0.1, apart=apart)
    assert ((2, 1) in angles.known) == counts


@pytest.mark.parametrize("moving", [2, 1])
def test_a_tube_that_moves_says_nothing_of_its_joints_until_it_rests(moving: int) -> None:
    angles = JointAngles()
    angles.on_yaw([3, 2, 1], RestingYaw(2, 10.0, 0.3, 1e-8))
    angles.on_motion(2)
    angles.on_yaw([3, 2, 1], RestingYaw(1, 10.5, 0.4, 1e-8))
    assert angles.known == {}
    angles.on_motion(moving)
    angles.on_yaw([3, 2, 1], RestingYaw(2, 11.0, 0.3, 1e-8))
    angles.on_yaw([3, 2, 1], RestingYaw(1, 11.0, 0.5, 1e-8))
    assert list(angles.known) == [(2, 1)]


@pytest.mark.parametrize(("nodes", "is_told"), [(FEWEST - 1, False), (FEWEST, True), (FEWEST + 1, True)])
def test_a_shared_scale_is_told_of_so_many_nodes_that_have_turned(nodes: int, is_told: bool) -> None:
    found = shared_scale([0.02] * nodes + [0.0, math.nan])
    assert (found is not None) == is_told
    if found is not None:
        assert (found.by, found.nodes) == (0.02, nodes)


def test_an_unfound_blunder_is_reckoned_with_no_larger_than_its_kind_may_be() -> None:
    hypothesis: Any = None  # what it is about is not asked
    found = Reliability(hypothesis, 1.0, np.array([0.1, 0.4, math.inf]), np.array([0.2, 0.3, 0.5]))
    assert found.unfound.tolist() == [0.1, 0.3, 0.5]


# walls


def two(rho: float) -> Columns:
    """Two columns at three depths of two layers, whose radii err by other amounts."""
    heads, planes = np.array([[0.0, 0.0], [0.0, 0.8]]), 3
    centres = np.repeat(heads[:, None, :], planes, axis=1)
    return Columns(
        ["A", "B"], np.array([0.0, 5.0, 10.0]), centres, np.zeros((2, planes, 2, 2)), heads, centres.copy(),
        np.full((2, planes), ColumnState.SURVEYED, np.int8), PlaneErrors.of_planes(np.zeros((2, planes, 2, 1))),
        PlaneErrors.of_planes(np.zeros((2, planes, 2, 0))), np.full((2, planes), 0.6),
        np.array([[0.01, 0.02, 0.03], [0.04, 0.05, 0.06]]), rho, np.array([0, 0, 1]),
    )  # fmt: skip


@pytest.mark.parametrize("rho", [0.0, 0.3, 1.0])
def test_a_radius_errs_as_much_as_was_told_whatever_part_of_it_is_common(rho: float) -> None:
    columns = two(rho)
    errors = WallErrors.of(columns)
    effects = errors.drawn(np.eye(errors.size), np.arange(2))[1] - 0.6  # (columns, numbers, depths)
    assert np.allclose(np.sum(effects**2, axis=1), columns.radius_stds**2)
    both = np.sum(effects[0] * effects[1], axis=0)
    assert np.allclose(both, rho * columns.radius_stds[0] * columns.radius_stds[1])
    for column, depth in itertools.product(range(2), range(3)):
        normal = np.zeros(errors.size)
        add_radius(errors, normal, column, depth, -2.0)
        assert np.allclose(normal, -2.0 * effects[column, :, depth])


@pytest.mark.parametrize("north_deg", [-8.0, 3.0])
def test_the_errors_of_a_wall_are_those_of_the_same_holes_told_from_true_north(north_deg: float) -> None:
    north = math.radians(north_deg)
    inclination, azimuth = np.radians([1.0, 2.0, 3.0]), np.radians([40.0, 80.0, 120.0])
    md, tool, site = np.array([0.0, 10.0, 20.0]), load_tool("mwd-rev5.1"), Site()
    tvd = np.array([0.0, 9.99, 19.97])
    found = survey_errors(WellSurvey(md, inclination, azimuth, tvd), tool, Assumptions(site=site, north=north))
    true = survey_errors(WellSurvey(md, inclination, azimuth + north, tvd), tool, Assumptions(site=site))
    turn = turn_north(north)
    for one, other in zip(found, true, strict=True):
        assert one.name == other.name
        assert np.allclose(one.effects, np.einsum("ij,...jm->...im", turn, other.effects)), one.name


@pytest.mark.parametrize("mode", list(PropagationMode))
@pytest.mark.parametrize("serial", ["", "R-17"])
def test_columns_share_the_errors_of_their_instrument_and_of_all(mode: PropagationMode, serial: str) -> None:
    design = ColumnDesign("P1", (0.0, 0.0, 0.0), 0.0, 0.0, 10.0, 0.4, Tolerance("x", 0.05, 0.0))
    plan = ColumnPlan(design, load_tool("relay"), serial)
    name = shared_name(ErrorColumns("bias", mode, np.zeros((2, 3, 1))), plan)
    if mode is PropagationMode.GLOBAL:
        assert name == "bias"
    elif mode in (PropagationMode.RANDOM, PropagationMode.SECTION) or not serial:
        assert name is None
    else:
        assert name == "R-17/bias"


def closing(days: list[date | None], legs: bool) -> list[float]:
    """Parts of a joint that are closed by a column beside it, on each day."""
    heads, depths = np.array([[0.0, 0.0], [0.0, 1.3], [0.0, 0.65]]), np.array([0.0, 1.0])
    centres = np.repeat(heads[:, None], 2, axis=1)
    columns = Columns.surveyed(["A", "B", "X"], depths, centres, np.zeros((3, 2, 2, 2)), heads, 0.4)
    detours = [Detour(0, np.array([[0, 2], [2, 1]]))] if legs else []
    return [stage.closed for stage in closing_by_day(columns, np.array([[0, 1]]), 0.1, days, detours)]


def test_a_way_round_closes_on_the_day_of_its_last_leg() -> None:
    for first, second, third in itertools.permutations((10, 11, 12)):
        days = [date(2026, 11, day) for day in (first, second, third)]
        assert closing(list(days), legs=True) == [0.0, 0.0, 1.0]
        assert closing(list(days), legs=False) == [0.0, 0.0, 0.0]
    assert closing([date(2026, 11, 10), None, date(2026, 11, 12)], legs=True) == [0.0, 0.0]


def column(top: float, bottom: float) -> ColumnDesign:
    return ColumnDesign("P", (0.0, 0.0, top), 0.0, 0.0, bottom - top, 0.4, Tolerance("x", 0.05, 0.0))


@pytest.mark.parametrize(
    ("tops", "bottoms", "expected"),
    [
        ((0.0, 0.0), (10.0, 10.0), (0.0, 10.0)),
        ((0.0, TOE), (10.0, 10.0 - TOE), (TOE, 10.0 - TOE)),
        ((0.0, TOE + 0.01), (10.0, 10.0 - TOE - 0.01), (0.0, 10.0)),
        ((3.0, 0.0), (6.0, 10.0), (0.0, 10.0)),
    ],
)
def test_a_joint_is_asked_for_where_both_are_or_the_longer_is(
    tops: tuple[float, float], bottoms: tuple[float, float], expected: tuple[float, float]
) -> None:
    designs = [column(top, bottom) for top, bottom in zip(tops, bottoms, strict=True)]
    ranges = tight_depths(designs, np.eye(3), np.array([[0, 1]]), TightRange())
    assert ranges[0].tolist() == pytest.approx(expected)


@pytest.mark.parametrize(
    ("stated", "expected"),
    [
        (TightRange(0.0, 10.0), (0.5 * TOE, 10.0 - 0.5 * TOE)),
        (TightRange(-2.0 * TOE, 10.0 + 2.0 * TOE), (-2.0 * TOE, 10.0 + 2.0 * TOE)),
        (TightRange(2.0, 8.0), (2.0, 8.0)),
    ],
)
def test_what_is_stated_counts_but_for_less_than_a_leg(stated: TightRange, expected: tuple[float, float]) -> None:
    designs = [column(0.5 * TOE, 10.0 - 0.5 * TOE), column(0.0, 10.0)]
    ranges = tight_depths(designs, np.eye(3), np.array([[0, 1]]), stated)
    assert ranges[0].tolist() == pytest.approx(expected)


def test_planes_at_the_ends_of_a_range_are_in_it() -> None:
    eps = SAME_PLANE
    depths = np.array([2.0 - 2.0 * eps, 2.0 - 0.5 * eps, 2.0, 5.0, 8.0, 8.0 + 0.5 * eps, 8.0 + 2.0 * eps])
    asked = asked_depths(depths, np.array([[2.0, 8.0]]))[0]
    assert asked.tolist() == [False, True, True, True, True, True, False]


def test_a_joint_is_shown_where_it_is_thinnest_and_by_the_depths_that_it_is_asked_at() -> None:
    s, u, out = int(ColumnState.SURVEYED), int(ColumnState.UNSURVEYED), int(ColumnState.OUTSIDE)
    joints = SimpleNamespace(
        pairs=np.array([[0, 1]]),
        thickness=np.array([[0.9, 0.5, 0.7, 0.8, math.nan]]),
        probability=np.array([[0.1, 0.2, 0.6, 0.3, 0.9]]),
        states=np.array([[s, s, s, u, out]]),
        worst_depths=None,
    )
    columns = SimpleNamespace(depths=np.array([0.0, 2.0, 4.0, 6.0, 8.0]), names=["A", "B"])
    shown: Any = SimpleNamespace(wall=SimpleNamespace(columns=columns)), SimpleNamespace(joints=joints)
    joint = wall_joint(*shown, 0)
    assert (joint.thickness_m, joint.thinnest_at_m, joint.surveyed_percent) == (0.5, 2.0, 75)
    assert joint.probability_where_surveyed == 0.6
    assert joint.state == "unsurveyed"
