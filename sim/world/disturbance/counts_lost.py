"""A counter that is too slow: of every edge above a rate it loses a share."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from sim.world.disturbance.row import ActsOn, Disturbance, OneImu, TubeMotion
from sim.world.section import NotNegative, Probability, ScenarioSection


class CountsLostSection(ScenarioSection):
    """How many, and from which rate on."""

    above_dps: NotNegative = Field(0.0, description="of the disc, either way")
    share: Probability = Field(0.0, description="of the edges above it")


def lose_counts(motion: TubeMotion, imu: OneImu, _: None) -> None:
    """Have the disc show less than it turns."""
    section = imu.section_of(COUNTS_LOST)
    if section.share > 0.0:
        steps = np.diff(motion.angle)
        fastest = math.radians(section.above_dps) * np.diff(motion.t)
        lost = np.where(np.abs(steps) > fastest, section.share * steps, 0.0)
        motion.angle = motion.angle - np.concatenate([[0.0], np.cumsum(lost)])


COUNTS_LOST = Disturbance("counts-lost", (), ActsOn.DISC, lose_counts, section=CountsLostSection)
