"""Weighted least squares of bias and matrix over any set of attitudes.

Y = H x + n, x = [bx by bz Mxx Mxy Mxz Myx Myy Myz Mzx Mzy Mzz], H_i = [I3, kron(I3, f_i^T)], weights R^-1. The drill
head on a robot arm presets pitch and roll; the true vectors are then in g. Source: AHRS-calibration paper, eqs. 13-15.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.calibration.coverage import COVERAGE, coverage_factor
from groundstation.calibration.jig import Combined, Jig, combined_uncertainty, settings_of
from groundstation.survey.fusion.resolve import is_covariance
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
RANK_TOLERANCE = 1e-5  # of the largest singular value; below it a preset decides by its rounding
YAW_STEPS = 50
CANDIDATES = {  # pitch and roll (deg) an arm can be sent to, in the order in which they are asked for
    "home (pitch 0, roll 0)": (0.0, 0.0),
    "pitch 0, roll 90 deg": (0.0, 90.0),
    "pitch 0, roll -90 deg": (0.0, -90.0),
    "pitch 90 deg, roll 0": (90.0, 0.0),
    "pitch -90 deg, roll 0": (-90.0, 0.0),
    "pitch 0, roll 180 deg": (0.0, 180.0),
}


@dataclass(frozen=True, slots=True)
class LeastSquares:
    """Least squares of readings = basis @ coefficients: ``coefficients`` (k, 3), ``cov`` (3 k, 3 k) row-major of them.

    ``condition`` is of the basis; ``levers`` (n,) is the largest gain of one reading on any coefficient.
    """

    coefficients: Array
    cov: Array
    residuals: Array
    condition: float
    rank: int
    levers: Array


@dataclass(frozen=True, slots=True)
class AttitudeFit:
    """Bias (3,) and matrix (3, 3) of an attitude set.

    ``cov`` (12, 12) is in the order of x above; ``residuals`` (n, 3) in the unit of the readings; ``rank`` of 4 and
    ``condition`` are of the rows [1, f / max |f|]; ``levers`` (n,) says how far one unit of an attitude's reading moves
    a parameter. ``yaw`` (rad) turns the rig's truth into the frame the matrix refers to; 0 unless it was free.
    """

    matrix: Array
    bias: Array
    cov: Array
    residuals: Array
    condition: float
    rank: int
    levers: Array
    yaw: float = 0.0
    yaw_std: float = 0.0
    degrees: int | None = None  # of freedom of each axis; None where the readings' covariances were known
    combined: Combined | None = None  # of b, then the columns of M, where the jig's errors were stated

    def coverage_factor(self, coverage: float = COVERAGE) -> float:
        """Standard errors on either side of a parameter within which it lies with a probability of ``coverage``.

        Student's t where the noise was estimated from the residuals: 4.30 on two degrees of freedom, 1.96 on many.
        """
        return coverage_factor(self.degrees, coverage)

    def bias_std(self) -> Array:
        """Standard errors (3,) of the bias."""
        return np.sqrt(np.diag(self.cov)[:3]) if self.combined is None else self.combined.std[0]

    def matrix_std(self) -> Array:
        """Standard errors (3, 3) of the matrix."""
        return np.sqrt(np.diag(self.cov)[3:]).reshape(3, 3) if self.combined is None else self.combined.std[1:].T

    def bias_expanded(self) -> Array:
        """Half widths (3,) of the intervals of the bias that hold 95 %."""
        return self.coverage_factor() * self.bias_std() if self.combined is None else self.combined.expanded[0]

    def matrix_expanded(self) -> Array:
        """Half widths (3, 3) of the intervals of the matrix that hold 95 %."""
        return self.coverage_factor() * self.matrix_std() if self.combined is None else self.combined.expanded[1:].T

    def residual_rms(self) -> float:
        """Root mean square of the residuals, in the unit of the readings."""
        return float(np.sqrt(np.mean(self.residuals**2)))


def true_vectors(pitch: Array, roll: Array) -> Array:
    """Truth (n, 3) in g of presets (n,) rad: x = sin p, y = cos p sin r, z = cos p cos r."""
    return np.stack([np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)], axis=-1)


def fit_attitudes(
    truth: Array,
    readings: Array,
    covs: Array | None = None,
    jig: Jig | None = None,
    settings: npt.NDArray[np.intp] | None = None,
) -> AttitudeFit:
    """Bias and matrix from any set of attitudes.

    Parameters
    ----------
    truth : (n, 3) true rate or specific force
    readings : (n, 3)
    covs : (n, 3, 3) of the readings; None weighs all alike and takes the noise of each axis from its residuals
    jig : its errors, common to readings of one setting; with ``covs`` it is not asked for
    settings : (n,) number of the setting of each reading; those of one attitude by default

    Raises
    ------
    CalibrationError
        When the attitudes do not determine bias and matrix (it names those that are missing), or numbers do not fit.
    """
    _check_observations(truth, readings, covs)
    size = float(np.linalg.norm(truth, axis=1).max())
    basis = np.column_stack([np.ones(len(truth)), truth])
    scale = np.array([1.0, size, size, size]) if size > 0.0 else np.ones(4)
    rank = rank_of(basis / scale)
    if rank < 4:
        raise CalibrationError(f"attitudes: expected a design of rank 4, got {rank} of 4: {_missing(basis / scale)}")
    solved = least_squares(basis, scale, readings, covs)
    # Coefficients come as [b, columns of M], x wants the rows of M.
    order = np.concatenate([np.arange(3), 3 + np.arange(9).reshape(3, 3).T.ravel()])
    matrix = solved.coefficients[1:].T.copy()
    combined = None
    if jig is not None and covs is None:
        settings = settings_of(truth) if settings is None else settings
        combined = combined_uncertainty(basis, solved.residuals, truth, matrix, settings, jig)
    return AttitudeFit(
        matrix=matrix,
        bias=solved.coefficients[0],
        cov=solved.cov[np.ix_(order, order)],
        residuals=solved.residuals,
        condition=solved.condition,
        rank=solved.rank,
        levers=solved.levers,
        degrees=len(truth) - 4 if covs is None else None,
        combined=combined,
    )


def fit_free_yaw(truth: Array, readings: Array, like: Array, covs: Array | None = None) -> AttitudeFit:
    """Bias, matrix and the yaw of the rig: readings = b + K Rz(yaw) truth, with K nearest to ``like`` in x and y.

    A full matrix swallows any yaw, so one sensor cannot separate the two and the residuals are those of
    ``fit_attitudes``: what fixes the yaw is ``like`` (3, 3), the matrix of an earlier calibration or of the mounting.
    Only its first two rows and columns count; an entry that is NaN is not known and does not count either.

    Raises
    ------
    CalibrationError
        As ``fit_attitudes``, and when ``like`` does not determine a yaw.
    """
    fixed = fit_attitudes(truth, readings, covs)
    known = np.zeros((3, 3), dtype=bool)
    known[:2, :2] = np.isfinite(like[:2, :2])
    yaw = _nearest_yaw(fixed.matrix, like, known)
    back = _turn(-yaw)
    by_yaw = _by_yaw(fixed.matrix, yaw)
    weight = np.where(known, by_yaw, 0.0).ravel()
    turned = np.kron(np.eye(3), back.T)
    yaw_by_matrix = -(weight @ turned) / (weight @ weight)
    jacobian = np.eye(12)
    jacobian[3:, 3:] = turned + np.outer(by_yaw.ravel(), yaw_by_matrix)
    return AttitudeFit(
        matrix=fixed.matrix @ back,
        bias=fixed.bias,
        cov=jacobian @ fixed.cov @ jacobian.T,
        residuals=fixed.residuals,
        condition=fixed.condition,
        rank=fixed.rank,
        levers=fixed.levers,
        yaw=yaw,
        yaw_std=math.sqrt(float(yaw_by_matrix @ fixed.cov[3:, 3:] @ yaw_by_matrix)),
        degrees=fixed.degrees,
    )


def least_squares(basis: Array, scale: Array, readings: Array, covs: Array | None) -> LeastSquares:
    """Weighted least squares of readings (n, 3) = basis (n, k) @ coefficients (k, 3).

    ``scale`` (k,) divides the columns, so that condition and rounding do not depend on units. The rank is the caller's
    to check. The normal matrix is never formed.

    Raises
    ------
    CalibrationError
        When neither ``covs`` nor a reading more than unknowns is there to estimate the noise from.
    """
    n, k = basis.shape
    if covs is None and n <= k:
        raise CalibrationError(f"least squares: expected covariances or {k + 1} readings or more, got {n} of an axis")
    scaled = basis / scale
    values = np.linalg.svd(scaled, compute_uv=False)
    roots = np.broadcast_to(np.eye(3), (n, 3, 3)) if covs is None else np.linalg.cholesky(covs)
    design = np.einsum("nk,ij->nikj", scaled, np.eye(3)).reshape(n, 3, 3 * k)
    q, r = np.linalg.qr(np.linalg.solve(roots, design).reshape(3 * n, 3 * k))
    white = np.linalg.solve(roots, readings[..., np.newaxis]).reshape(3 * n)
    coefficients = np.linalg.solve(r, q.T @ white).reshape(k, 3) / scale[:, np.newaxis]
    residuals = readings - basis @ coefficients
    inverse = np.linalg.inv(r) / np.repeat(scale, 3)[:, np.newaxis]
    cov = inverse @ inverse.T
    if covs is None:
        # Equal weights keep the sensor's axes apart, so each has a noise of its own.
        noise_std = np.tile(np.sqrt(np.sum(residuals**2, axis=0) / (n - k)), k)
        cov = cov * np.outer(noise_std, noise_std)
    levers = np.abs(np.linalg.pinv(scaled)).max(axis=0)
    return LeastSquares(coefficients, cov, residuals, float(values[0] / values[-1]), rank_of(scaled), levers)


def rank_of(basis: Array) -> int:
    """Numerical rank of a scaled basis (n, k)."""
    values = np.linalg.svd(basis, compute_uv=False)
    return int(np.sum(values > RANK_TOLERANCE * values[0]))


def _check_observations(truth: Array, readings: Array, covs: Array | None) -> None:
    if truth.ndim != 2 or truth.shape[1:] != (3,) or not len(truth) or readings.shape != truth.shape:
        raise CalibrationError(f"attitudes: expected (n, 3) truth and readings, got {truth.shape} and {readings.shape}")
    if not (np.all(np.isfinite(truth)) and np.all(np.isfinite(readings))):
        bad = int(np.flatnonzero(~np.all(np.isfinite(truth) & np.isfinite(readings), axis=1))[0])
        raise CalibrationError(f"attitudes: expected finite numbers, got {readings[bad].tolist()} at attitude {bad}")
    if covs is not None and (covs.shape != (len(truth), 3, 3) or not is_covariance(covs)):
        raise CalibrationError(f"attitudes: expected a positive definite (3, 3) of each reading, got {covs.tolist()}")


def _missing(basis: Array) -> str:
    """Names of the presets that would complete a design, the first of the candidates that help."""
    names = []
    for name, preset in CANDIDATES.items():
        pitch, roll = np.radians(preset)
        row = np.concatenate([[1.0], true_vectors(pitch, roll)])
        larger = np.vstack([basis, row])
        if rank_of(larger) > rank_of(basis):
            names.append(name)
            basis = larger
    return f"add the attitude{'s' if len(names) > 1 else ''} {'; '.join(names)}"


def _turn(yaw: float) -> Array:
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _by_yaw(matrix: Array, yaw: float) -> Array:
    """Derivative of matrix Rz(-yaw)."""
    c, s = math.cos(yaw), math.sin(yaw)
    slope = np.array([[-s, c, 0.0], [-c, -s, 0.0], [0.0, 0.0, 0.0]])
    return np.asarray(matrix @ slope)


def _nearest_yaw(matrix: Array, like: Array, known: npt.NDArray[np.bool_]) -> float:
    """Yaw that brings matrix Rz(-yaw) nearest to the known entries of ``like``, by Gauss-Newton."""
    target = np.where(known, like, 0.0)
    # With every entry known this is the answer; otherwise it is near enough to start from.
    yaw = math.atan2(float(np.sum(target * _by_yaw(matrix, 0.0))), float(np.sum(target * np.where(known, matrix, 0.0))))
    for _ in range(YAW_STEPS):
        slope = np.where(known, _by_yaw(matrix, yaw), 0.0)
        curvature = float(np.sum(slope**2))
        if curvature == 0.0 or not np.any(target):
            break
        step = float(np.sum(slope * (matrix @ _turn(-yaw) - target))) / curvature
        yaw -= step
        if abs(step) < 1e-13:
            return math.remainder(yaw, 2.0 * math.pi)
    raise CalibrationError(f"yaw: expected a matrix that tells x from y, got {like.tolist()}")
