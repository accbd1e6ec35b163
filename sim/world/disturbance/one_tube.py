"""What befalls one tube of a string at a time: the keys of it, and since when."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from sim.world.disturbance.row import Array, Mask, OneImu
from sim.world.scenario_file import ScenarioFile
from sim.world.section import NotNegative, ScenarioSection

Signed = Annotated[float, Field(ge=-1e4, le=1e4)]
Three = tuple[Signed, Signed, Signed]
NEVER = math.inf  # s


class OneTubeSection(ScenarioSection):
    """Whom it befalls, and when."""

    tube: int = Field(1, ge=1, description="1 is the lowest")
    after_s: NotNegative = Field(0.0, description="after the start; it lasts from then on")


def starts_at(file: ScenarioFile, section: OneTubeSection) -> float:
    """Rig time (s) from which on it lasts."""
    return file.schedule.begin_s + section.after_s


def is_later(imu: OneImu, section: OneTubeSection, t: Array) -> Mask:
    """Which of the rig times (n,) s of the samples of an IMU it befalls."""
    return (t > starts_at(imu.file, section)) & (imu.tube == section.tube)
