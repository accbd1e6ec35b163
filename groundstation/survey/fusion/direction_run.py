"""Directions of many stations side by side: what an adjustment comes to, which has the same columns at all of them.

One by one they are objects of a microsecond or two each, made where one is asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.packed import Packed, Places
from groundstation.survey.fusion.sphere_direction import SphereDirection

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class DirectionRun(Sequence[SphereDirection]):
    """Directions of stations from one on down.

    Parameters
    ----------
    tangents : (n, 3), unit vectors
    owns : (n, 3, 3), covariance of each that no other shares
    columns : (3, n, c), change of each for one standard deviation of what they share, where any has some
    places : (c,) of these columns among all
    width : how many columns there are in all
    """

    tangents: Array
    owns: Array
    columns: Array
    places: Places
    width: int

    def __len__(self) -> int:
        return len(self.tangents)

    @overload
    def __getitem__(self, place: int) -> SphereDirection: ...

    @overload
    def __getitem__(self, place: slice) -> DirectionRun: ...

    def __getitem__(self, place: int | slice) -> SphereDirection | DirectionRun:
        tangents, owns, columns = self.tangents[place], self.owns[place], self.columns[:, place]
        if isinstance(place, slice):
            return DirectionRun(tangents, owns, columns, self.places, self.width)
        return SphereDirection(tangents, owns, Packed.of_values(columns, self.places, self.width))
