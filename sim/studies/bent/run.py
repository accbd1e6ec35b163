"""Positions in a bent hole: what the string does there, and what the ground station was told that it does.

Tubes pass the stations of a hole one after the other, with joints, mounts and accelerometers that err as in a rig's
scenario and the firmware of every node on the encoder's aiding. The surveys go through the ground station's own
mathematics: resolve, shared errors, recursive Bayes, transport, trajectory. The truth is the hole. How
far its own directions at the stations lead from it, for no survey sees what lies between, is a column by itself: toes
are judged against those.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.fusion import StationFusion
from groundstation.survey.fusion.resolve import (
    Direction,
    angle_stds,
    direction_angles,
    known_direction,
    resolve_direction,
)
from groundstation.survey.fusion.shared import SharedErrors
from groundstation.survey.fusion.transport import carry_directions
from groundstation.survey.well.ellipsoid import coverage_radius
from groundstation.survey.well.methods import Method
from groundstation.survey.well.trajectory import Trajectory
from groundstation.survey.well.trajectory_rows import TrajectoryPoint
from node.kernels.arithmetic.angles import wrap_angle
from sim.string.direct_string import DirectString
from sim.string.result import StringSurvey
from sim.studies.pool import Step, over_cores, seed_jobs
from sim.studies.scenarios import CALIBRATED, Tables, change_sections
from sim.world.scenario import scenario_of
from sim.world.world import World

Array = npt.NDArray[np.float64]
TUBES = 8
LENGTH = 2.0  # m, of a tube
CONFIDENCE = 0.95
BASE: Tables = {
    "rig": {"tubes": TUBES, "tubes_at_start": 0, "tube_length_m": LENGTH},
    "schedule": {"add_s": 60.0, "stop_s": 40.0, "finish_s": 5.0},
    "rotation": {"turns": 7.3},
    "encoder": {"phase": "random"},
    "accelerometer": CALIBRATED,
    "medium": {"link": "off"},
}
HOLES = {
    "30 deg, through 20 deg of azimuth": {"inclination_deg": 30.0, "turn_deg": 20.0},
    "builds to 40 deg, turns by 60 deg": {"build_deg": 40.0, "turn_deg": 60.0},
    "straight, 30 deg": {"inclination_deg": 30.0},
}
KINDS = ("shortest", "parallel")


@dataclass(frozen=True, slots=True)
class BentRun:
    """One seed, by what the ground station was told: errors and what it states of them."""

    azimuth_error: dict[str, Array]  # (stations,) rad
    azimuth_std: dict[str, Array]
    toe_error: dict[str, float]  # m
    toe_distance: dict[str, float]  # in plan, in its own standard deviations
    between: float  # m, error of the toe that the true directions at the stations leave


def hole_cases() -> list[tuple[str, str, Tables]]:
    """Hole, string and scenario."""
    found = []
    for hole, spiral in HOLES.items():
        for string in KINDS:
            rough = {"samples_hz": 50.0, "string": {"transport": string}}
            found.append((hole, string, change_sections(BASE, path={"spiral": spiral}, rough=rough)))
    return found


def count_steps(seeds: int) -> int:
    """Runs of all seeds."""
    return seeds * len(hole_cases())


def run_study(seeds: int, step: Step) -> dict[str, Any]:
    """A row for each hole, string and setting; ``step`` is called after each run."""
    rows = []
    with over_cores(seeds, step) as run_all:
        for hole, string, tables in hole_cases():
            runs = run_all(run_seed, seed_jobs(tables, seeds))
            rows += [hole_row(hole, string, told, runs) for told in KINDS]
    return {"experiment": "bent-holes", "seeds": seeds, "cases": rows}


def run_seed(job: tuple[Tables, int]) -> BentRun:
    """One seed of one string, for a pool of processes."""
    tables, seed = job
    world = World(scenario_of(dict(tables)), seed)
    return trajectory_errors(world, DirectString(world).drill().surveys)


def trajectory_errors(world: World, surveys: Sequence[StringSurvey]) -> BentRun:
    """Errors of a ground station's trajectory of all surveys, by what it was told of the string."""
    hole = world.scenario.hole
    shared = SharedErrors()
    stations = fused_stations(world, surveys, shared)
    true = [hole.direction(md) for md in stations]
    collar = known_direction(*hole.direction(0.0))
    exact = Trajectory(Method.BALANCED_TANGENTIAL, collar)
    exact.extend([(md, known_direction(*one)) for md, one in zip(stations, true, strict=True)])
    toe = exact.points[-1].position
    found = BentRun({}, {}, {}, {}, float(np.linalg.norm(toe - hole.position(exact.points[-1].md))))
    for told in KINDS:
        end, directions = locate_toe(collar, stations, shared, told)
        azimuths = [direction_angles(one.lean, one.down)[1] for one in directions]
        found.azimuth_error[told] = np.array([wrap_angle(a - b[1]) for a, b in zip(azimuths, true, strict=True)])
        found.azimuth_std[told] = np.array([angle_stds(d.lean, d.down, d.total_cov)[1] for d in directions])
        error = end.position - toe
        found.toe_error[told] = float(np.linalg.norm(error))
        found.toe_distance[told] = math.sqrt(float(error[:2] @ np.linalg.solve(end.cov[:2, :2], error[:2])))
    return found


def fused_stations(world: World, surveys: Sequence[StringSurvey], shared: SharedErrors) -> dict[float, Direction]:
    """Direction of every station as its tubes measured it, by measured depth (m) from the collar down."""
    file = world.scenario.file
    mount_var = math.radians(file.joints.mount_std_deg) ** 2
    bias_std = math.radians(file.accelerometer.bias_std_deg) * file.accelerometer.gravity_mps2
    fusions: dict[float, StationFusion] = {}
    for survey in surveys:
        m = survey.measurement
        top = m.tube + m.hops - 1
        md = round(world.bit_depth(m.station_at) - (m.tube - 1) * LENGTH, 6)
        if md <= 0.0:
            continue
        resolved = resolve_direction(np.array(m.imus[0].force), np.array(m.imus[0].force_cov), m.yaw, m.yaw_var)
        above = range(m.tube + 1, top + 1)
        reading = shared.direction_of(resolved, m.tube, above, m.systematic_var, mount_var, bias_std)
        fusions.setdefault(md, StationFusion()).add_reading(reading)
    return {md: fusions[md].fused() for md in sorted(fusions)}


def locate_toe(
    collar: Direction, stations: dict[float, Direction], shared: SharedErrors, told: str
) -> tuple[TrajectoryPoint, list[Direction]]:
    """Last point and directions of the stations, by what the ground station was told of the string."""
    directions = list(stations.values())
    if told == "parallel":
        places = shared.transport_places(len(directions) + 1)
        directions = [carried.direction for carried in carry_directions(collar, directions, places)]
    trajectory = Trajectory(Method.BALANCED_TANGENTIAL, collar)
    trajectory.extend(list(zip(stations, directions, strict=True)))
    return trajectory.points[-1], directions


def hole_row(hole: str, string: str, told: str, runs: Sequence[BentRun]) -> dict[str, Any]:
    """Figures of one hole, string and setting."""
    errors, stds = (np.concatenate([getattr(r, name)[told] for r in runs]) for name in ("azimuth_error", "azimuth_std"))
    toes = np.array([r.toe_distance[told] for r in runs])
    inside = float(np.mean(toes <= coverage_radius(CONFIDENCE, 2)))
    return {
        "case": hole,
        "string": string,
        "told": told,
        "azimuth_rms_deg": math.degrees(math.sqrt(float(np.mean(errors**2)))),
        "azimuth_nees": float(np.mean(errors**2 / stds**2)),
        "toe_rms_cm": 100.0 * math.sqrt(float(np.mean([r.toe_error[told] ** 2 for r in runs]))),
        "toe_nees": float(np.mean(toes**2)) / 2.0,
        "inside_percent": 100.0 * inside,
        "between_cm": 100.0 * runs[0].between,
    }
