"""Residuals that follow on each other in the order of their record: a bias that walks from reading to reading.

A bias that moves by q from one reading to the next adds q^2 min(i, j) to the covariance of a noise of s. Least squares
shows of both what lies along the directions that it leaves; turned onto the axes of the walk's covariance there, l_k,
the residuals are independent, of variance s^2 (1 + r^2 l_k), with r = q / s common to the axes of a sensor and s its
axis's own. Two things follow. The most powerful invariant test of r = 0 against r = `AGAINST` says whether there is a
walk. And an interval has to hold what a walk too small to be seen may have moved: the parameter's variance is its mean
over r, weighed by the likelihood of the residuals under each.

Source: King 1987, Econometric Theory 3, 97 (point optimal invariant tests); Harville 1974, Biometrika 61, 383 (the
likelihood of residuals).
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
FEWEST_JUDGED: Final = 8  # degrees of freedom; of fewer, chance and a walk look too much alike to refuse a record
FEWEST_WIDENED: Final = 3  # the same; Student's intervals of fewer hold whatever walks
AGAINST: Final = 1.0  # of a walk's step over the noise: what the test is most powerful against
WALKS: Final = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)  # the same, of which an interval is the mean
BELIEVED: Final = (0.1, 0.1, 0.2, 0.2, 0.2, 0.2)  # in each, before any residual is seen: sensors' biases do wander
CHANCE: Final = 0.01  # of an honest record to be taken for one that walks
DRAWS: Final = 2_000_000  # of noise on one direction, for the limit of the test
FEWEST_DRAWS, MOST_DRAWS = 2000, 20_000  # records of those
SEED: Final = 3
LEAST: Final = 1e-24  # of the squares of a record; what is exact shows nothing


@dataclass(frozen=True, slots=True)
class _Walk:
    """What a walk of one size does to a design: all for noise of one."""

    left: Array  # (d,) variances of what least squares leaves
    gain: Array  # (4, n) of the residuals on the parameters, beyond what least squares makes of them
    variance: Array  # (4,) of the parameters by weighted least squares


@dataclass(frozen=True, slots=True)
class _Design:
    """Truths of a record: directions (n, d) that the fit leaves, variances (4,) by white noise, walks and limit."""

    directions: Array
    variance: Array
    walks: tuple[_Walk, ...]
    limit: float  # of the test


def find_walk(truth: Array, residuals: Array) -> bool:
    """Whether residuals (n, 3) of a fit to truths (n, 3) go as those of a bias that walks."""
    if len(truth) - 4 < FEWEST_JUDGED:
        return False
    design = _design_of(truth.tobytes())
    against = design.walks[WALKS.index(AGAINST)]
    return bool(_test(residuals.T @ design.directions, against.left) > design.limit)


def walk_widening(truth: Array, residuals: Array) -> Array:
    """Factors (3, 4), 1 or more, on the standard errors of bias and matrix row of each axis of readings.

    Parameters
    ----------
    truth, residuals : (n, 3)
    """
    if len(truth) - 4 < FEWEST_WIDENED or not float(np.sum(residuals**2)) > LEAST:
        return np.ones((3, 4))
    design = _design_of(truth.tobytes())
    shown = (residuals.T @ design.directions) ** 2
    degrees = shown.shape[1]
    scales = np.array([np.maximum(np.sum(shown / walk.left, axis=1), LEAST) for walk in design.walks])
    sizes = np.array([np.sum(np.log(walk.left)) for walk in design.walks])
    fits = -0.5 * degrees * np.log(scales).sum(axis=1) - 1.5 * sizes
    weights = np.exp(fits - fits.max()) * np.array(BELIEVED)
    weights /= weights.sum()
    variance = np.zeros((3, 4))
    for weight, scale, walk in zip(weights, scales, design.walks, strict=True):
        moved = residuals.T @ walk.gain.T
        variance += weight * (np.outer(scale, walk.variance) / (degrees - 2) + moved**2)
    white = np.outer(scales[0], design.variance) / (degrees - 2)
    return np.asarray(np.sqrt(np.maximum(variance / white, 1.0)))


def _test(shown: Array, left: Array) -> Array:
    """Statistic (...) of what least squares leaves (..., 3, d): large where it walks."""
    squares = shown**2 + LEAST
    return np.asarray(np.sum(np.log(np.sum(squares, axis=-1) / np.sum(squares / left, axis=-1)), axis=-1))


@functools.lru_cache(maxsize=16)
def _design_of(truths: bytes) -> _Design:
    """Design of truths (n, 3), given as their bytes."""
    truth = np.frombuffer(truths).reshape(-1, 3)
    count = len(truth)
    basis = np.column_stack([np.ones(count), truth])
    free = np.linalg.qr(basis, mode="complete")[0][:, 4:]
    walked = np.minimum.outer(np.arange(count), np.arange(count)).astype(np.float64)
    spread, axes = np.linalg.eigh(free.T @ walked @ free)
    walks = tuple(_walk_of(basis, 1.0 + r**2 * spread, np.eye(count) + r**2 * walked) for r in WALKS)
    draws = min(max(DRAWS // count, FEWEST_DRAWS), MOST_DRAWS)
    noise = np.random.default_rng(SEED).standard_normal((draws, 3, count - 4))
    limit = float(np.quantile(_test(noise, walks[WALKS.index(AGAINST)].left), 1.0 - CHANCE))
    return _Design(free @ axes, np.diag(np.linalg.inv(basis.T @ basis)).copy(), walks, limit)


def _walk_of(basis: Array, left: Array, cov: Array) -> _Walk:
    inverse = np.linalg.inv(cov)
    own = np.linalg.inv(basis.T @ inverse @ basis)
    return _Walk(left, own @ basis.T @ inverse, np.diag(own).copy())


def largest_widening(factors: Array) -> float:
    """The largest of the factors, for a certificate: 1 where nothing was seen."""
    return math.floor(100.0 * float(factors.max()) + 0.5) / 100.0
