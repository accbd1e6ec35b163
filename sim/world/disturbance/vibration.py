"""Vibration of a tube in the field: about its axis, of the forces, and what a gyroscope makes of that.

A campaign draws it at the frames of a sensor (``sim.world.disturbance.frame_vibration``), in whose sums it stands.
"""

from __future__ import annotations

import math

import numpy as np

from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, OneImu, TubeMotion
from sim.world.random_streams import RandomStream
from sim.world.scenario_file import ScenarioFile

G = 9.80665  # m/s^2, of a range and of a vibration
BAND = ("rough.vibration.lowest_hz", "rough.vibration.highest_hz")


def band_noise(random: np.random.Generator, count: int, rate: float, lowest: float, highest: float) -> Array:
    """Noise (count,) of rms 1 whose spectrum is flat from ``lowest`` to ``highest`` (Hz), at ``rate`` samples/s."""
    padded = 1 << (count - 1).bit_length()
    spectrum = np.fft.rfft(random.standard_normal(padded))
    hertz = np.fft.rfftfreq(padded, 1.0 / rate)
    inside = (hertz >= lowest) & (hertz <= highest)
    spectrum[~inside] = 0.0
    return np.asarray(np.fft.irfft(spectrum, padded)[:count] * math.sqrt((padded / 2.0) / max(inside.sum(), 1)))


def twist_to_and_fro(motion: TubeMotion, imu: OneImu, _: None) -> None:
    """Add the angle of the torsional vibration while the tube is driven."""
    section = imu.rough.vibration
    if section.torsional_dps == 0.0:
        return
    step = float(motion.t[1] - motion.t[0])
    random = imu.random(RandomStream.ROUGH_VIBRATION, 0)
    rate = band_noise(random, len(motion.t), 1.0 / step, section.lowest_hz, section.highest_hz)
    angle = np.cumsum(rate) * step
    motion.angle = motion.angle + math.radians(section.torsional_dps) * motion.driven * (angle - angle.mean())


def shake_forces(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Add the vibration of the forces, and keep it for what a gyroscope makes of it."""
    section = imu.rough.vibration
    size = np.where(samples.turning > 0.0, section.turning_g, section.resting_g)
    if not np.any(size > 0.0):
        return
    hertz = 1.0 / float(samples.t[1] - samples.t[0])
    random = imu.random(RandomStream.ROUGH_VIBRATION, 1)
    noise = [band_noise(random, len(size), hertz, section.lowest_hz, section.highest_hz) for _ in range(3)]
    samples.shaken = size[:, None] * np.stack(noise, axis=1)
    samples.force = samples.force + G * samples.shaken


def rectify_vibration(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Add what vibration is seen as by each axis of a gyroscope, the square of its size."""
    if samples.shaken is not None:
        seen = math.radians(imu.rough.sensor.rectification_dps_per_g2) * np.sum(samples.shaken**2, axis=1)
        samples.rate = samples.rate + seen[:, None]


def shakes_at_rest(file: ScenarioFile) -> dict[str, bool]:
    """The sums over frames have vibration from the start of a turning to its end."""
    return {"rough.vibration.resting_g": file.rough is not None and file.rough.vibration.resting_g > 0.0}


TORSIONAL = Disturbance(
    "torsional-vibration",
    ("rough.vibration.torsional_dps", *BAND),
    ActsOn.MOTION,
    twist_to_and_fro,
    compiled=Compiled(),
)
VIBRATION = Disturbance(
    "vibration",
    ("rough.vibration.turning_g", "rough.vibration.resting_g", *BAND),
    ActsOn.GRID,
    shake_forces,
    compiled=Compiled(),
    beyond=shakes_at_rest,
)
RECTIFICATION = Disturbance("rectification", ("rough.sensor.rectification_dps_per_g2",), ActsOn.GRID, rectify_vibration)
