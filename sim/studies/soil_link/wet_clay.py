"""Wellbore 1 by radio through wet clay: when its surveys came to the surface, beside when they were to."""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from node.process.encoder_process import EncoderProcess
from node.process.tube_process import TubeProcess
from sim.errors import RigError
from sim.rig.in_process import Build, InProcessStepper
from sim.rig.launcher import private_folder
from sim.rig.plain_base import PlainBase
from sim.rig.scheduler import Scheduler
from sim.studies.soil_link.delivery_time import STEP, LossyJoint, message_delay
from sim.world.parsing import read_toml
from sim.world.scenario import scenario_of
from sim.world.shipped import shipped_folder
from sim.world.world import World
from telemetry.messages import BASE, ENCODER, SurveyMeasurement

Array = npt.NDArray[np.float64]
SCENARIO = "wellbore-1-wet-clay"
SEED = 1


def wet_clay(tubes: int) -> World:
    """The world of the scenario, drilled to a number of tubes."""
    folder = shipped_folder()
    tables: dict[str, Any] = read_toml(folder / f"{SCENARIO}.toml")
    tables["rig"]["tubes"] = tubes
    tables["path"]["displacements"] = str((folder / tables["path"]["displacements"]).absolute())
    return World(scenario_of(tables), SEED)


def surveys_of(world: World) -> list[tuple[SurveyMeasurement, float]]:
    """Every survey that came to the surface, with the time (s) that it took from the end of its average."""
    with tempfile.TemporaryDirectory() as place:
        base = drill_wet_clay(world, Path(place))
    found = []
    for message, at in base.arrived.values():
        if isinstance(message, SurveyMeasurement):
            found.append((message, world.true_time(BASE, at) - message.station_at))
    return found


def drill_wet_clay(world: World, folder: Path) -> PlainBase:
    """Run the string in this process to its end; returns its surface end."""
    base = PlainBase()
    builders: dict[int, Build] = {BASE: lambda: base}
    builders[ENCODER] = partial(EncoderProcess, private_folder(folder, "encoder"), reach=world.reach)
    for tube in range(1, world.scenario.tubes + 1):
        settings = world.tube_settings(tube)
        builders[tube] = partial(TubeProcess, settings, private_folder(folder, f"tube-{tube}"))
    stepper = InProcessStepper(builders)
    Scheduler(world, stepper, stepper.follow).run()
    return base


def expected_delivery(world: World, surveys: list[tuple[SurveyMeasurement, float]]) -> Array:
    """Distribution of the delivery time over all surveys of the run, each over the joints that hung above its tube."""
    each = [message_delay([*joints_above(world, survey), cable_joint(world)]) for survey, _ in surveys]
    return np.asarray(np.mean(each, axis=0))


def joints_above(world: World, survey: SurveyMeasurement) -> list[LossyJoint]:
    """Joints that a survey passes on its way up, as they were when it was made.

    Raises
    ------
    RigError
        When the string has no radio.
    """
    if world.radio is None:
        raise RigError("delivery over a radio: expected a scenario with [radio], got one without")
    section, medium = world.radio.section, world.scenario.medium
    links = world.radio
    rate = 0.0 if section.burst_every_s is None else 1.0 / section.burst_every_s
    joints = []
    for joint in range(survey.tube, survey.tube + survey.hops):
        clear, burst = (links.error_rate(margin) for margin in links.states(joint, survey.station_at))
        joints.append(
            LossyJoint(
                (clear, burst),
                section.attempts,
                section.attempt_ms * 1e-3,
                medium.latency,
                medium.jitter,
                rate,
                1.0 / section.burst_s,
            )
        )
    return joints


def cable_joint(world: World) -> LossyJoint:
    """The cable from the drive head to the base station."""
    medium = world.scenario.medium
    return LossyJoint((medium.loss, medium.loss), 1, 0.0, medium.latency, medium.jitter)


def largest_difference(times: Array, distribution: Array) -> float:
    """Largest difference between the share that has come (n times, s) and that expected (Kolmogorov-Smirnov)."""
    order = np.sort(times)
    share = np.cumsum(distribution)[np.minimum((order / STEP).round().astype(int), len(distribution) - 1)]
    steps = np.arange(len(order) + 1) / len(order)
    return float(max(np.abs(share - steps[1:]).max(), np.abs(share - steps[:-1]).max()))
