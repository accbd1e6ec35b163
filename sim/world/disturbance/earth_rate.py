"""The earth turns under a gyroscope."""

from __future__ import annotations

import math

import numpy as np

from sim.world.disturbance.row import ActsOn, Array, Disturbance, ImuSamples, OneImu

EARTH = 7.292115e-5  # rad/s. Source: WGS 84, NGA.STND.0036


def earth_rate(latitude_deg: float, attitude: Array) -> Array:
    """Rate (n, 3, rad/s) by which the earth turns a body of these attitudes, R_ned_from_body (n, 3, 3)."""
    latitude = math.radians(latitude_deg)
    return np.asarray(EARTH * np.array([math.cos(latitude), 0.0, -math.sin(latitude)]) @ attitude)


def feel_earth(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Add the rate of the earth in the frame of the tube."""
    if imu.file.rough is None or imu.file.rough.latitude_deg is None or samples.truth is None:
        return
    samples.rate = samples.rate + earth_rate(imu.file.rough.latitude_deg, samples.truth.attitude(samples.t))


EARTH_RATE = Disturbance("earth-rate", ("rough.latitude_deg",), ActsOn.FELT, feel_earth)
