"""An IMU leans against the axis of its tube."""

from __future__ import annotations

import math

import numpy as np

from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, OneImu
from sim.world.random_streams import RandomStream
from sim.world.scenario_file import ScenarioFile
from sim.world.truth import imu_frame

Tilt = tuple[float, float]  # pitch and roll, rad


def draw_tilt(imu: OneImu) -> Tilt:
    """Lean of one IMU."""
    std = math.radians(imu.file.joints.mount_tilt_std_deg)
    pitch, roll = (std * imu.random(RandomStream.MOUNTS).standard_normal(2)).tolist()
    return pitch, roll


def lean_samples(samples: ImuSamples, _: OneImu, tilt: Tilt) -> None:
    """Turn rates and forces from the frame of the tube into that of the IMU."""
    frame = imu_frame(*tilt)
    samples.rate, samples.force = samples.rate @ frame.T, samples.force @ frame.T


def tilt_gains(tilt: Tilt, _: ScenarioFile) -> Array:
    """What the sensor shows, (6, 6)."""
    shown = np.zeros((6, 6))
    shown[:3, :3] = shown[3:, 3:] = imu_frame(*tilt)
    return shown


MOUNT_TILT = Disturbance(
    "mount-tilt",
    ("joints.mount_tilt_std_deg",),
    ActsOn.FELT,
    lean_samples,
    draw_tilt,
    Compiled(gains=tilt_gains),
)
