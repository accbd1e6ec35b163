"""The path between stations as a random process: a curvature that wanders and is forgotten over a length.

Across the hole, for each of two axes, with the measured depth s, an offset x (m), a direction theta (rad) and a
curvature kappa (rad/m) follow

    dx = theta ds,    dtheta = kappa ds,    dkappa = -kappa ds / l + sigma sqrt(2 / l) dW,

so that kappa is an Ornstein-Uhlenbeck process of standard deviation sigma and correlation length l.
Source: Uhlenbeck and Ornstein, Phys. Rev. 36 (1930); integrated twice as a linear system.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
OFFSET, DIRECTION, CURVATURE = range(3)  # of the state of one axis
NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)  # of a smooth integrand: exact to rounding up to forty lengths
SMALL = 0.5  # of length over correlation length, below which the response is summed as a series
EXPONENTS = np.arange(2.0, 14.0)  # of that series
COEFFICIENTS = np.array([(-1.0) ** k / math.factorial(k) for k in range(2, 14)])


@lru_cache(maxsize=4096)
def process_step(length: float, correlation_length: float) -> tuple[Array, Array]:
    """How the state of one axis goes on over a leg, and the noise that is added, for a curvature of variance 1.

    Parameters
    ----------
    length : m, of the leg, not negative
    correlation_length : m, over which a curvature is forgotten

    Returns
    -------
    (3, 3) transition F and (3, 3) covariance Q of (offset, direction, curvature): state' = F state + noise; neither
    is to be written to.
    """
    by_curvature = curvature_response(np.array([length]), correlation_length)[0]
    transition = np.array([[1.0, length, by_curvature[0]], [0.0, 1.0, by_curvature[1]], [0.0, 0.0, by_curvature[2]]])
    places, weights = 0.5 * length * (NODES + 1.0), 0.5 * length * WEIGHTS
    response = curvature_response(places, correlation_length)
    noise = 2.0 / correlation_length * np.einsum("k,ki,kj->ij", weights, response, response)
    return transition, noise


def curvature_response(lengths: Array, correlation_length: float) -> Array:
    """What a curvature of 1 comes to after lengths (n,), m: offset, direction and curvature (n, 3)."""
    u = lengths / correlation_length
    left = np.exp(-u)
    direction = -np.expm1(-u)
    powers = np.where(u < SMALL, u, 0.0)
    series = powers[:, None] ** EXPONENTS @ COEFFICIENTS  # e^-u - 1 + u
    offset = np.where(u < SMALL, series, u - direction)
    return np.stack([correlation_length**2 * offset, correlation_length * direction, left], axis=1)
