"""The normal equations of a hole, without its looks: what is known of tubes, collar and path before."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.kernels.path_legs import add_legs, bend_to, leg_departures
from groundstation.survey.adjustment.looks import (
    BIAS,
    OF_TUBE,
    TILT,
    TURN,
    FurtherEffects,
    PathPrior,
    StartingPoint,
    StringPrior,
)
from groundstation.survey.path.curvature_process import process_step

Array = npt.NDArray[np.float64]
STATE = 4  # unknowns of a station: direction and curvature, each across two axes
KNOWN = 1e-16  # rad^2, least variance of what is given as known


@dataclass(frozen=True, slots=True)
class Equations:
    """Normal equations: (s + 1, 4, 4) blocks of the path and between stations, (s + 1, 4, p + 1) and (p + 1, p + 1).

    The last column of ``coupled`` and ``in_common`` is the right side; ``at_station`` (s + 1, 2, 2) is the part of the
    looks in the information on each direction.
    """

    diagonal: Array
    tied: Array
    coupled: Array
    in_common: Array
    at_station: Array


def path_equations(path: PathPrior, start: StartingPoint, bases: Array) -> tuple[Array, Array, Array]:
    """Blocks (s + 1, 4, 4), ties to the station above (s + 1, 4, 4) and right sides (s + 1, 4) of the path alone."""
    count = len(path.md)
    diagonal, tied, right = np.zeros((count, STATE, STATE)), np.zeros((count, STATE, STATE)), np.zeros((count, STATE))
    known = known_collar(path, bases)
    diagonal[0, :2, :2] = known
    diagonal[0, 2, 2] = diagonal[0, 3, 3] = 1.0 / start.curvature_var
    right[0, :2] = known @ collar_bend(path, start, bases)
    right[0, 2:] = -start.curvatures[0] / start.curvature_var
    if count > 1:
        place = (start.tangents, bases, start.curvatures)
        add_legs(*leg_steps(path), start.leg_vars, *place, diagonal, tied, right)
    return diagonal, tied, right


def collar_bend(path: PathPrior, start: StartingPoint, bases: Array) -> Array:
    """Bend (2,), rad, from the direction at the collar to that which was told."""
    bend = np.empty(2)
    bend_to(start.tangents[0], path.collar, bases[0], bend)
    return bend


def known_collar(path: PathPrior, bases: Array) -> Array:
    """Information (2, 2) on the direction at the collar before any look."""
    (a, b), (_, c) = (bases[0] @ path.collar_cov @ bases[0].T).tolist()
    a, c = a + KNOWN, c + KNOWN
    size = a * c - b * b
    return np.array([[c / size, -b / size], [-b / size, a / size]])


def leg_steps(path: PathPrior) -> tuple[Array, Array]:
    """How the state of a station goes on to the next (s, 4, 4), and the information (s, 4, 4) of a curvature of 1.

    Over what a leg is longer than told the hole goes on bending: that is one more noise of its direction.
    """
    off = b"" if path.leg_length_var is None else path.leg_length_var.tobytes()
    return _steps_of(path.md.tobytes(), path.correlation_length, off)


@lru_cache(maxsize=4)  # one adjustment asks for its own again and again
def _steps_of(md: bytes, correlation_length: float, leg_length_var: bytes) -> tuple[Array, Array]:
    steps = [process_step(length, correlation_length) for length in np.diff(np.frombuffer(md)).tolist()]
    go = np.array([step[0][1:, 1:] for step in steps]).reshape(-1, 2, 2)
    noise = np.array([step[1][1:, 1:] for step in steps]).reshape(-1, 2, 2)
    if leg_length_var:
        noise[:, 0, 0] += np.frombuffer(leg_length_var)
    return _for_both_axes(go), _for_both_axes(np.asarray(np.linalg.inv(noise), np.float64))


def path_departures(path: PathPrior, start: StartingPoint, bases: Array) -> Array:
    """By how much (s, 4) each station departs from what the one above it leads to."""
    found = np.empty((len(path.md) - 1, STATE))
    leg_departures(leg_steps(path)[0], start.tangents, bases, start.curvatures, found)
    return found


def _for_both_axes(matrices: Array) -> Array:
    """Matrices (k, 2, 2) of direction and curvature of one axis as (k, 4, 4) of both axes."""
    found = np.zeros((len(matrices), 2, 2, 2, 2))
    found[:, :, 0, :, 0] = found[:, :, 1, :, 1] = matrices
    return found.reshape(-1, STATE, STATE)


def string_information(string: StringPrior, extra: FurtherEffects) -> Array:
    """Information (p, p) on tubes, gravity and further effects before any look."""
    count = string.count
    width = string.width + len(extra.std)
    found = np.zeros((width, width))
    stds = np.ones((count, OF_TUBE))
    stds[:, BIAS], stds[:, TILT] = string.bias_std[:, None], string.tilt_std[:, None]
    make_ups = np.ones(len(string.turn) - count)
    others = np.concatenate([stds.ravel(), [string.gravity_std], make_ups, extra.std])
    np.fill_diagonal(found, others**-2.0)
    turns = turn_places(string)
    found[np.ix_(turns, turns)] = np.linalg.inv(string.turn_cov)
    return found


def turn_places(string: StringPrior) -> npt.NDArray[np.intp]:
    """Places (m + u,) of the turns of tubes and of make-ups among what all stations have in common."""
    tubes = np.arange(string.count) * OF_TUBE + TURN
    return np.concatenate([tubes, np.arange(OF_TUBE * string.count + 1, string.width)])


def string_departure(string: StringPrior, start: StartingPoint) -> Array:
    """By how much (p,) tubes, gravity, make-ups and further effects stand off what was known of them before."""
    tubes = start.tubes.copy()
    tubes[:, TURN] -= string.turn[: string.count]
    make_ups = start.make_ups - string.turn[string.count :]
    return np.concatenate([tubes.ravel(), [start.gravity - string.gravity], make_ups, start.extra])
