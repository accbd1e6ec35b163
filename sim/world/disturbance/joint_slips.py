"""A joint slips a little after every stop, as the head is turned back to be let go: the string does not follow."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from pydantic import Field

from sim.world.disturbance.row import ActsOn, Disturbance, OneImu, TubeMotion
from sim.world.section import NotNegative, ScenarioSection

WITHIN: Final = 0.5  # s, that a slip takes


class JointSlipsSection(ScenarioSection):
    """By how much, and when."""

    slip_deg: float = Field(0.0, ge=-30.0, le=30.0, description="by which the string stays turned further at each stop")
    after_s: NotNegative = Field(3.0, description="after the stop")


def slip_at_stops(motion: TubeMotion, imu: OneImu, _: None) -> None:
    """Turn the string by all slips so far."""
    section = imu.section_of(JOINT_SLIPS)
    if section.slip_deg != 0.0:
        slips = [np.clip((motion.t - stop - section.after_s) / WITHIN, 0.0, 1.0) for stop in motion.stops()]
        motion.angle = motion.angle + math.radians(section.slip_deg) * np.sum(slips, axis=0)


JOINT_SLIPS = Disturbance("joint-slips", (), ActsOn.MOTION, slip_at_stops, section=JointSlipsSection)
