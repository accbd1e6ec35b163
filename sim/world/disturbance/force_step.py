"""The bias of the accelerometer of one tube steps at a time, and creeps from then on."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from pydantic import Field

from sim.kernel import shared_body
from sim.world.disturbance.one_tube import NEVER, OneTubeSection, Three, is_later, starts_at
from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, OneImu
from sim.world.disturbance.vibration import G
from sim.world.scenario_file import ScenarioFile

MILLI_G: Final = 1e-3 * G  # m/s^2


class ForceStepSection(OneTubeSection):
    """By how much."""

    step_mg: Three = Field((0.0, 0.0, 0.0), description="of the axes x, y, z, at once")
    creep_mg_per_s: Three = Field((0.0, 0.0, 0.0), description="likewise, steadily from then on")


class ForceStep(NamedTuple):
    """Of one accelerometer."""

    step: Array  # (3,) m/s^2
    creep: Array  # (3,) m/s^3


def draw_step(imu: OneImu) -> ForceStep:
    """Step and creep of one tube; none of the others."""
    section = imu.section_of(FORCE_STEP)
    of_it = float(imu.tube == section.tube) * MILLI_G
    return ForceStep(of_it * np.array(section.step_mg), of_it * np.array(section.creep_mg_per_s))


def step_and_creep(samples: ImuSamples, imu: OneImu, drawn: ForceStep) -> None:
    """Add what has come by the end of a sample."""
    section = imu.section_of(FORCE_STEP)
    later = is_later(imu, section, samples.t)[:, None]
    if later.any():
        since = samples.t[:, None] - starts_at(imu.file, section)
        samples.force = samples.force + later * (drawn.step + since * drawn.creep)


def set_step_time(shared: Any, file: ScenarioFile) -> None:
    """When it steps."""
    at = starts_at(file, FORCE_STEP.section_of(file))
    shared["steps_at"] = at if FORCE_STEP.name in file.disturbance else NEVER


def set_step(tube: Any, drawn: ForceStep) -> None:
    """How far."""
    tube["force_step"], tube["force_creep"] = drawn.step, drawn.creep


@shared_body
def read_step(shared: Any, tube: Any, now: Any, _drawn: Array, _at: int, row: Array) -> None:
    """Add what has come by the end of the cycle."""
    if now.end > shared.steps_at:
        for i in range(3):
            row[3 + i] += tube.force_step[i] + (now.end - shared.steps_at) * tube.force_creep[i]


FORCE_STEP = Disturbance(
    "force-step",
    (),
    ActsOn.SAMPLES,
    step_and_creep,
    draw_step,
    Compiled(
        shared=(("steps_at", "f8"),),  # s, rig time
        tube=(("force_step", "f8", (3,)), ("force_creep", "f8", (3,))),  # m/s^2, m/s^3
        set_shared=set_step_time,
        set_tube=set_step,
        read=read_step,
    ),
    section=ForceStepSection,
)
