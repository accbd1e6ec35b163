"""Readings that are none: a sensor at its range, and rows that were read twice."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
LONG: Final = 5  # rows in a row at the outermost value: noise does not stand there
WHOLE_RECORD: Final = 0.5  # of the rows at it: the sensor is stuck or made, and not at its range
FEW_REPEATS: Final = 0.02  # of the rows that equal the one before: noise of a coarse sensor does that
STUCK: Final = 0.9  # of them: it does not move at all


def rows_at_range(values: Array) -> Mask:
    """Rows (n,) in which a reading (n, 3) stands at the outermost value of its axis for five rows or more."""
    found = np.zeros(len(values), dtype=bool)
    for column in values.T:
        for extreme in (np.nanmax(column), np.nanmin(column)):
            at = column == extreme
            if extreme != 0.0 and 0 < np.sum(at) < WHOLE_RECORD * len(column):
                found |= _in_long_runs(at)
    return found


def rows_read_twice(values: Array) -> Mask:
    """Rows (n,) whose every reading (n, c) equals that of the row before, where this is no chance."""
    same = np.zeros(len(values), dtype=bool)
    same[1:] = np.all(values[1:] == values[:-1], axis=1)
    share = float(np.mean(same)) if len(same) else 0.0
    return same if FEW_REPEATS < share < STUCK else np.zeros(len(values), dtype=bool)


def _in_long_runs(at: Mask) -> Mask:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], at, [False]]).astype(np.int8)))
    found = np.zeros(len(at), dtype=bool)
    for begin, end in zip(edges[0::2], edges[1::2], strict=True):
        if end - begin >= LONG:
            found[begin:end] = True
    return found
