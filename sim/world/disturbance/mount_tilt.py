"""An IMU leans against the axis of its tube."""

from __future__ import annotations

import math

from sim.world.disturbance.row import ActsOn, Disturbance, ImuSamples, OneImu
from sim.world.random_streams import RandomStream
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


MOUNT_TILT = Disturbance("mount-tilt", ("joints.mount_tilt_std_deg",), ActsOn.FELT, lean_samples, draw_tilt)
