"""Fit of angle random walk, floor and rate random walk to overlapping Allan variances, with honest standard errors.

The variances at neighbouring averaging times share their data, so a fit that takes them for independent believes itself
too much. Their covariance is known: an Allan variance is a weighted sum of the periodogram, whose ordinates are
independent, so with S the power spectrum per sample and G_n the window of the averaging factor n

    sigma^2(n) = int S G_n df,    cov(m, n) = 2 / max(M_m, M_n) int S^2 G_m G_n df,
    G_n = 2 sin^4(pi n f) / (n sin pi f)^2

over one period of f (cycles per sample), M_n = count - 2 n + 1 terms. S is linear in N^2, F^2 and K^2, so cov is
quadratic in them, with coefficients of the design alone. Lengths are in samples here; `allan` puts in the rate.
Source: thesis appendix V for the curve and its three terms; the covariance is Whittle's, for a Gaussian record.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
WHITE, FLICKER, WALK = range(3)
Z95 = 1.959964  # of 95 % of a normal distribution
WALK_EVIDENCE = 9.0  # fall of chi^2 for one term more: three standard deviations of its own estimate
ITERATIONS = 12
ALIASES = 12  # of a spectrum, summed one by one; the rest as an integral, to 1e-6
CHUNK = 1 << 15  # frequencies held at a time


def flicker_spectrum(frequency: Array) -> Array:
    """Two-sided spectrum of sample means of flicker noise whose Allan variance is 1 at every averaging time.

    S(f) = (sin pi f / pi)^2 / (4 ln 2) sum_k |f + k|^-3, ``frequency`` (n,) in cycles per sample, 0 < f <= 1/2.
    The sum is what the averaging over one sample leaves of 1/f, folded at the sampling rate.
    """
    f = np.asarray(frequency)
    folded = f**-3.0
    for k in range(1, ALIASES + 1):
        folded = folded + (k + f) ** -3.0 + (k - f) ** -3.0
    edge = ALIASES + 0.5
    folded += 0.5 * ((edge + f) ** -2.0 + (edge - f) ** -2.0)
    return np.asarray((np.sin(np.pi * f) / np.pi) ** 2 * folded / (4.0 * math.log(2.0)))


def walk_spectrum(frequency: Array) -> Array:
    """Two-sided spectrum of sample means of a random walk of variance 1 per sample, 1 / (4 sin^2 pi f) - 1/6."""
    return np.asarray(0.25 / np.sin(np.pi * frequency) ** 2 - 1.0 / 6.0)


def allan_transfer_function(frequency: Array, factor: int) -> Array:
    """G_n(f) = 2 sin^4(pi n f) / (n sin pi f)^2, what an Allan variance sees of a spectrum."""
    return np.asarray(2.0 * np.sin(np.pi * factor * frequency) ** 4 / (factor * np.sin(np.pi * frequency)) ** 2)


def allan_design_matrix(factors: Array) -> Array:
    """Allan variance (k, 3) of unit white noise, flicker and random walk at averaging factors (k,): 1/n, 1, n/3."""
    n = np.asarray(factors, dtype=np.float64)
    return np.stack([1.0 / n, np.ones_like(n), n / 3.0], axis=1)


@lru_cache(maxsize=8)
def spectral_moments(count: int, factors: tuple[int, ...]) -> tuple[Array, Array]:
    """Integrals over frequency of a design: ``first`` (3, k) of S_a G_n and ``second`` (3, 3, k, k), the covariance.

    ``first`` must come out as `design` (it does to 0.4 % at a tenth of the record, better below), which is how the
    spectra are checked; ``second`` contracted twice with
    (N^2, F^2, K^2) is the covariance of the Allan variances.
    """
    k = len(factors)
    first, second = np.zeros((3, k)), np.zeros((3, 3, k, k))
    grid = (np.arange(count // 2) + 0.5) / (2 * (count // 2))  # midpoints of half a period: exact for white noise
    for start in range(0, grid.size, CHUNK):
        f = grid[start : start + CHUNK]
        windows = np.stack([allan_transfer_function(f, n) for n in factors])
        spectra = np.stack([np.ones_like(f), flicker_spectrum(f), walk_spectrum(f)])
        first += spectra @ windows.T
        for a in range(3):
            for b in range(a, 3):
                second[a, b] += (windows * (spectra[a] * spectra[b])) @ windows.T
    for a, b in ((0, 1), (0, 2), (1, 2)):
        second[b, a] = second[a, b]
    terms = count - 2.0 * np.array(factors) + 1.0
    second *= 2.0 / grid.size / np.maximum(terms[:, None], terms[None, :])
    return first / grid.size, second


@dataclass(frozen=True, slots=True)
class Estimate:
    """A deviation with its standard error and 95 % interval; ``low`` is 0 where the record does not show it."""

    value: float
    std: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class AllanFit:
    """N (white), F (floor) and K (walk, None where the record does not show it), with chi^2 of the fit.

    ``walk_evidence`` is the fall of chi^2 that the walk's term brings; it is kept above `WALK_EVIDENCE`.
    """

    random_walk: Estimate
    floor: Estimate
    rate_walk: Estimate | None
    chi2: float
    degrees: int
    walk_evidence: float

    @property
    def consistent(self) -> bool:
        """Whether the model's shape fits, to three standard deviations of chi^2."""
        return self.chi2 <= self.degrees + 3.0 * math.sqrt(2.0 * self.degrees)


def fit_allan_variances(variances: Array, factors: tuple[int, ...], count: int) -> AllanFit:
    """Weighted fit of sigma^2(n) = N^2 / n + F^2 (+ K^2 n / 3) to Allan variances (k,), per sample.

    The weights are the inverse of the covariance that the fitted terms themselves imply, iterated: weights from
    measured variances would favour those that came out low. Standard errors grow by sqrt(chi^2 / degrees) where that
    exceeds 1, so that a record with another shape than the model's is not believed too much.
    """
    second = spectral_moments(count, factors)[1]
    columns = allan_design_matrix(np.array(factors))
    start = np.array([max(variances[0] * factors[0], 0.0), float(variances.min()), 0.0])
    two, two_cov, chi2 = _solve(variances, columns[:, :WALK], second, start)
    # the evidence is weighed under the hypothesis of no walk: with a walk its own variance would hide it
    weights = np.linalg.inv(_covariance(second, np.append(two, 0.0)))
    under = columns.T @ weights @ columns
    walk = np.linalg.solve(under, columns.T @ weights @ variances)[WALK]
    evidence = float(np.sign(walk) * walk**2 / np.linalg.inv(under)[WALK, WALK])
    squares, cov, terms = two, two_cov, WALK
    if evidence > WALK_EVIDENCE:
        squares, cov, chi2 = _solve(variances, columns, second, np.append(two, walk))
        terms = WALK + 1
    degrees = len(factors) - terms
    cov = cov * max(chi2 / degrees, 1.0)
    found = [deviation_estimate(float(squares[a]), math.sqrt(cov[a, a])) for a in range(terms)]
    return AllanFit(found[WHITE], found[FLICKER], found[WALK] if terms > WALK else None, chi2, degrees, evidence)


def deviation_estimate(square: float, std: float) -> Estimate:
    """A deviation from its square and the square's standard error.

    Its logarithm is what is nearly normal, because the error of a variance is proportional to it; a square that is
    not clear of zero gets the interval of the square, down to zero.
    """
    value = math.sqrt(max(square, 0.0))
    if square < 3.0 * std:
        low, high = math.sqrt(max(square - Z95 * std, 0.0)), math.sqrt(max(square, 0.0) + Z95 * std)
        return Estimate(value, std / (2.0 * value) if square > std else math.sqrt(std), low, high)
    spread = math.exp(Z95 * std / (2.0 * square))
    return Estimate(value, std / (2.0 * value), value / spread, value * spread)


def _covariance(second: Array, squares: Array) -> Array:
    positive = np.maximum(squares, 0.0)
    return np.asarray(np.einsum("abmn,a,b->mn", second, positive, positive))


def _solve(variances: Array, columns: Array, second: Array, start: Array) -> tuple[Array, Array, float]:
    """Iterated generalised least squares: squares (p,), their covariance (p, p) and chi^2."""
    terms = columns.shape[1]
    squares = start[:terms]
    for _ in range(ITERATIONS):
        weights = np.linalg.inv(_covariance(second[:terms, :terms], squares))
        cov = np.linalg.inv(columns.T @ weights @ columns)
        squares = cov @ columns.T @ weights @ variances
    residual = variances - columns @ squares
    return squares, np.asarray(cov, dtype=np.float64), float(residual @ weights @ residual)
