"""Tubes that have looked once: their bias and tilt left out of the equations while an adjustment is on its way.

At the first stop of a string every tube has one look. Its bias and the tilt of its mount are in that look alone, so
they are as good as noise of it: eliminated first they leave a look of another weight, and of six unknowns of the tube
one. A step of all others is the same to the last digits, and theirs follows from what the look leaves. What the
adjustment comes to has them all again: its last steps are those of the whole equations.
Source: block elimination; Koch, "Parameter Estimation and Hypothesis Testing in Linear Models", Springer (1999), 1.1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Linearised
from groundstation.survey.adjustment.looks import OF_TUBE, TURN, Looks, StringPrior

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
OWN = slice(2, 2 + TURN)  # bias and tilt, of the unknowns of a look
SHARE = 0.5  # of all tubes that have looked once, from which on it is worth to leave them out


@dataclass(frozen=True, slots=True)
class LoneLooks:
    """The looks of tubes that have looked once.

    Parameters
    ----------
    rows, tubes : (q,) of them
    kept : (p',) places of what stations have in common without bias and tilt of these tubes
    places, gravity_at : of tubes (m, 6) and of gravity among the kept, see ``Linearised``
    rigid : (q, 5), information on bias and tilt before the look
    """

    rows: Places
    tubes: Places
    kept: Places
    places: Places
    gravity_at: int
    rigid: Array

    def put_into_weights(self, linear: Linearised, tubes: Array) -> tuple[Linearised, Array]:
        """Looks whose noise has bias and tilt in it, and by how much (q, 5, 3) these go with what such a look leaves.

        Parameters
        ----------
        linear : all looks
        tubes : (m, 6), where bias, tilt and turn of all tubes stand
        """
        by_own, weights = linear.jacobians[self.rows, :, OWN], linear.weights[self.rows]
        weighed = weights @ by_own
        whole = np.swapaxes(by_own, 1, 2) @ weighed + self.rigid[:, :, None] * np.eye(TURN)
        gains = np.linalg.solve(whole, np.swapaxes(weighed, 1, 2))
        left = np.eye(3) - by_own @ gains
        jacobians, whole_weights, residuals = linear.jacobians.copy(), linear.weights.copy(), linear.residuals.copy()
        jacobians[self.rows, :, OWN] = 0.0
        # as a sum of squares: what is left of a weight is a small part of it
        whole_weights[self.rows] = np.swapaxes(left, 1, 2) @ weights @ left + np.swapaxes(gains, 1, 2) @ (
            self.rigid[:, :, None] * gains
        )
        residuals[self.rows] += (by_own @ tubes[self.tubes, :TURN, None])[:, :, 0]
        made = replace(
            linear, jacobians=jacobians, weights=whole_weights, residuals=residuals, places=self.places,
            gravity_at=self.gravity_at,
        )  # fmt: skip
        return made, np.asarray(gains, np.float64)

    def whole_step(self, step: Array, gains: Array, left: Array, tubes: Array) -> Array:
        """Step (p,) of all that stations have in common, from that (p',) of what was kept and what looks (n, 3) leave.

        Parameters
        ----------
        gains, tubes : see ``put_into_weights``
        """
        found = np.empty(len(step) + self.rigid.size)
        found[self.kept] = step
        own = (gains @ left[self.rows, :, None])[:, :, 0]
        found[OF_TUBE * self.tubes[:, None] + np.arange(TURN)] = own - tubes[self.tubes, :TURN]
        return found


def lone_looks(looks: Looks, string: StringPrior, known: Array) -> LoneLooks | None:
    """The looks of tubes that have looked once; None where these are few.

    Parameters
    ----------
    known : (p, p), information on what stations have in common before any look
    """
    is_alone = np.bincount(looks.tube, minlength=string.count) == 1
    if np.sum(is_alone) < SHARE * string.count:
        return None
    rows = np.flatnonzero(is_alone[looks.tube])
    tubes = looks.tube[rows]
    is_kept = np.ones(len(known), bool)
    own = OF_TUBE * tubes[:, None] + np.arange(TURN)
    is_kept[own] = False
    place = np.cumsum(is_kept) - 1
    places = place[: OF_TUBE * string.count].reshape(-1, OF_TUBE).copy()
    places[is_alone] = places[is_alone, TURN:]
    return LoneLooks(rows, tubes, np.flatnonzero(is_kept), places, int(place[places.size]), np.diag(known)[own])
