"""What became of an IMU since its calibration."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sim.world.disturbance.row import ActsOn, Array, Disturbance, ImuSamples, OneImu
from sim.world.random_streams import RandomStream
from sim.world.scenario_file import DriftSection


@dataclass(frozen=True, slots=True)
class Drift:
    """Change of one IMU since its calibration: reading = matrix @ force + bias, and a rate at rest."""

    matrix: Array  # (3, 3), row = sensor axis
    bias: Array  # (3,) m/s^2
    rate: Array  # (3,) rad/s

    @classmethod
    def draw(cls, section: DriftSection, random: np.random.Generator) -> Drift:
        """Drift of one tube; small angles."""
        matrix = math.radians(section.accelerometer_misalignment_std_deg) * random.standard_normal((3, 3))
        np.fill_diagonal(matrix, 1.0 + section.accelerometer_scale_std * random.standard_normal(3))
        bias = section.accelerometer_bias_std_mps2 * random.standard_normal(3)
        return cls(matrix, bias, math.radians(section.gyroscope_bias_std_dps) * random.standard_normal(3))


def draw_drift(imu: OneImu) -> Drift | None:
    """Drift of one IMU, where the scenario has the table."""
    return None if imu.file.drift is None else Drift.draw(imu.file.drift, imu.random(RandomStream.DRIFT))


def drift_away(samples: ImuSamples, _: OneImu, drift: Drift | None) -> None:
    """Rates and forces as the sensor shows them now."""
    if drift is not None:
        samples.rate = samples.rate + drift.rate
        samples.force = samples.force @ drift.matrix.T + drift.bias


DRIFT = Disturbance("drift", ("drift",), ActsOn.SAMPLES, drift_away, draw_drift)
