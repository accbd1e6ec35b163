"""Of what the variance at the toe is made, source by source: exact, and they add up.

The error of a least-squares estimate with priors is linear in the errors of looks and priors, which are independent:
with g = Q w of a functional w, a look with the covariance C gives (W A g)^T C (W A g), and a prior with the information
P gives g^T P g. Summed they are w^T Q w, the variance of the functional.
Source: Koch, "Parameter Estimation and Hypothesis Testing in Linear Models", Springer (1999), 3.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum, auto

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.equations import KNOWN, path_equations, turn_places
from groundstation.survey.adjustment.looks import BIAS, OF_TUBE, TILT
from groundstation.survey.adjustment.run_of_stops import TurnCauses
from groundstation.survey.adjustment.toe_weights import moved_looks, toe_weights

Array = npt.NDArray[np.float64]


class ShareSource(StrEnum):
    """Where an error at the toe comes from."""

    FORCE_NOISE = auto()
    PLAY = auto()
    YAW_NOISE = auto()
    BIAS = auto()
    TILT = auto()
    TURN = auto()
    GRAVITY = auto()
    COLLAR = auto()
    PATH = auto()
    BLUNDER = auto()


@dataclass(frozen=True, slots=True)
class ErrorShare:
    """What one source gives.

    Parameters
    ----------
    source : it
    subject : the tube, or the place of a cause of turns or of a further effect; -1 of all, or of no named cause
    variances : (r,) of each functional; of the toe m^2 to north, east and down
    """

    source: ShareSource
    subject: int
    variances: Array


def toe_budget(found: Adjusted, causes: TurnCauses) -> list[ErrorShare]:
    """Shares of the variance of the toe to north, east and down, m^2."""
    return error_budget(found, toe_weights(found), causes)


def error_budget(found: Adjusted, weights: Array, causes: TurnCauses) -> list[ErrorShare]:
    """Shares of the variance of linear functionals of the directions.

    Parameters
    ----------
    found : the adjusted hole
    weights : (s + 1, 2, r), the functionals
    causes : of the turns of tubes; what ``StringPrior.turn_cov`` has beside them has no name
    """
    states, common = found.spread_of(weights)
    return [*_of_looks(found, moved_looks(found, states, common)), *_of_priors(found, states, common, causes)]


def _of_priors(found: Adjusted, states: Array, common: Array, causes: TurnCauses) -> list[ErrorShare]:
    collar, path = _of_path(found, states)
    return [
        *shares_of_string(found, common, causes),
        ErrorShare(ShareSource.COLLAR, -1, collar),
        ErrorShare(ShareSource.PATH, -1, path),
    ]


def shares_of_string(found: Adjusted, common: Array, causes: TurnCauses) -> list[ErrorShare]:
    """Shares of tubes, turns, gravity and blunders, by what functionals have in common (p, r)."""
    tubes = common[: OF_TUBE * found.string.count].reshape(found.string.count, OF_TUBE, -1)
    of_string = found.string.count * OF_TUBE
    further = common[found.string.width :] ** 2 / (found.extra.std[:, None] ** 2)
    gravity = common[of_string] ** 2 / found.string.gravity_std**2
    return [
        *_by_tube(ShareSource.BIAS, np.sum(tubes[:, BIAS] ** 2, axis=1) / found.string.bias_std[:, None] ** 2),
        *_by_tube(ShareSource.TILT, np.sum(tubes[:, TILT] ** 2, axis=1) / found.string.tilt_std[:, None] ** 2),
        *_of_turns(found, common[turn_places(found.string)], causes),
        ErrorShare(ShareSource.GRAVITY, -1, gravity),
        *_by_tube(ShareSource.BLUNDER, further),
    ]


def _by_tube(source: ShareSource, variances: Array) -> list[ErrorShare]:
    return [ErrorShare(source, subject, one) for subject, one in enumerate(variances)]


def _of_looks(found: Adjusted, moved: Array) -> list[ErrorShare]:
    """Noise of the force, play and noise of the yaw; what a look that counts less adds is theirs in proportion."""
    looks, linear = found.looks, found.linear
    pulled = linear.weights @ moved
    whole = np.einsum("kar,kar->kr", pulled, moved)
    turned = np.swapaxes(linear.jacobians[:, :, 5:8], 1, 2) @ pulled
    squares = turned * turned
    parts = np.stack([
        looks.force_var[:, None] * np.einsum("kar,kar->kr", pulled, pulled),
        found.now.play_var * (squares[:, 0] + squares[:, 1]),
        looks.yaw_var[:, None] * squares[:, 2],
    ])  # fmt: skip
    total = parts.sum(axis=0)
    shares = np.sum(parts * np.where(total > 0.0, whole / np.where(total > 0.0, total, 1.0), 0.0), axis=1)
    sources = (ShareSource.FORCE_NOISE, ShareSource.PLAY, ShareSource.YAW_NOISE)
    return [ErrorShare(source, -1, one) for source, one in zip(sources, shares, strict=True)]


def _of_turns(found: Adjusted, turns: Array, causes: TurnCauses) -> list[ErrorShare]:
    """Of each cause of turns, and of what is in their covariance beside the named ones."""
    weighed = np.linalg.solve(found.string.turn_cov, turns)
    patterns = np.concatenate([causes.of_tubes, causes.of_make_ups], axis=1)
    named = (causes.stds[:, None] * (patterns @ weighed)) ** 2
    rest = np.sum(weighed * turns, axis=0) - named.sum(axis=0)
    return [*_by_tube(ShareSource.TURN, named), ErrorShare(ShareSource.TURN, -1, rest)]


def _of_path(found: Adjusted, states: Array) -> tuple[Array, Array]:
    """Of the direction at the collar, and of the curvature that wanders."""
    diagonal, tied, _ = path_equations(found.path, found.now, found.linear.bases)
    whole = np.einsum("kar,kab,kbr->r", states, diagonal, states)
    whole += 2.0 * np.einsum("kar,kab,kbr->r", states[1:], tied[1:], states[:-1])
    basis = found.linear.bases[0]
    known = np.linalg.inv(basis @ found.path.collar_cov @ basis.T + KNOWN * np.eye(2))
    collar = np.einsum("ar,ab,br->r", states[0, :2], known, states[0, :2])
    return collar, whole - collar
