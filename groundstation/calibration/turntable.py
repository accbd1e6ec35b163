"""Basic alignment on a turn table: two rotations about each axis.

The sensor reads G = M w + b, with M scale and misalignment, b the bias and w the true rate or true specific force.
Source: thesis Tables III.1-III.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from telemetry.calibration import check_invertible
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
SETTINGS = np.tile(np.arange(3), 2)  # of ``as_observations``: an axis is set up once and turned both ways


@dataclass(frozen=True, slots=True)
class Alignment:
    """Matrix (3, 3) and bias (3,) of G = M w + b.

    ``residuals`` (3, 3), row = turned axis: the bias that axis alone shows minus their mean, the only redundancy here.
    """

    matrix: Array
    bias: Array
    residuals: Array

    def residual_rms(self) -> float:
        """Root mean square of the residuals, in the unit of the readings."""
        return float(np.sqrt(np.mean(self.residuals**2)))


def turntable_alignment(positive: Array, negative: Array, reference: float) -> Alignment:
    """Matrix and bias from two rotations per axis.

    M[s, r] = (T[r, s, +] - T[r, s, -]) / (2 ref) and b[s] = mean over r of (T[r, s, +] + T[r, s, -]) / 2.

    Parameters
    ----------
    positive, negative : (3, 3), row r = the axis that is turned, column s = the sensor's axis, unit of the reference
    reference : true rate, or true specific force of the axis up, of the positive runs

    Raises
    ------
    CalibrationError
        When the reference is not positive, or the three responses are not independent.
    """
    if not (np.isfinite(reference) and reference > 0.0):
        raise CalibrationError(f"turn table: expected a positive reference, got {reference}")
    if positive.shape != (3, 3) or negative.shape != (3, 3):
        raise CalibrationError(f"turn table: expected (3, 3) readings, got {positive.shape} and {negative.shape}")
    # Rows of the table are turned axes and rows of M are sensor axes: this is the transpose that is easily forgotten.
    matrix = ((positive - negative) / (2.0 * reference)).T
    biases = (positive + negative) / 2.0
    bias = biases.mean(axis=0)
    check_invertible(matrix)
    return Alignment(matrix, bias, biases - bias)


def correct_readings(readings: Array, matrix: Array, bias: Array) -> Array:
    """True vectors (..., 3) of readings (..., 3): w = M^-1 (G - b)."""
    return np.asarray(np.linalg.solve(matrix, (readings - bias)[..., np.newaxis])[..., 0], dtype=np.float64)


def as_observations(positive: Array, negative: Array, reference: float) -> tuple[Array, Array]:
    """Truth (6, 3) and readings (6, 3) of a table, for the estimators that take any set of attitudes."""
    truth = reference * np.eye(3)
    return np.concatenate([truth, -truth]), np.concatenate([positive, negative])
