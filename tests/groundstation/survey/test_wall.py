"""Walls of columns: as-built centres, the worst joint, the column that closes it, and who is whose neighbour."""

import math
from dataclasses import replace

import numpy as np
import pytest

from groundstation.survey.wall.as_built import Columns, Cut, intersect_planes
from groundstation.survey.wall.column_joint import joint_thickness
from groundstation.survey.wall.plane_errors import PlaneErrors
from groundstation.survey.wall.wall_joints import (
    crossed_joints,
    extra_column,
    judge_joints,
    neighbours_in_grid,
    neighbours_in_line,
    worst_joint,
)
from groundstation.survey.wall.wall_verdict import judge_columns
from groundstation.survey.well.arcs import on_arc
from groundstation.survey.well.methods import Method, station_positions, station_tangents

DEG = math.pi / 180.0
RADIUS, SPACING, REQUIRED, LENGTH = 0.60, 0.75, 0.80, 30.0
LIMIT = 2.0 * math.sqrt(RADIUS**2 - 0.25 * REQUIRED**2)  # 0.894 m


def random_wells(count: int, stations: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Near-vertical wells surveyed every 2 m: measured depths, positions and tangents."""
    generator = np.random.default_rng(9)
    md = np.broadcast_to(2.0 * np.arange(stations), (count, stations))
    lean = np.cumsum(generator.normal(0.0, 0.3 * DEG, (count, stations, 2)), axis=1)
    inclination, azimuth = np.hypot(lean[..., 0], lean[..., 1]), np.arctan2(lean[..., 1], lean[..., 0])
    return (
        md,
        station_positions(Method.MINIMUM_CURVATURE, md, inclination, azimuth),
        station_tangents(inclination, azimuth),
    )


def centre_on_arc(md: np.ndarray, position: np.ndarray, tangent: np.ndarray, tvd: float) -> np.ndarray:
    k = next(k for k, below in enumerate(position[1:]) if tvd <= below[2])

    def place(share: float) -> np.ndarray:
        ends = tangent[k], tangent[k + 1], position[k + 1] - position[k]
        return position[k] + on_arc(*ends, float(md[k + 1] - md[k]), share)[0]

    low, high = 0.0, 1.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if place(middle)[2] < tvd else (low, middle)
    return place(low)[:2]


def in_planes(found: Cut, errors: np.ndarray) -> np.ndarray:
    """Errors (w, z, 2, k) of columns in planes, of those of their stations (w, n, 3, k)."""
    effects = list(found.in_plane(errors))
    nothing = np.zeros((*found.share.shape, 0))
    return PlaneErrors.of_stations(effects, found.upper, found.share, nothing).at(range(len(effects)))


@pytest.mark.slow
def test_centres_at_a_depth_lie_on_the_arcs_of_the_wells() -> None:
    md, position, tangent = random_wells(6, 16)
    depths = np.linspace(0.0, 29.5, 60)
    centres = intersect_planes(position, tangent, depths).centres
    for well in range(6):
        for depth, centre in zip(depths, centres[well], strict=True):
            np.testing.assert_allclose(
                centre, centre_on_arc(md[well], position[well], tangent[well], depth), atol=0.0005
            )


def test_centres_at_the_depths_of_stations_are_the_stations() -> None:
    _, position, tangent = random_wells(1, 10)
    generator = np.random.default_rng(10)
    root = generator.normal(0.0, 0.01, (1, 10, 3, 3))
    covs = root @ np.swapaxes(root, -1, -2)
    found = intersect_planes(position, tangent, position[0, :, 2])
    errors = in_planes(found, root)
    plane = errors @ np.swapaxes(errors, -1, -2)
    np.testing.assert_allclose(found.centres[0], position[0, :, :2], atol=1e-12)
    slope = tangent[0, :, :2] / tangent[0, :, 2:]
    for k in range(10):
        lateral = np.concatenate([np.eye(2), -slope[k][:, None]], axis=1)
        np.testing.assert_allclose(plane[0, k], lateral @ covs[0, k] @ lateral.T, rtol=1e-9)


def test_below_its_toe_a_column_has_no_centre() -> None:
    inclination = np.zeros((2, 4))
    md = np.array([[0.0, 2.0, 4.0, 6.0], [0.0, 1.0, 2.0, 3.0]])
    position = station_positions(Method.MINIMUM_CURVATURE, md, inclination, inclination)
    centres = intersect_planes(position, station_tangents(inclination, inclination), np.arange(8.0)).centres
    np.testing.assert_array_equal(np.isnan(centres[0, :, 0]), np.arange(8.0) > 6.0)
    np.testing.assert_array_equal(np.isnan(centres[1, :, 1]), np.arange(8.0) > 3.0)


def test_an_error_of_depth_moves_the_centre_by_the_slope_of_the_hole() -> None:
    tilt = 20.0 * DEG
    inclination, azimuth = np.full((1, 3), tilt), np.full((1, 3), 90.0 * DEG)
    md = np.array([[0.0, 5.0, 10.0]])
    position = station_positions(Method.MINIMUM_CURVATURE, md, inclination, azimuth)
    covs = np.broadcast_to(np.diag([1e-6, 4e-6, 9e-4]), (1, 3, 3, 3))
    found = intersect_planes(position, station_tangents(inclination, azimuth), np.array([2.0, 7.0]))
    errors = in_planes(found, np.sqrt(covs))
    plane = errors @ np.swapaxes(errors, -1, -2)
    np.testing.assert_allclose(found.centres[0], [[0.0, 2.0 * math.tan(tilt)], [0.0, 7.0 * math.tan(tilt)]], atol=1e-12)
    expected = np.diag([1e-6, 4e-6 + 9e-4 * math.tan(tilt) ** 2])
    np.testing.assert_allclose(plane[0], [expected, expected], atol=1e-15)


DEPTHS = np.linspace(0.0, LENGTH, 61)


def wall(deviating_deg: float = 0.5, std_per_m: float = 3e-4, count: int = 5) -> tuple[Columns, np.ndarray]:
    """A wall to the east whose third column runs away to the east; centres uncertain in proportion to depth."""
    designs = np.stack([np.zeros(count), SPACING * np.arange(count)], axis=1)
    centres = np.repeat(designs[:, None, :], len(DEPTHS), axis=1)
    centres[2, :, 1] += DEPTHS * math.tan(deviating_deg * DEG)
    var = (std_per_m * DEPTHS + 1e-4) ** 2
    covs = np.broadcast_to(var[:, None, None] * np.eye(2), (count, len(DEPTHS), 2, 2))
    names = [f"C{k + 1}" for k in range(count)]
    return Columns.surveyed(names, DEPTHS, centres, covs, designs, RADIUS), neighbours_in_line(count, closed=False)


def test_the_worst_joint_is_told_by_name_depth_and_direction() -> None:
    columns, pairs = wall()
    found = judge_joints(columns, pairs, REQUIRED)
    joint, depth = worst_joint(found)
    assert [columns.names[k] for k in found.pairs[joint]] == ["C2", "C3"]
    assert columns.depths[depth] == 30.0
    np.testing.assert_allclose(found.offset[joint, depth], [0.0, 30.0 * math.tan(0.5 * DEG)], atol=1e-12)
    assert found.thickness[joint, depth] == pytest.approx(
        2.0 * math.sqrt(RADIUS**2 - 0.25 * (SPACING + 30.0 * math.tan(0.5 * DEG)) ** 2)
    )
    np.testing.assert_array_equal(found.offset[0], np.zeros((len(DEPTHS), 2)))


def test_a_joint_opens_where_the_column_has_used_up_the_margin() -> None:
    columns, pairs = wall()
    found = judge_joints(columns, pairs, REQUIRED)
    opens = (LIMIT - SPACING) / math.tan(0.5 * DEG)
    np.testing.assert_array_equal(found.thickness[1] < REQUIRED, opens < DEPTHS)
    assert np.all(found.thickness[[0, 2, 3]] > REQUIRED)
    assert np.all((found.probability[1] > 0.5) == (opens < DEPTHS))
    assert np.all(np.diff(found.probability[1]) >= -1e-9)


def test_both_regions_of_uncertainty_count_towards_a_joint() -> None:
    from scipy.stats import ncx2

    columns, pairs = wall(0.0)
    found = judge_joints(columns, pairs, REQUIRED)
    std = math.sqrt(2.0) * (3e-4 * 30.0 + 1e-4)
    expected = float(ncx2.sf((LIMIT / std) ** 2, 2, (SPACING / std) ** 2))
    np.testing.assert_allclose(found.probability[:, -1], expected, rtol=1e-6)


def test_the_more_probable_gap_is_worse_than_the_thinner_joint() -> None:
    columns, pairs = wall(0.2)
    covs = columns.covs.copy()
    covs[0] = 0.2**2 * np.eye(2)
    uncertain = Columns.surveyed(columns.names, DEPTHS, columns.centres, covs, columns.designs, RADIUS)
    found = judge_joints(uncertain, pairs, REQUIRED)
    assert worst_joint(found)[0] == 0
    assert found.thickness[1, -1] < found.thickness[0, -1]


def test_of_equally_probable_joints_the_thinnest_is_worst() -> None:
    columns, pairs = wall(0.05)
    covs = np.zeros_like(columns.covs)
    certain = Columns.surveyed(columns.names, DEPTHS, columns.centres, covs, columns.designs, RADIUS)
    found = judge_joints(certain, pairs, REQUIRED)
    np.testing.assert_array_equal(found.probability, 0.0)
    assert worst_joint(found) == (1, len(DEPTHS) - 1)


def test_below_the_end_of_a_column_its_joints_are_open() -> None:
    columns, pairs = wall(0.0)
    centres = columns.centres.copy()
    centres[1, DEPTHS > 20.0] = np.nan
    short = Columns.surveyed(columns.names, DEPTHS, centres, columns.covs, columns.designs, RADIUS)
    found = judge_joints(short, pairs, REQUIRED)
    for joint in (0, 1):
        np.testing.assert_array_equal(np.isnan(found.thickness[joint]), DEPTHS > 20.0)
        np.testing.assert_array_equal(found.probability[joint] == 1.0, DEPTHS > 20.0)
    assert np.all(found.probability[2:] < 1e-9)
    joint, depth = worst_joint(found)
    assert (joint, DEPTHS[depth]) == (0, 20.5)
    extra = extra_column(short, found, 0, REQUIRED)
    assert extra is not None
    assert (extra.from_depth, extra.to_depth) == (20.5, 30.0)
    assert (extra.north, extra.east, extra.closes) == (0.0, SPACING, True)


def test_an_extra_column_in_the_middle_closes_the_gap() -> None:
    columns, pairs = wall()
    found = judge_joints(columns, pairs, REQUIRED)
    extra = extra_column(columns, found, 1, REQUIRED)
    assert extra is not None
    assert extra.closes
    assert (extra.from_depth, extra.to_depth) == (17.0, 30.0)
    assert extra.north == pytest.approx(0.0, abs=1e-12)
    first, last = (0.5 * z * math.tan(0.5 * DEG) for z in (17.0, 30.0))
    assert extra.east == pytest.approx(1.5 * SPACING + 0.5 * (first + last))
    for k in (1, 2):
        far = np.abs(columns.centres[k, DEPTHS >= 17.0, 1] - extra.east)
        assert np.all(joint_thickness(far, RADIUS) >= REQUIRED)


def test_a_gap_that_is_too_wide_is_not_closed_by_one_more_column() -> None:
    columns, pairs = wall(3.0)
    extra = extra_column(columns, judge_joints(columns, pairs, REQUIRED), 1, REQUIRED)
    assert extra is not None
    assert not extra.closes


def test_a_joint_that_is_thick_enough_needs_no_extra_column() -> None:
    columns, pairs = wall()
    assert extra_column(columns, judge_joints(columns, pairs, REQUIRED), 0, REQUIRED) is None


@pytest.mark.parametrize(
    ("count", "closed", "expected"),
    [
        (4, False, [(0, 1), (1, 2), (2, 3)]),
        (4, True, [(0, 1), (1, 2), (2, 3), (3, 0)]),
        (3, True, [(0, 1), (1, 2), (2, 0)]),
        (2, True, [(0, 1)]),
        (2, False, [(0, 1)]),
        (1, False, []),
        (1, True, []),
    ],
)
def test_neighbours_in_a_line_follow_each_other(count: int, closed: bool, expected: list[tuple[int, int]]) -> None:
    assert [tuple(pair) for pair in neighbours_in_line(count, closed=closed)] == expected


def test_neighbours_in_a_square_grid_are_those_beside_and_not_across() -> None:
    heads = np.array([[north, east] for north in range(3) for east in range(3)], float) * SPACING
    pairs = neighbours_in_grid(heads, SPACING)
    assert len(pairs) == 12
    np.testing.assert_allclose(np.linalg.norm(heads[pairs[:, 0]] - heads[pairs[:, 1]], axis=1), SPACING)
    assert [tuple(pair) for pair in pairs[:3]] == [(0, 1), (0, 3), (1, 2)]
    assert np.all(pairs[:, 0] < pairs[:, 1])


def test_neighbours_in_a_triangular_grid_are_six_to_the_middle() -> None:
    around = [[math.cos(k * math.pi / 3.0), math.sin(k * math.pi / 3.0)] for k in range(6)]
    pairs = neighbours_in_grid(SPACING * np.array([[0.0, 0.0], *around]), SPACING)
    assert np.count_nonzero(pairs == 0) == 6
    assert len(pairs) == 12


def test_columns_far_apart_have_no_neighbours() -> None:
    assert neighbours_in_grid(np.array([[0.0, 0.0], [5.0, 5.0]]), SPACING).shape == (0, 2)


@pytest.mark.parametrize(("own_plan", "is_told"), [((0.75, 0.75), True), ((2.0, 2.0), False)])
def test_a_void_is_told_of_a_hole_whose_plan_comes_to_it(own_plan: tuple[float, float], is_told: bool) -> None:
    """Eight columns about a place where none stands. The ninth begins 4 m away; its plan leads there, or elsewhere."""
    depths = np.arange(0.0, 3.0)
    heads = 0.75 * np.array([[r, c] for r in range(3) for c in range(3)], float)
    centres = np.repeat(heads[:, None], 3, axis=1)
    centres[4] = np.nan
    covs = np.broadcast_to(1e-6 * np.eye(2), (9, 3, 2, 2))
    columns = Columns.surveyed([f"G{k}" for k in range(9)], depths, centres, covs, heads, 0.6)
    designs, planned = columns.designs.copy(), columns.planned.copy()
    designs[4] = 4.0, 4.0
    planned[4] = own_plan
    columns = replace(columns, designs=designs, planned=planned)
    found = judge_columns(columns, np.array([[4, 5]]), 0.8, grid_spacing=0.75, about=4)
    assert [void.depth for void in found.voids] == ([0.0, 1.0, 2.0] if is_told else [])


def test_columns_that_cross_by_their_design_have_not_changed_sides() -> None:
    """Of two that are raked across each other; the third crosses where its design does not."""
    heads = np.array([[0.0, 0.0], [0.0, 0.4], [0.0, 0.8]])
    rake = np.linspace(0.0, 0.9, len(DEPTHS))
    planned = np.repeat(heads[:, None], len(DEPTHS), axis=1)
    planned[0, :, 1] += rake
    columns = Columns.surveyed(["A", "B", "C"], DEPTHS, planned, np.zeros((3, len(DEPTHS), 2, 2)), heads, RADIUS)
    pairs = neighbours_in_line(3, closed=False)
    assert crossed_joints(replace(columns, planned=planned), pairs) == []
    joint, depth = crossed_joints(columns, pairs)[0]  # with upright designs
    assert joint == 0
    assert rake[depth - 1] <= 0.4 < rake[depth]


def test_an_extra_column_stands_where_its_furthest_neighbour_is_nearest() -> None:
    """A neighbour that bulges at one depth alone: the mean of its places is not where one column joins it there."""
    columns, pairs = wall(0.0, count=3)
    centres = columns.centres.copy()
    centres[1, :, 1] -= 0.35
    centres[1, 30, 1] -= 0.3
    bulged = replace(columns, centres=centres)
    extra = extra_column(bulged, judge_joints(bulged, pairs, REQUIRED), 1, REQUIRED)
    assert extra is not None
    middles = 0.5 * (centres[1, :, 1] + centres[2, :, 1])
    assert extra.east == pytest.approx(0.5 * (middles.min() + middles.max()), abs=1e-9)
