"""What the errors of a jig do to a calibration: known in size, common to all readings of one setting, and not noise.

A jig that is off by a small turn d shows the sensor d x f more than the truth f, so its readings M (d x f). The
residuals hold noise and jig together: what the jig leaves in them is taken from their variance, and the intervals are
those that hold at whatever noise is left (``intervals``).
Source: JCGM 100:2008 (GUM), 4.3 and annex G.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.calibration.coverage import COVERAGE
from groundstation.calibration.intervals import Spread, coverage_interval
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
UNREACHED = 1e-9  # of the jig's variance of all readings, below which it does not reach a direction


@dataclass(frozen=True, slots=True)
class Jig:
    """Standard deviations (rad) of a jig's attitude: common to all readings of one setting, and of each reading."""

    common: float
    random: float

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises
        ------
        CalibrationError
            When one is negative or not a number.
        """
        if not (0.0 <= self.common < math.inf and 0.0 <= self.random < math.inf):
            raise CalibrationError(
                f"jig: expected two standard deviations, got {self.common:g} and {self.random:g} rad"
            )


@dataclass(frozen=True, slots=True)
class Combined:
    """Standard errors and half widths (k, 3) of the intervals of coefficients (k, 3).

    ``refuted`` (3,) is whether the residuals of an axis are too small for the jig as it is stated.
    """

    std: Array
    expanded: Array
    refuted: npt.NDArray[np.bool_]


def combined_uncertainty(
    basis: Array,
    residuals: Array,
    truth: Array,
    matrix: Array,
    settings: npt.NDArray[np.intp],
    jig: Jig,
    coverage: float = COVERAGE,
) -> Combined:
    """Uncertainty of least squares of readings (n, 3) = basis (n, k) @ coefficients under noise and a jig's errors.

    Parameters
    ----------
    truth : (n, 3) in the units of the design
    matrix : (3, 3) of the sensor
    settings : (n,) number of the setting of each reading, whose common error is one
    """
    n, k = basis.shape
    gain = np.linalg.pinv(basis)
    shown = reading_errors(truth, matrix, settings, jig)
    spreads = spreads_of(basis, shown)
    squares = np.sum(residuals**2, axis=0)
    std, expanded, refuted = np.empty((k, 3)), np.empty((k, 3)), np.zeros(3, np.bool_)
    left = np.eye(n) - basis @ gain
    least = np.einsum("mn,nimi->i", left, shown) / (n - k)
    for row, axis in np.ndindex(k, 3):
        spread = spreads[row][axis]
        noise = max(float(squares[axis]) / (n - k) - float(least[axis]), 0.0)
        std[row, axis] = math.sqrt(spread.by_noise * noise + spread.by_jig)
        interval = coverage_interval(spread, coverage)
        expanded[row, axis] = interval.half_width(squares[axis])
        refuted[axis] |= interval.is_refuted_by(squares[axis])
    return Combined(std, expanded, refuted)


def spreads_of(basis: Array, shown: Array) -> list[list[Spread]]:
    """Spread of each coefficient (k, 3) of a basis (n, k); ``shown`` (n, 3, n, 3): covariance by the jig."""
    n, k = basis.shape
    gain = np.linalg.pinv(basis)
    left = np.eye(n) - basis @ gain
    spreads: list[list[Spread]] = [[] for _ in range(k)]
    for axis in range(3):
        cov = shown[:, axis, :, axis]
        whole = float(np.trace(cov))
        values, directions = np.linalg.eigh(left @ cov @ left)
        reached = values > max(UNREACHED * whole, 1e-300)
        for row in range(k):
            by_noise, by_jig = float(gain[row] @ gain[row]), float(gain[row] @ cov @ gain[row])
            by_jig = by_jig if by_jig > UNREACHED**2 * by_noise * whole else 0.0
            common = gain[row] @ cov @ directions[:, reached]
            spreads[row].append(Spread(by_noise, by_jig, values[reached], common, n - k))
    return spreads


def settings_of(truth: Array) -> npt.NDArray[np.intp]:
    """Number (n,) of the setting of each reading: those with one truth (n, 3) share it."""
    return np.unique(np.round(truth, 9) + 0.0, axis=0, return_inverse=True)[1].ravel()


def reading_errors(truth: Array, matrix: Array, settings: npt.NDArray[np.intp], jig: Jig) -> Array:
    """Covariance (n, 3, n, 3) of the readings of a sensor that a jig turns by errors."""
    turned = -matrix @ cross_product_matrices(truth)  # (n, 3, 3) of a turn
    together = jig.common**2 * (settings[:, None] == settings[None, :]) + jig.random**2 * np.eye(len(truth))
    return np.asarray(np.einsum("mn,mia,nja->minj", together, turned, turned))


def cross_product_matrices(vectors: Array) -> Array:
    """Matrices (n, 3, 3) of v x."""
    x, y, z = vectors.T
    o = np.zeros_like(x)
    return np.stack([np.stack(row, axis=-1) for row in ((o, -z, y), (z, o, -x), (-y, x, o))], axis=-2)
