"""Where a hole ends, foreseen: by draws of the process in space, on raked and vertical designs; what it rests on."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.path.curvature_prior import CurvaturePrior
from groundstation.survey.path.curvature_tendency import CurvatureTendency, learn_curvature
from groundstation.survey.path.path_ahead import root_of
from groundstation.survey.wall.column_deviation import ColumnDesign
from groundstation.survey.wall.projected_end import CONE_POINTS, ProjectedEnd, project_to_target
from groundstation.survey.well.trajectory_rows import TrajectoryPoint

DEG = math.pi / 180.0
# a ground that all but goes straight, without layers: what is foreseen is the straight line
STRAIGHT_ON = CurvaturePrior(np.array([1e-9]), np.array([400.0]), np.ones((1, 1)), np.zeros(1), np.ones(1), 1e-9, 1e6)
CROOKED = CurvaturePrior(
    np.array([0.1 * DEG]), np.array([15.0]), np.ones((1, 1)), np.array([0.2 * DEG]), np.ones(1), 1e4, 60.0e4
)


def direction_of(inclination: float, azimuth: float, std: float, shared: float = 0.0) -> Direction:
    lean = math.sin(inclination) * np.array([math.cos(azimuth), math.sin(azimuth)])
    cov = std**2 * (np.eye(2) - np.outer(lean, lean))
    columns = np.array([[0.0], [shared]]) if shared else np.zeros((2, 0))
    return Direction(lean, math.cos(inclination), cov, columns)


def tangent_of(direction: Direction) -> np.ndarray:
    return np.array([*direction.lean, direction.down])


def going(tangent: np.ndarray, prior: CurvaturePrior, stations: int = 6, cov: float = 0.0) -> CurvatureTendency:
    """A hole that went straight in a direction so far."""
    covs = np.broadcast_to(cov * (np.eye(3) - np.outer(tangent, tangent)), (stations, 3, 3))
    return learn_curvature(2.0 * np.arange(stations), np.tile(tangent, (stations, 1)), covs, prior)


def point_at(position: list[float], tangent: np.ndarray, cov: float = 0.0, md: float = 10.0) -> TrajectoryPoint:
    return TrajectoryPoint(md, tangent, np.array(position), cov * np.eye(3), np.zeros((3, 0)))


def foresee(
    position: list[float],
    direction: Direction,
    design: ColumnDesign,
    prior: CurvaturePrior = STRAIGHT_ON,
    cov: float = 0.0,
) -> ProjectedEnd:
    tangent = tangent_of(direction)
    return project_to_target(point_at(position, tangent, cov), direction, going(tangent, prior), design)


@given(st.floats(0.0, 5.0), st.floats(0.0, 360.0), st.floats(0.0, 50.0), st.floats(0.0, 6.2))
def test_a_hole_in_ground_that_bends_nothing_ends_straight_ahead(
    off_deg: float, towards_deg: float, raked_deg: float, azimuth: float
) -> None:
    """Where its line meets the plane across the design axis at its end."""
    design = ColumnDesign(inclination=raked_deg * DEG, azimuth=azimuth, length=25.0)
    turned = off_deg * DEG * np.array([math.cos(towards_deg * DEG), math.sin(towards_deg * DEG)])
    tangent = design.axis + turned @ design.across
    tangent /= np.linalg.norm(tangent)
    direction = Direction(tangent[:2], float(tangent[2]), np.zeros((2, 2)), np.zeros((2, 0)))
    start = 10.0 * design.axis + 0.3 * design.across[0]
    found = project_to_target(point_at(start.tolist(), tangent), direction, going(tangent, STRAIGHT_ON), design)
    rest = 15.0 / float(tangent @ design.axis)
    expected = design.across @ (start + rest * tangent)
    assert found.ends.offset == pytest.approx(expected, abs=1e-6)
    assert (found.ends.along, found.ends.md) == (pytest.approx(25.0), pytest.approx(10.0 + rest))
    assert found.ends.limit == pytest.approx(0.05 + 0.02 * 25.0)


def test_what_all_directions_share_errs_with_the_position() -> None:
    """3 mm of position and 2 mrad that all directions share, over 20 m: 43 mm on that axis."""
    found = foresee([0.0, 0.0, 10.0], direction_of(0.0, 0.0, 0.0, shared=2e-3), ColumnDesign(), cov=9e-6)
    own = found.foreseen.cov[0, 0] - 0.003**2
    assert math.sqrt(found.measured[1, 1]) == pytest.approx(0.043, rel=0.01)
    assert math.sqrt(found.foreseen.cov[1, 1]) == pytest.approx(0.043, rel=0.05)
    assert own < 0.01**2


def test_it_is_what_draws_of_the_process_do_in_space() -> None:
    """A raked hole in crooked ground: half of the ends, and 95 %, lie where it says, by holes drilled on."""
    design = ColumnDesign(inclination=30.0 * DEG, azimuth=80.0 * DEG, length=30.0)
    tangent = design.axis
    direction = Direction(tangent[:2], float(tangent[2]), np.zeros((2, 2)), np.zeros((2, 0)))
    tendency = going(tangent, CROOKED)
    found = project_to_target(point_at((12.0 * tangent).tolist(), tangent), direction, tendency, design)
    random, count, step = np.random.default_rng(6), 4000, 0.1
    mean, (a, b, c) = tendency.means[0], tendency.blocks[0]
    cov = np.block([[a, b], [b.T, c]])
    angle, bend = np.split(random.multivariate_normal(mean, cov, count), 2, axis=1)
    keeps = math.exp(-step / 15.0)
    comes = np.where(
        random.uniform(size=count) < 1.0 - math.exp(-18.0 / 60.0), 18.0 * random.uniform(size=count), np.inf
    )
    jump, offset = 0.2 * DEG * random.normal(size=(count, 2)), np.zeros((count, 2))
    for k in range(180):
        total = bend + np.where(((k + 0.5) * step > comes)[:, None], jump, 0.0)
        offset += step * (angle + 0.5 * step * total)
        angle = angle + step * total
        bend = keeps * bend + 0.1 * DEG * math.sqrt(1.0 - keeps**2) * random.normal(size=(count, 2))
    ends = offset @ tendency.axes @ design.across.T
    for chance in (0.5, 0.8, 0.95):
        share = np.mean(np.hypot(*(ends - found.ends.offset).T) <= found.foreseen.radius_of(chance, found.ends.offset))
        assert share == pytest.approx(chance, abs=0.025)
    assert found.within == pytest.approx(np.mean(np.hypot(*ends.T) <= found.limit), abs=0.02)
    for chance in (0.95, 0.5, 0.95):  # what was asked before is not the answer to another chance
        assert found.distance_of(chance) == pytest.approx(np.quantile(np.hypot(*ends.T), chance), rel=0.06)


def test_the_cone_opens_to_the_end_and_its_last_point_is_the_end() -> None:
    found = foresee([0.1, 0.0, 10.0], direction_of(0.5 * DEG, 1.0, 1e-4), ColumnDesign(), CROOKED, cov=1e-6)
    assert len(found.cone) == CONE_POINTS
    assert np.all(np.diff([point.radius for point in found.cone]) > 0.0)
    assert np.diff([point.mean.along for point in found.cone]) == pytest.approx(np.full(CONE_POINTS - 1, 2.5))
    last = found.cone[-1]
    assert last.mean.offset == pytest.approx(found.ends.offset)
    assert last.half_width == pytest.approx(found.half_width)
    assert last.mean.limit == found.limit


def test_nothing_is_ahead_of_a_hole_at_its_depth() -> None:
    found = foresee([0.1, 0.0, 31.0], direction_of(0.1, 0.0, 1e-3), ColumnDesign(), cov=1e-6)
    assert found.is_reached
    assert found.cone == []
    assert found.ends.offset == pytest.approx([0.1, 0.0])
    assert found.ends.along == pytest.approx(31.0)
    assert found.half_width == pytest.approx(1.96e-3, rel=1e-3)
    nearly = foresee([0.1, 0.0, 29.95], direction_of(0.1, 0.0, 1e-3), ColumnDesign(), cov=1e-6)
    assert nearly.is_reached
    assert nearly.ends.along == pytest.approx(30.0)


def test_a_hole_that_lies_across_its_design_does_not_come_to_its_end() -> None:
    found = foresee([0.1, 0.0, 10.0], direction_of(89.0 * DEG, 0.0, 1e-3), ColumnDesign(), cov=1e-6)
    assert not found.comes_there
    assert (found.within, found.chance_within(100.0), found.distance_of(0.95)) == (0.0, 0.0, math.inf)


@given(st.integers(0, 10_000))
def test_a_root_is_one(seed: int) -> None:
    roots = np.random.default_rng(seed).normal(size=(3, 2, 2))
    covs = roots @ roots.transpose(0, 2, 1)
    found = root_of(covs)
    assert found @ found == pytest.approx(covs, abs=1e-9)
    assert root_of(np.zeros((2, 2))).tolist() == [[0.0, 0.0], [0.0, 0.0]]
