"""Directions as a trajectory takes them: tangents with their errors, each worked out once. Frame: north, east, down."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.resolve import Direction
from groundstation.survey.shared import Packed, packed_of

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Tangent:
    """The downhole unit vector of a direction, its own covariance (3, 3) and its shared columns (3, s)."""

    direction: Direction
    unit: tuple[float, float, float]
    cov: Array
    columns: Packed


def tangents_along(directions: Sequence[Direction], known: Sequence[Tangent] = ()) -> list[Tangent]:
    """Tangents of directions; those of a direction that is ``known`` already are used again."""
    found = {id(one.direction): one for one in known}
    new = [direction for direction in directions if id(direction) not in found]
    found |= {id(one.direction): one for one in _worked_out(new)}
    return [found[id(direction)] for direction in directions]


def _worked_out(directions: Sequence[Direction]) -> Iterator[Tangent]:
    if not directions:
        return
    units = units_of(directions)
    jacobians = jacobians_of(units)
    covs = jacobians @ np.array([one.cov for one in directions]) @ jacobians.transpose(0, 2, 1)
    for direction, unit, jacobian, cov in zip(directions, units.tolist(), jacobians, covs, strict=True):
        yield Tangent(direction, tuple(unit), cov.copy(), packed_of(direction).under(jacobian))


def units_of(directions: Sequence[Direction]) -> Array:
    """Downhole unit vectors (n, 3)."""
    return np.array([(*direction.lean.tolist(), direction.down) for direction in directions])


def jacobians_of(tangents: Array) -> Array:
    """D tangent / d lean (n, 3, 2); the vertical part follows from the unit length."""
    down = np.copysign(np.maximum(np.abs(tangents[:, 2]), 1e-6), tangents[:, 2])
    jacobians = np.zeros((len(tangents), 3, 2))
    jacobians[:, 0, 0] = jacobians[:, 1, 1] = 1.0
    jacobians[:, 2] = -tangents[:, :2] / down[:, None]
    return jacobians
