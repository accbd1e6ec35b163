"""The string whirls in its hole while it is driven: its axis goes around on a cone, and its mass on a circle.

Model: in the tube's own frame the axis leans by a small angle that goes around at a steady rate. A tube that is carried
around on a cone without turning about its own axis feels 2 pi f (1 - cos a) about it, which no encoder shows (coning:
J. E. Bortz, IEEE Trans. AES 7 (1971) 61). The force is that of the circle.
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from sim.world.disturbance.row import ActsOn, Disturbance, ImuSamples, OneImu
from sim.world.disturbance.vibration import G
from sim.world.section import NotNegative, ScenarioSection


class WhirlSection(ScenarioSection):
    """How wide, and how fast."""

    lean_deg: NotNegative = Field(0.0, le=5.0, description="of the axis")
    force_g: NotNegative = Field(0.0, le=8.0, description="of the circle")
    hertz: float = Field(5.0, ge=-50.0, le=50.0, description="around, against the tube; below 0: backward")


def whirl_around(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Add what the sensors feel of the cone."""
    section = imu.section_of(WHIRL)
    if section.lean_deg == 0.0 and section.force_g == 0.0:
        return
    around, lean = math.tau * section.hertz, math.radians(section.lean_deg)
    c, s = np.cos(around * samples.t), np.sin(around * samples.t)
    felt = np.stack([-lean * around * c, -lean * around * s, np.full_like(c, around * (1.0 - math.cos(lean)))], axis=1)
    driven = (samples.turning > 0.0)[:, None]
    samples.rate = samples.rate + np.where(driven, felt, 0.0)
    circle = G * section.force_g * np.stack([c, s, np.zeros_like(c)], axis=1)
    samples.force = samples.force + np.where(driven, circle, 0.0)


WHIRL = Disturbance("whirl", (), ActsOn.GRID, whirl_around, section=WhirlSection)
