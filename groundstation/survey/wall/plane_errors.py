"""Errors of columns where planes cut them, kept at the stations and read a few columns at a time.

A column has fewer stations than planes, and in a plane it errs as the two stations about it do, blended. A wall of
thousands of columns is then held in the memory of its stations. Each number of a column is one standard deviation of
one independent error; m.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class PlaneErrors:
    """Errors of columns in planes.

    Attributes
    ----------
    effects : of every column, (stations, 2, k): what its stations err in the plane by each number
    upper : (columns, depths) station above each plane
    share : (columns, depths) of the station below that one
    alike : (columns, depths, e) m, what further numbers move a column by in either direction, two of them each
    width : numbers of a column, of that which has most
    """

    effects: list[Array]
    upper: Indices
    share: Array
    alike: Array
    width: int

    @classmethod
    def of_stations(cls, effects: list[Array], upper: Indices, share: Array, alike: Array) -> PlaneErrors:
        """Errors of columns by their stations, as wide as the column with most numbers."""
        used = np.any(alike > 0.0, axis=1).sum(axis=1).tolist()
        width = max((e.shape[-1] + 2 * more for e, more in zip(effects, used, strict=True)), default=0)
        return cls(effects, upper, share, alike, width)

    @classmethod
    def of_planes(cls, errors: Array) -> PlaneErrors:
        """Errors (columns, depths, 2, k) that are known in every plane."""
        count, depths = errors.shape[:2]
        upper = np.broadcast_to(np.arange(depths), (count, depths))
        nothing = np.zeros((count, depths))
        return cls(list(errors), upper, nothing, nothing[..., None][..., :0], errors.shape[-1])

    def at(self, columns: Sequence[int] | Indices) -> Array:
        """Errors (columns, depths, 2, width) of some columns, zero where a column has fewer numbers than others."""
        out = np.zeros((len(columns), self.upper.shape[1], 2, self.width))
        for row, k in enumerate(columns):
            found, upper, g = self.effects[k], self.upper[k], self.share[k][:, None, None]
            wide = found.shape[-1]
            lower = np.minimum(upper + 1, len(found) - 1)
            out[row, ..., :wide] = (1.0 - g) * found[upper] + g * found[lower]
            for size in self.alike[k].T:
                if np.any(size > 0.0):
                    out[row, :, 0, wide] = out[row, :, 1, wide + 1] = size
                    wide += 2
        return out

    def subset(self, which: Indices) -> PlaneErrors:
        """Some of the columns, in the order of ``which``, as wide as before."""
        effects = [self.effects[k] for k in which.tolist()]
        return PlaneErrors(effects, self.upper[which], self.share[which], self.alike[which], self.width)
