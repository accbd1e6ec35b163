"""The string twists so slowly that no ramp shows it: it winds up while it is driven, and creeps under a resting head.

Model: while the head is driven a twist grows from zero, evenly, until it is wound; some time after the stop it is let
go, evenly. A string that creeps turns at a steady rate from the stop on; when the head takes it along again it is
turned back within the time in which it winds.
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from sim.world.disturbance.row import ActsOn, Array, Disturbance, OneImu, TubeMotion
from sim.world.section import NotNegative, Positive, ScenarioSection


class SlowTwistSection(ScenarioSection):
    """How far, and how slowly."""

    twist_deg: NotNegative = Field(0.0, le=90.0, description="by which the string lags the head once it is wound")
    wind_s: Positive = Field(30.0, description="of turning, until it is")
    hold_s: NotNegative = Field(5.0, description="after the stop, until it is let go")
    unwind_s: Positive = Field(20.0, description="that this takes")
    creep_dps: float = Field(0.0, ge=-1.0, le=1.0, description="of the string under a head at rest")


def twist_slowly(motion: TubeMotion, imu: OneImu, _: None) -> None:
    """Take what the string lags from its angle."""
    section = imu.section_of(SLOW_TWIST)
    if section.twist_deg == 0.0 and section.creep_dps == 0.0:
        return
    starts = motion.t[1:][np.diff(motion.driven) > 0.0]
    lag = np.zeros_like(motion.t)
    for start, stop in zip(starts.tolist(), motion.stops().tolist(), strict=True):
        lag += math.radians(section.twist_deg) * wound_share(section, motion.t - start, motion.t - stop, stop - start)
        later = starts[starts > stop]
        again = float(later[0]) if len(later) else math.inf
        crept = np.clip(motion.t, stop, again) - stop
        back = np.clip((motion.t - again) / section.wind_s, 0.0, 1.0) if len(later) else 0.0
        lag -= math.radians(section.creep_dps) * crept * (1.0 - back)
    motion.angle = motion.angle - lag


def wound_share(section: SlowTwistSection, since_start: Array, since_stop: Array, driven: float) -> Array:
    """Share of the twist (n,) that one turning of ``driven`` s leaves in the string."""
    grown = np.clip(np.minimum(since_start, driven) / section.wind_s, 0.0, 1.0)
    return np.asarray(grown * (1.0 - np.clip((since_stop - section.hold_s) / section.unwind_s, 0.0, 1.0)))


SLOW_TWIST = Disturbance("slow-twist", (), ActsOn.MOTION, twist_slowly, section=SlowTwistSection)
