"""Walls, shafts and grids read back whole: answer, figure, warnings, closing and what is refused, word by word.

The verdict beside a closed form stands in `test_wall_report_whole.py` and `test_wall_answer_whole.py`; here lenses of
straight columns and their regions are calculated again, and every other figure of walls of all kinds is held.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest
from read_back import check, drawing, leaves, write_anew
from small_wall import HEAD_STD, HOLES, write_wall

from groundstation.errors import SurveyError
from groundstation.report.plots_wall import draw_wall, wall_figure
from groundstation.report.wall_report import column_records
from groundstation.survey.exports.export_request import exported_bytes, site_of_wall
from groundstation.survey.requests.wall_result import wall_result
from groundstation.survey.wall.judged_wall import judge_wall
from groundstation.survey.wall.wall_file import Wall, read_wall
from groundstation.survey.wall.wall_joints import worst_joint

HEAD = "column,md_m,inclination_deg,azimuth_deg,time_s\n"
PLAN = """tolerance = "40 mm + 1:120"
[[leg]]
length_m = 3
[[leg]]
length_m = 5
build_deg_per_m = 0.5
turn_deg_per_m = 1.5
[[leg]]
length_m = 4
to_inclination_deg = 4
to_azimuth_deg = 20
"""
RING = """name = "shaft 3"
layout = "shaft"
radius_m = 0.45
thickness_m = 0.3
length_m = 9
depth_step_m = 1.5
radius_cv = 0.04
radius_correlation = 0.6
unsurveyed_percent = 1.5
head_sigma_m = 0.006
instrument = "relay"
serial = "R-1"
allowed_probability = 0.02
tight_from_m = 1
tight_to_m = 8
north = "grid"
convergence_deg = 1.75
stations_north = "magnetic"
declination_deg = 3.25
northing_m = 5000.5
easting_m = 300.25
height_m = 31.4
grid_scale_factor = 0.9996
heads = "heads.csv"
stations = "stations.csv"

[[layer]]
from_m = 3
radius_m = 0.5
[[layer]]
from_m = 6
radius_m = 0.42
radius_cv = 0.06
"""
GRID = """name = "grid"
layout = "grid"
spacing_m = 0.9
radius_m = 0.6
radius_cv = 0.03
thickness_m = 0.2
length_m = 6
depth_step_m = 2
instrument = "mwd-rev5.1"
field_nt = 49230
dip_deg = 66.5
declination_deg = 3.25
latitude_deg = 52.4
gravity_mps2 = 9.8123
depth_reference = "rotary-table"
answer_depth_reference = "collar"
depth_reference_height_m = 0.75
heads = "heads.csv"
stations = "stations.csv"
"""
BENT = """name = "bent"
radius_m = 0.7
thickness_m = 0.5
depth_step_m = 1
plan = "plan.toml"
instrument = "rst-inclinometer"
heads = "heads.csv"
stations = "stations.csv"
"""


def put(folder: Path, wall: str, heads: str, stations: Iterable[str]) -> Path:
    (folder / "heads.csv").write_text(heads)
    (folder / "stations.csv").write_text(HEAD + "\n".join(stations) + "\n")
    (folder / "wall.toml").write_text(wall)
    return folder / "wall.toml"


def ring(folder: Path) -> Path:
    """Seven columns around a shaft, one of them replaced and one joint with a column between."""
    heads, rows = ["column,north_m,east_m,down_m,serial,state,drilled_to_m,drilled_on,between,replaces"], []
    for k in range(7):
        turn = math.tau * k / 7.0
        state = "not-drilled" if k == 4 else "planned" if k == 6 else ""
        day = "" if state else f"2026-03-{2 + k:02d}"
        heads.append(
            f"S{k},{0.86 * math.cos(turn):.4f},{0.86 * math.sin(turn):.4f},{0.05 * k:g},{'R-2' if k > 2 else ''},"
            f"{state},{8.0 if k == 5 else ''},{day},,"
        )
        depth = {1: 6.0, 5: 7.5}.get(k, 9.0)
        if not state:
            rows += [f"S{k},{md:g},{0.25 * k + 0.02 * md:g},{37 * k + 4 * md:g},{60 * md + 700 * k:g}"
                     for md in (0.0, 2.0, 5.0, depth)]  # fmt: skip
    heads += ["X1,0.9,0.45,0,,,,2026-03-20,S0/S1,", "X2,-0.75,-0.38,0,R-2,,,2026-03-21,,S4"]
    rows += [f"{name},{md:g},{0.4 + 0.01 * md:g},{azimuth},{60 * md + 9000:g}"
             for name, azimuth in (("X1", 120), ("X2", 300)) for md in (0.0, 4.5, 9.0)]  # fmt: skip
    return put(folder, RING, "\n".join(heads) + "\n", rows)


def grid(folder: Path) -> Path:
    """Three by three columns under a floor, one of which leans away and leaves a void."""
    heads, rows = ["column,north_m,east_m,tolerance,head_sigma_m"], []
    for k in range(9):
        heads.append(f"G{k},{0.9 * (k // 3):g},{0.9 * (k % 3):g},{'5-cm' if k == 4 else ''},{0.01 if k % 2 else ''}")
        lean = 4.0 if k == 4 else 0.1 * k
        rows += [f"G{k},{md + 0.75:g},{lean:g},{25 * k:g},{50 * md + 900 * k:g}" for md in (0.0, 3.0, 6.0)]
    return put(folder, GRID, "\n".join(heads) + "\n", rows)


def bent(folder: Path) -> Path:
    """Columns along a plan that builds and turns, one of them straight by its own design."""
    (folder / "plan.toml").write_text(PLAN)
    heads = (
        "column,north_m,east_m,inclination_deg,azimuth_deg,length_m,radius_m,tolerance\n"
        "B1,0,0,,,,,\nB2,0.4,0.8,,,,0.75,\nB3,0.8,1.6,,,,,1:80\nB4,1.2,2.4,1.5,10,12,,\n"
    )
    way = ((0.0, 0.0, 0.0), (3.0, 0.1, 5.0), (5.5, 1.3, 4.0), (8.0, 2.4, 9.0), (12.0, 4.1, 21.0))
    rows = [
        f"B{k},{md:g},{inclination + 0.05 * k:g},{azimuth + 2 * k:g},{40 * md + 800 * k:g}"
        for k in (1, 2, 3, 4) for md, inclination, azimuth in way
    ]  # fmt: skip
    return put(folder, BENT, heads, rows)


WALLS: dict[str, Callable[[Path], Path]] = {"straight": write_wall, "ring": ring, "grid": grid, "bent": bent}


def told(folder: Path, name: str) -> Iterator[str]:
    """Answer, warnings, stations, records of the report, and the figure in both shades."""
    wall = read_wall(WALLS[name](folder))
    judgement = judge_wall(wall)
    for line in (*leaves(wall_result(wall, judgement)), *told_columns(wall)):
        yield line.replace(str(folder), "FOLDER")
    for record in column_records(wall, judgement):
        yield from leaves({"actions": record.actions, "chance": record.state}, f"record {record.design.name}")
    yield from drawing(draw_wall(wall, judgement))
    extra = dict(judgement.extras).get(worst_joint(judgement.joints)[0])
    yield from drawing(
        wall_figure(
            wall.columns, judgement.joints, wall.file.thickness, extra, "again", shown=4, allowed=0.2, shade="thickness"
        )
    )


def told_columns(wall: Wall) -> Iterator[str]:
    columns = wall.columns
    parts = {
        "names": list(columns.names), "depths": columns.depths, "centres": columns.centres, "covs": columns.covs,
        "radii": columns.radii, "designs": columns.designs, "states": columns.states,
        "drawn": columns.drawn_centres, "frame": wall.built.frame, "pairs": wall.pairs,
    }  # fmt: skip
    yield from leaves(parts, "as built")
    yield from leaves([(one.joint, one) for one in wall.detours], "detours")
    yield from leaves(list(wall.stages), "stages")
    yield from leaves(wall.tight_depths, "tight")


def told_file(folder: Path, form: str) -> Iterator[str]:
    """A wall as a file of another program, from its site coordinates."""
    from datetime import date

    wall = read_wall(ring(folder))
    site = site_of_wall(wall, judge_wall(wall), date(2026, 11, 20), "EPSG:25833")
    for hole in site.holes:
        yield from leaves(hole, hole.name)
    yield from exported_bytes(site, form).decode().replace(">", ">\n").replace("\r\n", "\n").splitlines()


MADE: dict[str, Callable[[Path], Iterable[str]]] = {
    **{f"wall-{name}": (lambda folder, name=name: told(folder, name)) for name in WALLS},  # type: ignore[misc]
    **{f"wall-file-{form}": (lambda folder, form=form: told_file(folder, form)) for form in ("ags", "diggs", "ifc")},  # type: ignore[misc]
}


SLOW = ("wall-ring", "wall-grid", "wall-file-diggs", "wall-file-ifc")


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in MADE])
def test_a_wall_is_told_as_approved(tmp_path: Path, name: str) -> None:
    check(name, MADE[name](tmp_path))


def test_joints_of_straight_columns_are_lenses_of_two_circles(tmp_path: Path) -> None:
    """Chord of two circles at the distance of their centres, each straight by its inclination and azimuth."""
    wall = read_wall(write_wall(tmp_path))
    found = judge_wall(wall).joints
    names, radii = list(wall.columns.names), {"C": 0.65}

    def centre(name: str, depth: float) -> np.ndarray:
        inclination, azimuth, *_ = HOLES[name]
        lean = depth * math.tan(math.radians(inclination))
        head = np.array([0.0, 0.9 * names.index(name)])
        return head + lean * np.array([math.cos(math.radians(azimuth)), math.sin(math.radians(azimuth))])

    for joint, (first, second) in enumerate([("A", "B"), ("B", "C")]):
        for z, depth in enumerate((0.0, 2.0, 4.0)):
            apart = float(np.linalg.norm(centre(second, depth) - centre(first, depth)))
            one, other = radii.get(first, 0.6), radii.get(second, 0.6)
            foot = (apart * apart + one * one - other * other) / (2.0 * apart)
            assert found.distance[joint, z] == pytest.approx(apart, rel=1e-9)
            assert found.thickness[joint, z] == pytest.approx(2.0 * math.sqrt(one * one - foot * foot), rel=1e-9)


def test_regions_are_told_covariances_and_that_of_setting_out(tmp_path: Path) -> None:
    columns = read_wall(write_wall(tmp_path)).columns
    for name in ("A", "B", "E"):
        nn, ne, _, ee, _, _ = HOLES[name][3]
        expected = np.array([[nn, ne], [ne, ee]]) + HEAD_STD**2 * np.eye(2)
        np.testing.assert_allclose(columns.covs[list(columns.names).index(name), -1], expected, rtol=0.05)


REFUSED = {
    "radius_m": ('radius_m = "wide"', "radius_m: expected a positive number, got 'wide'"),
    "thickness_m": ("thickness_m = 0", "thickness_m: expected a positive number, got 0"),
    "head_sigma_m": ("head_sigma_m = -0.1", "head_sigma_m: expected a non-negative number, got -0.1"),
    "northing_m": ("northing_m = inf", "northing_m: expected a finite number, got inf"),
    "tolerance": ("tolerance = 5", "tolerance: expected a text, got 5"),
    "depth_step_m": ("depth_step_m = 2.1", "depth_step_m: expected at most 2, got 2.1"),
    "stations": ("colour = 3", "colour: unknown key; expected one of name, heads, stations, layout, tolerance"),
    "heads": ("", "heads is missing"),
    "length_m": ('layout = "grid"', "spacing_m is missing; a grid needs it to know who is whose neighbour"),
    "project": ('layout = "row"', "layout: expected one of line, shaft, grid, got 'row'"),
    "client": ('method = "straight"', "method: expected one of tangential, balanced-tangential, average-angle"),
}


@pytest.mark.parametrize("key", REFUSED)
def test_what_a_wall_file_may_not_say_is_named(tmp_path: Path, key: str) -> None:
    path = write_wall(tmp_path)
    new, words = REFUSED[key]
    lines = [new if line.startswith(f"{key} ") else line for line in path.read_text().splitlines()]
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(SurveyError) as error:
        read_wall(path)
    assert str(error.value).startswith(f"{path}: {words}")


if __name__ == "__main__":
    write_anew(MADE)
