"""The laboratory string of thesis 4.2 as a scenario, and what is judged of it.

Still, 20 turns at 71 deg/s, still again, under an aiding that comes and goes, is late or is dated by its arrival.
Thesis 4.2 rests from 350 to 550 s; here that window opens with the stop, so what the last outage left in the yaw
counts. Joints and mounts are exact and the accelerometer has noise only, as the figures to reach have it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.resolve import direction_angles, resolve_direction
from node.kernels.arithmetic.angles import wrap_angle
from node.kernels.arithmetic.formats import PERIOD
from sim.string.direct_string import DirectString
from sim.string.result import StringRun, wrap_angles
from sim.studies.scenarios import Tables, complete_string
from sim.world.motion import Trapezoid
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import SurveyMeasurement

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
STOP, END, FINISH = 350.0, 550.0, 5.0  # s after the start. Source: thesis 4.2
RUN_IN = 20.0  # s, of turning before the yaw is judged as rotating, and of rest before it is judged as settled
TURNS, RATE_DPS, ACCELERATION_DPS2 = 20.0, 71.0, 35.0
TURN = Trapezoid(TURNS * math.tau, math.radians(RATE_DPS), math.radians(ACCELERATION_DPS2))
LAB: Tables = {
    "rig": complete_string(1),
    "path": {"straight": {"inclination_deg": 2.0}},
    "schedule": {"add_s": STOP - TURN.duration, "stop_s": END - STOP, "finish_s": FINISH, "blocks": 1},
    "rotation": {"turns": TURNS, "rate_dps": RATE_DPS, "acceleration_dps2": ACCELERATION_DPS2},
    "joints": {"reading_std_deg": 0.0, "mount_std_deg": 0.0},
    "accelerometer": {"bias_std_deg": 0.0},
    "medium": {"link": "off", "loss": 0.0},
}
CYCLES = math.floor((END + FINISH) / PERIOD + 1e-9)
ENDS: Array = PERIOD * np.arange(1.0, CYCLES + 1.0)  # s after the start
REST: Mask = (ENDS - PERIOD >= STOP) & (ENDS <= END)
SETTLED: Mask = (ENDS >= STOP + RUN_IN) & (ENDS <= END)
ROTATING: Mask = (STOP - TURN.duration + RUN_IN <= ENDS) & (STOP - TURN.ramp >= ENDS)
FIRST_PERIOD = 50.0  # s, of turning, after which a link of 20 s on and 30 s off was heard for all of its 20 s
ONCE_AIDED: Mask = ROTATING & (STOP - TURN.duration + FIRST_PERIOD <= ENDS)


@dataclass(frozen=True, slots=True)
class LabRun:
    """Results of one seed: yaw errors (cycles, hops) rad and the rest, hop by hop from the head down."""

    error: Array  # rad, at the end of every cycle
    var: Array  # rad^2, as the node states it
    total_var: Array  # rad^2, with its systematic part
    bias_error: Array  # rad/s, z gyroscope, estimate minus truth
    azimuth_error: Array  # (hops,) rad, mean force and mean yaw of the window of rest
    survey_error: Array  # (hops,) rad, of the node's own last survey; NaN if it made none


def run_seed(job: tuple[Tables, int]) -> LabRun:
    """One seed of one scenario, for a pool of processes."""
    tables, seed = job
    return run_seed_of_each(([tables], seed))[0]


def run_seed_of_each(job: tuple[Sequence[Tables], int]) -> list[LabRun]:
    """One seed of several scenarios; the world of those that differ in their aiding alone is worked out once."""
    setups, seed = job
    worlds: dict[str, World] = {}
    runs = []
    for tables in setups:
        scenario = scenario_of(dict(tables))
        unaided = scenario.file.model_dump_json(exclude={"aiding"})
        if unaided not in worlds:
            worlds[unaided] = World(scenario, seed)
        world = worlds[unaided].aided_like(scenario)
        runs.append(errors_by_hop(world, DirectString(world).drill()))
    return runs


def errors_by_hop(world: World, run: StringRun) -> LabRun:
    """Errors hop by hop: the top tube is the first."""
    tubes = range(world.scenario.tubes, 0, -1)
    bias = np.stack([run.gyro_bias[:, tube - 1] - world.sensors.gyro_bias(tube) for tube in tubes], axis=1)
    surveys = {survey.tube: survey.measurement for survey in run.surveys}
    return LabRun(
        run.error[:, ::-1],
        run.var[:, ::-1],
        run.total_var[:, ::-1],
        bias,
        np.array([_azimuth_of_rest(world, run, tube) for tube in tubes]),
        np.array([_azimuth_of_survey(surveys.get(tube)) for tube in tubes]),
    )


def _azimuth_of_rest(world: World, run: StringRun, tube: int) -> float:
    force = world.sensors.samples(tube)[REST, 3:6]
    yaw = run.yaw[REST, tube - 1]
    mean = float(yaw[0] + np.mean(wrap_angles(yaw - yaw[0])))
    return _azimuth(force.mean(axis=0), np.cov(force.T) / len(force), mean, float(run.var[REST, tube - 1].mean()))


def _azimuth_of_survey(survey: SurveyMeasurement | None) -> float:
    if survey is None:
        return math.nan
    mean = survey.imus[0]
    return _azimuth(np.array(mean.force), np.array(mean.force_cov), survey.yaw, survey.yaw_var)


def _azimuth(force: Array, cov: Array, yaw: float, yaw_var: float) -> float:
    """Azimuth of the tube in (-pi, pi]; the hole leans north, so it is the error."""
    direction = resolve_direction(force, cov, yaw, yaw_var).direction
    return wrap_angle(direction_angles(direction.lean, direction.down)[1])
