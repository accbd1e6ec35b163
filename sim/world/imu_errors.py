"""Errors of one IMU over a whole run, drawn from streams of its own, so that no other process changes them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.jit import kernel
from sim.world.scenario_file import AccelerometerSection, DriftSection, GyroSection

Array = npt.NDArray[np.float64]
SAMPLE_RATE_HZ = 65.0  # of the gyroscope, whose single sample has the noise of this band. Source: thesis Table V.1
WANDERING = ("noise_dps_rthz", "bias_std_dps")


def gauss_markov(random: np.random.Generator, count: int, std: Array, tau: float, step: float) -> Array:
    """First-order Gauss-Markov process (count, 3), stationary from the start, discretised exactly.

    b_k+1 = phi b_k + std sqrt(1 - phi^2) w,  phi = exp(-step / tau).
    """
    phi = math.exp(-step / tau)
    draws = random.standard_normal((count, 3))
    draws[1:] *= math.sqrt(1.0 - phi * phi)
    follow(draws, phi)
    return draws * std


@kernel
def follow(draws: Array, phi: float) -> None:
    """Add to every row of ``draws`` (n, m) its part ``phi`` of the row before, in place."""
    for k in range(1, draws.shape[0]):
        for j in range(draws.shape[1]):
            draws[k, j] += phi * draws[k - 1, j]


@dataclass(frozen=True, slots=True)
class Drift:
    """Change of one IMU since its calibration: reading = matrix @ force + bias, and a rate at rest."""

    matrix: Array  # (3, 3), row = sensor axis
    bias: Array  # (3,) m/s^2
    rate: Array  # (3,) rad/s

    @classmethod
    def draw(cls, section: DriftSection, random: np.random.Generator) -> Drift:
        """Drift of one tube; small angles."""
        matrix = math.radians(section.accelerometer_misalignment_std_deg) * random.standard_normal((3, 3))
        np.fill_diagonal(matrix, 1.0 + section.accelerometer_scale_std * random.standard_normal(3))
        bias = section.accelerometer_bias_std_mps2 * random.standard_normal(3)
        return cls(matrix, bias, math.radians(section.gyroscope_bias_std_dps) * random.standard_normal(3))


@dataclass(frozen=True, slots=True)
class ImuErrors:
    """Error models of gyroscope and accelerometer, as the scenario states them."""

    gyroscope: GyroSection
    accelerometer: AccelerometerSection

    def times(self, factor: float) -> ImuErrors:
        """Those of an IMU whose noise is larger by ``factor``."""
        if factor == 1.0:
            return self
        noise = {name: tuple(factor * x for x in getattr(self.gyroscope, name)) for name in WANDERING}
        accelerometer = self.accelerometer.model_copy(update={"noise_deg": factor * self.accelerometer.noise_deg})
        return ImuErrors(self.gyroscope.model_copy(update=noise), accelerometer)

    def gyro(self, random: np.random.Generator, rate: Array, force: Array, period: float) -> Array:
        """Readings (n, 3, rad/s) of the mean rates (n, 3), cycle after cycle of ``period`` (s)."""
        g = self.gyroscope
        bias, matrix = self.constants(random)
        white = np.radians(np.array(g.noise_dps_rthz)) / math.sqrt(period)
        wander = gauss_markov(random, len(rate), np.radians(np.array(g.bias_std_dps)), g.bias_tau_s, period)
        noise = white * random.standard_normal(rate.shape)
        pull = math.radians(g.g_sensitivity_dps_per_g) / self.accelerometer.gravity_mps2 * force
        return quantise(rate @ matrix.T + bias + wander + noise + pull, g.resolution_dps, g.range_dps)

    def accelerations(self, random: np.random.Generator, force: Array, turning: Array) -> Array:
        """Readings (n, 3, m/s^2) of the mean specific forces (n, 3); ``turning`` (n,) says when the bit shakes them."""
        a = self.accelerometer
        tilt = math.radians(1.0) * a.gravity_mps2
        bias = self.force_bias(random)
        noise = a.noise_deg * tilt * random.standard_normal(force.shape)
        shaking = a.vibration_mps2 * turning[:, None] * random.standard_normal(force.shape)
        return np.asarray(force + bias + noise + shaking)

    def constants(self, random: np.random.Generator) -> tuple[Array, Array]:
        """Of the gyroscope: constant bias (3,) rad/s, and its reading by the true rates (3, 3)."""
        g = self.gyroscope
        bias = np.radians(np.array(g.constant_bias_dps) + g.constant_bias_std_dps * random.standard_normal(3))
        return bias, self._distortion(random)

    def force_bias(self, random: np.random.Generator) -> Array:
        """Of the accelerometer (3,), m/s^2."""
        a = self.accelerometer
        tilt = math.radians(1.0) * a.gravity_mps2
        return np.asarray(a.bias_std_deg * tilt * random.standard_normal(3))

    def readings(self, random: np.random.Generator, rate: Array, force: Array, turning: Array, period: float) -> Array:
        """Both, one after the other from one stream, (n, 6)."""
        gyro = self.gyro(random, rate, force, period)
        return np.concatenate([gyro, self.accelerations(random, force, turning)], axis=1)

    def _distortion(self, random: np.random.Generator) -> Array:
        g = self.gyroscope
        matrix = math.radians(g.misalignment_std_deg) * random.standard_normal((3, 3))
        np.fill_diagonal(matrix, 1.0 + g.scale_factor_std * random.standard_normal(3))
        return np.asarray(matrix)


def quantise(rate: Array, resolution_dps: float, range_dps: float) -> Array:
    """Round to the resolution and clip at the range (both deg/s); ``rate`` in rad/s."""
    limit = math.radians(range_dps)
    if resolution_dps > 0.0:
        step = math.radians(resolution_dps)
        rate = np.round(rate / step) * step
    return np.clip(rate, -limit, limit)


def single_samples(gyroscope: GyroSection, period: float) -> GyroSection:
    """The gyroscope whose mean over ``period`` (s) is as noisy as one sample of the one given."""
    spread = math.sqrt(period * SAMPLE_RATE_HZ)
    x, y, z = (noise * spread for noise in gyroscope.noise_dps_rthz)
    return gyroscope.model_copy(update={"noise_dps_rthz": (x, y, z)})
