"""From directions at measured depths to positions with their covariance, one station appended at a time.

A station enters two legs, so its weight in the position is half their summed length, and half the last leg for the last
station (the Jacobian of the balanced tangential method, used for every method as the industry's error model does).
Its errors are kept by running sums in a compiled loop: appending costs the same however many stations there are. What
stations share may become more columns as the hole grows; the columns of a point are those known when it was added.
Source: thesis 2.1-2.3 and eqs. I.1-I.12. Frame: north, east, down.
"""

from __future__ import annotations

import itertools
import math
import operator
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.methods import OPPOSITE, Method, dogleg, leg, ratio_factor
from groundstation.survey.resolve import Direction, angles
from groundstation.survey.shared import added, widened
from groundstation.survey.tangents import Tangent, tangents_along

Array = npt.NDArray[np.float64]
BLOCK = 64  # stations, whose columns are held at a time


@dataclass(frozen=True, slots=True)
class Point:
    """One station of a trajectory."""

    md: float  # m
    tangent: Array  # (3,)
    position: Array  # (3,) m, north east down
    cov: Array  # (3, 3) m^2, random and shared
    shared: Array  # (3, s) m, change for one standard deviation of every shared error, or what is kept of that


ROW: Final = np.dtype([(name, np.float64, shape) for name, shape in (("md", ()), ("position", 3), ("cov", (3, 3)))])
FEWEST = 8  # rows of a table
GROWTH = 8  # share of its rows by which a table grows


@dataclass(frozen=True, slots=True)
class Sums:
    """What a hole has come to at a station: the running sums of the kernel, and the length of the last leg (m)."""

    own: Array  # (3, 3)
    passed: Array  # (3, s)
    length: float

    def copied(self) -> Sums:
        """The same, to go on with."""
        return Sums(self.own.copy(), self.passed.copy(), self.length)


class Trajectory:
    """Positions of stations in order of depth, one appended at a time.

    Parameters
    ----------
    method : of the legs
    collar : direction at the first depth, known: vertical by default
    start_md : m
    keep : makes of the shared columns (n, 3, s) of n points what these keep of them, one each: all by default, which
        of a string of fifty tubes is 750 numbers a point
    """

    def __init__(
        self,
        method: Method = Method.BALANCED_TANGENTIAL,
        collar: Direction | None = None,
        start_md: float = 0.0,
        keep: Callable[[Array], Iterable[Array]] = np.asarray,
    ) -> None:
        self._method = method
        self._keep = keep
        first = collar or Direction(np.zeros(2), 1.0, np.zeros((2, 2)), np.zeros((2, 0)))
        self._tangents = tangents_along([first])  # of the collar and every station
        self._rows = np.zeros(FEWEST, ROW)
        self._rows["md"][0] = start_md
        self._kept = list(keep(np.zeros((1, 3, 0))))
        self._sums = Sums(np.zeros((3, 3)), np.zeros((3, 0)), 0.0)
        self._marks = [self._sums.copied()]  # at the collar and every BLOCK stations from there

    def __len__(self) -> int:
        """How many points there are."""
        return len(self._tangents)

    def __getitem__(self, place: int) -> Point:
        place = range(len(self))[place]
        md, position, cov = self._rows[place]
        unit = np.array(self._tangents[place].unit)
        return Point(float(md), unit, position.copy(), cov.copy(), self._kept[place])

    @property
    def points(self) -> list[Point]:
        """Every station and the collar before them, made anew."""
        return [self[place] for place in range(len(self))]

    @property
    def md(self) -> Array:
        """Depths (n,) of the points, m."""
        return np.asarray(self._rows["md"][: len(self)])

    @property
    def positions(self) -> Array:
        """Positions (n, 3) of the points, m."""
        return np.asarray(self._rows["position"][: len(self)])

    @property
    def covs(self) -> Array:
        """Covariances (n, 3, 3) of the positions, m^2."""
        return np.asarray(self._rows["cov"][: len(self)])

    def append(self, md: float, direction: Direction) -> Point:
        """Add the station at ``md`` (m).

        Raises
        ------
        SurveyError
            When the depth does not grow, or the two directions are opposite.
        """
        self.extend([(md, direction)])
        return self[-1]

    def extend(self, stations: Sequence[tuple[float, Direction]]) -> None:
        """Add stations (m, direction); the same bit for bit as one after the other, and several times as fast.

        Raises
        ------
        SurveyError
            When a depth does not grow, or two directions are opposite; then none is added.
        """
        self._extend([md for md, _ in stations], tangents_along([direction for _, direction in stations]))

    def lead_through(self, stations: Sequence[tuple[float, Direction]]) -> None:
        """Lead it from the collar through these stations (m, direction), bit for bit as one that is drawn anew.

        Down to the first one that is another than before it stays as it is.

        Raises
        ------
        SurveyError
            When a depth does not grow, or two directions are opposite; then what is below may be lacking.
        """
        mds, tangents = [md for md, _ in stations], tangents_along([one for _, one in stations], self._tangents)
        known = zip(self.md[1:].tolist(), self._tangents[1:], strict=True)
        are_same = map(operator.eq, zip(mds, tangents, strict=True), known)
        same = sum(itertools.takewhile(bool, are_same))
        if same < len(self) - 1:
            same -= same % BLOCK
            self._cut(same)
        self._extend(mds[same:], tangents[same:])

    def _cut(self, count: int) -> None:
        """Go back to the first stations, a number of blocks."""
        del self._tangents[count + 1 :], self._kept[count + 1 :], self._marks[count // BLOCK + 1 :]
        self._sums = self._marks[-1].copied()

    def _extend(self, mds: Sequence[float], tangents: Sequence[Tangent]) -> None:
        if not tangents:
            return
        before = len(self) - 1
        depths = [float(self._rows["md"][before]), *mds]
        lengths = np.diff(depths)
        for n, length in enumerate(lengths.tolist()):
            if not 0.0 < length < math.inf:
                raise SurveyError(f"trajectory: expected a depth beyond {depths[n]:g} m, got {mds[n]:g} m")
        along = [self._tangents[-1], *tangents]
        legs = self._legs(lengths, depths, along)
        self._make_room(len(tangents))
        own = self._rows[before + 1 : before + 1 + len(mds)]
        own["md"] = mds
        own["position"] = np.add.accumulate([self._rows["position"][before], *legs])[1:]
        first = 0
        while first < len(mds):
            some = slice(first, min(first + BLOCK - (before + first) % BLOCK, len(mds)))
            self._sums, runs, covs = _follow(self._sums, lengths[some], along[some.start : some.stop + 1])
            for begin, run in zip(itertools.accumulate(map(len, runs), initial=0), runs, strict=False):
                covs[begin : begin + len(run)] += run @ run.transpose(0, 2, 1)
                self._kept.extend(self._keep(run))
            own["cov"][some] = covs
            first = some.stop
            if (before + first) % BLOCK == 0:
                self._marks.append(self._sums.copied())
        self._tangents += tangents

    def columns(self) -> Iterator[Array]:
        """Shared columns (n, 3, s) of the points from the collar down, some at a time, as many as were known there."""
        yield np.zeros((1, 3, 0))
        lengths = np.diff(self.md)
        for number, mark in enumerate(self._marks):
            some = slice(number * BLOCK, min((number + 1) * BLOCK, len(lengths)))
            if some.start < some.stop:
                yield from _follow(mark.copied(), lengths[some], self._tangents[some.start : some.stop + 1])[1]

    def _make_room(self, more: int) -> None:
        """Have rows for more points."""
        known, count = self._rows, len(self)
        if count + more > len(known):
            self._rows = np.zeros(count + more + (count + more) // GROWTH, ROW)
            self._rows[:count] = known[:count]

    def _legs(self, lengths: Array, mds: Sequence[float], tangents: Sequence[Tangent]) -> Array:
        """Displacements (n, 3) from station to station."""
        if self._method is Method.BALANCED_TANGENTIAL:
            units = np.array([one.unit for one in tangents])
            return np.asarray((0.5 * lengths)[:, None] * (units[:-1] + units[1:]))
        ends = zip(mds, itertools.pairwise(tangents), lengths.tolist(), strict=False)
        return np.array([self._leg(md, *pair, length) for md, pair, length in ends])

    def _leg(self, md: float, before: Tangent, tangent: Tangent, length: float) -> Array:
        i1, a1 = angles(np.array(before.unit[:2]), before.unit[2])
        i2, a2 = angles(tangent.direction.lean, tangent.direction.down)
        if self._method is Method.MINIMUM_CURVATURE and dogleg(math, i1, a1, i2, a2) > math.pi - OPPOSITE:
            raise SurveyError(f"trajectory: the hole turns back on itself between {md:g} and {md + length:g} m")
        return np.array(leg(math, self._method, length, i1, a1, i2, a2))


def _follow(sums: Sums, lengths: Array, tangents: Sequence[Tangent]) -> tuple[Sums, list[Array], Array]:
    """Go on from sums, which are used up, by legs (n,), m, with the tangents at both ends of each, n + 1.

    Returns the sums, the shared columns (.., 3, s) of the positions at the ends of the legs, those with equally many
    together, and the covariances (n, 3, 3) that are their own.
    """
    from groundstation.survey.kernels.position_errors import add_stations  # whoever only reads needs no compiler

    columns = [one.columns for one in tangents]
    known = max(sums.passed.shape[1], columns[0].width)
    widths = list(itertools.accumulate((one.width for one in columns[1:]), max, initial=known))
    starts = np.array([0, *itertools.accumulate(len(one.places) for one in columns)])
    places = np.concatenate([one.places for one in columns]).astype(np.intp, copy=False)
    ends = 0.5 * lengths
    weights = ends.copy()  # of the station before each, which has both its legs now
    weights[0] += 0.5 * sums.length
    weights[1:] += ends[:-1]
    passed, shared, out = (
        widened(sums.passed, widths[-1]),
        np.empty((len(ends), 3, widths[-1])),
        np.empty((len(ends), 3, 3)),
    )
    covs, values = np.array([one.cov for one in tangents]), np.concatenate([one.values for one in columns], axis=1)
    add_stations(weights, ends, starts, places, values, covs, passed, sums.own, shared, out)
    runs, end = [], 0
    for width, same in itertools.groupby(widths[1:]):
        begin, end = end, end + len(list(same))
        runs.append(shared[begin:end, :, :width])
    return Sums(sums.own, passed, float(lengths[-1])), runs, out


def interpolate(points: list[Point], md: float) -> Point:
    """Point on the arc between two stations at ``md`` (m); its covariance is interpolated between theirs.

    Raises
    ------
    SurveyError
        When ``md`` is outside the trajectory.
    """
    if not points[0].md <= md <= points[-1].md:
        raise SurveyError(f"trajectory: expected a depth of {points[0].md:g}..{points[-1].md:g} m, got {md:g} m")
    for upper, lower in itertools.pairwise(points):
        if md <= lower.md:
            return on_arc(upper, lower, (md - upper.md) / (lower.md - upper.md))
    return points[-1]


def on_arc(upper: Point, lower: Point, f: float) -> Point:
    """Fraction ``f`` of a leg along its arc, bent evenly so that it ends where the method put the lower station."""
    angle = math.atan2(
        float(np.linalg.norm(np.cross(upper.tangent, lower.tangent))), float(upper.tangent @ lower.tangent)
    )
    if angle < 1e-9:
        tangent = upper.tangent + f * (lower.tangent - upper.tangent)
    else:
        tangent = (math.sin((1.0 - f) * angle) * upper.tangent + math.sin(f * angle) * lower.tangent) / math.sin(angle)
    half = 0.5 * (lower.md - upper.md)
    arc = half * f * ratio_factor(math, f * angle) * (upper.tangent + tangent)
    whole = half * ratio_factor(math, angle) * (upper.tangent + lower.tangent)
    position = upper.position + arc + f * (lower.position - upper.position - whole)
    cov = (1.0 - f) * upper.cov + f * lower.cov
    shared = added((1.0 - f) * upper.shared, f * lower.shared)
    return Point(upper.md + f * (lower.md - upper.md), tangent, position, cov, shared)
