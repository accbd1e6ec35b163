"""Walls as files: what is not known makes none of them tight; designs, layers, instruments and remedies by column."""

import math
from pathlib import Path

import numpy as np
import pytest

from groundstation.errors import SurveyError
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.judged_wall import judge_wall
from groundstation.survey.wall.wall_file import Wall, read_wall
from groundstation.survey.wall.wall_verdict import FindingKind, Judgement, WallVerdict

DEG = math.pi / 180.0
HOLE = "{0},0,{1},{2}\n{0},10,{1},{2}\n{0},{3},{1},{2}\n"


def made(
    folder: Path,
    heads: str,
    stations: str,
    *,
    radius: float = 0.6,
    thickness: float = 0.8,
    more: str = "",
) -> Path:
    (folder / "heads.csv").write_text(heads)
    (folder / "stations.csv").write_text("column,md_m,inclination_deg,azimuth_deg\n" + stations)
    path = folder / "wall.toml"
    path.write_text(
        f'radius_m = {radius}\nthickness_m = {thickness}\nheads = "heads.csv"\nstations = "stations.csv"\n{more}'
    )
    return path


def row_of(count: int, spacing: float = 0.75) -> str:
    return "column,north_m,east_m\n" + "".join(f"C{k + 1},0,{spacing * k}\n" for k in range(count))


def judged(path: Path) -> tuple[Wall, Judgement]:
    wall = read_wall(path)
    return wall, judge_wall(wall)


def holes(count: int, depth: float = 20.0, *, without: tuple[int, ...] = ()) -> str:
    return "".join(HOLE.format(f"C{k}", 0.0, 0.0, depth) for k in range(1, count + 1) if k not in without)


def test_columns_as_designed_and_surveyed_to_their_toes_are_tight(tmp_path: Path) -> None:
    _, found = judged(made(tmp_path, row_of(4), holes(4)))
    assert (found.verdict, found.findings, found.extras) == (WallVerdict.TIGHT, [], [])
    assert found.system.probability < 1e-6


def test_a_short_column_between_long_ones_opens_both_its_joints(tmp_path: Path) -> None:
    short = "C2,0,0,0\nC2,5,0,0\nC2,10,0,0\n"
    wall, found = judged(made(tmp_path, row_of(3), holes(3, without=(2,)) + short))
    assert found.verdict is WallVerdict.NOT_TIGHT
    (finding,) = found.findings
    assert (finding.kind, finding.what, finding.top, finding.bottom) == (FindingKind.MISSING, "C2", 10.5, 20.0)
    assert found.system.certain
    assert np.all(found.joints.probability[:, wall.columns.depths > 10.0] == 1.0)
    assert [(j, extra.closes) for j, extra in found.extras] == [(0, True), (1, True)]


def test_short_missing_unsurveyed_and_not_drilled_columns_are_each_named(tmp_path: Path) -> None:
    heads = (
        "column,north_m,east_m,state,drilled_to_m\n"
        "C1,0,0,,\nC2,0,0.75,,\nC3,0,1.5,,\nC4,0,2.25,drilled,\nC5,0,3.0,not-drilled,\nC6,0,3.75,,20\nC7,0,4.5,planned,\n"
    )
    stations = holes(1) + "C2,0,0,0\nC2,5,0,0\nC2,12,0,0\n" + HOLE.format("C6", 0, 0, 12)
    stations += "C4,0,0,0\nC4,5,0,0\nC4,10,0,0\n"
    _, found = judged(made(tmp_path, heads, stations, more="length_m = 20"))
    assert found.verdict is WallVerdict.NOT_TIGHT
    assert {
        (f.kind, f.what, f.top, f.bottom)
        for f in found.findings
        if f.kind in (FindingKind.MISSING, FindingKind.UNSURVEYED)
    } == {
        (FindingKind.MISSING, "C2", 12.5, 20.0),
        (FindingKind.MISSING, "C3", 0.0, 20.0),
        (FindingKind.UNSURVEYED, "C4", 10.5, 20.0),
        (FindingKind.MISSING, "C5", 0.0, 20.0),
        (FindingKind.UNSURVEYED, "C6", 12.5, 20.0),
        (FindingKind.MISSING, "C7", 0.0, 20.0),
    }


def test_an_unsurveyed_end_goes_on_as_it_leans_and_grows_uncertain(tmp_path: Path) -> None:
    heads = "column,north_m,east_m,state\nC1,0,0,\nC2,0,0.75,drilled\n"
    stations = holes(1) + "C2,0,0.2,90\nC2,5,0.2,90\nC2,10,0.2,90\n"
    wall, found = judged(made(tmp_path, heads, stations, more="length_m = 20\nunsurveyed_percent = 1.5"))
    assert found.verdict is WallVerdict.NOT_PROVEN
    columns = wall.columns
    np.testing.assert_allclose(columns.centres[1, :, 1], 0.75 + columns.depths * math.tan(0.2 * DEG), atol=2e-4)
    std = np.sqrt(columns.covs[1, :, 1, 1])
    assert std[-1] == pytest.approx(0.015 * 10.0, rel=0.02)
    assert np.all(np.diff(std) > -1e-12)


def test_a_drilled_column_without_any_survey_follows_its_design_and_is_named(tmp_path: Path) -> None:
    heads = "column,north_m,east_m,state\nC1,0,0,\nC2,0,0.75,drilled\n"
    wall, found = judged(made(tmp_path, heads, holes(1), more="length_m = 20"))
    assert found.verdict is WallVerdict.NOT_PROVEN
    assert np.all(wall.columns.states[1, 1:] == ColumnState.UNSURVEYED)
    assert np.sqrt(wall.columns.covs[1, -1, 0, 0]) == pytest.approx(0.2, rel=0.01)


@pytest.mark.slow
def test_a_grid_with_good_joints_has_a_void_in_every_cell(tmp_path: Path) -> None:
    heads = "column,north_m,east_m\n" + "".join(
        f"C{3 * a + b + 1},{0.9 * a},{0.9 * b}\n" for a in range(3) for b in range(3)
    )
    path = made(tmp_path, heads, holes(9), thickness=0.5, more='layout = "grid"\nspacing_m = 0.9\ndepth_step_m = 2')
    _, found = judged(path)
    assert not np.any(found.joints.thickness < 0.5)
    assert found.verdict is WallVerdict.NOT_TIGHT
    assert [finding.kind for finding in found.findings] == [FindingKind.VOID] * 4
    assert "hole of 3.6 cm radius" in found.findings[0].text
    assert found.system.probability > 0.99


def test_a_grid_that_covers_its_plane_is_tight(tmp_path: Path) -> None:
    heads = "column,north_m,east_m\n" + "".join(
        f"C{3 * a + b + 1},{0.7 * a},{0.7 * b}\n" for a in range(3) for b in range(3)
    )
    _, found = judged(made(tmp_path, heads, holes(9), more='layout = "grid"\nspacing_m = 0.7\ndepth_step_m = 2'))
    assert (found.verdict, found.findings) == (WallVerdict.TIGHT, [])


def raked(folder: Path, more: str) -> Judgement:
    """Columns raked by 15 deg across the wall, surveyed with a yaw error of 3 deg that is constant in an instrument."""
    (folder / "yaw.toml").write_text(
        '[tool]\nname = "yaw"\ntitle = "t"\n'
        '[[term]]\nname = "N"\nvalue = 0.02\nunit = "deg"\nmode = "random"\ninclination = "1"\n'
        '[[term]]\nname = "M"\nvalue = 0.05\nunit = "deg"\nmode = "random"\nazimuth = "1"\n'
        '[[term]]\nname = "YAW"\nvalue = 3\nunit = "deg"\nmode = "systematic"\nazimuth = "1"\n'
    )
    stations = "".join(HOLE.format(f"C{k}", 15.0, 0.0, 14.0) for k in (1, 2))
    more = f'instrument = "yaw.toml"\ninclination_deg = 15\nlength_m = 14\n{more}'
    return judged(made(folder, row_of(2), stations, more=more))[1]


def test_what_one_instrument_errs_in_all_columns_does_not_open_a_raked_wall(tmp_path: Path) -> None:
    apart, together = raked(tmp_path, ""), raked(tmp_path, 'serial = "string 7"')
    assert float(np.nanmax(apart.joints.probability)) > 0.2
    assert float(np.nanmax(together.joints.probability)) < 1e-3
    assert together.verdict is WallVerdict.TIGHT


def test_a_raked_column_on_its_design_is_on_it(tmp_path: Path) -> None:
    stations = "".join(HOLE.format(f"C{k}", 15.0, 40.0, 20.0) for k in (1, 2, 3))
    wall, found = judged(
        made(tmp_path, row_of(3), stations, more="inclination_deg = 15\nazimuth_deg = 40\nlength_m = 20")
    )
    assert found.verdict is WallVerdict.TIGHT
    within = wall.columns.states != ColumnState.OUTSIDE
    np.testing.assert_allclose(wall.columns.centres[within], wall.columns.planned[within], atol=1e-9)
    assert np.all(np.count_nonzero(within, axis=1) >= 40)
    assert wall.columns.depths[-1] - wall.columns.depths[0] >= 20.0 - 1e-9


def test_a_horizontal_fan_is_cut_across_its_axis(tmp_path: Path) -> None:
    heads = "column,north_m,east_m,down_m,azimuth_deg\nC1,0,0,3,89\nC2,0.75,0,3,90\nC3,1.5,0,3,91\n"
    stations = "".join(HOLE.format(f"C{k}", 90.0, a, 10.5) for k, a in ((1, 89), (2, 90), (3, 91)))
    wall, found = judged(made(tmp_path, heads, stations, more="inclination_deg = 90\nlength_m = 10.5"))
    np.testing.assert_allclose(wall.built.frame[2], [0.0, 1.0, 0.0], atol=1e-12)
    first, last = (np.hypot(*(wall.columns.centres[1, z] - wall.columns.centres[0, z])) for z in (0, -1))
    assert first == pytest.approx(0.75, abs=1e-9)
    assert last == pytest.approx(0.75 - 10.5 * math.tan(DEG), abs=0.01)  # azimuths converge southwards of 90 deg
    assert found.verdict is WallVerdict.TIGHT


def test_layers_and_columns_have_their_own_radius(tmp_path: Path) -> None:
    heads = "column,north_m,east_m,radius_m\nC1,0,0,\nC2,0,0.75,0.7\nC3,0,1.5,\n"
    more = "radius_cv = 0.02\n[[layer]]\nfrom_m = 12\nradius_m = 0.45\nradius_cv = 0.08\n"
    wall, found = judged(made(tmp_path, heads, holes(3), more=more))
    np.testing.assert_array_equal(wall.columns.radii[:, 0], [0.6, 0.7, 0.6])
    np.testing.assert_array_equal(wall.columns.radii[:, -1], [0.45, 0.45, 0.45])
    np.testing.assert_allclose(wall.columns.radius_stds[:, -1], 0.036)
    (first, second) = [f for f in found.findings if f.kind is FindingKind.THIN]
    assert (first.top, first.bottom, second.what) == (12.0, 20.0, "C2-C3")


def test_setting_out_errs_at_every_depth(tmp_path: Path) -> None:
    heads = "column,north_m,east_m,head_sigma_m\nC1,0,0,\nC2,0,0.75,0.04\n"
    wall, _ = judged(made(tmp_path, heads, holes(2), more="head_sigma_m = 0.015"))
    np.testing.assert_allclose(np.sqrt(wall.columns.covs[:, 0, 0, 0]), [0.015, 0.04])


def test_a_remedial_column_stands_in_for_one_that_is_not_there(tmp_path: Path) -> None:
    heads = (
        "column,north_m,east_m,state,between,replaces\n"
        "C1,0,0,,,\nC2,0,0.75,not-drilled,,\nC3,0,1.5,,,\nC4,0,2.6,,,\nR2,0.02,0.75,,,C2\nR3,0,2.05,,C3/C4,\n"
    )
    stations = "".join(HOLE.format(name, 0, 0, 20) for name in ("C1", "C3", "C4", "R2", "R3"))
    _, found = judged(made(tmp_path, heads, stations))
    assert [f.kind for f in found.findings] == [FindingKind.MISSING]  # C2 is still not there, yet nothing is open
    assert np.all(found.joints.states != ColumnState.MISSING)


@pytest.mark.parametrize(
    ("heads", "stations", "more", "named"),
    [
        (row_of(2, 1.0), holes(2), "", "the design cannot be met anywhere: its nearest columns are 1.000 m apart"),
        ("column,north_m,east_m,state\nC1,0,0,\nC2,0,0.75,lost\n", holes(1), "", "line 3: column C2: state: expected"),
        ("column,north_m,east_m,radius_m\nC1,0,0,-0.6\nC2,0,0.7,\n", holes(2), "", "column C1: radius_m: expected"),
        ("column,north_m,east_m,state\nC1,0,0,planned\nC2,0,0.7,\n", holes(2), "", "C1: stated as planned, yet it has"),
        ("column,north_m,east_m,drilled_to_m\nC1,0,0,5\nC2,0,0.7,\n", holes(2), "", "drilled to 5 m, yet surveyed"),
        ("column,north_m,east_m,between\nC1,0,0,\nC2,0,0.7,\nR,0,1,C1/C9\n", holes(2), "", "C9 is not among the heads"),
        ("column,north_m,east_m,tolerance\nC1,0,0,1:x\nC2,0,0.7,\n", holes(2), "", "line 2: column C1: tolerance, by"),
        (row_of(2), "", "", "length_m is missing; no column was surveyed"),
        (row_of(2), holes(2), "allowed_probability = 0.9", "allowed_probability: expected at most 0.5"),
        (row_of(2), holes(2), "[[layer]]\nradius_m = 0.5", "layer 1: from_m is missing"),
        (row_of(2), holes(2), "[[layer]]\nfrom_m = 3\n[[layer]]\nfrom_m = 3", "expected from_m beyond 3 m, got 3 m"),
        (row_of(2), HOLE.format("C1", 0, 0, 20) + HOLE.format("C2", 88, 0, 20), "", "C2: at 0 m the hole runs"),
    ],
)  # fmt: skip
def test_what_contradicts_itself_is_refused(tmp_path: Path, heads: str, stations: str, more: str, named: str) -> None:
    with pytest.raises(SurveyError) as error:
        read_wall(made(tmp_path, heads, stations, more=more))
    assert named in str(error.value)
    assert "\n" not in str(error.value)


def test_neighbours_that_cross_are_named(tmp_path: Path) -> None:
    stations = holes(3, without=(2,)) + HOLE.format("C2", 3.0, 270.0, 20.0)
    _, found = judged(made(tmp_path, row_of(3), stations))
    assert found.verdict is WallVerdict.NOT_TIGHT
    assert [f.what for f in found.findings if f.kind is FindingKind.CROSSING] == ["C1-C2"]
