"""A laboratory in software: sensors at rest, on a turn table and on a robot arm, with every parameter known.

Noise is drawn in the frequency domain from the spectrum of its sample means, on a circle at least twice as long as the
record, so that the ends do not know of each other. One seed gives one record, whatever else is drawn from it.
Source: N. J. Kasdin, Proc. IEEE 83 (1995) 802, for noise of a given spectrum; thesis appendix III for the table.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.calibration.allan_fit import flicker_spectrum
from sim.errors import SimError

Array = npt.NDArray[np.float64]
MEMORY = 20.0  # correlation times that a circle must be longer than the record
COMPONENTS = ("white", "flicker", "gauss_markov", "random_walk")


class BenchError(SimError, ValueError):
    """The laboratory was asked for what cannot be."""


@dataclass(frozen=True, slots=True)
class StaticNoise:
    """Noise of one axis; an entry of 0 leaves its component out.

    ``white`` N, unit / sqrt(Hz); ``flicker`` F, the flat Allan deviation, unit; ``walk`` K, unit sqrt(Hz);
    ``bias_std`` (unit) and ``bias_tau`` (s) of a Gauss-Markov process; ``constant``, unit.
    """

    white: float = 0.0
    flicker: float = 0.0
    walk: float = 0.0
    bias_std: float = 0.0
    bias_tau: float = 1.0
    constant: float = 0.0

    def __post_init__(self) -> None:
        sizes = (self.white, self.flicker, self.walk, self.bias_std)
        if not (all(math.isfinite(s) and s >= 0.0 for s in sizes) and self.bias_tau > 0.0):
            raise BenchError(f"static noise: expected finite sizes of at least 0 and bias_tau > 0, got {self}")


def static_record(axes: tuple[StaticNoise, ...], count: int, rate: float, seed: int) -> Array:
    """Readings (count, axes) at rest at ``rate`` (Hz); each component of each axis has a stream of its own."""
    if count < 2 or not (math.isfinite(rate) and rate > 0.0):
        raise BenchError(f"static record: expected two readings or more at a positive rate, got {count} at {rate} Hz")
    streams = np.random.SeedSequence(seed).spawn(len(axes))
    return np.stack([_axis(axis, count, rate, s) for axis, s in zip(axes, streams, strict=True)], axis=1)


def white(random: np.random.Generator, count: int, density: float, rate: float) -> Array:
    """Means (count,) over 1/rate of white noise of ``density`` N: standard deviation N sqrt(rate)."""
    return np.asarray(density * math.sqrt(rate) * random.standard_normal(count))


def flicker(random: np.random.Generator, count: int, floor: float) -> Array:
    """Sample means (count,) of 1/f noise whose Allan deviation is ``floor`` at every averaging time."""
    return floor * shaped(random, count, 2 * count, flicker_spectrum)


def gauss_markov(random: np.random.Generator, count: int, std: float, tau: float, rate: float) -> Array:
    """First-order Gauss-Markov process (count,), stationary: autocovariance std^2 exp(-|t| / tau)."""
    phi = math.exp(-1.0 / (tau * rate))
    length = max(2 * count, count + math.ceil(MEMORY * tau * rate))

    def spectrum(f: Array) -> Array:
        return np.asarray((1.0 - phi * phi) / (1.0 - 2.0 * phi * np.cos(2.0 * np.pi * f) + phi * phi))

    # the process has a mean over the circle, of variance spectrum(0) / length, which `shaped` leaves out
    mean = math.sqrt((1.0 + phi) / (1.0 - phi) / length) * random.standard_normal()
    return std * (shaped(random, count, length, spectrum) + mean)


def random_walk(random: np.random.Generator, count: int, density: float, rate: float) -> Array:
    """Means (count,) over 1/rate of a Brownian motion of ``density`` K, K^2 t of variance; exact, from 0.

    Over one sample the end moves by e and the mean by e / 2 + u / sqrt(12), e and u independent.
    """
    ends, within = random.standard_normal((2, count))
    walk = np.cumsum(ends) - ends
    return np.asarray(density / math.sqrt(rate) * (walk + 0.5 * ends + within / math.sqrt(12.0)))


def shaped(random: np.random.Generator, count: int, length: int, spectrum: Callable[[Array], Array]) -> Array:
    """First ``count`` of a circle of ``length`` Gaussian samples with a two-sided power spectrum per sample, mean 0.

    Every frequency k / length has independent parts of variance S length / 2; autocovariance = inverse transform of S.
    """
    length += length % 2
    amplitude = np.sqrt(spectrum(np.arange(1, length // 2 + 1) / length) * length)
    parts = random.standard_normal((2, amplitude.size)) * math.sqrt(0.5)
    bins = np.zeros(length // 2 + 1, dtype=np.complex128)
    bins[1:] = amplitude * (parts[0] + 1j * parts[1])
    bins[-1] = amplitude[-1] * parts[0, -1] * math.sqrt(2.0)  # the Nyquist frequency has a real part alone
    return np.asarray(np.fft.irfft(bins, length)[:count])


def turn_table(
    random: np.random.Generator,
    matrix: Array,
    bias: Array,
    reference: float,
    noise_std: float = 0.0,
    axis_std: float = 0.0,
) -> Array:
    """Table (3, 6) of mean readings, G = M w + b: row = the axis turned, column pair = the sensor's axis, + then -.

    ``noise_std`` is of each mean; ``axis_std`` (rad) is the rig's misalignment across the axis turned, each way, fixed.
    """
    table = np.empty((3, 6))
    for turned in range(3):
        across = axis_std * random.standard_normal(3)
        across[turned] = 0.0
        axis = np.eye(3)[turned] + across
        axis /= np.linalg.norm(axis)
        for way, sign in enumerate((1.0, -1.0)):
            table[turned, way::2] = matrix @ (sign * reference * axis) + bias + noise_std * random.standard_normal(3)
    return table


@dataclass(frozen=True, slots=True)
class ArmRecord:
    """Robot-arm record as published: preset pitch and roll (k,), rad; mean readings (k, 3) with covariance (3, 3)."""

    pitch: Array
    roll: Array
    readings: Array
    cov: Array


def arm_truth(pitch: Array, roll: Array, yaw: float = 0.0) -> Array:
    """Specific force (k, 3) in g at preset attitudes (rad), of a rig frame turned by ``yaw`` (rad) from the sensor's.

    x = sin p, y = cos p sin r, z = cos p cos r. Source: AHRS-calibration paper.
    """
    level = np.stack([np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)], axis=1)
    c, s = math.cos(yaw), math.sin(yaw)
    return np.asarray(level @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T)


def robot_arm(
    random: np.random.Generator,
    pitch: Array,
    roll: Array,
    matrix: Array,
    bias: Array,
    *,
    noise_std: float = 0.0,
    samples: int = 1000,
    attitude_std: float = 0.0,
    yaw: float = 0.0,
) -> ArmRecord:
    """Mean readings G = M f + b at preset attitudes (k,); ``matrix`` maps g to the reading's unit, as published.

    ``noise_std`` is of one of ``samples`` readings of a mean; ``attitude_std`` (rad) is the arm's, in pitch and roll.
    """
    if pitch.ndim != 1 or pitch.shape != roll.shape or samples < 1:
        raise BenchError(f"robot arm: expected equal (k,) pitch and roll, got {pitch.shape}, {roll.shape}, {samples}")
    errors = attitude_std * random.standard_normal((2, pitch.size))
    mean_std = noise_std / math.sqrt(samples)
    force = arm_truth(pitch + errors[0], roll + errors[1], yaw)
    readings = force @ matrix.T + bias + mean_std * random.standard_normal(force.shape)
    return ArmRecord(pitch, roll, readings, mean_std**2 * np.eye(3))


def _axis(noise: StaticNoise, count: int, rate: float, stream: np.random.SeedSequence) -> Array:
    randoms = [np.random.default_rng(s) for s in stream.spawn(len(COMPONENTS))]
    record = np.full(count, noise.constant)
    if noise.white:
        record += white(randoms[0], count, noise.white, rate)
    if noise.flicker:
        record += flicker(randoms[1], count, noise.flicker)
    if noise.bias_std:
        record += gauss_markov(randoms[2], count, noise.bias_std, noise.bias_tau, rate)
    if noise.walk:
        record += random_walk(randoms[3], count, noise.walk, rate)
    return record
