"""Half widths that hold what they state whatever the noise is, where a jig's errors are known in size.

The half width w of a parameter's interval follows from the sum of squares s of the residuals, which hold noise and jig
together. For a noise of variance v, the residuals have the variance v + e_i along the directions that the jig reaches
and v along all others. The parameter is correlated with them by g_i, so given the residuals it is normal with

    mean = sum of g_i z_i / sqrt(v + e_i),    variance = v a + b - sum of g_i^2 / (v + e_i)

(z_i standard normal, a and b its variance by noise of one and by the jig). w(s) is solved for so that the coverage is
the stated one at every v: Gauss-Newton on log w at knots of log s, the residuals drawn once and for all. Without a jig
it is Student's interval. Where all error is the jig's it is narrower than any that takes s for noise alone.
Residuals below all that the jig alone would leave refute it: there the width is that of the jig as it is stated.
Source: JCGM 100:2008 (GUM), annex G, for the problem; calibration of a confidence interval over a nuisance parameter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.calibration.coverage import COVERAGE, coverage_factor

Array = npt.NDArray[np.float64]
DRAWS = 800  # of the residuals
SEED = 7  # the same record gives the same interval
KNOTS = 32
BELOW_ALL = 0.002  # share of sums of squares without noise below which none is expected: two in a thousand records
NOISES = np.concatenate([[0.0], np.logspace(-2.5, 3.5, 28)])  # variances over the jig's
LEAST_NOISE = 1e-3  # of the jig's variance, where the jig leaves nothing in the residuals
STEPS = 15
SMOOTH, NEAR = 0.002, 0.0005  # weights against bends of log w and against what it begins with
FURTHEST = 0.5  # change of log w in one step
NOTHING = 1e-12  # of the largest variance
DEVIATIONS = np.linspace(-9.0, 9.0, 3601)
BELOW = np.array([0.5 * math.erfc(-step / math.sqrt(2.0)) for step in DEVIATIONS])


@dataclass(frozen=True, slots=True)
class Spread:
    """Effect of noise and of the jig's errors on one parameter and on its residuals."""

    by_noise: float  # variance of the parameter for a noise of variance one
    by_jig: float  # its variance by the jig
    shown: Array  # (d,) variances of the residuals by the jig, along the directions it reaches
    common: Array  # (d,) covariances of the parameter and these
    degrees: int  # directions of the residuals

    @property
    def scale(self) -> float:
        """Variance of a reading's noise that would matter as much as the jig."""
        return max(float(np.sum(self.shown)) / self.degrees, self.by_jig / self.by_noise)


@dataclass(frozen=True, slots=True)
class Interval:
    """Logarithm of the half width at knots of the logarithm of the sum of squares; as its root beyond them.

    ``by_jig`` is the half width by the jig alone, as it is stated: that of residuals which refute it; 0 where the jig
    does not reach the parameter.
    """

    knots: Array
    widths: Array
    by_jig: float = 0.0

    def half_width(self, squares: Array) -> Array:
        """Half width of the interval for sums of squares (...) of the residuals."""
        at = _log(squares)
        beyond = 0.5 * np.maximum(at - self.knots[-1], 0.0)
        found = np.exp(np.interp(at, self.knots, self.widths) + beyond)
        return np.asarray(np.where(self.is_refuted_by(squares), self.by_jig, found))

    def is_refuted_by(self, squares: Array) -> npt.NDArray[np.bool_]:
        """Whether sums of squares (...) are smaller than the jig alone would leave, in all but `BELOW_ALL`."""
        return np.asarray((self.by_jig > 0.0) & (_log(squares) < self.knots[0]))


def coverage_interval(spread: Spread, coverage: float = COVERAGE) -> Interval:
    """The interval of one parameter."""
    n, a, b, c = spread.degrees, spread.by_noise, spread.by_jig, spread.scale
    factor = coverage_factor(n, coverage)
    if c <= 0.0:  # no jig: Student's, a straight line in the logarithms
        ends = np.linspace(-700.0, 700.0, 2)
        return Interval(ends, 0.5 * ends + math.log(factor * math.sqrt(a / n)))
    least = float(np.sum(spread.shown)) / n
    noise = c * np.maximum(NOISES, 0.0 if least > NOTHING * c else LEAST_NOISE)
    squares, mean, std = _drawn(spread, noise)
    logs = np.log(np.maximum(squares, NOTHING * n * c))
    knots = np.linspace(float(np.quantile(logs[:, 0], BELOW_ALL)), float(np.max(logs)), KNOTS)
    step = knots[1] - knots[0]
    place = np.clip((logs - knots[0]) / step, 0.0, KNOTS - 1.000001)
    k = place.astype(np.intp)
    blend = place - k
    begin = 0.5 * np.log(
        coverage_factor(None, coverage) ** 2 * b
        + factor**2 * a * np.maximum(np.exp(knots) / n - least, 0.0)
        + NOTHING * a * c
    )
    bends, widths = np.diff(np.eye(KNOTS), 2, axis=0), begin
    for _ in range(STEPS):
        w = np.exp((1.0 - blend) * widths[k] + blend * widths[k + 1])
        upper, lower = (w - mean) / std, (-w - mean) / std
        held = np.mean(_below(upper) - _below(lower), axis=0)
        slope = (np.exp(-0.5 * upper**2) + np.exp(-0.5 * lower**2)) * w / (std * math.sqrt(math.tau) * len(w))
        by_knot = _summed(slope * (1.0 - blend), k) + _summed(slope * blend, k + 1)
        off = widths - begin
        design = np.concatenate([by_knot, SMOOTH * bends, NEAR * np.eye(KNOTS)])
        wanted = np.concatenate([coverage - held, -SMOOTH * bends @ off, -NEAR * off])
        widths = widths + np.clip(np.linalg.lstsq(design, wanted, rcond=None)[0], -FURTHEST, FURTHEST)
    return Interval(knots, widths, coverage_factor(None, coverage) * math.sqrt(b))


def _log(squares: Array) -> Array:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.asarray(squares, float)))


def _drawn(spread: Spread, noise: Array) -> tuple[Array, Array, Array]:
    """Sum of squares (draws, v) of residuals, mean (draws, v) and standard deviation (v,) of the parameter given them.

    ``noise`` (v,) are variances.
    """
    rng, reached = np.random.default_rng(SEED), len(spread.shown)
    half = rng.standard_normal((DRAWS // 2, reached))
    z = np.concatenate([half, -half])
    others = spread.degrees - reached
    rest = np.sum(rng.standard_normal((DRAWS, others)) ** 2, axis=1)
    variance = np.maximum(noise[:, None] + spread.shown, 1e-300)
    squares = z**2 @ variance.T + rest[:, None] * noise
    mean = z @ (spread.common / np.sqrt(variance)).T
    left = noise * spread.by_noise + spread.by_jig - np.sum(spread.common**2 / variance, axis=1)
    return squares, mean, np.sqrt(np.maximum(left, NOTHING * spread.by_noise * spread.scale))


def _summed(values: Array, knots: npt.NDArray[np.intp]) -> Array:
    """Sums (v, knots) of values (draws, v) by their knot."""
    count = values.shape[1]
    cells = knots + KNOTS * np.arange(count)
    return np.asarray(np.bincount(cells.ravel(), values.ravel(), count * KNOTS).reshape(count, KNOTS), float)


def _below(x: Array) -> Array:
    """Standard normal distribution function."""
    return np.asarray(np.interp(x, DEVIATIONS, BELOW))
