"""The encoder's counter stands for a while, though the head turns: a belt slips, a cable is loose.

What it did not count then stays missed.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field

from sim.world.disturbance.row import ActsOn, Disturbance, OneImu, TubeMotion
from sim.world.section import NotNegative, ScenarioSection


class CounterStandsSection(ScenarioSection):
    """When, and for how long."""

    after_s: NotNegative = Field(0.0, description="after the start")
    stands_s: NotNegative = Field(0.0, description="for which it stands")


def hold_counter(motion: TubeMotion, imu: OneImu, _: None) -> None:
    """Leave out what the disc turned by meanwhile."""
    section = imu.section_of(COUNTER_STANDS)
    if section.stands_s > 0.0:
        first = imu.file.schedule.begin_s + section.after_s
        span = np.clip(motion.t, first, first + section.stands_s)
        missed = np.interp(span, motion.t, motion.angle)
        motion.angle = motion.angle - (missed - missed[0])


COUNTER_STANDS = Disturbance("counter-stands", (), ActsOn.DISC, hold_counter, section=CounterStandsSection)
