"""Allan deviation of a static record, and what it says of the sensor.

The overlapping estimator is written here, in four lines: `allantools` 2024.6 gives the same numbers to the last bit,
but installs Sphinx and twenty packages more. Tests hold it against eq. V.28 and the published NBS 1000-point data.
Units are those of the record: for deg/s, N is in deg/s/sqrt(Hz), F in deg/s and K in deg/s sqrt(Hz).
Source: thesis appendix V, eq. V.28; IEEE Std 952 for the terms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from groundstation.calibration.allan_fit import AllanFit, Estimate, fit_allan_variances
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
AXES = "xyz"
SHORTEST_RECORD = 60.0  # s, below it no averaging time past a few seconds is known to 25 %
FEWEST_READINGS = 1000
LONGEST_IN_FIT = 10  # clusters at the longest averaging time of the fit; the theory of its errors holds to there
LONGEST_IN_CURVE = 3  # clusters at the end of the curve
LONGEST_IN_MINIMUM = 9  # clusters, a confidence of 25 %: beyond it the lowest point is the luckiest one
SHORTEST_IN_FIT = 0.1  # s, below it the sensor's own low-pass filter colours the noise
PER_OCTAVE = 3  # points of the curve
STUCK_AT_EXTREME = 0.01  # of the readings; of Gaussian noise hardly one stands there
JUMP = 8.0  # robust standard deviations between neighbouring means: chance gives 4.5 in a day
BLOCKS = 64  # of a record, in which slow steps and trends are looked for
DRIFT = 20.0  # fitted drift over the record, in standard deviations beside it; of 1000 pure random walks one has it


@dataclass(frozen=True, slots=True)
class AllanReading:
    """One point of the curve as read: too high by the other terms at 1 s, by them and by chance at the minimum."""

    tau: float
    deviation: float
    confidence: float


@dataclass(frozen=True, slots=True)
class AllanResult:
    """One axis: the curve (k,) with relative 1-sigma ``confidence``, the fit, and two raw readings beside it."""

    tau: Array
    deviation: Array
    confidence: Array
    fit: AllanFit
    raw_at_1s: AllanReading
    raw_minimum: AllanReading

    @property
    def random_walk(self) -> Estimate:
        """N, angle (or velocity) random walk, unit / sqrt(Hz)."""
        return self.fit.random_walk

    @property
    def floor(self) -> Estimate:
        """F, bias instability as the flat part of the curve, unit."""
        return self.fit.floor


def allan_variance(record: Array, factor: int) -> float:
    """Overlapping Allan variance of (n,) readings: half the mean square difference of neighbouring means of ``factor``.

    sigma^2(m) = sum_k (x_k+2m - 2 x_k+m + x_k)^2 / (2 m^2 (n - 2m + 1)), x the running sum. Source: eq. V.28.
    """
    return _variance_of_sums(_sums(record), factor)


def relative_standard_error(count: int, factor: Array | int) -> Array:
    """Relative standard error of a deviation, 1 / sqrt(2 (count / factor - 1))."""
    return np.asarray(1.0 / np.sqrt(2.0 * (count / np.asarray(factor, dtype=np.float64) - 1.0)))


def curve_factors(count: int) -> list[int]:
    """Averaging factors of the curve, `PER_OCTAVE` log-spaced points an octave, without repetition."""
    octaves = math.log2(count / LONGEST_IN_CURVE)
    return sorted({int(2.0 ** (k / PER_OCTAVE)) for k in range(int(octaves * PER_OCTAVE) + 1)})


def fit_factors(count: int, rate: float) -> tuple[int, ...]:
    """Averaging factors of the fit, one an octave: points closer together share nearly all of their data."""
    first = max(1, math.ceil(SHORTEST_IN_FIT * rate))
    return tuple(first << k for k in range(int(math.log2(count / LONGEST_IN_FIT / first)) + 1))


def analyse_allan_deviation(record: Array, rate: float) -> list[AllanResult]:
    """Allan analysis of each axis of a static record.

    Parameters
    ----------
    record : (n,) or (n, 3) readings in one unit
    rate : readings per second, Hz

    Raises
    ------
    CalibrationError
        When the record is too short, not finite, stuck or saturated, or when the sensor moved or drifted.
    """
    columns = _columns(np.asarray(record, dtype=np.float64), rate)
    return [_analyse_axis(columns[:, k], rate, AXES[k]) for k in range(columns.shape[1])]


def _sums(record: Array) -> Array:
    # without the mean, whose sum would cost digits; the second difference does not see it
    return np.concatenate([[0.0], np.cumsum(record - np.mean(record))])


def _variance_of_sums(sums: Array, m: int) -> float:
    second = sums[2 * m :] - 2.0 * sums[m:-m] + sums[: -2 * m]
    return float(second @ second) / (2.0 * m * m * second.size)


def _analyse_axis(record: Array, rate: float, axis: str) -> AllanResult:
    _refuse_stuck(record, axis)
    _refuse_moved(record, rate, axis)
    count, sums = record.size, _sums(record)
    factors = np.array(curve_factors(count))
    deviation = np.sqrt([_variance_of_sums(sums, int(m)) for m in factors])
    error = relative_standard_error(count, factors)
    chosen = fit_factors(count, rate)
    found = fit_allan_variances(np.array([_variance_of_sums(sums, m) for m in chosen]), chosen, count)
    second = round(rate)
    at_1s = AllanReading(
        second / rate, math.sqrt(_variance_of_sums(sums, second)), float(relative_standard_error(count, second))
    )
    low = int(np.argmin(np.where(factors * LONGEST_IN_MINIMUM <= count, deviation, np.inf)))
    minimum = AllanReading(float(factors[low] / rate), float(deviation[low]), float(error[low]))
    return AllanResult(factors / rate, deviation, error, _at_rate(found, rate), at_1s, minimum)


def _at_rate(found: AllanFit, rate: float) -> AllanFit:
    """Convert a fit per sample to one per second: N^2 / n = N^2 / rate / tau, K^2 n / 3 = K^2 rate tau / 3."""
    white, walk = _scaled(found.random_walk, 1.0 / math.sqrt(rate)), found.rate_walk
    slow = _scaled(walk, math.sqrt(rate)) if walk is not None else None
    return replace(found, random_walk=white, rate_walk=slow)


def _scaled(e: Estimate, scale: float) -> Estimate:
    return Estimate(e.value * scale, e.std * scale, e.low * scale, e.high * scale)


def _columns(record: Array, rate: float) -> Array:
    if not (math.isfinite(rate) and rate >= 1.0):
        raise CalibrationError(f"allan: expected a rate of at least 1 Hz, got {rate} Hz")
    columns = record[:, None] if record.ndim == 1 else record
    if columns.ndim != 2 or columns.shape[1] not in {1, 3}:
        raise CalibrationError(f"allan: expected a record of shape (n,) or (n, 3), got {record.shape}")
    count = columns.shape[0]
    needed = max(FEWEST_READINGS, math.ceil(SHORTEST_RECORD * rate))
    if count < needed:
        raise CalibrationError(f"allan: the record is too short: {count} readings at {rate} Hz, needed are {needed}")
    bad = np.argwhere(~np.isfinite(columns))
    if bad.size:
        row, k = bad[0]
        raise CalibrationError(
            f"allan: reading {row} of axis {AXES[k]} is {columns[row, k]}; {len(bad)} are not finite"
        )
    return columns


def _refuse_stuck(record: Array, axis: str) -> None:
    low, high = float(record.min()), float(record.max())
    if low == high:
        raise CalibrationError(f"allan: axis {axis} is stuck: every reading is {low}")
    for extreme in (low, high):
        share = float(np.mean(record == extreme))
        if share > STUCK_AT_EXTREME:
            raise CalibrationError(
                f"allan: axis {axis} is saturated or coarser than its noise: {share:.1%} of the readings stand at "
                f"{extreme}, the outermost value"
            )


def _refuse_moved(record: Array, rate: float, axis: str) -> None:
    """Steps between neighbouring means of 1 s and of a 64th of the record; a trend beside what is left of the means."""
    for length in (round(rate), record.size // BLOCKS):
        means = _means(record, length)
        steps = np.abs(np.diff(means))
        scale = 1.4826 * float(np.median(steps)) or float(np.std(steps))
        worst = int(np.argmax(steps))
        if steps[worst] > JUMP * scale:
            raise CalibrationError(
                f"allan: the sensor moved: the mean of axis {axis} steps by {steps[worst]:.4g} near "
                f"{(worst + 1) * length / rate:.1f} s, {steps[worst] / scale:.1f} standard deviations"
            )
    time = np.arange(means.size) - 0.5 * (means.size - 1)
    slope = float(time @ means) / float(time @ time)
    drift, rest = abs(slope) * means.size, float(np.std(means - means.mean() - slope * time))
    if drift > DRIFT * rest:
        raise CalibrationError(
            f"allan: axis {axis} has a trend: it drifts by {drift:.4g} over the record and scatters by {rest:.4g} "
            "beside that; let the sensor warm up"
        )


def _means(record: Array, length: int) -> Array:
    blocks = record.size // length
    return np.asarray(record[: blocks * length].reshape(blocks, length).mean(axis=1))
