"""Two tubes are exchanged in the tally, so that each is corrected by the calibration of the other's serial number.

A calibration takes away the raw bias of an accelerometer. With the other's it takes away that one's, so either tube
is left with the difference of the two, of opposite signs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import Field

from sim.kernel import shared_body
from sim.world.disturbance.force_step import MILLI_G
from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, OneImu
from sim.world.random_streams import RandomStream, random_stream
from sim.world.section import NotNegative, ScenarioSection


class CalibrationExchangedSection(ScenarioSection):
    """Which tubes, and what a calibration takes away of each."""

    tubes: tuple[int, int] = Field((1, 2), description="that have each other's")
    raw_mg: NotNegative = Field(0.0, le=500.0, description="bias before calibration, each axis of each tube, 1 sigma")


def draw_left(imu: OneImu) -> Array:
    """Bias (3,) m/s^2 that is left of a tube: its own raw one less that of the other."""
    section = imu.section_of(CALIBRATION_EXCHANGED)
    if imu.tube not in section.tubes or not section.raw_mg:
        return np.zeros(3)
    one, other = section.tubes if imu.tube == section.tubes[0] else section.tubes[::-1]
    raw = [random_stream(imu.seed, RandomStream.EXCHANGED, tube).standard_normal(3) for tube in (one, other)]
    return np.asarray(section.raw_mg * MILLI_G * (raw[0] - raw[1]))


def leave_bias(samples: ImuSamples, _: OneImu, left: Array) -> None:
    """Add what is left."""
    if left.any():
        samples.force = samples.force + left


def set_left(tube: Any, left: Array) -> None:
    """What is left of a tube."""
    tube["left_bias"] = left


@shared_body
def read_left(_shared: Any, tube: Any, _now: Any, _drawn: Array, _at: int, row: Array) -> None:
    """Add what is left."""
    for i in range(3):
        row[3 + i] += tube.left_bias[i]


CALIBRATION_EXCHANGED = Disturbance(
    "calibration-exchanged",
    (),
    ActsOn.SAMPLES,
    leave_bias,
    draw_left,
    Compiled(tube=(("left_bias", "f8", (3,)),), set_tube=set_left, read=read_left),  # m/s^2
    section=CalibrationExchangedSection,
)
