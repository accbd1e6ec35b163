"""What the errors of a jig do to a calibration: known in size, common to all readings of one setting, and not noise.

A jig that is off by a small turn d shows the sensor d x f more than the truth f, so its readings M (d x f). The
residuals hold noise and jig together: their variance T is at least what the jig alone leaves in them, t, and given the
residuals is distributed as RSS / chi^2 above that (Student's distribution where there is no jig). A parameter's
variance is (T - t) a + b, a of the noise and b of the jig; the interval is that of the mixture over T. Few residuals
cannot tell noise from jig: the weight ((T - t) / T)^-0.7 towards little noise keeps the intervals at 93 to 97 % where
the two are alike, and at 98 % on five degrees of freedom where nearly all is the jig's.
Source: JCGM 100:2008 (GUM), 4.3 and annex G; Gelman et al., Bayesian Data Analysis, 3.2, for T.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.calibration.coverage import COVERAGE
from groundstation.calibration.errors import CalibrationError

Array = npt.NDArray[np.float64]
POINTS = 500  # of the distribution of the noise
LEAST = 1e-10  # of chi^2, below which the noise is not followed
NEAR = 0.7  # towards little noise
STEPS = np.linspace(0.0, 8.0, 4001)  # standard deviations
INSIDE = np.array([math.erf(step / math.sqrt(2.0)) for step in STEPS])


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
    """Standard errors and half widths (k, 3) of the intervals of coefficients (k, 3)."""

    std: Array
    expanded: Array


def combine(
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
    least = np.einsum("mn,nimi->i", np.eye(n) - basis @ gain, shown) / (n - k)
    squares = np.sum(residuals**2, axis=0)
    by_noise = np.repeat(np.diag(gain @ gain.T)[:, None], 3, axis=1)
    by_jig = np.einsum("am,mini,an->ai", gain, shown, gain)
    std = np.sqrt(by_noise * np.maximum(squares / (n - k) - least, 0.0) + by_jig)
    return Combined(std, half_widths(by_noise, by_jig, squares, least, n - k, coverage))


def half_widths(by_noise: Array, by_jig: Array, squares: Array, least: Array, degrees: int, coverage: float) -> Array:
    """Half widths (k, 3) of intervals that hold a parameter with a probability, the noise of each axis (3,) unknown.

    Parameters
    ----------
    by_noise, by_jig : (k, 3) variance for a noise of one, and by the jig
    squares, least : (3,) sum of squares of the residuals of an axis, and variance that the jig leaves in them
    """
    out = np.empty_like(by_noise)
    for axis in range(by_noise.shape[1]):
        scale = max(float(squares[axis]), float(least[axis]), 1e-300)
        noise = np.exp(np.linspace(math.log(1e-9 * scale), math.log(scale / LEAST), POINTS))
        whole = noise + least[axis]
        chi2 = squares[axis] / whole
        with np.errstate(divide="ignore"):
            share = np.exp(
                (1.0 - NEAR) * np.log(noise / whole) + 0.5 * (degrees * np.log(chi2 / degrees) - chi2 + degrees)
            )
        share /= np.sum(share)
        for row in range(len(by_noise)):
            sizes = np.sqrt(noise * by_noise[row, axis] + by_jig[row, axis])
            out[row, axis] = _held(sizes, share, coverage)
    return out


def _held(sizes: Array, share: Array, coverage: float) -> float:
    """Width within which a mixture of normals of standard deviations ``sizes`` lies with a probability."""
    low, high = 0.0, 10.0 * float(np.max(sizes))
    if high == 0.0:
        return 0.0
    while high - low > 1e-6 * high:
        middle = 0.5 * (low + high)
        within = float(share @ np.interp(middle / np.maximum(sizes, 1e-300), STEPS, INSIDE))
        low, high = (middle, high) if within < coverage else (low, middle)
    return 0.5 * (low + high)


def settings_of(truth: Array) -> npt.NDArray[np.intp]:
    """Number (n,) of the setting of each reading: those with one truth (n, 3) share it."""
    return np.unique(np.round(truth, 9) + 0.0, axis=0, return_inverse=True)[1].ravel()


def reading_errors(truth: Array, matrix: Array, settings: npt.NDArray[np.intp], jig: Jig) -> Array:
    """Covariance (n, 3, n, 3) of the readings of a sensor that a jig turns by errors."""
    turned = -matrix @ cross(truth)  # (n, 3, 3) of a turn
    together = jig.common**2 * (settings[:, None] == settings[None, :]) + jig.random**2 * np.eye(len(truth))
    return np.asarray(np.einsum("mn,mia,nja->minj", together, turned, turned))


def cross(vectors: Array) -> Array:
    """Matrices (n, 3, 3) of v x."""
    x, y, z = vectors.T
    o = np.zeros_like(x)
    return np.stack([np.stack(row, axis=-1) for row in ((o, -z, y), (z, o, -x), (-y, x, o))], axis=-2)
