"""An accelerometer from rests at attitudes that are not known: whatever way it lies, it feels gravity.

G = M f + b with |f| = g at every rest. A turn of all axes together is not seen, so inv(M) is upper triangular: the
sensor's z is its own, y lies in the plane of y and z. Nine parameters, by Gauss-Newton.
Source: Tedaldi, Pretto, Menegatti 2014, eqs. 3-10.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
PARAMETERS: Final = 9
FEWEST: Final = 12  # rests
STEPS: Final = 60
ENOUGH: Final = 1e-12  # of a step
LARGEST_CONDITION: Final = 60.0  # of the scaled design; rests on six faces and between have 3 to 8
ROWS, COLUMNS = np.array([0, 1, 2, 0, 0, 1]), np.array([0, 1, 2, 1, 2, 2])  # of an upper triangle


@dataclass(frozen=True, slots=True)
class GravityFit:
    """Matrix (3, 3) and bias (3,) of G = M f + b with standard errors, and residuals (n,) of |f|, m/s^2.

    ``left_out`` (n,): the residual of each rest by a fit to the half of the rests that it is not in.
    """

    matrix: Array
    bias: Array
    matrix_std: Array
    bias_std: Array
    residuals: Array
    left_out: Array
    condition: float

    def residual_rms(self) -> float:
        """Root mean square of the residuals, m/s^2."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    def left_out_rms(self) -> float:
        """The same of rests that the fit did not use."""
        return float(np.sqrt(np.mean(self.left_out**2)))


def fit_gravity_sphere(means: Array, gravity: float) -> GravityFit:
    """Accelerometer of the mean readings (n, 3) m/s^2 of rests; ``gravity`` in m/s^2.

    Raises
    ------
    CalibrationError
        When the rests are too few or lie too much alike.
    """
    if len(means) < FEWEST:
        raise CalibrationError(f"rests: expected {FEWEST} or more at different attitudes, got {len(means)}")
    values, jacobian = _solved(means, gravity)
    scaled = jacobian / np.linalg.norm(jacobian, axis=0)
    condition = float(np.linalg.cond(scaled))
    if not condition < LARGEST_CONDITION:
        raise CalibrationError(
            f"rests: expected attitudes that tell nine parameters apart, got a condition of {condition:.3g}; lay it on "
            "all six sides and between them"
        )
    residuals = _sizes(values, means) - gravity
    left_out = np.empty(len(means))
    for first in (0, 1):
        own = np.arange(len(means)) % 2 == first
        left_out[~own] = _sizes(_solved(means[own], gravity)[0], means[~own]) - gravity
    variance = float(np.sum(residuals**2)) / max(len(means) - PARAMETERS, 1)
    cov = variance * np.linalg.inv(jacobian.T @ jacobian)
    matrix: Array = np.linalg.inv(_triangle(values)).astype(np.float64)
    std = np.zeros((3, 3))
    for k in range(6):  # dM = -M dK M
        unit = np.zeros((3, 3))
        unit[ROWS[k], COLUMNS[k]] = math.sqrt(cov[k, k])
        std += (matrix @ unit @ matrix) ** 2
    return GravityFit(matrix, values[6:], np.sqrt(std), np.sqrt(np.diag(cov)[6:]), residuals, left_out, condition)


def _triangle(values: Array) -> Array:
    inverse = np.zeros((3, 3))
    inverse[ROWS, COLUMNS] = values[:6]
    return inverse


def _sizes(values: Array, means: Array) -> Array:
    return np.asarray(np.linalg.norm((means - values[6:]) @ _triangle(values).T, axis=1))


def _solved(means: Array, gravity: float) -> tuple[Array, Array]:
    """Parameters (9,) and the derivative (n, 9) of |f| by them."""
    values = np.concatenate([np.ones(3), np.zeros(6)])
    for _ in range(STEPS):
        inverse, shifted = _triangle(values), means - values[6:]
        force = shifted @ inverse.T
        sizes = np.linalg.norm(force, axis=1)
        unit = force / sizes[:, None]
        jacobian = np.column_stack([unit[:, ROWS] * shifted[:, COLUMNS], -unit @ inverse])
        step = np.linalg.lstsq(jacobian, gravity - sizes, rcond=None)[0]
        values = values + step
        if float(np.abs(step).max()) < ENOUGH:
            break
    return values, jacobian
