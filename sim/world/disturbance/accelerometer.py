"""What an accelerometer reads beside the force: a constant bias, noise, and the shaking of the bit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from node.kernels.arithmetic.formats import PERIOD
from sim.kernel import shared_body
from sim.world.disturbance.lanes import Lane
from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, OneImu
from sim.world.random_streams import RandomStream
from sim.world.scenario_file import ScenarioFile


def tilt_force(file: ScenarioFile) -> float:
    """Force (m/s^2) that a tilt by 1 deg moves from one axis to another."""
    return math.radians(1.0) * file.accelerometer.gravity_mps2


def draw_bias(imu: OneImu) -> Array:
    """Bias of one accelerometer (3,), m/s^2."""
    scale = imu.file.accelerometer.bias_std_deg * tilt_force(imu.file)
    return np.asarray(scale * imu.random(RandomStream.ACCELEROMETER).standard_normal(3))


def offset_forces(samples: ImuSamples, _: OneImu, bias: Array) -> None:
    """Add the bias."""
    samples.force = samples.force + bias


def set_bias(tube: Any, bias: Array) -> None:
    """Bias of a tube."""
    tube["force_bias"] = bias


@shared_body
def read_bias(_shared: Any, tube: Any, _now: Any, _drawn: Array, _at: int, row: Array) -> None:
    """Add the bias."""
    for i in range(3):
        row[3 + i] += tube.force_bias[i]


def add_noise(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Add the noise, which is stated for the mean of a cycle and larger over less; and the shaking, in a plain world.

    A rough world has vibration of its own in place of that.
    """
    a, random = imu.file.accelerometer, imu.random(RandomStream.ACCELEROMETER)
    noise_deg = imu.noise * a.noise_deg
    if samples.period != PERIOD:
        noise_deg *= math.sqrt(PERIOD / samples.period)
    samples.force = samples.force + noise_deg * tilt_force(imu.file) * random.standard_normal(samples.force.shape)
    if imu.file.rough is None:
        shaking = a.vibration_mps2 * samples.turning[:, None] * random.standard_normal(samples.force.shape)
        samples.force = samples.force + shaking


def set_noise(shared: Any, file: ScenarioFile) -> None:
    """Noise of the mean of a cycle, or of a frame, and shaking."""
    shared["force"] = file.accelerometer.noise_deg * tilt_force(file)
    shared["shaking"] = file.accelerometer.vibration_mps2
    if file.rough is not None:
        shared["force"] *= math.sqrt(PERIOD * file.rough.sensor.frames_hz)
        shared["shaking"] = 0.0


@shared_body
def read_noise(shared: Any, _tube: Any, now: Any, drawn: Array, at: int, row: Array) -> None:
    """Noise and shaking of a mean, as one."""
    size = now.share * math.sqrt(shared.force**2 + (shared.shaking * now.shaken) ** 2)
    for i in range(3):
        row[3 + i] += size * drawn[at + i]


FORCE_BIAS = Disturbance(
    "force-bias",
    ("accelerometer.bias_std_deg",),
    ActsOn.SAMPLES,
    offset_forces,
    draw_bias,
    Compiled(tube=(("force_bias", "f8", (3,)),), set_tube=set_bias, read=read_bias),  # m/s^2
)
FORCE_NOISE = Disturbance(
    "force-noise",
    ("accelerometer.noise_deg", "accelerometer.vibration_mps2"),
    ActsOn.SAMPLES,
    add_noise,
    compiled=Compiled(
        shared=(("force", "f8"), ("shaking", "f8")),  # m/s^2
        set_shared=set_noise,
        lane=Lane.FORCE,
        read=read_noise,
    ),
)
