"""One hole surveyed station by station, and what the ground station's own rooms foresee of its end from each."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.path.curvature_tendency import learn_curvature
from groundstation.survey.path.mixture_score import score_forecast
from groundstation.survey.path.path_between import tendency_between
from groundstation.survey.wall.column_deviation import ColumnDesign, parse_tolerance
from groundstation.survey.wall.projected_end import project_to_target
from groundstation.survey.well.methods import Method
from groundstation.survey.well.trajectory import Trajectory
from groundstation.survey.well.trajectory_rows import TrajectoryPoint
from sim.studies.projection.drilled_holes import LENGTH, DrilledHole
from sim.world.random_streams import RandomStream, random_stream

Array = npt.NDArray[np.float64]
SPACING = 2.0  # m
STATIONS = 14  # the last one 2 m above the end
DIRECTION_STD = math.radians(0.02)  # of a surveyed direction, each way
COLLAR_STD = math.radians(0.1)  # of that at the collar, as it is stated
LIMITS = (0.05, 0.15, 0.3, 0.65, 1.0)  # m, for which a chance is asked
BACK = 2  # legs, of a guess by the curvature of now
DEADLINE = 0.95  # chance by which a deadline is worked out


@dataclass(frozen=True, slots=True)
class Foreseen:
    """What was foreseen of one hole from each station (s,), and what came; m."""

    inside: Array  # of the cone of 95 %
    radius: Array  # of it
    off: Array  # (s, 2), from the mean
    score: Array  # continuous ranked probability score, mean of the axes
    straight: Array  # the same of going straight on
    constant: Array  # and of the curvature of now
    reached: Array  # whether the end is nearer to the axis than the distance by which a deadline is worked out
    chances: Array  # (s, limits), of ending within
    within: Array  # (limits,), whether it did


def foresee_ends(hole: DrilledHole, seed: int, number: int) -> Foreseen:
    """Survey a hole and foresee its end from every station."""
    design = _design(hole.inclination, hole.azimuth)
    measured = survey_hole(hole, seed, number)
    axis = design.axis
    collar = Direction(axis[:2].copy(), float(axis[2]), _lean_cov(axis, COLLAR_STD), np.zeros((2, 0)))
    trajectory = Trajectory(Method.MINIMUM_CURVATURE, collar)
    trajectory.extend([(SPACING * (k + 1), direction) for k, direction in enumerate(measured)])
    end = design.across @ hole.end(design.axis)
    found = [_from_station(trajectory, k, measured[k - 1], design, end) for k in range(1, STATIONS + 1)]
    inside, radius, off, score, straight, constant, reached, chances = map(np.array, zip(*found, strict=True))
    within = np.hypot(*end) <= np.array(LIMITS)
    return Foreseen(inside, radius, off, score, straight, constant, reached, chances, within)


def survey_hole(hole: DrilledHole, seed: int, number: int) -> list[Direction]:
    """Directions at the stations as they are measured."""
    random = random_stream(seed, RandomStream.PATHS, number, 1)
    found = []
    for md in SPACING * np.arange(1, STATIONS + 1):
        tangent = np.array([np.interp(md, hole.md, column) for column in hole.tangents.T])
        read = tangent + DIRECTION_STD * random.normal(size=3)
        read /= np.linalg.norm(read)
        found.append(Direction(read[:2], float(read[2]), _lean_cov(read, DIRECTION_STD), np.zeros((2, 0))))
    return found


def _from_station(
    trajectory: Trajectory, k: int, direction: Direction, design: ColumnDesign, end: Array
) -> tuple[object, ...]:
    """What is foreseen from one station, beside the two simple guesses."""
    md, tangents = trajectory.md[: k + 1], trajectory.tangents[: k + 1]
    tendency = learn_curvature(md, tangents, trajectory.tangent_covs[: k + 1])
    point = trajectory[k]
    path = tendency_between(tendency, np.diff(md)).sum()
    across = np.eye(3) - np.outer(point.tangent, point.tangent)
    known = TrajectoryPoint(point.md, point.tangent, point.position, point.cov + path * across, point.shared)
    foreseen = project_to_target(known, direction, tendency, design)
    mean = foreseen.ends.offset
    radius = foreseen.foreseen.radius_of(0.95, mean)
    is_reached = foreseen.chance_within(float(np.hypot(*end))) <= DEADLINE  # one chance; the distance of one takes 17
    chances = [foreseen.chance_within(limit) for limit in LIMITS]
    straight, constant = simple_guesses(tangents, md, point, design)
    return (
        bool(np.hypot(*(end - mean)) <= radius), radius, end - mean, score_forecast(foreseen.foreseen, end),
        np.abs(end - straight).mean(), np.abs(end - constant).mean(),
        is_reached, chances,
    )  # fmt: skip


def simple_guesses(tangents: Array, md: Array, point: TrajectoryPoint, design: ColumnDesign) -> tuple[Array, Array]:
    """Ends (2,) of going straight on, and of bending on as over the last legs."""
    back = min(BACK, len(md) - 1)
    rest = (design.length - point.position @ design.axis) / (point.tangent @ design.axis)
    straight = design.across @ (point.position + rest * point.tangent)
    bend = (tangents[-1] - tangents[-1 - back]) / (md[-1] - md[-1 - back])
    return straight, straight + design.across @ (0.5 * rest**2 * bend)


def _lean_cov(tangent: Array, std: float) -> Array:
    return std**2 * (np.eye(2) - np.outer(tangent[:2], tangent[:2]))


def _design(inclination: float, azimuth: float) -> ColumnDesign:
    return ColumnDesign(
        "hole", inclination=inclination, azimuth=azimuth, length=LENGTH, tolerance=parse_tolerance("en-12716")
    )
