"""A gyroscope whose bias about z steps as the string turns first."""

from __future__ import annotations

import math

import numpy as np

from sim.world.disturbance.row import ActsOn, Array, Disturbance, ImuSamples, OneImu


def stepped_bias(imu: OneImu, ends: Array) -> Array:
    """Bias (n,) rad/s in the cycles that end at ``ends`` (n,), s."""
    return np.asarray(math.radians(imu.file.gyroscope.bias_step_dps) * (ends > imu.turns_from))


def step_bias(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Add the step; of a frame that is between two cycles, a part of it."""
    if imu.file.gyroscope.bias_step_dps == 0.0:
        return
    if samples.is_frame:
        bias = np.interp(samples.t, samples.ends, stepped_bias(imu, samples.ends))
    else:
        bias = stepped_bias(imu, samples.t)
    samples.rate = samples.rate + bias[:, None] * np.array([0.0, 0.0, 1.0])


BIAS_STEP = Disturbance("bias-step", ("gyroscope.bias_step_dps",), ActsOn.SAMPLES, step_bias)
