"""What a calibration has left of a gyroscope: constant bias, scale and misalignment."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from sim.kernel import shared_body
from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, OneImu
from sim.world.random_streams import RandomStream
from sim.world.scenario_file import ScenarioFile


@dataclass(frozen=True, slots=True)
class GyroscopeConstants:
    """Of one gyroscope: reading = matrix @ rate + bias."""

    bias: Array  # (3,) rad/s
    matrix: Array  # (3, 3)


def draw_gyroscope(imu: OneImu) -> GyroscopeConstants:
    """Constants of one gyroscope; small angles."""
    g, random = imu.file.gyroscope, imu.random(RandomStream.GYRO)
    bias = np.radians(np.array(g.constant_bias_dps) + g.constant_bias_std_dps * random.standard_normal(3))
    matrix = math.radians(g.misalignment_std_deg) * random.standard_normal((3, 3))
    np.fill_diagonal(matrix, 1.0 + g.scale_factor_std * random.standard_normal(3))
    return GyroscopeConstants(bias, matrix)


def distort_rates(samples: ImuSamples, _: OneImu, drawn: GyroscopeConstants) -> None:
    """Scale, misalign and offset the rates."""
    samples.rate = samples.rate @ drawn.matrix.T + drawn.bias


def gyroscope_gains(drawn: GyroscopeConstants, _: ScenarioFile) -> Array:
    """What the sensor shows, (6, 6)."""
    shown = np.eye(6)
    shown[:3, :3] = drawn.matrix
    return shown


def set_bias(tube: Any, drawn: GyroscopeConstants) -> None:
    """Bias of a tube."""
    tube["rate_bias"] = drawn.bias


@shared_body
def read_bias(_shared: Any, tube: Any, _now: Any, _drawn: Array, _at: int, row: Array) -> None:
    """Add the bias."""
    for i in range(3):
        row[i] += tube.rate_bias[i]


GYROSCOPE = Disturbance(
    "gyroscope",
    (
        "gyroscope.constant_bias_dps",
        "gyroscope.constant_bias_std_dps",
        "gyroscope.scale_factor_std",
        "gyroscope.misalignment_std_deg",
    ),
    ActsOn.SAMPLES,
    distort_rates,
    draw_gyroscope,
    Compiled(tube=(("rate_bias", "f8", (3,)),), set_tube=set_bias, gains=gyroscope_gains, read=read_bias),  # rad/s
)
