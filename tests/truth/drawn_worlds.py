"""Strings that drill holes of many kinds, as an adjustment is given them, with the truth beside."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from hole_world import Holes, Plan, TubeErrors, direction, draw_holes, draw_tubes, read_tubes
from scipy.linalg import block_diag

from groundstation.survey.adjustment.looks import Looks, PathPrior, StringPrior

Array = npt.NDArray[np.float64]
DEG = np.pi / 180.0
GRAVITY, GRAVITY_STD, LENGTH = 9.81, 2e-3, 20.0
MG = 1e-3 * 9.81


@dataclass(frozen=True)
class Case:
    """What is drawn of a world; degrees, metres, m/s^2.

    ``length`` is that over which the holes forget their curvature; the adjustment is told ``LENGTH``, whatever it is.
    ``left_out`` are looks that are missing, ``repeated`` stops that are made twice; ``untold`` tubes have a joint above
    them of which nothing is known.
    """

    seed: int = 0
    worlds: int = 1
    tubes: int = 3
    stations: int = 4
    make_ups: int = 1
    inclination: float = 30.0
    azimuth: float = 57.0
    yaw: float = 0.02
    tilt: float = 0.3
    bias: float = MG
    joint: float = 0.1
    play: float = 0.01
    noise: float = 2e-4
    legs: tuple[float, ...] = (2.0,)
    collar: float = 0.5
    curvature: float = 0.15
    freedom: float = math.inf
    length: float = LENGTH
    told: float = 0.0
    same_tool_face: bool = False
    left_out: frozenset[int] = frozenset()
    repeated: frozenset[int] = frozenset()
    untold: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Worlds:
    """Several worlds of one case."""

    string: StringPrior
    path: PathPrior
    plan: Plan
    holes: Holes
    tubes: TubeErrors
    forces: Array
    yaws: Array
    case: Case = field(repr=False)

    def looks(self, world: int) -> Looks:
        """Looks of one of them."""
        plan = self.plan
        return Looks(
            plan.station, plan.tube, plan.make_up, plan.stop, self.forces[world].copy(), plan.force_std**2,
            self.yaws[world].copy(), plan.yaw_std**2,
        )  # fmt: skip


def stops_of(case: Case) -> list[tuple[int, int, int]]:
    """Station, tube and stop of every look: tube by tube the string passes every station, the lowest first."""
    found = []
    for stop in range(case.stations):
        for time in range(2 if stop in case.repeated else 1):
            found += [(stop + 1 - tube, tube, 2 * stop + time) for tube in range(min(stop + 1, case.tubes))]
    kept = [look for place, look in enumerate(found) if place not in case.left_out]
    return kept or found[:1]


def sizes_of(case: Case) -> Array:
    """Standard deviations (w, 1), rad/m, of the curvatures of the holes of a case."""
    if math.isinf(case.freedom):
        return np.full((case.worlds, 1), case.curvature * DEG)
    drawn = np.random.default_rng([case.seed, 1]).chisquare(case.freedom, (case.worlds, 1))
    return np.asarray(case.curvature * DEG * np.sqrt((case.freedom - 2.0) / drawn))


def draw_worlds(case: Case) -> Worlds:
    """Draw worlds of a case."""
    rng = np.random.default_rng(case.seed)
    md = np.concatenate([[0.0], np.cumsum(np.resize(case.legs, case.stations))])
    collar = direction(case.inclination * DEG, case.azimuth * DEG)
    holes = draw_holes(rng, case.worlds, md, collar, case.collar * DEG, sizes_of(case), case.length)
    count = case.tubes
    joints = np.full(count, case.joint * DEG)
    joints[list(case.untold)] = np.pi / np.sqrt(3.0)
    above = np.tril(np.ones((count, count))) * joints  # tube 0 is the lowest; its chain is the longest
    made = np.full(case.make_ups, case.joint * DEG if case.make_ups > 1 else 1e-5)
    turn_cov = block_diag(above[::-1, ::-1] @ above[::-1, ::-1].T, np.diag(made**2))
    turn_cov += (1e-5) ** 2 * np.eye(len(turn_cov))
    told = case.told * DEG * rng.uniform(-1.0, 1.0, len(turn_cov))
    string = StringPrior(
        np.full(count, case.bias), np.full(count, case.tilt * DEG), told, turn_cov, GRAVITY, GRAVITY_STD,
        case.play * DEG,
    )  # fmt: skip
    tubes = draw_tubes(
        rng, case.worlds, string.bias_std, string.tilt_std, told, turn_cov, string.gravity, string.gravity_std
    )
    station, tube, stop = (np.array(part, np.intp) for part in zip(*stops_of(case), strict=True))
    looks = len(station)
    make_up = stop // 2 * case.make_ups // case.stations
    plan = Plan(
        station, tube, make_up, stop, np.full(looks, case.noise), np.full(looks, case.yaw * DEG), case.play * DEG
    )  # fmt: skip
    faces = rng.uniform(-np.pi, np.pi, (case.worlds, looks))
    if case.same_tool_face:
        faces = faces[:, :count][:, tube] if looks >= count else faces
    forces, yaws = read_tubes(rng, plan, holes, tubes, faces)
    across = np.eye(3) - np.outer(collar, collar)
    path = PathPrior(md, collar, across * (case.collar * DEG) ** 2, case.curvature * DEG, LENGTH)
    return Worlds(string, path, plan, holes, tubes, forces, yaws, case)
