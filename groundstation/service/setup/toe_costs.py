"""What each item of a setup costs at the toe: the part of its standard deviation, to first order. No I/O.

A yaw that is wrong turns what was surveyed by it about the vertical, a tilt moves the toe by the length that was
surveyed with it, and what many tubes err by independently is averaged over them. An adjustment of the whole hole gives
the same budget exactly, with what the tubes say about each other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from groundstation.service.setup.setup_priors import SetupPrior, SetupPriors
from groundstation.service.setup.told_value import SetupKind
from groundstation.survey.fusion.resolve import known_direction
from groundstation.survey.wall.column_deviation import ColumnDesign
from groundstation.survey.well.trajectory import Trajectory

GRAVITY = 9.81  # m/s^2, by which a bias is a tilt
TURN_MOST = math.sqrt(2.0)  # of its closure, by which an azimuth that may be any moves the toe, root mean square


@dataclass(frozen=True, slots=True)
class ToeCourse:
    """What a hole is like, as far as costs go; m.

    ``closure`` is horizontal, from the collar to the toe; ``legs`` are those between stations.
    """

    length: float
    closure: float
    first_leg: float
    longest_leg: float
    legs: int
    tubes: int


def toe_costs(priors: SetupPriors, trajectory: Trajectory) -> Mapping[str, float]:
    """Standard deviation (m) at the toe by each item, by name.

    Parameters
    ----------
    priors : of the setup
    trajectory : surveyed, or of the design before the first survey
    """
    tubes = sorted({int(one.subject) for one in priors.by_name.values() if one.kind is SetupKind.MOUNT}, reverse=True)
    course = course_of(trajectory, max(len(tubes), 1))
    return {name: _cost_of(prior, course, tubes, trajectory) for name, prior in priors.by_name.items()}


def course_of(trajectory: Trajectory, tubes: int) -> ToeCourse:
    """Shape of a hole that so many tubes survey."""
    mds, toe = trajectory.md, trajectory.positions[-1]
    legs = [float(lower - upper) for upper, lower in pairwise(mds)] or [0.0]
    return ToeCourse(
        float(mds[-1] - mds[0]), math.hypot(toe[0], toe[1]), legs[0], max(legs), max(len(mds) - 1, 1), tubes
    )


def designed_course(design: ColumnDesign, leg: float) -> Trajectory:
    """The hole as it is designed, surveyed every ``leg`` (m), for a rig that has not surveyed yet."""
    direction = known_direction(design.inclination, design.azimuth)
    drawn = Trajectory(collar=direction, keeps_columns=False)
    legs = max(round(design.length / leg), 1)
    drawn.put([(design.length * place / legs, direction) for place in range(1, legs + 1)])
    return drawn


def _cost_of(prior: SetupPrior, course: ToeCourse, tubes: list[int], trajectory: Trajectory) -> float:
    """Standard deviation at the toe (m) by one item; zero of what moves no direction: gravity, an aided gyroscope."""
    if prior.kind is SetupKind.JOINT:
        return _turned(prior.sigma, _closure_below(prior.subject, tubes, course, trajectory))
    cost = COSTS.get(prior.kind)
    return 0.0 if cost is None else cost(prior.sigma, course)


def _cost_of_collar(sigma: float, course: ToeCourse) -> float:
    """The collar enters the first leg alone where stations are surveyed below it."""
    return sigma * (course.first_leg / 2.0 if course.legs > 1 else course.length)


def _turned(sigma: float, closure: float) -> float:
    """How far the toe moves where azimuths turn by a standard deviation (rad): the chord of the arc."""
    return closure * min(sigma, TURN_MOST)


def _closure_below(subject: str, tubes: list[int], course: ToeCourse, trajectory: Trajectory) -> float:
    """Horizontal length that only tubes below a joint have surveyed."""
    upper, lower = subject.split("-")
    if int(lower) not in tubes:
        return 0.0
    if upper == "drive":
        return course.closure if int(lower) == tubes[0] else course.closure / course.legs
    below = len(tubes) - tubes.index(int(lower))
    depth = trajectory.md[-1] - below / len(tubes) * course.length
    place = min(int(trajectory.md.searchsorted(depth)), len(trajectory.md) - 1)
    north, east = (trajectory.positions[-1] - trajectory.positions[place])[:2]
    return math.hypot(north, east)


COSTS: Final[dict[SetupKind, Callable[[float, ToeCourse], float]]] = {
    SetupKind.NORTH: lambda sigma, course: _turned(sigma, course.closure),
    SetupKind.COLLAR: _cost_of_collar,
    SetupKind.MOUNT: lambda sigma, course: sigma * course.length / course.tubes,
    SetupKind.MOUNT_TURN: lambda sigma, course: _turned(sigma, course.closure) / course.tubes,
    SetupKind.ACCELEROMETER: lambda sigma, course: sigma / GRAVITY * course.length / course.tubes,
    SetupKind.LENGTH: lambda sigma, _course: sigma,
    SetupKind.STICK_UP: lambda sigma, _course: sigma,
    SetupKind.DEPTH_SCALE: lambda sigma, course: sigma * course.length,
    SetupKind.PLAY: lambda sigma, course: sigma * course.length / math.sqrt(course.legs * course.tubes),
    SetupKind.PATH: lambda sigma, course: sigma * course.longest_leg**2 / 8.0 * math.sqrt(course.legs),
}
