"""Ellipses and ellipsoids of a stated confidence from a covariance of positions. Frame: north, east, down; m."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError

Array = npt.NDArray[np.float64]
SINGULAR = 1e-14  # of the largest variance, below which a covariance has no volume


@dataclass(frozen=True, slots=True)
class Ellipse:
    """Semi-axes (m), largest first, and direction of the larger one (rad, from north, in [0, pi))."""

    major: float
    minor: float
    azimuth: float


def coverage_radius(probability: float, dimensions: int) -> float:
    """Standard deviations within which a Gaussian vector lies with a probability: the root of a chi-square quantile.

    Raises
    ------
    SurveyError
        When the probability is not between 0 and 1, or the dimensions are not 1, 2 or 3.
    """
    if not 0.0 < probability < 1.0 or dimensions not in (1, 2, 3):
        raise SurveyError(f"confidence: expected 0..1 in 1, 2 or 3 dimensions, got {probability} in {dimensions}")
    if dimensions == 1:
        return NormalDist().inv_cdf(0.5 * (1.0 + probability))
    if dimensions == 2:
        return math.sqrt(-2.0 * math.log1p(-probability))
    low, high = 0.0, 40.0
    while high - low > 1e-12:
        middle = 0.5 * (low + high)
        inside = math.erf(middle / math.sqrt(2.0)) - math.sqrt(2.0 / math.pi) * middle * math.exp(-0.5 * middle**2)
        low, high = (middle, high) if inside < probability else (low, middle)
    return low


def probability_of(sigma: float, dimensions: int) -> float:
    """Probability of a Gaussian vector to lie within ``sigma`` standard deviations.

    Raises
    ------
    SurveyError
        When the dimensions are not 1, 2 or 3.
    """
    if dimensions not in (1, 2, 3):
        raise SurveyError(f"confidence: expected 1, 2 or 3 dimensions, got {dimensions}")
    if dimensions == 1:
        return math.erf(sigma / math.sqrt(2.0))
    if dimensions == 2:
        return -math.expm1(-0.5 * sigma**2)
    return math.erf(sigma / math.sqrt(2.0)) - math.sqrt(2.0 / math.pi) * sigma * math.exp(-0.5 * sigma**2)


def plan_ellipse(cov: Array, sigma: float = 1.0) -> Ellipse:
    """Ellipse in plan of a covariance (3, 3) or (2, 2), ``sigma`` standard deviations large."""
    return plan_ellipses(cov[None], sigma)[0]


def plan_ellipses(covs: Array, sigma: float = 1.0) -> list[Ellipse]:
    """Return ``plan_ellipse`` of many covariances (n, 3, 3) or (n, 2, 2)."""
    values, vectors = np.linalg.eigh(covs[:, :2, :2])
    semi = sigma * np.sqrt(np.maximum(values, 0.0))
    azimuths = np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1]) % math.pi
    return [Ellipse(*row) for row in np.column_stack([semi[:, ::-1], azimuths]).tolist()]


def ellipsoid_axes(cov: Array, sigma: float = 1.0) -> tuple[Array, Array]:
    """Semi-axes (..., 3) of ellipsoids, largest first, and their directions (..., 3, 3), one a row."""
    values, vectors = np.linalg.eigh(cov)
    return sigma * np.sqrt(np.maximum(values[..., ::-1], 0.0)), np.swapaxes(vectors[..., ::-1], -1, -2).copy()


def hole_axes(inclination: float, azimuth: float) -> Array:
    """Highside, lateral (to the right of it) and along the hole: unit vectors (3, 3), one a row.

    Where the hole is vertical the highside is the direction of its azimuth, as in the industry's models.
    """
    si, ci, sa, ca = math.sin(inclination), math.cos(inclination), math.sin(azimuth), math.cos(azimuth)
    return np.array([[ci * ca, ci * sa, -si], [-sa, ca, 0.0], [si * ca, si * sa, ci]])


def ellipse_outline(cov: Array, sigma: float, points: int = 73) -> Array:
    """Closed outline (points, 2) of the ellipse of a covariance (2, 2)."""
    values, vectors = np.linalg.eigh(cov)
    angle = np.linspace(0.0, math.tau, points)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    return np.asarray((vectors @ (sigma * np.sqrt(np.maximum(values, 0.0))[:, None] * circle)).T)


def check_covariance(cov: Array, where: str) -> None:
    """Refuse a matrix that is not a covariance (k, k).

    Raises
    ------
    SurveyError
        When it is not finite, not symmetric, or has no extent in some direction (singular).
    """
    if not np.all(np.isfinite(cov)):
        raise SurveyError(f"{where}: expected a finite covariance, got {cov.tolist()}")
    if float(np.max(np.abs(cov - cov.T))) > 1e-9 * float(np.max(np.abs(cov))):
        raise SurveyError(f"{where}: expected a symmetric covariance, got {cov.tolist()}")
    values = np.linalg.eigvalsh(cov)
    if not values[0] > SINGULAR * values[-1]:
        raise SurveyError(
            f"{where}: the covariance is singular, its variances along its axes are "
            f"{', '.join(f'{value:.3g}' for value in values)} m^2; expected all of them positive"
        )
