"""Points and rows of a trajectory: what is told and kept of each station, and the sums with which its errors go on.

Frame: north, east, down; m.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

ROW: Final = np.dtype(
    [
        ("md", np.float64),
        ("tangent", np.float64, 3),
        ("own", np.float64, (3, 3)),  # covariance of the tangent that no other shares
        ("width", np.intp),  # shared columns that the direction knows
        ("count", np.intp),  # of them those that are kept
        ("depths", np.intp),  # shared columns that are kept of its depth
        ("depth_var", np.float64),  # m^2, of its depth, that no other shares
        ("along", np.float64, 3),  # displacement of the leg above for a metre of it
        ("kinks", np.float64, (3, 3)),  # m^2, what the own errors of the depths above come to
        ("path", np.float64, (3, 3)),  # m^2, what the path between the stations above comes to
        ("memory", np.float64),  # m^2, what that has to do with the curvature here
        ("position", np.float64, 3),
        ("cov", np.float64, (3, 3)),
    ]
)
FEWEST = 8  # rows of a table
GROWTH = 8  # share of its rows by which a table grows


@dataclass(frozen=True, slots=True)
class TrajectoryPoint:
    """One station of a trajectory."""

    md: float  # m
    tangent: Array  # (3,)
    position: Array  # (3,) m, north east down
    cov: Array  # (3, 3) m^2, random and shared
    shared: Array  # (3, s) m, change for one standard deviation of every shared error; (3, 0) where it is not kept


@dataclass(frozen=True, slots=True)
class TrajectorySums:
    """Running sums of the error kernel at a station, and the length of the last leg (m)."""

    own: Array  # (3, 3)
    passed: Array  # (3, s)
    length: float


@dataclass(frozen=True, slots=True)
class Followed:
    """Result of following a part of a hole down."""

    sums: TrajectorySums  # at its end
    marks: list[TrajectorySums]  # after every `BLOCK` stations of the hole
    runs: list[Array]  # (.., 3, s) shared columns of the positions, those with equally many together, if wanted
    covs: Array  # (n, 3, 3)


def across_of(along: Array) -> Array:
    """Projections (..., 3, 3) on the planes across vectors (..., 3); on all of space of one that is zero."""
    sizes = (along * along).sum(axis=-1)[..., None, None]
    return np.asarray(np.eye(3) - along[..., :, None] * along[..., None, :] / np.where(sizes > 0.0, sizes, 1.0))


def runs_of(shared: Array, widths: npt.NDArray[np.intp]) -> list[Array]:
    """Parts of columns (n, 3, s) with as many columns as were known of each, those with equally many together."""
    if widths[0] == widths[-1]:
        return [shared[:, :, : int(widths[0])]]
    borders = [0, *(np.flatnonzero(np.diff(widths)) + 1).tolist(), len(widths)]
    return [shared[a:b, :, : int(widths[a])] for a, b in itertools.pairwise(borders)]
