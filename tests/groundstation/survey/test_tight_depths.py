"""Depths over which a wall is to be tight: no wall becomes tight by a column that is too short or begins too low."""

import math
from pathlib import Path

import numpy as np
import pytest

from groundstation.errors import SurveyError
from groundstation.survey.tools.instruments import load_tool
from groundstation.survey.wall.column_deviation import ColumnDesign
from groundstation.survey.wall.column_plans import Assumptions, ColumnPlan, ColumnSurvey
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.judged_wall import judge_wall
from groundstation.survey.wall.tight_depths import TightRange
from groundstation.survey.wall.wall_columns import build_wall
from groundstation.survey.wall.wall_file import Wall, read_wall
from groundstation.survey.wall.wall_verdict import FindingKind, Judgement, WallVerdict, judge_columns

HEADS = "column,north_m,east_m,down_m,length_m,inclination_deg,azimuth_deg\n"
SQUARE = [(0.0, 0.0), (0.0, 0.7), (0.7, 0.0), (0.7, 0.7)]
LONG = ("A", 0.0, 0.0, 0.0, 20.0, 0.0, 0.0)


def made(folder: Path, rows: list[tuple[str, float, float, float, float, float, float]], more: str = "") -> Path:
    """Columns (name, north, east, down, length, inclination, azimuth), each drilled and surveyed on its design."""
    (folder / "heads.csv").write_text(HEADS + "".join(",".join(map(str, row)) + "\n" for row in rows))
    (folder / "stations.csv").write_text(
        "column,md_m,inclination_deg,azimuth_deg\n"
        + "".join(f"{name},{md},{i},{a}\n" for name, _, _, _, length, i, a in rows for md in (0, 3, length))
    )
    path = folder / "wall.toml"
    path.write_text(f'radius_m = 0.6\nthickness_m = 0.8\nheads = "heads.csv"\nstations = "stations.csv"\n{more}')
    return path


def judged(path: Path) -> tuple[Wall, Judgement]:
    wall = read_wall(path)
    return wall, judge_wall(wall)


def beside(
    name: str, k: int, down: float = 0.0, length: float = 20.0
) -> tuple[str, float, float, float, float, float, float]:
    return (name, 0.0, 0.75 * k, down, length, 0.0, 0.0)


def test_a_short_column_between_long_ones_is_refused_as_a_design(tmp_path: Path) -> None:
    with pytest.raises(SurveyError) as error:
        read_wall(made(tmp_path, [LONG, beside("B", 1, length=10.0), beside("C", 2)]))
    words = "joint A-B is to be tight from 0 to 20 m, yet by its design column B ends at 10 m; expected a toe at 20 m"
    assert words in str(error.value)
    assert "or tight_to_m = 10" in str(error.value)


def test_heads_five_metres_apart_open_at_the_top(tmp_path: Path) -> None:
    with pytest.raises(SurveyError) as error:
        read_wall(made(tmp_path, [LONG, beside("B", 1, down=5.0, length=15.0)]))
    words = "joint A-B is to be tight from 0 to 20 m, yet by its design column B begins at 5 m: it opens at the top"
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_over_the_depth_that_is_stated_they_are_tight(tmp_path: Path) -> None:
    rows = [LONG, beside("B", 1, down=5.0, length=13.0), beside("C", 2)]
    wall, found = judged(made(tmp_path, rows, "tight_from_m = 5\ntight_to_m = 18\n"))
    assert found.verdict is WallVerdict.TIGHT
    np.testing.assert_array_equal(wall.tight_depths, [[5.0, 18.0]] * 2)
    asked = found.joints.states != ColumnState.OUTSIDE
    np.testing.assert_array_equal(wall.columns.depths[asked[0]][[0, -1]], [5.0, 18.0])
    for more in ("tight_from_m = 5\ntight_to_m = 18.5\n", "tight_from_m = 4.5\ntight_to_m = 18\n"):
        with pytest.raises(SurveyError, match="yet by its design column B"):
            read_wall(made(tmp_path, rows, more))


@pytest.mark.parametrize(
    ("more", "named"),
    [
        ("tight_from_m = 18\ntight_to_m = 5\n", "tight_from_m: expected a depth above tight_to_m, 5 m, got 18 m"),
        (
            "tight_from_m = 50\n",
            "no depth in which it is to be tight: it begins at 50 m and ends at 20 m",
        ),
        ("tight_to_m = 40\n", "column A ends at 20 m; expected a toe at 40 m"),
        ("tight_from_m = -3\n", "column A begins at 0 m: it opens at the top; expected a head at -3 m"),
        ('tight_to_m = "deep"\n', "tight_to_m: expected a finite number, got 'deep'"),
    ],
)
def test_a_range_that_no_design_reaches_is_refused(tmp_path: Path, more: str, named: str) -> None:
    with pytest.raises(SurveyError) as error:
        read_wall(made(tmp_path, [LONG, beside("B", 1)], more))
    assert named in str(error.value)
    assert "\n" not in str(error.value)


def test_without_a_range_a_joint_is_asked_for_where_either_design_is() -> None:
    """What has no file to be refused, as a wall that is judged while it is drilled, is open there."""
    plans, holes = [], []
    for name, east, length in (("A", 0.0, 20.0), ("B", 0.75, 10.0)):
        plans.append(ColumnPlan(ColumnDesign(name, (0.0, east, 0.0), length=length), load_tool("relay")))
        holes.append(ColumnSurvey(np.array([0.0, 3.0, length]), np.zeros(3), np.zeros(3)))
    columns = build_wall(plans, holes, Assumptions()).columns
    found = judge_columns(columns, np.array([[0, 1]]), 0.8)
    assert found.verdict is WallVerdict.NOT_TIGHT
    (finding,) = found.findings
    assert (finding.kind, finding.what, finding.top, finding.bottom) == (FindingKind.MISSING, "A-B", 10.5, 20.0)
    assert "no column B is designed there" in finding.text
    assert found.system.certain


def test_a_remedial_column_helps_a_design_that_does_not_reach(tmp_path: Path) -> None:
    path = made(tmp_path, [LONG, beside("B", 1, length=10.0), ("R", 0.0, 0.75, 9.0, 11.0, 0.0, 0.0)])
    heads = path.with_name("heads.csv")
    lines = heads.read_text().splitlines()
    heads.write_text("\n".join([lines[0] + ",replaces", *(x + "," for x in lines[1:-1]), lines[-1] + ",B"]) + "\n")
    _, found = judged(path)
    assert (found.verdict, found.findings) == (WallVerdict.TIGHT, [])


def test_a_design_that_opens_below_is_said_to(tmp_path: Path) -> None:
    """Two columns that lean away from each other by 1 deg: 0.75 m apart at the head, 1.1 m at 10 m."""
    rows = [
        (name, 0.0, east, 0.0, 20.0, 1.0, azimuth) for name, east, azimuth in (("A", 0.0, 270.0), ("B", 0.75, 90.0))
    ]
    _, found = judged(made(tmp_path, rows))
    assert found.verdict is WallVerdict.NOT_TIGHT
    (said,) = [finding for finding in found.findings if finding.kind is FindingKind.DESIGN]
    opens = (2.0 * math.sqrt(0.6**2 - 0.4**2) - 0.75) / (2.0 * math.tan(math.radians(1.0)))
    assert said.top == pytest.approx(opens, abs=0.5)
    assert said.bottom == pytest.approx(20.0 * math.cos(math.radians(1.0)), abs=1e-6)
    assert said.text.startswith("the design of joint A-B opens from 4.5 to 19.997 m: its axes are up to 1.448 m apart")


def test_a_design_that_opens_at_the_top_is_said_to(tmp_path: Path) -> None:
    rows = [(name, 0.0, east, 0.0, 20.0, 1.0, azimuth) for name, east, azimuth in (("A", 0.0, 90.0), ("B", 1.2, 270.0))]
    _, found = judged(made(tmp_path, rows))
    assert found.verdict is WallVerdict.NOT_TIGHT
    (said,) = [finding for finding in found.findings if finding.kind is FindingKind.DESIGN]
    assert said.text.startswith("the design of joint A-B opens from 0 to ")
    assert "\n" not in said.text


@pytest.mark.parametrize("azimuth", [0.0, 40.0, 90.0])
def test_level_heads_of_a_raked_wall_are_not_a_step(tmp_path: Path, azimuth: float) -> None:
    rows = [(name, 0.0, 0.75 * k, 0.0, 20.0, 20.0, azimuth) for k, name in enumerate("ABC")]
    wall, found = judged(made(tmp_path, rows))
    assert (found.verdict, found.findings) == (WallVerdict.TIGHT, [])
    span = wall.tight_depths[:, 1] - wall.tight_depths[:, 0]
    np.testing.assert_allclose(
        span, 20.0 - 0.75 * math.sin(math.radians(20)) * math.sin(math.radians(azimuth)), atol=1e-9
    )


FLAT = [61.0, 85.0, 90.0, 90.2, 110.0]  # deg


@pytest.mark.parametrize("rake", FLAT)
def test_a_short_column_of_a_flat_wall_is_no_level_ground(tmp_path: Path, rake: float) -> None:
    """Toes of horizontal columns lie level, however short one of them is."""
    rows = [(name, 0.0, 0.75 * k, 0.0, 20.0 - 10.0 * (name == "B"), rake, 0.0) for k, name in enumerate("ABC")]
    with pytest.raises(SurveyError, match="to be tight from 0 to 20 m, yet by its design column B ends at 10 m"):
        read_wall(made(tmp_path, rows))


@pytest.mark.parametrize("rake", FLAT)
def test_a_head_further_in_opens_a_flat_wall_at_the_top(tmp_path: Path, rake: float) -> None:
    rows = [(name, 5.0 * (name == "B"), 0.75 * k, 0.0, 20.0, rake, 0.0) for k, name in enumerate("ABC")]
    begins = 5.0 * math.sin(math.radians(rake))
    with pytest.raises(SurveyError, match=f"column B begins at {begins:g} m: it opens at the top"):
        read_wall(made(tmp_path, rows))


def test_ends_of_a_range(tmp_path: Path) -> None:
    assert TightRange(None, 3.0).top is None
    with pytest.raises(SurveyError, match="expected a depth above tight_to_m"):
        TightRange(3.0, 3.0)


def test_a_wall_of_one_column_and_names_that_differ_by_case_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="expected at least two columns next to each other, got 1"):
        read_wall(made(tmp_path, [LONG]))
    with pytest.raises(SurveyError, match="line 3: column a stands in line 2 already as A; expected names that differ"):
        read_wall(made(tmp_path, [LONG, beside("a", 1)]))
    path = made(tmp_path, [LONG, beside("B", 1)])
    stations = path.with_name("stations.csv")
    stations.write_text(stations.read_text().replace("B,", "b,"))
    with pytest.raises(SurveyError, match="column b is not among the heads; B is"):
        read_wall(path)


def test_a_grid_is_covered_over_the_depths_that_are_stated(tmp_path: Path) -> None:
    """Above 4 m two of four columns are not there: a void that is not asked about."""
    rows = [(name, *place, 4.0 * (name in "BC"), 8.0, 0.0, 0.0) for name, place in zip("ABCD", SQUARE, strict=True)]
    more = 'layout = "grid"\nspacing_m = 0.7\ndepth_step_m = 1\n'
    wall, found = judged(made(tmp_path, rows, more + "tight_from_m = 4\ntight_to_m = 8\n"))
    assert (found.verdict, found.voids) == (WallVerdict.TIGHT, [])
    np.testing.assert_array_equal(wall.columns.depths, [4.0, 5.0, 6.0, 7.0, 8.0])
    with pytest.raises(SurveyError, match="begins at 4 m: it opens at the top"):
        read_wall(made(tmp_path, rows, more))
