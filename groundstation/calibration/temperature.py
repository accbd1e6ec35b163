"""Bias and matrix as polynomials in the temperature, for each axis its own.

b(T) = sum_p b_p (T - T_ref)^p and M(T) = sum_q M_q (T - T_ref)^q, linear in their coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.calibration.attitudes import least_squares, rank_of
from groundstation.survey.fusion.resolve import is_covariance
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
SHORTEST_SPAN = 10.0  # K; a slope from less is noise times a long lever


@dataclass(frozen=True, slots=True)
class TemperatureModel:
    """Coefficients ``bias`` (p + 1, 3) and ``matrix`` (q + 1, 3, 3) in powers of (T - ``reference``), K."""

    reference: float
    bias: Array
    matrix: Array

    def bias_at(self, temperature: Array) -> Array:
        """Bias (..., 3) at temperatures (...,)."""
        return np.tensordot(_powers(temperature - self.reference, len(self.bias)), self.bias, axes=1)

    def matrix_at(self, temperature: Array) -> Array:
        """Matrix (..., 3, 3) at temperatures (...,)."""
        return np.tensordot(_powers(temperature - self.reference, len(self.matrix)), self.matrix, axes=1)

    def correct(self, readings: Array, temperature: Array) -> Array:
        """True vectors (..., 3) of readings (..., 3): w = M(T)^-1 (G - b(T))."""
        difference = readings - self.bias_at(temperature)
        return np.asarray(
            np.linalg.solve(self.matrix_at(temperature), difference[..., np.newaxis])[..., 0], dtype=float
        )


@dataclass(frozen=True, slots=True)
class TemperatureFit:
    """A model with the standard errors of its coefficients, shaped like them, and the residuals (n, 3)."""

    model: TemperatureModel
    bias_std: Array
    matrix_std: Array
    residuals: Array
    condition: float

    def residual_rms(self) -> float:
        """Root mean square of the residuals, in the unit of the readings."""
        return float(np.sqrt(np.mean(self.residuals**2)))


def fit_temperature_polynomials(
    truth: Array,
    readings: Array,
    temperature: Array,
    reference: float = 25.0,
    bias_degree: int = 1,
    matrix_degree: int = 1,
    covs: Array | None = None,
) -> TemperatureFit:
    """Polynomials from attitudes at several temperatures.

    Parameters
    ----------
    truth, readings : (n, 3)
    temperature : (n,) C
    covs : (n, 3, 3) of the readings; None weighs all alike

    Raises
    ------
    CalibrationError
        When the record does not span temperatures, or attitudes and temperatures do not determine the coefficients.
    """
    _check(truth, readings, temperature, covs, bias_degree, matrix_degree)
    span = float(np.ptp(temperature))
    if max(bias_degree, matrix_degree) > 0 and span < SHORTEST_SPAN:
        raise CalibrationError(
            f"temperature: expected a record that spans {SHORTEST_SPAN} K or slopes of a datasheet, got {span:.3g} K"
        )
    basis = _basis(truth, temperature - reference, bias_degree, matrix_degree)
    scale = np.abs(basis).max(axis=0)
    scale[scale == 0.0] = 1.0
    if (rank := rank_of(basis / scale)) < basis.shape[1]:
        raise CalibrationError(
            f"temperature: expected a design of rank {basis.shape[1]}, got {rank}: every attitude must be held at"
            f" {max(bias_degree, matrix_degree) + 1} temperatures or more, {_held(temperature)} were recorded"
        )
    solved = least_squares(basis, scale, readings, covs)
    stds = np.sqrt(np.diag(solved.cov)).reshape(solved.coefficients.shape)
    bias, matrix = _split(solved.coefficients, bias_degree)
    bias_std, matrix_std = _split(stds, bias_degree)
    model = TemperatureModel(reference, bias, matrix)
    return TemperatureFit(model, bias_std, matrix_std, solved.residuals, solved.condition)


def from_datasheet(
    matrix: Array, bias: Array, reference: float, bias_slope: Array, scale_slope: Array
) -> TemperatureModel:
    """Model of a record at one temperature and the slopes of the maker.

    ``bias_slope`` (3,) is in the unit of the readings per K, ``scale_slope`` (3,) the relative change of an axis per K.
    """
    return TemperatureModel(reference, np.stack([bias, bias_slope]), np.stack([matrix, np.diag(scale_slope) @ matrix]))


def _powers(difference: Array, count: int) -> Array:
    return np.asarray(difference[..., np.newaxis] ** np.arange(count), dtype=np.float64)


def _basis(truth: Array, difference: Array, bias_degree: int, matrix_degree: int) -> Array:
    """Columns (n, p + 1 + 3 (q + 1)): the powers of the bias, then truth times each power of the matrix."""
    by_matrix = np.einsum("nq,nj->nqj", _powers(difference, matrix_degree + 1), truth)
    return np.column_stack([_powers(difference, bias_degree + 1), by_matrix.reshape(len(truth), -1)])


def _split(coefficients: Array, bias_degree: int) -> tuple[Array, Array]:
    """Coefficients (k, 3) as those of the bias (p + 1, 3) and of the matrix (q + 1, 3, 3)."""
    columns = coefficients[bias_degree + 1 :].reshape(-1, 3, 3)
    return coefficients[: bias_degree + 1], np.swapaxes(columns, 1, 2).copy()


def _held(temperature: Array) -> int:
    """Number of temperatures that are at least 1 K apart."""
    return 1 + int(np.sum(np.diff(np.sort(temperature)) > 1.0))


def _check(
    truth: Array, readings: Array, temperature: Array, covs: Array | None, bias_degree: int, matrix_degree: int
) -> None:
    shapes = (truth.shape, readings.shape, temperature.shape)
    if truth.ndim != 2 or not len(truth) or shapes != ((len(truth), 3), (len(truth), 3), (len(truth),)):
        raise CalibrationError(f"temperature: expected (n, 3), (n, 3) and (n,), got {shapes}")
    if not all(np.all(np.isfinite(values)) for values in (truth, readings, temperature)):
        raise CalibrationError("temperature: expected finite truth, readings and temperatures, got some that are not")
    if bias_degree < 0 or matrix_degree < 0:
        raise CalibrationError(f"temperature: expected degrees of 0 or more, got {bias_degree} and {matrix_degree}")
    if covs is not None and (covs.shape != (len(truth), 3, 3) or not is_covariance(covs)):
        raise CalibrationError("temperature: expected a positive definite (3, 3) of each reading, got some that is not")
