"""Columns with a plan in a wall file: where planes cut them by the circle's closed form, verdicts, refusals."""

import math
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from groundstation.errors import SurveyError
from groundstation.report.wall_report import column_records
from groundstation.survey.wall.column_deviation import ColumnDesign
from groundstation.survey.wall.judged_wall import judge_wall
from groundstation.survey.wall.wall_file import Wall, read_wall
from groundstation.survey.wall.wall_verdict import FindingKind, Judgement, WallVerdict
from groundstation.survey.well.well_plan import WellPlan

DEG = math.pi / 180.0
BUILD, LENGTH, SPACING = 2.0, 20.0, 0.75  # deg/m and m
PLAN = f"[[leg]]\nlength_m = {LENGTH}\nbuild_deg_per_m = {BUILD}\n"
STATIONS_OF_PLAN = "md_m,inclination_deg,azimuth_deg\n" + "".join(f"{k},{BUILD * k},0\n" for k in range(21))


def wall_of(
    folder: Path, depths: dict[str, float], *, more: str = 'plan = "plan.toml"\n', heads: str = "", tail: str = ""
) -> Path:
    """Columns in a row to the east, each drilled on the plan to its depth (m) with stations every metre."""
    (folder / "plan.toml").write_text(PLAN + tail)
    (folder / "plan.csv").write_text(STATIONS_OF_PLAN)
    rows = "".join(f"{name},0,{SPACING * k}\n" for k, name in enumerate(depths))
    (folder / "heads.csv").write_text(heads or f"column,north_m,east_m\n{rows}")
    stations = "".join(f"{name},{k},{BUILD * k},0\n" for name, end in depths.items() for k in range(int(end) + 1))
    (folder / "stations.csv").write_text("column,md_m,inclination_deg,azimuth_deg\n" + stations)
    path = folder / "wall.toml"
    path.write_text(f'radius_m = 0.6\nthickness_m = 0.8\nheads = "heads.csv"\nstations = "stations.csv"\n{more}')
    return path


def judged(path: Path) -> tuple[Wall, Judgement]:
    wall = read_wall(path)
    return wall, judge_wall(wall)


@pytest.mark.parametrize("name", ["plan.toml", "plan.csv"])
def test_planes_cut_a_plan_where_its_circle_lies(tmp_path: Path, name: str) -> None:
    path = wall_of(tmp_path, {"A": LENGTH, "B": LENGTH}, more=f'plan = "{name}"\n')
    columns = read_wall(path).columns
    # a circle over its chord, which is the normal of the planes
    radius, half = 1.0 / (BUILD * DEG), 0.5 * LENGTH * BUILD * DEG
    chord = 2.0 * radius * math.sin(half)
    assert columns.depths[-1] == pytest.approx(chord, abs=1e-9)
    sag = np.sqrt(radius**2 - (columns.depths - 0.5 * chord) ** 2) - radius * math.cos(half)
    for k, east in enumerate((0.0, SPACING)):
        np.testing.assert_allclose(columns.planned[k, :, 1], east, atol=1e-9)
        np.testing.assert_allclose(columns.planned[k, :, 0], -sag, atol=1e-9)
        np.testing.assert_allclose(columns.centres[k], columns.planned[k], atol=2e-4)  # cubics between stations


def test_columns_drilled_on_their_plan_are_tight_and_on_it(tmp_path: Path) -> None:
    wall, found = judged(wall_of(tmp_path, {"A": LENGTH, "B": LENGTH, "C": LENGTH}))
    assert (found.verdict, found.findings) == (WallVerdict.TIGHT, [])
    np.testing.assert_allclose(found.joints.distance, SPACING, atol=1e-6)
    for record in column_records(wall, found):
        assert record.design.length == pytest.approx(LENGTH)
        assert max(one.size for one in record.deviations()) < 1e-6


def test_straight_columns_beside_planned_ones_leave_them(tmp_path: Path) -> None:
    """A plan for two of three: the third is a straight one, from which they bend away."""
    heads = (
        "column,north_m,east_m,plan,inclination_deg,length_m\nA,0,0,plan.csv,,\nB,0,0.75,plan.csv,,\nC,0,1.5,,0,20\n"
    )
    path = wall_of(tmp_path, {"A": LENGTH, "B": LENGTH}, more="tight_to_m = 16\n", heads=heads)
    with (tmp_path / "stations.csv").open("a") as file:
        file.writelines(f"C,{k},0,0\n" for k in range(21))
    wall, found = judged(path)
    assert found.verdict is WallVerdict.NOT_TIGHT
    assert {one.what for one in found.findings if one.kind is FindingKind.THIN} == {"B-C"}
    assert wall.plans[2].design.plan is None
    assert wall.plans[0].design.plan is wall.plans[1].design.plan
    assert [name for name, _ in wall.file.digests()] == ["wall.toml", "heads.csv", "stations.csv", "plan.csv"]


def test_what_is_not_surveyed_bends_as_the_plan_does(tmp_path: Path) -> None:
    heads = "column,north_m,east_m,drilled_to_m\nA,0,0,20\nB,0,0.75,20\n"
    wall, found = judged(wall_of(tmp_path, {"A": 8.0, "B": LENGTH}, heads=heads))
    assert found.verdict is WallVerdict.NOT_PROVEN
    off = wall.columns.centres[0] - wall.columns.planned[0]
    assert float(np.max(np.abs(off))) < 2e-3
    nothing = "column,north_m,east_m,state\nA,0,0,drilled\nB,0,0.75,\n"
    wall = read_wall(wall_of(tmp_path, {"B": LENGTH}, heads=nothing))
    np.testing.assert_allclose(wall.columns.centres[0], wall.columns.planned[0], atol=1e-3)


def test_what_is_not_surveyed_keeps_what_its_last_survey_is_off_the_plan(tmp_path: Path) -> None:
    """Three degrees off at the last survey are three degrees all the way down, and not put right below it."""
    heads = "column,north_m,east_m,drilled_to_m\nA,0,0,20\nB,0,0.75,20\n"
    path = wall_of(tmp_path, {"A": 8.0, "B": LENGTH}, heads=heads)
    off_plan = "".join(f"A,{k},{BUILD * k + 3.0},0\n" for k in range(9))
    lines = (tmp_path / "stations.csv").read_text().splitlines(keepends=True)
    (tmp_path / "stations.csv").write_text(lines[0] + off_plan + "".join(lines[10:]))
    columns = read_wall(path).columns
    off = columns.centres[0, :, 0] - columns.planned[0, :, 0]
    for top, bottom in ((2.0, 6.0), (9.0, 13.0), (14.0, 18.0)):
        above, below = (int(np.argmin(np.abs(columns.depths - depth))) for depth in (top, bottom))
        grown = float(off[below] - off[above]) / float(columns.depths[below] - columns.depths[above])
        assert grown == pytest.approx(math.tan(3.0 * DEG), rel=0.15)


def test_a_plan_that_is_too_short_is_refused_and_closes_no_day_too_early(tmp_path: Path) -> None:
    heads = "column,north_m,east_m,plan,drilled_on\nA,0,0,plan.toml,2026-01-01\nB,0,0.75,short.csv,2026-01-02\n"
    (tmp_path / "short.csv").write_text("".join(STATIONS_OF_PLAN.splitlines(keepends=True)[:13]))
    path = wall_of(tmp_path, {"A": LENGTH, "B": 11.0}, more="", heads=heads)
    with pytest.raises(SurveyError, match=r"joint A-B is to be tight from 0 to .* m, .* column B ends at"):
        read_wall(path)
    path.write_text(path.read_text() + "tight_to_m = 10\n")
    first, last = read_wall(path).stages
    assert (first.day, first.closed, last.closed) == (date(2026, 1, 1), 0.0, 1.0)


def test_azimuths_of_a_plan_count_from_the_north_of_the_wall(tmp_path: Path) -> None:
    more = 'plan = "plan.toml"\nnorth = "grid"\nconvergence_deg = 2\nstations_north = "true"\n'
    path = wall_of(tmp_path, {"A": LENGTH, "B": LENGTH}, more=more)
    stations = (tmp_path / "stations.csv").read_text().replace(",0\n", ",2\n")
    (tmp_path / "stations.csv").write_text(stations)
    columns = read_wall(path).columns
    np.testing.assert_allclose(columns.centres, columns.planned, atol=2e-4)


def test_a_plan_is_drawn_as_a_straight_axis_is(tmp_path: Path) -> None:
    del tmp_path
    plan = WellPlan.of_stations(np.array([0.0, 10.0]), np.full(2, 0.3), np.full(2, 1.0))
    straight = ColumnDesign("one", (1.0, 2.0, 0.0), 0.3, 1.0, 10.0)
    planned = ColumnDesign.of_plan("one", plan, straight.head, straight.radius, straight.tolerance)
    along = np.array([-1.0, 0.0, 4.0, 12.0])
    np.testing.assert_allclose(planned.across_at(along), straight.across_at(along), atol=1e-12)
    np.testing.assert_allclose(planned.chord, straight.chord, atol=1e-12)


@pytest.mark.parametrize(
    ("more", "heads", "tail", "named"),
    [
        ('plan = "gone.csv"\n', "", "", "gone.csv: No such file"),
        ('plan = "plan.toml"\nlength_m = 20\n', "", "", "length_m: expected none beside a plan, which says it, got 20"),
        ("", "column,north_m,east_m,plan,azimuth_deg\nA,0,0,plan.csv,3\nB,0,1,,\n", "", "column A: azimuth_deg: exp"),
        ('plan = "plan.toml"\n', "", "[[leg]]\nlength_m = 0\n", "leg 2: expected a length above 0 m, got 0 m"),
        ('plan = "plan.toml"\n', "", "[[leg]]\nlength_m = 35\nbuild_deg_per_m = 4\n", "more than 80 deg from the mean"),
    ],
)  # fmt: skip
def test_plans_that_cannot_be_are_refused_in_a_line(
    tmp_path: Path, more: str, heads: str, tail: str, named: str
) -> None:
    with pytest.raises(SurveyError, match=named) as caught:
        read_wall(wall_of(tmp_path, {"A": LENGTH, "B": LENGTH}, more=more, heads=heads, tail=tail))
    assert "\n" not in str(caught.value)


def test_a_plan_begins_at_the_head_of_its_column(tmp_path: Path) -> None:
    path = wall_of(tmp_path, {"A": LENGTH, "B": LENGTH})
    (tmp_path / "plan.toml").write_text("north_m = 1.5\n" + PLAN)
    with pytest.raises(SurveyError, match=r"plan.toml: expected a plan that begins at the head .* got 1.5"):
        read_wall(path)
