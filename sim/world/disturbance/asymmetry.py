"""A gyroscope whose scale in one direction is not that in the other."""

from __future__ import annotations

import numpy as np

from sim.world.disturbance.row import ActsOn, Disturbance, ImuSamples, OneImu


def scale_by_sign(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Half of the difference upon the scale of either direction."""
    samples.rate = samples.rate + 0.5 * imu.rough.sensor.scale_asymmetry * np.abs(samples.rate)


ASYMMETRY = Disturbance("asymmetry", ("rough.sensor.scale_asymmetry",), ActsOn.GRID, scale_by_sign)
