"""How good a forecast was, once it is known what came: the continuous ranked probability score of a mixture."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from groundstation.survey.path.normal_mixture import NormalMixture

Array = npt.NDArray[np.float64]
ROOT_TWO_PI = math.sqrt(2.0 * math.pi)
LEAST = 1e-12  # m, of a standard deviation


def score_forecast(mixture: NormalMixture, came: Array) -> float:
    """Continuous ranked probability score (m) of where it came to (2,), mean of the two axes; 0 is the best.

    Of a forecast that is one place it is the distance from there along each axis.
    Source: Grimit, Gneiting, Berrocal and Johnson, Q. J. R. Meteorol. Soc. 132 (2006), eq. 5.
    """
    stds = np.sqrt(np.diagonal(mixture.covs, axis1=1, axis2=2))
    pairs = np.multiply.outer(mixture.weights, mixture.weights)
    total = 0.0
    for mean, std, at in zip(mixture.means.T, stds.T, came.tolist(), strict=True):
        apart = mean_distance(mean[:, None] - mean, np.hypot(std[:, None], std))
        total += float(mixture.weights @ mean_distance(at - mean, std)) - 0.5 * float((pairs * apart).sum())
    return 0.5 * total


def mean_distance(means: Array, stds: Array) -> Array:
    """Mean of |x| of normals."""
    stds = np.maximum(stds, LEAST)
    ratio = means / stds
    density = np.exp(-0.5 * ratio * ratio) / ROOT_TWO_PI
    return np.asarray(2.0 * stds * density + means * (2.0 * ndtr(ratio) - 1.0))
