"""All clusters that were measured at one station, as one direction.

Tube by tube the string passes the same depth. Readings that found the same hole are combined by recursive Bayes, which
is a running sum of information: order-independent and of constant memory. When the hole moved in between, later
readings count more: weights k^p by their order, or the earlier ones are dropped when neighbouring stations saw the same
change. What readings share (joints, mounts, biases) is carried with the same weights and never averages away by itself.
Source: thesis 3.6 and 4.3, eqs. 3.39-3.42.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.shared import Fused, Packed, add_shared_errors, packed_each, stack_shared_errors

Array = npt.NDArray[np.float64]
# a departure in the plane is beyond this length as often (4.55 %) as one number is beyond two standard deviations
DEPARTED = math.sqrt(-2.0 * math.log(math.erfc(math.sqrt(2.0))))
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


@dataclass(frozen=True, slots=True)
class Stack:
    """Readings of several stations, one of each, side by side: (n, 2), (n,), (n, 2, 2), (n, 2, 2) and (n, 2, s)."""

    lean: Array
    down: Array
    cov: Array
    information: Array
    shared: Array


def stack_of(readings: Sequence[Direction]) -> Stack:
    """Return readings stacked along a first axis (n,)."""
    rows = [(one.lean, one.down, one.cov, one.information) for one in readings]
    lean, down, cov, information = map(np.array, zip(*rows, strict=True))
    return Stack(lean, down, cov, information, stack_shared_errors(readings, max(one.width for one in readings)))


@dataclass(slots=True)
class StationFusion:
    """Running recursive Bayes of one station."""

    count: int = 0
    _sums: Array = field(default_factory=lambda: np.zeros((5, 2)))  # information, weighted lean, random covariance
    _shared: Packed = field(default_factory=lambda: Packed(np.zeros((2, 0))))
    _down: float = 0.0

    def add_reading(self, reading: Direction) -> None:
        """Add one cluster, weighted by the inverse of its total covariance, shared errors included."""
        self.add_each([self], stack_of([reading]))

    def fused(self) -> Direction:
        """Mean, random covariance (2, 2) and shared columns (2, s)."""
        return self.fuse_each([self])[0]

    @staticmethod
    def add_each(fusions: Sequence[StationFusion], readings: Stack) -> None:
        """Add one reading to each of several stations; equal bit for bit to adding them one by one."""
        weighed = readings.information @ readings.shared
        shared = np.zeros((*weighed.shape[:2], max(weighed.shape[2], *(one._shared.width for one in fusions))))
        for own, one in zip(shared, fusions, strict=True):
            one._shared.fill(own)
        shared[:, :, : weighed.shape[2]] += weighed
        lean = (readings.information @ readings.lean[:, :, None])[:, :, 0]
        random = readings.information @ readings.cov @ readings.information
        sums = np.array([one._sums for one in fusions])
        sums[:, :2] += readings.information
        sums[:, 2] += lean
        sums[:, 3:] += random
        for one, own, packed, down in zip(fusions, sums, packed_each(shared), readings.down.tolist(), strict=True):
            one._sums, one._shared, one._down = own.copy(), packed, one._down + down
            one.count += 1

    @staticmethod
    def fuse_each(fusions: Sequence[StationFusion]) -> list[Direction]:
        """Return the fused direction of each station."""
        sums = np.array([one._sums for one in fusions])
        gains = np.linalg.inv(sums[:, :2])
        leans = (gains @ sums[:, 2, :, None])[:, :, 0]
        covs = gains @ sums[:, 3:] @ gains
        rows = zip(fusions, gains, leans, covs, strict=True)
        return [
            Fused(lean.copy(), vertical_part(lean, one._down), cov.copy(), one._shared.under(gain))
            for one, gain, lean, cov in rows
        ]


class GrowingBayes:
    """Recursive Bayes of readings that mostly grow at their end: the sum over the earlier ones is reused."""

    def __init__(self) -> None:
        self._fusion = StationFusion()
        self._begin = self._end = 0
        self._known: Direction | None = None  # what they came to

    def of(self, begin: int, end: int, readings: Callable[[int, int], Iterable[Direction]]) -> Direction:
        """Return ``fuse_by_bayes`` of the readings from ``begin`` to before ``end``, equal bit for bit.

        ``readings(begin, end)`` gives those of such a range.
        """
        if begin != self._begin or end < self._end or self._end < begin:
            self._fusion, self._begin, self._end, self._known = StationFusion(), begin, begin, None
        if self._known is None or self._end != end:
            for reading in readings(self._end, end):
                self._fusion.add_reading(reading)
            self._known = self._fusion.fused()
        self._end = end
        return self._known

    def known(self, begin: int, end: int) -> Direction | None:
        """Return the fused direction of a range if it was the last one asked for, else None."""
        return self._known if (begin, end) == (self._begin, self._end) else None

    def lacks_one(self, begin: int, end: int) -> bool:
        """Return whether the sum holds all readings of a range but the last."""
        return (begin, end) == (self._begin, self._end + 1)

    @staticmethod
    def grow_each(growing: Sequence[GrowingBayes], readings: Stack) -> None:
        """Add to each of several sums the one reading that it lacks."""
        fusions = [one._fusion for one in growing]
        StationFusion.add_each(fusions, readings)
        for one, known in zip(growing, StationFusion.fuse_each(fusions), strict=True):
            one._end, one._known = one._end + 1, known

    def forget(self, place: int) -> None:
        """Drop the sum if it holds the reading at ``place``, which has changed with all behind it."""
        if place < self._end:
            self._fusion, self._end, self._known = StationFusion(), self._begin, None


def vertical_part(lean: Array, sense: float) -> float:
    """Vertical part of a unit vector with the horizontal part ``lean``, downward where ``sense`` is positive."""
    return math.copysign(math.sqrt(1.0 - min(float(lean @ lean), 1.0)), sense)


def fuse_by_bayes(readings: Sequence[Direction]) -> Direction:
    """Recursive Bayes of at least one reading."""
    fusion = StationFusion()
    for reading in readings:
        fusion.add_reading(reading)
    return fusion.fused()


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
    weights = sequence_weights(len(readings), POWERS[scheme])
    lean = np.sum([w * r.lean for w, r in zip(weights, readings, strict=True)], axis=0)
    cov = np.sum([w * w * r.cov for w, r in zip(weights, readings, strict=True)], axis=0)
    shared = np.zeros((2, 0))
    for w, r in zip(weights, readings, strict=True):
        shared = add_shared_errors(shared, w * r.shared)
    return Direction(lean, vertical_part(lean, sum(r.down for r in readings)), cov, shared)


def adaptive_weighting(readings: Sequence[Direction]) -> Weighting:
    """Linear for a small departure of the newest reading, quadratic for a larger, cubic for a large one."""
    size = newest_departure(readings)[1]
    if size <= DEPARTED:
        return Weighting.LINEAR
    return Weighting.QUADRATIC if size <= QUADRATIC_TO else Weighting.CUBIC


def newest_departure(readings: Sequence[Direction]) -> tuple[Array, float]:
    """Departure of the newest reading from those before: vector (2,), size in standard deviations; 0 for a first."""
    return departure_from(fuse_by_bayes(readings[:-1]), readings[-1]) if len(readings) > 1 else (np.zeros(2), 0.0)


def departure_from(earlier: Direction, newest: Direction) -> tuple[Array, float]:
    """Return the departure of a reading from the fused earlier ones: vector (2,) and size in standard deviations.

    The covariance of the difference knows what the two have in common: an error of the same mount cancels.
    """
    return departures_from([earlier], stack_of([newest]))[0]


def departures_from(earlier: Sequence[Direction], newest: Stack) -> list[Departure]:
    """Return ``departure_from`` of several stations."""
    differences = newest.lean - np.array([one.lean for one in earlier])
    apart = -stack_shared_errors(earlier, max(newest.shared.shape[2], *(one.width for one in earlier)))
    apart[:, :, : newest.shared.shape[2]] += newest.shared
    covs = newest.cov + np.array([one.cov for one in earlier]) + apart @ apart.transpose(0, 2, 1)
    squares = differences[:, None] @ np.linalg.solve(covs, differences[:, :, None])
    return [(one, math.sqrt(square)) for one, square in zip(differences, squares[:, 0, 0].tolist(), strict=True)]


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
