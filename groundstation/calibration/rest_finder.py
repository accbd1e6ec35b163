"""Stretches of an IMU's record in which it was at rest, found by the scatter of its readings and by nothing else.

A bias is no motion: a gyroscope that reads five degrees a second at rest scatters as one that reads none. A window is
quiet where its variance is near the smallest that the record has. Source: Tedaldi, Pretto, Menegatti 2014.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
WINDOW: Final = 50  # rows whose scatter is one number
SHORTEST: Final = 100  # rows of a rest
QUIETEST: Final = 0.05  # of the windows, whose largest variance is that of a rest
LOUDEST: Final = 5.0  # standard deviations of that, of a window at rest
MARGIN: Final = 10  # rows at either end of a rest that are not used
TURNING: Final = 8.0  # robust standard deviations of a rest's mean rate off the others: it turned steadily
STEADY: Final = 1e-3  # rad/s, added to that: a bias that wanders from rest to rest is no turn


def find_rests(force: Array, rate: Array | None, breaks: npt.NDArray[np.bool_]) -> list[slice]:
    """Rows of each rest of a record (n, 3) of specific force.

    With ``rate`` (n, 3) the gyroscope is at rest too: a hand that still holds the sensor shows there before it shows in
    the force. Its means are then those of a gyroscope at rest, of fewer and shorter rests.

    Raises
    ------
    CalibrationError
        When the record is shorter than a rest.
    """
    if len(force) < SHORTEST:
        raise CalibrationError(f"rests: expected {SHORTEST} rows or more, got {len(force)}")
    quiet = _quiet_rows(force)
    if rate is not None:
        quiet &= _quiet_rows(rate)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], quiet.astype(np.int8), [0]])))
    found = []
    for begin, end in zip(edges[0::2], edges[1::2], strict=True):
        inside = [int(k) for k in np.flatnonzero(breaks[begin:end]) + begin if k > begin]
        for a, b in zip([int(begin), *inside], [*inside, int(end)], strict=True):
            if b - a >= SHORTEST:
                found.append(slice(a + MARGIN, b - MARGIN))
    return found if rate is None else _without_turns(found, rate)


def _quiet_rows(readings: Array) -> npt.NDArray[np.bool_]:
    """Rows (n,) in the middle of a quiet window."""
    centred = readings - readings.mean(axis=0)
    sums = np.cumsum(np.vstack([np.zeros(3), centred]), axis=0)
    squares = np.cumsum(np.vstack([np.zeros(3), centred**2]), axis=0)
    means = (sums[WINDOW:] - sums[:-WINDOW]) / WINDOW
    variance = np.sum(np.maximum((squares[WINDOW:] - squares[:-WINDOW]) / WINDOW - means**2, 0.0), axis=1)
    limit = LOUDEST**2 * float(np.quantile(variance, QUIETEST))
    quiet = np.zeros(len(readings), dtype=bool)
    quiet[np.flatnonzero(variance <= limit) + WINDOW // 2] = True
    return quiet


def _without_turns(found: list[slice], rate: Array) -> list[slice]:
    """Rests without those whose mean rate lies off the others': a steady turn scatters as little as a rest."""
    if len(found) < 3:
        return found
    means = np.array([rate[rest].mean(axis=0) for rest in found])
    off = np.abs(means - np.median(means, axis=0))
    spread = 1.4826 * np.median(off, axis=0) + STEADY
    return [rest for rest, row in zip(found, off, strict=True) if np.all(row <= TURNING * spread)]
