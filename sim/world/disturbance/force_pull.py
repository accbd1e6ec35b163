"""Forces that a gyroscope takes for rates: of each axis on its own, or of each on each, drawn for every IMU."""

from __future__ import annotations

import math

import numpy as np

from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, OneImu
from sim.world.disturbance.vibration import G
from sim.world.random_streams import RandomStream
from sim.world.scenario_file import ScenarioFile


def draw_pull(imu: OneImu) -> Array:
    """What the forces do to the axes of one gyroscope (3, 3), rad/s by m/s^2; none in a plain world."""
    if imu.file.rough is None:
        return np.zeros((3, 3))
    drawn = imu.random(RandomStream.ROUGH_PULL).standard_normal((3, 3))
    return np.asarray(math.radians(imu.rough.sensor.g_sensitivity_dps_per_g) / G * drawn)


def pull_across(samples: ImuSamples, _: OneImu, pull: Array) -> None:
    """Add what the forces are seen as, vibration and all."""
    if pull.any():
        samples.rate = samples.rate + samples.force @ pull.T


def across_gains(pull: Array, _: ScenarioFile) -> Array:
    """What the sensor shows, (6, 6)."""
    shown = np.eye(6)
    shown[:3, 3:] = pull
    return shown


def own_pull(file: ScenarioFile) -> float:
    """What the force along an axis of a gyroscope does to it, rad/s by m/s^2."""
    return math.radians(file.gyroscope.g_sensitivity_dps_per_g) / file.accelerometer.gravity_mps2


def pull_along(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Add what the force along each axis is seen as."""
    samples.rate = samples.rate + own_pull(imu.file) * samples.felt_force


def along_gains(_: None, file: ScenarioFile) -> Array:
    """What the sensor shows, (6, 6)."""
    shown = np.eye(6)
    shown[:3, 3:] = own_pull(file) * np.eye(3)
    return shown


PULL_ACROSS = Disturbance(
    "pull-across",
    ("rough.sensor.g_sensitivity_dps_per_g",),
    ActsOn.GRID,
    pull_across,
    draw_pull,
    Compiled(gains=across_gains),
)
PULL_ALONG = Disturbance(
    "pull-along",
    ("gyroscope.g_sensitivity_dps_per_g",),
    ActsOn.SAMPLES,
    pull_along,
    compiled=Compiled(gains=along_gains),
)
