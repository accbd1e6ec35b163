"""Rows of a long answer as they are sent, kept from answer to answer: of ten thousand few change. No I/O."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import orjson

TOGETHER = 256  # rows that are objects at a time: of more the collector of garbage makes the larger part of the work
Numbers = npt.NDArray[np.int64]


class RowTexts:
    """JSON of the rows of a table, each made anew once its ``marks`` are others."""

    def __init__(self, marks: int) -> None:
        self._texts = np.empty(0, np.object_)
        self._marks: Numbers = np.empty((0, marks), np.int64)

    def texts_of(self, rows: Numbers, marks: Numbers, render: Callable[[Numbers], list[Any]]) -> list[bytes]:
        """JSON of ``rows`` (n,) of a table, in their order.

        Parameters
        ----------
        marks : (n, marks), of which a row has others once it shows something else; none is negative
        render : what the rows at some places of ``rows`` show
        """
        self._have_room(int(rows.max(initial=-1)) + 1)
        stale = np.flatnonzero((self._marks[rows] != marks).any(axis=1))
        for some in np.split(stale, range(TOGETHER, len(stale), TOGETHER)):
            for row, shown in zip(rows[some].tolist(), render(some), strict=True):
                self._texts[row] = orjson.dumps(shown)
        self._marks[rows[stale]] = marks[stale]
        return list(self._texts[rows])

    def _have_room(self, count: int) -> None:
        if (lacking := count - len(self._texts)) > 0:
            self._texts = np.concatenate([self._texts, np.empty(lacking, np.object_)])
            none = np.full((lacking, self._marks.shape[1]), -1, np.int64)
            self._marks = np.concatenate([self._marks, none])
