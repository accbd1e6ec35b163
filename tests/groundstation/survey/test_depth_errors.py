"""Regions of positions against holes that were really drilled: depths, directions and the path between stations err.

The truth shares nothing with what is judged: the curvature is an autoregression in steps of two centimetres, the hole
is its sum, and every reading is taken where its tube really hung.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest

from groundstation.survey.fusion.resolve import Direction, known_direction
from groundstation.survey.fusion.shared import SharedErrors
from groundstation.survey.path.leg_wander import LegWander
from groundstation.survey.well.depth_errors import EXACT, DepthErrors, mean_depth
from groundstation.survey.well.trajectory import Trajectory
from groundstation.survey.well.trajectory_rows import TrajectoryPoint

DEG = math.pi / 180.0
STEP = 0.02  # m
STATIONS, SPACING = 10, 2.0
ERRORS = DepthErrors(scale_std=2e-3, offset_std=0.01, tube_std=3e-3, reading_std=4e-3)
WANDER = LegWander(0.2 * DEG, 8.0)
NOISE = 3e-4  # rad, of one reading, each way
INSIDE = 7.8147  # chi-square of 3 degrees of freedom, 95 %
HOLES = 2000


@dataclass(frozen=True)
class Drilled:
    """True positions and tangents (holes, steps, 3) every `STEP`."""

    positions: np.ndarray
    tangents: np.ndarray

    def at(self, values: np.ndarray, depths: np.ndarray) -> np.ndarray:
        """One of the two at true depths (holes,)."""
        where = depths / STEP
        k = np.clip(where.astype(int), 0, values.shape[1] - 2)
        share = (where - k)[:, None]
        rows = np.arange(len(values))
        return (1.0 - share) * values[rows, k] + share * values[rows, k + 1]


def drilled(holes: int, inclination: float, generator: np.random.Generator) -> Drilled:
    """Holes whose curvature wanders on two axes that are carried along."""
    steps = int((STATIONS * SPACING + 1.0) / STEP)
    kept = math.exp(-STEP / WANDER.length)
    curvature = WANDER.std * generator.standard_normal((2, holes))
    tangent = np.tile([math.sin(inclination), 0.0, math.cos(inclination)], (holes, 1))
    first = np.tile([math.cos(inclination), 0.0, -math.sin(inclination)], (holes, 1))
    position = np.zeros((holes, 3))
    positions, tangents = [position], [tangent]
    for _ in range(steps):
        second = np.cross(tangent, first)
        turned = tangent + STEP * (curvature[0][:, None] * first + curvature[1][:, None] * second)
        turned /= np.linalg.norm(turned, axis=1)[:, None]
        position = position + 0.5 * STEP * (tangent + turned)
        first = first - (first * turned).sum(axis=1)[:, None] * turned
        first /= np.linalg.norm(first, axis=1)[:, None]
        tangent = turned
        curvature = kept * curvature + WANDER.std * math.sqrt(1.0 - kept**2) * generator.standard_normal((2, holes))
        positions.append(position)
        tangents.append(tangent)
    return Drilled(np.stack(positions, axis=1), np.stack(tangents, axis=1))


def read_depths(holes: int, generator: np.random.Generator) -> list[np.ndarray]:
    """True depths (readings, holes) of each station: the nodes that pass it, the one at the bit first."""
    scale = ERRORS.scale_std * generator.standard_normal(holes)
    offset = ERRORS.offset_std * generator.standard_normal(holes)
    lengths = ERRORS.tube_std * generator.standard_normal((STATIONS, holes))
    found = []
    for station in range(1, STATIONS + 1):
        rows = []
        for below in range(STATIONS - station + 1):
            bit = SPACING * (station + below)
            reading = ERRORS.reading_std * generator.standard_normal(holes)
            rows.append(SPACING * station - (scale * bit + offset + reading - lengths[:below].sum(axis=0)))
        found.append(np.array(rows))
    return found


def read_directions(tangents: np.ndarray, generator: np.random.Generator) -> Iterator[Direction]:
    """Directions of holes with tangents (readings, holes, 3), of one station: the mean of what each node read."""
    mean = tangents.mean(axis=0)
    across = np.eye(3) - mean[:, :, None] * mean[:, None]
    std = NOISE / math.sqrt(len(tangents))
    noisy = mean + std * np.einsum("hij,hj->hi", across, generator.standard_normal(mean.shape))
    for tangent, plane in zip(noisy / np.linalg.norm(noisy, axis=1)[:, None], across, strict=True):
        yield Direction(tangent[:2], float(tangent[2]), std**2 * plane[:2, :2], np.zeros((2, 0)))


@pytest.mark.slow
@pytest.mark.parametrize("inclination_deg", [0.0, 35.0, 70.0, 130.0])
def test_the_region_holds_where_the_nodes_really_were(inclination_deg: float) -> None:
    generator = np.random.default_rng(47)
    inclination = inclination_deg * DEG
    hole = drilled(HOLES, inclination, generator)
    depths = read_depths(HOLES, generator)
    shared = SharedErrors()
    below = [shared.depth_places_of(list(range(1, count + 1))) for count in range(STATIONS)]
    station_depths, truth, directions = {}, [], []
    for station, rows in enumerate(depths, 1):
        md = SPACING * station
        station_depths[md] = mean_depth(md, below[: len(rows)], ERRORS, SPACING)
        truth.append(hole.at(hole.positions, rows.mean(axis=0)))
        seen = np.stack([hole.at(hole.tangents, own) for own in rows])
        directions.append(list(read_directions(seen, generator)))
    inside = np.zeros((STATIONS, 4))
    collar = known_direction(inclination, 0.0)
    for one in range(HOLES):
        drawn = Trajectory(collar=collar, wander=WANDER)
        drawn.extend([(SPACING * (k + 1), own[one]) for k, own in enumerate(directions)], station_depths)
        errors = drawn.positions[1:] - np.array([own[one] for own in truth])
        whole = np.einsum("ni,ni->n", errors, np.linalg.solve(drawn.covs[1:], errors[:, :, None])[:, :, 0])
        axes = errors**2 / np.diagonal(drawn.covs[1:], axis1=1, axis2=2)
        inside += np.column_stack([whole < INSIDE, axes < 3.8415])
    share = inside / HOLES
    assert share.min() >= 0.93, share
    assert share.max() <= 0.97, share


@pytest.mark.slow
def test_between_stations_the_region_holds_the_hole() -> None:
    """Stations a long way apart, read without error: all that is not known is what the path did between them."""
    generator = np.random.default_rng(5)
    hole, leg = drilled(HOLES, 0.0, generator), 4.0
    inside = dict.fromkeys((0.25, 0.5, 0.75, 1.0), 0)
    sizes = dict.fromkeys(inside, 0.0)
    ends = [hole.at(hole.tangents, np.full(HOLES, md)) for md in (leg, 2.0 * leg)]
    true = {share: hole.at(hole.positions, np.full(HOLES, leg * (1.0 + share))) for share in inside}
    for one in range(HOLES):
        drawn = Trajectory(wander=WANDER)
        for number, end in enumerate(ends, 1):
            drawn.append(number * leg, known_direction(math.acos(end[one, 2]), math.atan2(end[one, 1], end[one, 0])))
        for share in inside:
            point = drawn.at(leg * (1.0 + share))
            error = (point.position - true[share][one])[:2]
            inside[share] += float(error @ np.linalg.solve(point.cov[:2, :2], error)) < 5.9915
            sizes[share] = point.cov[0, 0] - drawn[1].cov[0, 0]
    assert 0.0 <= sizes[0.25] < sizes[0.5] < sizes[1.0], sizes
    for share, count in inside.items():
        assert 0.93 <= count / HOLES <= 0.97, (share, count / HOLES)


def station(md: float, inclination: float, azimuth: float, std: float = 1e-3) -> tuple[float, Direction]:
    known = known_direction(inclination, azimuth)
    columns = np.outer([-known.lean[1], known.lean[0]], [2e-3, 1e-3])
    return md, replace(known, cov=std**2 * np.eye(2), shared=columns)


def hole_of(count: int, shared: SharedErrors) -> Trajectory:
    drawn = Trajectory(wander=WANDER, keeps_columns=True)
    below = [shared.depth_places_of(list(range(1, n + 1))) for n in range(count)]
    stations = [station(2.0 * k, 0.1 + 0.02 * k, 0.3 * k) for k in range(1, count + 1)]
    depths = {md: mean_depth(md, below[: 1 + k % 4], ERRORS, 2.0) for k, (md, _) in enumerate(stations)}
    drawn.extend(stations, depths)
    return drawn


@pytest.mark.parametrize("count", [1, 2, 65, 130])
def test_a_point_just_above_a_station_is_that_station(count: int) -> None:
    """The two are worked out in different ways; at the borders of the blocks of the sums too."""
    drawn = hole_of(count, SharedErrors())
    for place in {1, count // 2 + 1, count}:
        there = drawn[place]
        for point in (drawn.at(there.md), drawn.at(there.md - 1e-9)):
            np.testing.assert_allclose(point.position, there.position, atol=1e-8)
            np.testing.assert_allclose(point.cov, there.cov, rtol=1e-6, atol=1e-12)
            np.testing.assert_allclose(point.shared, there.shared, rtol=1e-6, atol=1e-10)


def test_a_point_between_is_as_one_more_station_with_the_direction_between() -> None:
    """Without a path that wanders nothing else is in it: of half the second leg three parts in four are the upper's."""
    upper, lower = station(2.0, 0.12, 0.3), station(4.0, 0.121, 0.301)
    drawn = Trajectory(collar=known_direction(0.12, 0.3))
    drawn.extend([upper, lower])
    point, half = drawn.at(3.0), known_direction(0.1205, 0.3005)
    tangents = np.array([[*one.lean, one.down] for one in (upper[1], half)])
    assert point.position == pytest.approx(2.0 * tangents[0] + 0.5 * tangents.sum(axis=0), abs=1e-6)
    expected = (1.0 + 0.75) * upper[1].shared + 0.25 * lower[1].shared
    np.testing.assert_allclose(point.shared[:2], expected, rtol=1e-9)


def test_every_source_moves_a_straight_hole_along_itself_as_its_formula_says() -> None:
    shared, inclination = SharedErrors(), 0.4
    axis = np.array([math.sin(inclination), 0.0, math.cos(inclination)])
    below = [shared.depth_places_of(list(range(1, n + 1))) for n in range(3)]
    drawn = Trajectory(collar=known_direction(inclination, 0.0))
    stations = [(md, known_direction(inclination, 0.0)) for md in (2.0, 4.0, 6.0)]
    drawn.extend(stations, {md: mean_depth(md, below, ERRORS, 2.0) for md, _ in stations})
    for place, md in enumerate((2.0, 4.0, 6.0), 1):
        scale = ERRORS.scale_std * (md + 2.0)  # its readings come from bits 0, 2 and 4 m deeper
        tubes = ERRORS.tube_std**2 * ((2.0 / 3.0) ** 2 + (1.0 / 3.0) ** 2)
        expected = scale**2 + ERRORS.offset_std**2 + tubes + ERRORS.reading_std**2 / 3.0
        np.testing.assert_allclose(drawn[place].cov, expected * np.outer(axis, axis), atol=1e-15)


def test_a_depth_without_error_changes_nothing() -> None:
    stations = [station(2.0 * k, 0.1, 0.2 * k) for k in range(1, 5)]
    one, other = Trajectory(), Trajectory()
    one.extend(stations)
    other.extend(stations, {md: EXACT for md, _ in stations})
    np.testing.assert_array_equal(one.covs, other.covs)


def test_stations_put_one_by_one_are_as_the_whole_hole() -> None:
    count = 70
    shared = SharedErrors()
    whole = hole_of(count, shared)
    below = [shared.depth_places_of(list(range(1, n + 1))) for n in range(count)]
    put = Trajectory(wander=WANDER)
    for k in reversed(range(1, count + 1)):
        md, direction = station(2.0 * k, 0.1 + 0.02 * k, 0.3 * k)
        put.put([(md, direction)], {md: mean_depth(md, below[: 1 + (k - 1) % 4], ERRORS, 2.0)})
    assert same(put.points, whole.points)


def same(one: list[TrajectoryPoint], other: list[TrajectoryPoint]) -> bool:
    pairs = zip(one, other, strict=True)
    return all(
        np.array_equal(a.position, b.position) and np.array_equal(a.cov, b.cov) and np.array_equal(a.shared, b.shared)
        for a, b in pairs
    )
