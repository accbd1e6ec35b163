"""All clusters that were measured at one station, as one direction.

Tube by tube the string passes the same depth. Readings that found the same hole are combined by recursive Bayes, on the
sphere (`sphere_fusion`) and not in the plane of the lean: whatever the order. When the hole moved in between, later
readings count more: weights k^p by their order, or the earlier ones are dropped when neighbouring stations saw the same
change. What readings share (joints, mounts, biases) is carried with the same weights and never averages away by itself.
Source: thesis 3.6 and 4.3, eqs. 3.39-3.42.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from operator import attrgetter

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.packed import Packed, packed_each
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.sphere_direction import OWN, PACKED, TANGENT, YAW_VARS, SphereDirection, on_sphere
from groundstation.survey.fusion.sphere_fusion import Stack, fuse_on_sphere, off_direction

Array = npt.NDArray[np.float64]
# a departure in the plane is beyond this length as often (4.55 %) as one number is beyond two standard deviations
DEPARTED = math.sqrt(-2.0 * math.log(math.erfc(math.sqrt(2.0))))
WIDTH = attrgetter("width")
QUADRATIC_TO = 4.0  # standard deviations up to which the adaptive scheme is quadratic


Departure = tuple[Array, float]


class Weighting(Enum):
    """How the readings of stations come to directions: all of the hole in one, or by weights within each station.

    The latter, oldest first, are the thesis's, for experiments.
    """

    ADJUSTED = "adjusted"
    BAYES = "bayes"
    EQUAL = "equal"
    LINEAR = "linear"
    QUADRATIC = "quadratic"
    CUBIC = "cubic"
    ADAPTIVE = "adaptive"


POWERS = {Weighting.EQUAL: 0, Weighting.LINEAR: 1, Weighting.QUADRATIC: 2, Weighting.CUBIC: 3}


def stack_of(readings: Sequence[Direction]) -> Stack:
    """Return readings stacked along a first axis (n,)."""
    return _stacked([*map(on_sphere, readings)])


def _stacked(found: Sequence[SphereDirection], width: int = 0) -> Stack:
    """The same, with as many columns as the widest has, or ``width``."""
    columns = _columns_of(found, max(width, *map(WIDTH, found)) if len(found) > 1 else max(width, found[0].width))
    tangents, covs = np.array([*map(TANGENT, found)]), np.array([*map(OWN, found)])
    return Stack(tangents, covs, columns, np.array([*map(YAW_VARS, found)]))


def _columns_of(directions: Sequence[SphereDirection], width: int) -> Array:
    """Columns (n, 3, width) of unit vectors, with zeros for those that one does not know."""
    columns = np.zeros((len(directions), 3, width))
    for own, packed in zip(columns, map(PACKED, directions), strict=True):
        own[:, packed.places] = packed.values
    return columns


class StationFusion:
    """Recursive Bayes of one station: its readings, and what they come to."""

    def __init__(self) -> None:
        self._readings: list[SphereDirection] = []

    @property
    def count(self) -> int:
        """Number of readings."""
        return len(self._readings)

    def add_reading(self, reading: Direction) -> None:
        """Add one cluster, weighted by the inverse of its total covariance, shared errors included."""
        self._readings.append(on_sphere(reading))

    def fused(self) -> SphereDirection:
        """Mean on the sphere, random covariance and shared columns."""
        return fuse_by_bayes(self._readings)


class GrowingBayes:
    """Recursive Bayes of readings that mostly grow at their end: what they came to last is kept."""

    def __init__(self) -> None:
        self._begin = self._end = 0
        self._known: SphereDirection | None = None

    def of(self, begin: int, end: int, readings: Callable[[int, int], Iterable[Direction]]) -> SphereDirection:
        """Return ``fuse_by_bayes`` of the readings from ``begin`` to before ``end``.

        ``readings(begin, end)`` gives those of such a range.
        """
        known = self.known(begin, end)
        return self._keep(begin, end, fuse_by_bayes([*readings(begin, end)])) if known is None else known

    def _keep(self, begin: int, end: int, found: SphereDirection) -> SphereDirection:
        self._begin, self._end, self._known = begin, end, found
        return found

    def known(self, begin: int, end: int) -> SphereDirection | None:
        """Return the fused direction of a range if it was the last one asked for, else None."""
        return self._known if (begin, end) == (self._begin, self._end) else None

    def lacks_one(self, begin: int, end: int) -> bool:
        """Return whether what is known is that of all readings of a range but the last."""
        return (begin, end) == (self._begin, self._end + 1)

    @staticmethod
    def fuse_each(growing: Sequence[GrowingBayes], ranges: Sequence[tuple[int, int]], readings: Stack) -> None:
        """Fuse the readings of several ranges, which stand one after the other; each as by itself bit for bit."""
        begin = np.append(0, np.cumsum(np.diff(ranges)))
        packed = packed_each(readings.shared)
        found = fuse_on_sphere(readings.tangents, readings.covs, packed, readings.yaw_vars, begin)
        for one, (first, end), direction in zip(growing, ranges, found, strict=True):
            one._keep(first, end, direction)

    def forget(self, place: int) -> None:
        """Drop what is known if the reading at ``place`` is in it, which has changed with all behind it."""
        if place < self._end:
            self._begin, self._end, self._known = self._begin, self._begin, None


def vertical_part(lean: Array, sense: float) -> float:
    """Vertical part of a unit vector with the horizontal part ``lean``, downward where ``sense`` is positive."""
    return math.copysign(math.sqrt(1.0 - min(float(lean @ lean), 1.0)), sense)


def fuse_by_bayes(readings: Sequence[Direction]) -> SphereDirection:
    """Recursive Bayes of at least one reading, see ``sphere_fusion``."""
    found = [*map(on_sphere, readings)]
    tangents, covs, yaw_vars = (np.array([*map(part, found)]) for part in (TANGENT, OWN, YAW_VARS))
    return fuse_on_sphere(tangents, covs, [*map(PACKED, found)], yaw_vars, np.array([0, len(found)]))[0]


def sequence_weights(count: int, power: int) -> Array:
    """Weights (count,) k^p / sum, the newest largest. Source: thesis Table 4.30 (whose cubic row is garbled)."""
    k = np.arange(1.0, count + 1.0) ** power
    return np.asarray(k / k.sum())


def fuse_by_scheme(readings: Sequence[Direction], scheme: Weighting) -> Direction:
    """Readings of one station, oldest first, combined by a scheme."""
    if scheme is Weighting.BAYES:
        return fuse_by_bayes(readings)
    if scheme is Weighting.ADAPTIVE:
        scheme = adaptive_weighting(readings)
    weights, found = sequence_weights(len(readings), POWERS[scheme]), [*map(on_sphere, readings)]
    lean = np.sum([w * one.lean for w, one in zip(weights, found, strict=True)], axis=0)
    tangent = np.array([*lean, vertical_part(lean, sum(one.down for one in found))])
    own = np.sum([w * w * one.own for w, one in zip(weights, found, strict=True)], axis=0)
    columns = _columns_of(found, max(one.width for one in found))
    shared = np.sum([w * each for w, each in zip(weights, columns, strict=True)], axis=0)
    yaw_vars = tuple((weights**2 @ np.array([one.yaw_vars for one in found])).tolist())
    return SphereDirection(tangent, own, Packed(shared), yaw_vars)


def adaptive_weighting(readings: Sequence[Direction]) -> Weighting:
    """Linear for a small departure of the newest reading, quadratic for a larger, cubic for a large one."""
    size = newest_departure(readings)[1]
    if size <= DEPARTED:
        return Weighting.LINEAR
    return Weighting.QUADRATIC if size <= QUADRATIC_TO else Weighting.CUBIC


def newest_departure(readings: Sequence[Direction]) -> tuple[Array, float]:
    """Departure of the newest reading from those before: vector (2,), size in standard deviations; 0 for a first."""
    return departure_from(fuse_by_bayes(readings[:-1]), readings[-1]) if len(readings) > 1 else (np.zeros(2), 0.0)


def departure_from(earlier: SphereDirection, newest: Direction) -> tuple[Array, float]:
    """Return the departure of a reading from the fused earlier ones: vector (2,) and size in standard deviations.

    The covariance of the difference knows what the two have in common: an error of the same mount cancels.
    """
    return departures_from([earlier], stack_of([newest]))[0]


def departures_from(earlier: Sequence[SphereDirection], newest: Stack) -> list[Departure]:
    """Return ``departure_from`` of several stations, each across its earlier direction: to north and east, tilted."""
    before, after = _stacked(earlier, newest.shared.shape[2]), newest
    if before.shared.shape[2] > newest.shared.shape[2]:
        shared = np.zeros_like(before.shared)
        shared[:, :, : newest.shared.shape[2]] = newest.shared
        after = replace(newest, shared=shared)
    apart, covs = off_direction(before, after)
    squares = apart[:, None] @ np.linalg.solve(covs, apart[:, :, None])
    return [(one, math.sqrt(square)) for one, square in zip(apart, squares[:, 0, 0].tolist(), strict=True)]


@dataclass(frozen=True, slots=True)
class Evidence:
    """Evidence that a station has moved: departures in standard deviations, own and of the neighbours."""

    own: float
    neighbours: tuple[float, ...]
    agree: bool

    @property
    def moved(self) -> bool:
        """Whether the earlier readings are to be dropped."""
        return self.own > DEPARTED and self.agree


def moved_hole(station: Sequence[Direction], neighbours: Sequence[Sequence[Direction]]) -> Evidence:
    """Judge the newest reading of a station by those of its neighbours at the same pass.

    A neighbour agrees when its own newest reading departed too, to the same side; all that have one must.
    """
    return judge_departure(
        newest_departure(station), [newest_departure(other) for other in neighbours if len(other) > 1]
    )


def judge_departure(departed: Departure, seen: Sequence[Departure]) -> Evidence:
    """Judge a known departure; ``seen`` are those of the neighbours that have one."""
    difference, own = departed
    agree = bool(seen) and all(size > DEPARTED and float(d @ difference) > 0.0 for d, size in seen)
    return Evidence(own, tuple(size for _, size in seen), agree)
