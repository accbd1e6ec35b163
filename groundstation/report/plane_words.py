"""Names of the axes of the planes that cut a wall: north, east and depth where its columns are vertical."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
WAYS = (("north", "south"), ("east", "west"), ("down", "up"))  # of each axis of the site, forth and back
EXACTLY = 0.999  # cosine of an angle of 2.5 deg
VERTICAL = 1e-9


class PlaneWords(NamedTuple):
    """Labels of both axes of a plane and of the depth along its normal, and what a look at it is called."""

    first: str = "North (m)"
    second: str = "East (m)"
    depth: str = "TVD (m)"
    view: str = "Plan"


def name_axes(frame: Array) -> PlaneWords:
    """Names of the axes in the rows of ``frame`` (3, 3), two of the planes and their normal: by the nearest way."""
    if np.allclose(frame, np.eye(3), atol=VERTICAL):
        return PlaneWords()
    first, second = (_name_axis(row) for row in frame[:2])
    return PlaneWords(f"{first} (m)", f"{second} (m)", "Along the columns (m)", "Across")


def _name_axis(row: Array) -> str:
    most = int(np.argmax(np.abs(row)))
    way = WAYS[most][int(row[most] < 0.0)]
    return way.capitalize() if abs(row[most]) >= EXACTLY else f"Mostly {way}"
