"""A gyroscope from the turns between rests: integrated, it has to turn gravity of one rest into that of the next.

The bias is the mean reading at rest. The matrix, in the accelerometer's frame, follows by Gauss-Newton from all turns;
each says what turned across gravity and nothing of a turn about it. Every third turn is left out of a fit that judges
the matrix, and used in the one that lands. Source: Tedaldi, Pretto, Menegatti 2014, eqs. 11-14.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
FEWEST: Final = 9  # turns
SMALLEST: Final = math.radians(10.0)  # of gravity between two rests; less says nothing of a scale
LONGEST: Final = 3000  # rows of a turn; in a longer one the bias has moved
STEPS: Final = 12
SMALL: Final = 1e-6  # relative step of a derivative
ENOUGH: Final = 1e-10
JUDGED: Final = 3  # one turn in as many is left out


@dataclass(frozen=True, slots=True)
class TurnsFit:
    """Matrix (3, 3) and bias (3,) rad/s of w_read = M w + b with standard errors.

    ``residuals`` (k,) rad: angle between gravity turned and gravity felt; ``left_out`` those of turns that a fit did
    not use, ``uncalibrated`` of the same turns with the bias alone taken off.
    """

    matrix: Array
    bias: Array
    matrix_std: Array
    bias_std: Array
    residuals: Array
    left_out: Array
    uncalibrated: Array


def fit_turns(rate: Array, period: float, rests: list[slice], gravity: Array) -> TurnsFit:
    """Gyroscope of rates (n, 3) rad/s, one every ``period`` s; ``gravity`` (k, 3): unit vectors at the rests.

    Raises
    ------
    CalibrationError
        When the turns between the rests are too few.
    """
    at_rest = np.array([rate[rest].mean(axis=0) for rest in rests])
    bias, spread = at_rest.mean(axis=0), at_rest.std(axis=0, ddof=1) / math.sqrt(len(rests))
    turns = [
        (rate[a.stop : b.start] - bias, gravity[k], gravity[k + 1])
        for k, (a, b) in enumerate(itertools.pairwise(rests))
        if b.start - a.stop <= LONGEST and float(gravity[k] @ gravity[k + 1]) < math.cos(SMALLEST)
    ]
    if len(turns) < FEWEST:
        raise CalibrationError(f"turns: expected {FEWEST} or more of 10 deg between rests, got {len(turns)}")
    used = [turn for k, turn in enumerate(turns) if k % JUDGED]
    judged = [turn for k, turn in enumerate(turns) if not k % JUDGED]
    inverse, jacobian = _solved(turns, period)
    misses = _misses(inverse, turns, period)
    variance = float(misses @ misses) / max(2 * len(turns) - 9, 1)
    # a turn about gravity is in no miss: of what is left open the standard error is large, not zero
    cov = variance * np.linalg.pinv(jacobian.T @ jacobian)
    matrix: Array = np.linalg.inv(inverse).astype(np.float64)
    std = np.zeros((3, 3))
    for k in range(9):
        unit = np.zeros(9)
        unit[k] = math.sqrt(max(cov[k, k], 0.0))
        std += (matrix @ unit.reshape(3, 3) @ matrix) ** 2
    left_out = _angles(_misses(_solved(used, period)[0], judged, period))
    bare = _angles(_misses(np.eye(3), judged, period))
    return TurnsFit(matrix, bias, np.sqrt(std), spread, _angles(misses), left_out, bare)


Turn = tuple[Array, Array, Array]


def turned_vector(rates: Array, period: float, vector: Array) -> Array:
    """A vector (3,) fixed in space as the body sees it after rates (n, 3) of the body, rad/s."""
    half = 0.5 * period * np.linalg.norm(rates, axis=1)
    axis = 0.5 * period * np.sinc(half / math.pi)[:, None] * rates
    quaternions = np.column_stack([np.cos(half), axis])
    while len(quaternions) > 1:  # by pairs, in their order
        if len(quaternions) % 2:
            quaternions = np.vstack([quaternions, [1.0, 0.0, 0.0, 0.0]])
        quaternions = _products(quaternions[0::2], quaternions[1::2])
    w, x, y, z = quaternions[0]
    body_to_start = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return np.asarray(body_to_start.T @ vector)


def _products(a: Array, b: Array) -> Array:
    w, v, u, t = a[:, :1], a[:, 1:], b[:, :1], b[:, 1:]
    return np.hstack([w * u - np.sum(v * t, axis=1, keepdims=True), w * t + u * v + np.cross(v, t)])


def _misses(inverse: Array, turns: list[Turn], period: float) -> Array:
    """Differences (3 k,) of gravity felt and gravity turned."""
    found = [turned_vector(rates @ inverse.T, period, before) - after for rates, before, after in turns]
    return np.concatenate(found)


def _angles(misses: Array) -> Array:
    return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(misses.reshape(-1, 3), axis=1), 1.0)))


def _solved(turns: list[Turn], period: float) -> tuple[Array, Array]:
    """Inverse matrix (3, 3) and the derivative (3 k, 9) of the misses by it."""
    inverse = np.eye(3)
    for _ in range(STEPS):
        misses = _misses(inverse, turns, period)
        columns = []
        for k in range(9):
            moved = inverse.copy()
            moved.flat[k] += SMALL
            columns.append((_misses(moved, turns, period) - misses) / SMALL)
        jacobian = np.stack(columns, axis=1)
        step = np.linalg.lstsq(jacobian, -misses, rcond=1e-8)[0]
        inverse = inverse + step.reshape(3, 3)
        if float(np.abs(step).max()) < ENOUGH:
            break
    return inverse, jacobian
