"""Columns of shared errors that are kept packed: most of them are zero."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Places = npt.NDArray[Any]  # of few bits where these are enough
MOST_OF_16_BITS = 1 << 16


class Packed:
    """Columns (k, s) of which most are zero: a station knows those of the tubes that passed it, of a hundred tubes.

    Attributes
    ----------
    width : how many there are
    places : (c,) of those that may not be zero
    values : (k, c) what stands there
    """

    __slots__ = ("places", "values", "width")

    def __init__(self, columns: Array, places: Places | None = None) -> None:
        """``places`` of those that are not zero, where they are known."""
        at = np.nonzero(columns.any(axis=0))[0] if places is None else places
        self.values: Array = columns.take(at, axis=1)
        self.width = int(columns.shape[1])
        self.places = at.astype(np.uint16 if self.width <= MOST_OF_16_BITS else np.intp, copy=False)

    @classmethod
    def of_values(cls, values: Array, places: Places, width: int) -> Packed:
        """Columns of which ``values`` (k, c) stand at ``places`` (c,), of ``width``."""
        made = cls.__new__(cls)
        made.places = places.astype(np.uint16 if width <= MOST_OF_16_BITS else np.intp, copy=False)
        made.values, made.width = values, width
        return made

    def under(self, matrix: Array) -> Packed:
        """Return the columns ``matrix`` (j, k) @ columns (k, s), of shape (j, s)."""
        return Packed.of_values(matrix @ self.values, self.places, self.width)

    def columns(self) -> Array:
        """All of them (k, s), made anew."""
        columns = np.zeros((len(self.values), self.width))
        self.fill(columns)
        return columns

    def fill(self, columns: Array) -> None:
        """Put them into zeros (k, s or more)."""
        columns[:, self.places] = self.values


def packed_each(columns: Array) -> list[Packed]:
    """Columns (n, k, s) of several, each packed by itself."""
    are_some = np.asarray(columns.any(axis=1))
    return [Packed(own, some.nonzero()[0]) for own, some in zip(columns, are_some, strict=True)]
