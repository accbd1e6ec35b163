"""A sensor at rest in software: noise with every parameter known.

Noise is drawn in the frequency domain from the spectrum of its sample means, on a circle at least twice as long as the
record, so that the ends do not know of each other. One seed gives one record, whatever else is drawn from it.
Source: N. J. Kasdin, Proc. IEEE 83 (1995) 802, for noise of a given spectrum.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.calibration.allan_fit import flicker_spectrum
from sim.instruments.instrument import InstrumentError, Records

Array = npt.NDArray[np.float64]
MEMORY = 20.0  # correlation times that a circle must be longer than the record
COMPONENTS = ("white", "flicker", "gauss_markov", "random_walk")
# MPU6500, 2 h at 65 Hz: deg/s/sqrt(Hz), deg/s. Source: thesis Table V.1.
RANDOM_WALK = (8.9e-3, 6.9e-3, 7.38e-3)
BIAS_INSTABILITY = (7.9e-3, 3.83e-3, 3.33e-3)
RATE = 65.0  # Hz
DURATION = 1800.0  # s, of the record that is written


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
            raise InstrumentError(f"static noise: expected finite sizes of at least 0 and bias_tau > 0, got {self}")


def static_record(axes: tuple[StaticNoise, ...], count: int, rate: float, seed: int) -> Array:
    """Readings (count, axes) at rest at ``rate`` (Hz); each component of each axis has a stream of its own."""
    if count < 2 or not (math.isfinite(rate) and rate > 0.0):
        raise InstrumentError(
            f"static record: expected two readings or more at a positive rate, got {count} at {rate} Hz"
        )
    streams = np.random.SeedSequence(seed).spawn(len(axes))
    return np.stack([_axis(axis, count, rate, s) for axis, s in zip(axes, streams, strict=True)], axis=1)


def mpu6500_noise() -> tuple[StaticNoise, ...]:
    """The three axes of the node's own gyroscope, deg/s."""
    return tuple(StaticNoise(white=n, flicker=f) for n, f in zip(RANDOM_WALK, BIAS_INSTABILITY, strict=True))


def simulate_records(seed: int) -> Records:
    """Half an hour of that gyroscope at rest as an array of float32, deg/s."""
    content = io.BytesIO()
    np.save(content, static_record(mpu6500_noise(), round(DURATION * RATE), RATE, seed).astype(np.float32))
    truth = {"random_walk_dps_rthz": RANDOM_WALK, "bias_instability_dps": BIAS_INSTABILITY, "rate_hz": RATE}
    return Records({"static.npy": content.getvalue()}, {"gyroscope": truth})


def white_noise(random: np.random.Generator, count: int, density: float, rate: float) -> Array:
    """Means (count,) over 1/rate of white noise of ``density`` N: standard deviation N sqrt(rate)."""
    return np.asarray(density * math.sqrt(rate) * random.standard_normal(count))


def flicker_noise(random: np.random.Generator, count: int, floor: float) -> Array:
    """Sample means (count,) of 1/f noise whose Allan deviation is ``floor`` at every averaging time."""
    return floor * shaped_noise(random, count, 2 * count, flicker_spectrum)


def gauss_markov(random: np.random.Generator, count: int, std: float, tau: float, rate: float) -> Array:
    """First-order Gauss-Markov process (count,), stationary: autocovariance std^2 exp(-|t| / tau)."""
    phi = math.exp(-1.0 / (tau * rate))
    length = max(2 * count, count + math.ceil(MEMORY * tau * rate))

    def spectrum(f: Array) -> Array:
        return np.asarray((1.0 - phi * phi) / (1.0 - 2.0 * phi * np.cos(2.0 * np.pi * f) + phi * phi))

    # the process has a mean over the circle, of variance spectrum(0) / length, which `shaped` leaves out
    mean = math.sqrt((1.0 + phi) / (1.0 - phi) / length) * random.standard_normal()
    return std * (shaped_noise(random, count, length, spectrum) + mean)


def random_walk(random: np.random.Generator, count: int, density: float, rate: float) -> Array:
    """Means (count,) over 1/rate of a Brownian motion of ``density`` K, K^2 t of variance; exact, from 0.

    Over one sample the end moves by e and the mean by e / 2 + u / sqrt(12), e and u independent.
    """
    ends, within = random.standard_normal((2, count))
    walk = np.cumsum(ends) - ends
    return np.asarray(density / math.sqrt(rate) * (walk + 0.5 * ends + within / math.sqrt(12.0)))


def shaped_noise(random: np.random.Generator, count: int, length: int, spectrum: Callable[[Array], Array]) -> Array:
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


def _axis(noise: StaticNoise, count: int, rate: float, stream: np.random.SeedSequence) -> Array:
    randoms = [np.random.default_rng(s) for s in stream.spawn(len(COMPONENTS))]
    record = np.full(count, noise.constant)
    if noise.white:
        record += white_noise(randoms[0], count, noise.white, rate)
    if noise.flicker:
        record += flicker_noise(randoms[1], count, noise.flicker)
    if noise.bias_std:
        record += gauss_markov(randoms[2], count, noise.bias_std, noise.bias_tau, rate)
    if noise.walk:
        record += random_walk(randoms[3], count, noise.walk, rate)
    return record
