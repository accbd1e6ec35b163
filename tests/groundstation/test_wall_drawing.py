"""The figure of a wall in print, measured: columns, regions and joints of a wall that runs obliquely."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.axes import Axes

from groundstation.report.plane_words import name_axes
from groundstation.report.plots_wall import draw_wall, wall_figure
from groundstation.survey.wall.as_built import Columns, plane_frame
from groundstation.survey.wall.column_deviation import ColumnDesign
from groundstation.survey.wall.judged_wall import judge_wall
from groundstation.survey.wall.wall_file import read_wall
from groundstation.survey.wall.wall_joints import (
    Joints,
    judge_joints,
    neighbours_in_grid,
    neighbours_in_line,
    worst_joint,
)

RADIUS, REQUIRED, COUNT = 0.6, 0.8, 5
DEPTHS = np.arange(0.0, 20.1, 1.0)
COV = np.array([[4e-4, 2.5e-4], [2.5e-4, 9e-4]])  # at the toe
SIGMA = math.sqrt(-2.0 * math.log(1.0 - 0.95))


def wall() -> tuple[Columns, Joints]:
    """Columns 0.75 m apart on a line to the north-east by east; the fourth leans away to the north."""
    along = np.array([math.cos(1.1), math.sin(1.1)])
    heads = 0.75 * np.arange(COUNT)[:, None] * along + np.array([3.0, -7.0])
    leans = np.zeros((COUNT, 2))
    leans[3] = 0.011, 0.004
    centres = heads[:, None] + leans[:, None] * DEPTHS[:, None]
    covs = np.broadcast_to(
        (DEPTHS / DEPTHS[-1])[:, None, None] ** 2 * COV + 1e-8 * np.eye(2), (COUNT, len(DEPTHS), 2, 2)
    )
    names = [f"P{k + 1}" for k in range(COUNT)]
    columns = Columns.surveyed(names, DEPTHS, centres, covs, heads, RADIUS)
    return columns, judge_joints(columns, neighbours_in_line(COUNT, closed=False), REQUIRED)


def panels() -> tuple[Axes, ...]:
    """Thickness over depth, map, plan, worst joint."""
    columns, found = wall()
    figure = wall_figure(columns, found, REQUIRED, None, "oblique")
    plt.close(figure)
    return tuple(figure.axes[:4])


def of(axes: Axes, gid: str) -> list[Any]:
    return [artist for artist in axes.get_children() if artist.get_gid() == gid]


def thickness(first: int, second: int) -> np.ndarray:
    """Of a joint over depth: the common chord of two equal circles."""
    columns, _ = wall()
    apart = np.hypot(*np.moveaxis(columns.centres[second] - columns.centres[first], -1, 0))
    return np.asarray(2.0 * np.sqrt(RADIUS**2 - (0.5 * apart) ** 2))


def test_the_plan_has_every_column_where_it_is_at_the_worst_depth() -> None:
    columns, found = wall()
    _, depth = worst_joint(found)
    plan = panels()[2]
    circles = of(plan, "column")
    np.testing.assert_allclose([one.get_center() for one in circles], columns.centres[:, depth, ::-1], atol=1e-12)
    assert {one.get_radius() for one in circles} == {RADIUS}
    heads = next(line for line in plan.lines if line.get_marker() == "+")
    np.testing.assert_allclose(np.array(heads.get_data()).T, columns.designs[:, ::-1])
    assert (plan.get_xlabel(), plan.get_ylabel()) == ("East (m)", "North (m)")
    assert plan.get_xlim()[0] < plan.get_xlim()[1]
    assert plan.get_ylim()[0] < plan.get_ylim()[1]


def test_the_window_of_the_plan_is_around_the_worst_joint() -> None:
    columns, found = wall()
    joint, depth = worst_joint(found)
    (window,) = [patch for patch in panels()[2].patches if not patch.get_gid()]
    middle = columns.centres[list(found.pairs[joint]), depth].mean(axis=0)
    assert window.get_x() + 0.5 * window.get_width() == pytest.approx(middle[1])
    assert window.get_y() + 0.5 * window.get_height() == pytest.approx(middle[0])


def test_regions_of_the_worst_joint_are_those_of_their_covariances() -> None:
    columns, found = wall()
    _, depth = worst_joint(found)
    zoom = panels()[3]
    circles, outlines = of(zoom, "column"), of(zoom, "ellipse")
    assert len(outlines) == len(circles) >= 2
    known = np.linalg.inv(columns.covs[0, depth])
    for circle, outline in zip(circles, outlines, strict=True):
        east, north = (outline.get_path().vertices[:-1] - circle.get_center()).T
        off = np.stack([north, east], axis=-1)
        np.testing.assert_allclose(np.sqrt(np.einsum("ni,ij,nj->n", off, known, off)), SIGMA, rtol=1e-6)
    places = {tuple(np.round(one.get_center(), 9)) for one in circles}
    assert places <= {tuple(np.round(place, 9)) for place in columns.centres[:, depth, ::-1]}


def test_the_bar_across_the_worst_joint_is_its_thickness_and_square_to_the_centres() -> None:
    columns, found = wall()
    joint, depth = worst_joint(found)
    first, second = (int(k) for k in found.pairs[joint])
    bar = max((line for line in panels()[3].lines if line.get_linewidth() > 2.0), key=lambda line: line.get_linewidth())
    ends = np.array(bar.get_data()).T[:, ::-1]  # north, east
    assert np.hypot(*(ends[1] - ends[0])) == pytest.approx(thickness(first, second)[depth])
    between = columns.centres[second, depth] - columns.centres[first, depth]
    assert abs(float((ends[1] - ends[0]) @ between)) < 1e-12
    np.testing.assert_allclose(ends.mean(axis=0), columns.centres[[first, second], depth].mean(axis=0))


def test_thickness_is_drawn_over_depth_downwards_the_worst_joint_first() -> None:
    columns, found = wall()
    joint, depth = worst_joint(found)
    over_depth, shades = panels()[:2]
    first, second = (int(k) for k in found.pairs[joint])
    np.testing.assert_allclose(over_depth.lines[0].get_xdata(), thickness(first, second), rtol=1e-9)
    np.testing.assert_allclose(over_depth.lines[0].get_ydata(), DEPTHS)
    required = next(line for line in over_depth.lines if "required" in str(line.get_label()))
    assert list(required.get_xdata()) == [REQUIRED, REQUIRED]
    for axes in (over_depth, shades):
        assert axes.get_ylim()[0] > axes.get_ylim()[1]
    (ring,) = of(shades, "worst")
    assert (ring.get_xdata()[0], ring.get_ydata()[0]) == (joint, columns.depths[depth])
    cells = np.asarray(shades.collections[0].get_array()).reshape(len(DEPTHS), COUNT - 1)
    np.testing.assert_allclose(cells, found.probability.T)


AXES = {"North": (1, 0, 0), "South": (-1, 0, 0), "East": (0, 1, 0), "West": (0, -1, 0), "Down": (0, 0, 1)} | {
    "Up": (0, 0, -1)
}


@pytest.mark.parametrize(
    ("inclination_deg", "azimuth_deg", "first", "second", "depth"),
    [
        (0.0, 0.0, "North", "East", "TVD"),
        (90.0, 0.0, "Up", "East", "Along the columns"),
        (90.0, 90.0, "North", "Up", "Along the columns"),
        (90.0, 180.0, "Down", "East", "Along the columns"),
        (15.0, 0.0, "Mostly north", "East", "Along the columns"),
        (15.0, 90.0, "North", "Mostly east", "Along the columns"),
    ],
)
def test_axes_of_planes_are_named_by_where_they_point(
    inclination_deg: float, azimuth_deg: float, first: str, second: str, depth: str
) -> None:
    i, a = math.radians(inclination_deg), math.radians(azimuth_deg)
    axis = np.array([math.sin(i) * math.cos(a), math.sin(i) * math.sin(a), math.cos(i)])
    frame = plane_frame([ColumnDesign(inclination=i, azimuth=a)])
    np.testing.assert_allclose(frame[2], axis, atol=1e-12)
    words = name_axes(frame)
    assert words.depth == f"{depth} (m)"
    for row, word in zip(frame, (first, second), strict=False):
        assert row @ AXES[word.split()[-1].capitalize()] > (0.95 if "ostly" in word else 0.999)
    assert words[:2] == (f"{first} (m)", f"{second} (m)")


def test_a_level_wall_says_up_and_along(tmp_path: Path) -> None:
    """Three columns to the north, the middle one of which rises: it lies higher in the picture, whose axis says up."""
    (tmp_path / "heads.csv").write_text("column,north_m,east_m\nA,0,0\nB,0,0.75\nC,0,1.5\n")
    rows = [f"{name},{md},{90 + (name == 'B')},0" for name in "ABC" for md in (0, 5, 10)]
    (tmp_path / "stations.csv").write_text("column,md_m,inclination_deg,azimuth_deg\n" + "\n".join(rows) + "\n")
    (tmp_path / "wall.toml").write_text(
        'radius_m = 0.6\nthickness_m = 0.8\nlength_m = 10\ninclination_deg = 90\nheads = "heads.csv"\n'
        'stations = "stations.csv"\n'
    )
    found = read_wall(tmp_path / "wall.toml")
    figure = draw_wall(found, judge_wall(found))
    plt.close(figure)
    thick, shades, plan, zoom = figure.axes[:4]
    assert {axes.get_ylabel() for axes in (thick, shades)} == {"Along the columns (m)"}
    assert {(axes.get_xlabel(), axes.get_ylabel()) for axes in (plan, zoom)} == {("East (m)", "Up (m)")}
    centres = np.array([one.get_center() for one in of(plan, "column")])
    rise = 10.0 * math.tan(math.radians(1.0))
    np.testing.assert_allclose(centres, [[0.0, 0.0], [0.75, rise], [1.5, 0.0]], atol=1e-9)


def test_a_column_of_a_grid_is_nearer_to_its_name_than_any_other() -> None:
    heads = 0.75 * np.array([[r, c] for r in range(3) for c in range(3)], float)
    centres = np.repeat(heads[:, None], len(DEPTHS), axis=1)
    centres[4] += 0.004 * DEPTHS[:, None]
    covs = np.broadcast_to(1e-6 * np.eye(2), (9, len(DEPTHS), 2, 2))
    columns = Columns.surveyed([f"G{k}" for k in range(9)], DEPTHS, centres, covs, heads, RADIUS)
    figure = wall_figure(columns, judge_joints(columns, neighbours_in_grid(heads, 0.75), REQUIRED), REQUIRED, None, "g")
    plt.close(figure)
    names = [text for text in figure.axes[3].texts if text.get_text().startswith("G")]
    assert len(names) >= 6
    for text in names:
        away = np.hypot(*(centres[:, -1, ::-1] - text.get_position()).T)
        assert f"G{int(np.argmin(away))}" == text.get_text()


def test_joints_that_are_missing_all_along_leave_room_for_those_that_have_a_thickness(tmp_path: Path) -> None:
    """Two of seven columns were not drilled: four joints are open everywhere, and three lines were none."""
    (tmp_path / "h.csv").write_text("column,north_m,east_m\n" + "".join(f"K{k},0,{0.75 * k}\n" for k in range(7)))
    rows = "".join(f"K{k},{md},{0.1 * k},90\n" for k in (0, 1, 3, 5, 6) for md in (0, 5, 10))
    (tmp_path / "s.csv").write_text(f"column,md_m,inclination_deg,azimuth_deg\n{rows}")
    text = 'radius_m = 0.6\nthickness_m = 0.8\nlength_m = 10\nheads = "h.csv"\nstations = "s.csv"\n'
    (tmp_path / "wall.toml").write_text(text)
    figure = draw_wall(judged := read_wall(tmp_path / "wall.toml"), judge_wall(judged))
    plt.close(figure)
    drawn = {line.get_label().split(",")[0]: np.isfinite(line.get_xdata()).any() for line in figure.axes[0].lines}
    assert {name for name, is_drawn in drawn.items() if is_drawn} >= {"K0–K1", "K5–K6"}
