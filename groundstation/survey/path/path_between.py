"""How far a hole may be off the arc of minimum curvature between two stations, because its curvature wanders there.

The directions at both ends are known; the arc between them is the one of even curvature. With a curvature kappa(s) over
a leg h, the offset at a place s of the leg errs by

    y(s) = int_0^s (s - u) kappa du - s^2 / (2 h) int_0^h kappa du,

at the lower station by int (h/2 - u) kappa du, which has nothing in common with the change of direction: so minimum
curvature is the best estimate there, and the errors of two legs are as good as independent.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.path.curvature_process import curvature_response, process_step
from groundstation.survey.path.curvature_tendency import CurvatureTendency

Array = npt.NDArray[np.float64]
UNIT = np.diag([0.0, 0.0, 1.0])  # covariance of the state at the upper station, of a curvature of variance 1


def path_between(lengths: Array, size: float, correlation_length: float, part: float = 1.0) -> Array:
    """Variance (n,) of the position across the hole, on each axis, in legs that are surveyed at both ends (m^2).

    Parameters
    ----------
    lengths : (n,) m, of the legs
    size : rad/m, standard deviation of the curvature
    correlation_length : m, over which it is forgotten
    part : of the leg, from 0 at the upper station to 1 at the lower one
    """
    legs, places = np.unique(lengths, return_inverse=True)
    return np.array([size**2 * _of_leg(leg, correlation_length, part) for leg in legs.tolist()])[places]


def tendency_between(tendency: CurvatureTendency, lengths: Array, part: float = 1.0) -> Array:
    """Return ``path_between`` with what is known of a hole: the mean over all sizes and lengths.

    Jumps are in it as often as the directions of the hole show them, for a jump in a surveyed leg is seen at its end.
    """
    prior, found = tendency.prior, np.zeros(len(lengths))
    for length, weights in zip(prior.lengths.tolist(), tendency.weights.T, strict=True):
        found += float(weights @ prior.sizes**2) * path_between(lengths, 1.0, length, part)
    jumped = float(prior.jump_shares @ prior.jumps**2) * np.minimum(tendency.jumped * lengths / tendency.looked, 1.0)
    return found + jumped * lengths**4 * _of_jump(part)


def _of_leg(leg: float, correlation_length: float, part: float) -> float:
    """Variance for a curvature of variance 1."""
    if part <= 0.0 or leg <= 0.0:
        return 0.0
    step, noise = process_step(part * leg, correlation_length)
    at = step @ UNIT @ step.T + noise
    left = (1.0 - part) * leg
    onward = curvature_response(np.array([left]), correlation_length)[0, 1]
    turned = process_step(leg, correlation_length)
    whole = (turned[0] @ UNIT @ turned[0].T + turned[1])[1, 1]
    share = 0.5 * part**2 * leg
    return max(float(at[0, 0] - 2.0 * share * (at[0, 1] + onward * at[0, 2]) + share**2 * whole), 0.0)


def _of_jump(part: float) -> float:
    """Variance for a jump of 1 rad/m, somewhere in a leg of 1 m: the mean of y^2 over its place."""
    places, weights = np.polynomial.legendre.leggauss(12)
    before = 0.5 * part * (places + 1.0)  # places up to the part; beyond them the jump is in the direction alone
    after = part + 0.5 * (1.0 - part) * (places + 1.0)
    share = 0.5 * part**2
    first = 0.5 * (part - before) ** 2 - share * (1.0 - before)
    second = -share * (1.0 - after)
    return float(0.5 * part * weights @ first**2 + 0.5 * (1.0 - part) * weights @ second**2)
