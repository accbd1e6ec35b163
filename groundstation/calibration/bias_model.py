"""What a filter takes of a sensor's noise: white noise and a Gauss-Markov bias of the sensor's own correlation time.

A filter with one Gauss-Markov state has two questions of a gyroscope: how fast its yaw grows uncertain in a second, and
how far it drifts once the bias was learnt at rest and no aiding comes. The first is white noise; the second, over
minutes, is how long a bias lasts. So white noise, size and correlation time are fitted to the whole curve. No sensor
has the shape of one such process: a point is believed to `SHAPE` at best, else the short times, known to a percent,
would decide what the minutes do. A record of two hours leaves correlation times of many minutes open, and the drifts
that they make are not alike: the pair that is handed over is the one whose drifts are those of all pairs on average,
each with its likelihood. Source: IEEE Std 952; thesis appendix V for the pair of the published curve.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
GAUSS_MARKOV_PEAK: Final = 1.89  # averaging time of the largest Allan deviation, in correlation times
FLOOR_TAU: Final = 30.0  # s, where the published curve of the node's sensor has its floor
SHAPE: Final = 0.1  # relative, of an Allan variance, by which one Gauss-Markov process is a sensor's bias
SHORTEST: Final = 0.25  # s, below it the sensor's own low-pass filter colours the noise
SHARED: Final = 3.0  # points of an octave, which share nearly all of their data
FEWEST_CLUSTERS: Final = 6.0  # of a point that is fitted
STEPS: Final = 90  # of the correlation time, in equal ratios
ROUNDS: Final = 5  # of weights by the fitted curve
LONGEST: Final = 2.0  # longest averaging times, of a correlation time that a record shows
CLEAR: Final = 2.0  # standard errors, from which on a bias is seen
BOUND: Final = 1.645  # standard errors to the bound of a bias that is not
LEARNT: Final = 60.0  # s at rest, after which a drift is told
SPANS: Final = (60.0, 300.0, 900.0)  # s, after which
FEWEST_DRIFTS: Final = 3.0  # times learning and drifting, of a record that shows a drift


@dataclass(frozen=True, slots=True)
class FilterNoise:
    """White noise (unit / sqrt(Hz)) and first-order Gauss-Markov bias (unit, s) of one axis, for the filter.

    ``is_bound``: the record shows no bias; what is given is the largest that it may hide.
    """

    white: float
    bias_std: float
    bias_tau: float
    is_bound: bool = False


def gauss_markov_variance(tau: Array | float, correlation: float) -> Array:
    """Allan variance at ``tau`` (s) of a Gauss-Markov process of variance 1. Source: IEEE Std 952.

    2 / x (1 - (3 - 4 exp(-x) + exp(-2 x)) / (2 x)),  x = tau / correlation.
    """
    x = np.asarray(tau, dtype=np.float64) / correlation
    return np.asarray(2.0 / x * (1.0 - (3.0 - 4.0 * np.exp(-x) + np.exp(-2.0 * x)) / (2.0 * x)))


def filter_noise(at_1s: float, at_floor: float, floor_tau: float = FLOOR_TAU) -> FilterNoise:
    """White noise and Gauss-Markov bias whose Allan deviation passes through two points of a printed curve.

    The bias has its largest Allan deviation at the floor: correlation time = floor_tau / 1.89; then
    sigma^2(tau) = N^2 / tau + sigma_b^2 g(tau) at 1 s and at ``floor_tau`` (s) are two linear equations.

    Raises
    ------
    CalibrationError
        When no such pair exists: the floor lies above what the point at 1 s allows, or below the white noise.
    """
    if not floor_tau > 1.0:
        raise CalibrationError(f"filter noise: expected the floor at more than 1 s, got {floor_tau} s")
    correlation = floor_tau / GAUSS_MARKOV_PEAK
    taus = np.array([1.0, floor_tau])
    system = np.stack([1.0 / taus, gauss_markov_variance(taus, correlation)], axis=1)
    white, bias = np.linalg.solve(system, np.array([at_1s, at_floor]) ** 2)
    if not (math.isfinite(white + bias) and white >= 0.0 and bias >= 0.0):
        raise CalibrationError(
            f"filter noise: no white and Gauss-Markov noise has an Allan deviation of {at_1s} at 1 s and {at_floor} "
            f"at {floor_tau} s"
        )
    return FilterNoise(math.sqrt(white), math.sqrt(bias), correlation)


def fit_bias_model(tau: Array, deviation: Array, confidence: Array) -> FilterNoise:
    """White noise and Gauss-Markov bias of a curve; every curve has one.

    Parameters
    ----------
    tau : (k,) s, averaging times
    deviation : (k,) Allan deviations
    confidence : (k,) relative standard errors of them
    """
    clusters = 1.0 + 1.0 / (2.0 * confidence**2)
    used = (tau >= SHORTEST) & (clusters >= FEWEST_CLUSTERS)
    if np.sum(used) < 4:
        used = np.ones_like(tau, dtype=bool)
    t, variance = tau[used], deviation[used] ** 2
    error = np.sqrt((2.0 * confidence[used]) ** 2 + SHAPE**2)
    lasting = np.geomspace(max(t[0], 1.0), LONGEST * t[-1], STEPS)
    found = [_solve(t, variance, error, correlation) for correlation in lasting]
    pairs = [
        FilterNoise(math.sqrt(white), math.sqrt(max(bias, 0.0)), float(correlation))
        for ((white, bias), _, _), correlation in zip(found, lasting, strict=True)
    ]
    costs = np.array([cost for _, _, cost in found])
    likely = np.exp(-0.5 * (costs - costs.min()) / SHARED)
    best = int(np.argmin(costs))
    if found[best][0][1] > CLEAR * found[best][1][1]:
        return _as_all(pairs, likely / likely.sum())
    longest = float(t[-1]) / GAUSS_MARKOV_PEAK
    (white, bias), stds, _ = _solve(t, variance, error, longest)
    return FilterNoise(math.sqrt(white), math.sqrt(max(bias, 0.0) + BOUND * stds[1]), longest, is_bound=True)


def drift_std(noise: FilterNoise, span: float, learnt: float = LEARNT) -> float:
    """Standard deviation of the angle that an axis drifts by over ``span`` (s), its bias learnt as a mean at rest.

    The bias is the mean over ``learnt`` (s) just before. With V(t) the variance of the integral of a Gauss-Markov
    process, V = 2 tau (t - tau (1 - exp(-t / tau))), and C = (V(learnt + span) - V(learnt) - V(span)) / 2

        var = N^2 (span + span^2 / learnt) + sigma_b^2 (V(span) + r^2 V(learnt) - 2 r C),  r = span / learnt.
    """

    def integral(t: float) -> float:
        last = noise.bias_tau
        return 2.0 * last * (t + last * math.expm1(-t / last))

    ratio = span / learnt
    common = 0.5 * (integral(learnt + span) - integral(learnt) - integral(span))
    bias = integral(span) + ratio**2 * integral(learnt) - 2.0 * ratio * common
    return math.sqrt(noise.white**2 * (span + span * ratio) + noise.bias_std**2 * max(bias, 0.0))


def seen_drift(record: Array, rate: float, span: float, learnt: float = LEARNT) -> float | None:
    """The same as a record (n,) of ``rate`` Hz shows it, rms; None where it is too short to."""
    first, after = round(learnt * rate), round(span * rate)
    if len(record) < FEWEST_DRIFTS * (first + after):
        return None
    sums = np.concatenate([[0.0], np.cumsum(record - np.mean(record))]) / rate
    begin = np.arange(0, len(record) - first - after, max(1, round(rate)))
    bias = (sums[begin + first] - sums[begin]) / (first / rate)
    drift = sums[begin + first + after] - sums[begin + first] - bias * (after / rate)
    return float(np.sqrt(np.mean(drift**2)))


def _as_all(pairs: list[FilterNoise], likely: Array) -> FilterNoise:
    """The pair whose drifts are nearest to those of all pairs on average, by their likelihood."""
    variances = np.array([[drift_std(pair, span) ** 2 for span in SPANS] for pair in pairs])
    wanted = likely @ variances
    return pairs[int(np.argmin(np.sum(np.log(variances / wanted) ** 2, axis=1)))]


def _solve(
    t: Array, variance: Array, error: Array, correlation: float
) -> tuple[tuple[float, float], tuple[float, float], float]:
    """Squares of white noise and bias for a correlation time, their standard errors, and the cost in logarithms."""
    columns = np.stack([1.0 / t, gauss_markov_variance(t, correlation)], axis=1)
    curve = variance
    for _ in range(ROUNDS):
        weighted = columns / (error * curve)[:, None]
        squares = np.linalg.lstsq(weighted, variance / (error * curve), rcond=None)[0]
        white = max(float(squares[0]), 1e-3 * float(variance[0] * t[0]))
        kept = max(float(squares[1]), 0.0)
        curve = columns @ np.array([white, kept])
    cov = np.linalg.inv(weighted.T @ weighted)
    stds = (math.sqrt(cov[0, 0]), math.sqrt(cov[1, 1]))
    ratio = variance / curve
    cost = float(np.sum(2.0 * (ratio - 1.0 - np.log(ratio)) / error**2))  # deviance of a variance
    return (white, float(squares[1])), stds, cost
