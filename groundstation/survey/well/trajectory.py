"""From directions at measured depths to positions with their covariance, one station appended at a time.

A station enters two legs, so its weight in the position is half their summed length, and half the last leg for the last
station (the Jacobian of the balanced tangential method, used for every method as the industry's error model does).
Its errors are kept by running sums in a compiled loop: appending costs the same however many stations there are, and
where one changes, those below are drawn from the nearest mark above. What stations share may become more columns as the
hole grows; the columns of a point are those known when it was added.
Source: thesis 2.1-2.3 and eqs. I.1-I.12. Frame: north, east, down.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Final

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.fusion.resolve import Direction, direction_angles
from groundstation.survey.fusion.shared import Packed, add_shared_errors
from groundstation.survey.fusion.sphere_direction import tangent_errors
from groundstation.survey.fusion.tangents import tangent_jacobians, tangents_of
from groundstation.survey.well.methods import OPPOSITE, Method, dogleg, leg_displacement, ratio_factor

Array = npt.NDArray[np.float64]
BLOCK = 64  # stations from mark to mark
NONE: Final = Packed(np.zeros((2, 0)))
UNKNOWN: Final = np.zeros((3, 0))
NOTHING: Final = np.zeros(0)
FROM_ZERO: Final = np.zeros(1, np.intp)


@dataclass(frozen=True, slots=True)
class TrajectoryPoint:
    """One station of a trajectory."""

    md: float  # m
    tangent: Array  # (3,)
    position: Array  # (3,) m, north east down
    cov: Array  # (3, 3) m^2, random and shared
    shared: Array  # (3, s) m, change for one standard deviation of every shared error; (3, 0) where it is not kept


ROW: Final = np.dtype(
    [
        ("md", np.float64),
        ("tangent", np.float64, 3),
        ("own", np.float64, (3, 3)),  # covariance of the tangent that no other shares
        ("width", np.intp),  # shared columns that the direction knows
        ("count", np.intp),  # of them those that are kept
        ("position", np.float64, 3),
        ("cov", np.float64, (3, 3)),
    ]
)
FEWEST = 8  # rows of a table
GROWTH = 8  # share of its rows by which a table grows


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


class Trajectory:
    """Positions of stations in order of depth.

    Parameters
    ----------
    method : of the legs
    collar : direction at the first depth, known: vertical by default
    start_md : m
    keeps_columns : whether every point keeps its shared columns, which of a string of fifty tubes are 750 numbers
    """

    def __init__(
        self,
        method: Method = Method.BALANCED_TANGENTIAL,
        collar: Direction | None = None,
        start_md: float = 0.0,
        *,
        keeps_columns: bool = True,
    ) -> None:
        self._method = method
        self._keeps_columns = keeps_columns
        first = collar or Direction(np.zeros(2), 1.0, np.zeros((2, 2)), np.zeros((2, 0)))
        self._rows = np.zeros(FEWEST, ROW)
        self._directions: list[Direction] = []  # of the collar and every station
        self._columns: list[Packed] = []  # (2, s), of each
        self._down: list[Array] = []  # and what those come to in the vertical, (c,) of those that are kept
        self._insert(0, start_md, first)
        self._direct([0])
        self._kept = [UNKNOWN]  # shared columns of every point that is drawn
        self._sums = TrajectorySums(np.zeros((3, 3)), np.zeros((3, 0)), 0.0)
        self._marks = [self._sums]  # at the collar and every BLOCK stations from there

    def __len__(self) -> int:
        """Number of points."""
        return len(self._directions)

    def __getitem__(self, place: int) -> TrajectoryPoint:
        place = range(len(self))[place]
        row = self._rows[place]
        return TrajectoryPoint(
            float(row["md"]), row["tangent"].copy(), row["position"].copy(), row["cov"].copy(), self._kept[place]
        )

    @property
    def points(self) -> list[TrajectoryPoint]:
        """The collar and every station, made anew."""
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

    def append(self, md: float, direction: Direction) -> TrajectoryPoint:
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
        depths = [float(self._rows["md"][len(self) - 1]), *(md for md, _ in stations)]
        for before, md in itertools.pairwise(depths):
            if not 0.0 < md - before < math.inf:
                raise SurveyError(f"trajectory: expected a depth beyond {before:g} m, got {md:g} m")
        known = len(self)
        for place, (md, direction) in enumerate(stations, known):
            self._insert(place, md, direction)
        self._direct(range(known, len(self)))
        try:
            self._draw(known)
        except SurveyError:
            del self._directions[known:], self._columns[known:], self._down[known:]
            raise

    def put(self, stations: Iterable[tuple[float, Direction]]) -> None:
        """Put stations (m, direction) between the others, or in the place of those at the same depth.

        What is above the first of them stays as it is; the whole is bit for bit as one that is drawn anew.

        Raises
        ------
        SurveyError
            When a depth is not below the first; then none is put.
        """
        changed, collar = [], float(self._rows["md"][0])
        stations = sorted(stations, key=itemgetter(0))
        for md, _ in stations:
            if not collar < md < math.inf:
                raise SurveyError(f"trajectory: expected a depth beyond {collar:g} m, got {md:g} m")
        for md, direction in stations:
            place = int(np.searchsorted(self.md, md))
            if place == len(self) or self._rows["md"][place] != md:
                self._insert(place, md, direction)
            elif self._directions[place] is direction:
                continue
            self._directions[place] = direction
            changed.append(place)
        self._direct(changed)
        if changed:
            self._draw(changed[0])

    def columns(self) -> Iterator[Array]:
        """Shared columns (n, 3, s) of the points from the collar down, some at a time, as many as were known there."""
        yield UNKNOWN[None]
        for begin, mark in zip(range(0, len(self) - 1, BLOCK), self._marks, strict=False):
            yield from self._follow(mark, begin, min(begin + BLOCK, len(self) - 1), with_columns=True).runs

    def _insert(self, place: int, md: float, direction: Direction) -> None:
        """Insert a row for a station; what follows from its direction is not in it yet."""
        known, count = self._rows, len(self)
        if count == len(known):
            self._rows = np.zeros(count + 1 + count // GROWTH, ROW)
            self._rows[:count] = known
        self._rows[place + 1 : count + 1] = self._rows[place:count]
        self._rows["md"][place] = md
        self._directions.insert(place, direction)
        self._columns.insert(place, NONE)
        self._down.insert(place, NOTHING)

    def _direct(self, places: Sequence[int]) -> None:
        """Compute the rows at some places that depend on their own direction alone."""
        if not places:
            return
        directions = [self._directions[place] for place in places]
        tangents = tangents_of(directions)
        jacobians = tangent_jacobians(tangents)
        rows, at = self._rows, np.array(places)
        for place, direction, jacobian in zip(places, directions, jacobians, strict=True):
            rows["own"][place], self._columns[place], self._down[place] = tangent_errors(direction, jacobian)
        rows["tangent"][at] = tangents
        rows["width"][at] = [direction.width for direction in directions]
        rows["count"][at] = [len(self._columns[place].places) for place in places]

    def _draw(self, first: int) -> None:
        """Compute the positions from a place on."""
        begin = first - 1
        if begin < len(self._kept) - 1:
            begin -= begin % BLOCK
            del self._kept[begin + 1 :], self._marks[begin // BLOCK + 1 :]
            self._sums = self._marks[-1]
        end = len(self)
        rows = self._rows[begin:end]
        rows["position"] = np.add.accumulate([rows["position"][0], *self._legs(rows)])
        followed = self._follow(self._sums, begin, end - 1, with_columns=self._keeps_columns)
        rows["cov"][1:] = followed.covs
        self._sums = followed.sums
        self._marks += followed.marks
        if self._keeps_columns:
            self._kept += itertools.chain.from_iterable(followed.runs)
        else:
            self._kept += [UNKNOWN] * (len(rows) - 1)

    def _follow(self, sums: TrajectorySums, begin: int, end: int, *, with_columns: bool) -> Followed:
        """Continue ``sums`` from one place to another."""
        from groundstation.survey.well.kernels.position_errors import (
            add_stations,  # reading alone needs no compiler
        )

        rows, columns = self._rows[begin : end + 1], self._columns[begin : end + 1]
        known = max(sums.passed.shape[1], int(rows["width"][0]))
        widths = np.maximum(np.maximum.accumulate(rows["width"][1:]), known)
        starts = np.concatenate([FROM_ZERO, rows["count"].cumsum()])
        places = np.concatenate([one.places for one in columns]).astype(np.intp, copy=False)
        lean, down = (
            np.concatenate([one.values for one in columns], axis=1),
            np.concatenate(self._down[begin : end + 1]),
        )
        legs = np.diff(rows["md"])
        ends = 0.5 * legs
        weights = ends.copy()  # of the station before each, which has both its legs now
        weights[0] += 0.5 * sums.length
        weights[1:] += ends[:-1]
        width, count = int(widths[-1]), len(ends)
        marked = np.arange(BLOCK - begin % BLOCK, count + 1, BLOCK) - 1
        marks, own_marks = np.empty((len(marked), 3, width)), np.empty((len(marked), 3, 3))
        passed, own = np.zeros((3, width)), sums.own.copy()
        passed[:, : sums.passed.shape[1]] = sums.passed
        shared, covs = np.empty((count if with_columns else 0, 3, width)), np.empty((count, 3, 3))
        add_stations(
            weights, ends, starts, places, lean, down, rows["own"].copy(), widths, passed, own,
            int(marked[0]) if len(marked) else count, BLOCK, marks, own_marks, shared, covs,
        )  # fmt: skip
        return Followed(
            TrajectorySums(own, passed, float(legs[-1])),
            [
                TrajectorySums(own_marks[number].copy(), marks[number, :, : int(widths[k])].copy(), float(legs[k]))
                for number, k in enumerate(marked.tolist())
            ],
            runs_of(shared, widths) if with_columns else [],
            covs,
        )

    def _legs(self, rows: npt.NDArray[np.void]) -> Array:
        """Displacements (n, 3) from station to station."""
        if self._method is Method.BALANCED_TANGENTIAL:
            return np.asarray((0.5 * np.diff(rows["md"]))[:, None] * (rows["tangent"][:-1] + rows["tangent"][1:]))
        return np.array([self._leg(*ends) for ends in itertools.pairwise(rows)])

    def _leg(self, before: np.void, after: np.void) -> Array:
        i1, a1 = direction_angles(before["tangent"][:2], float(before["tangent"][2]))
        i2, a2 = direction_angles(after["tangent"][:2], float(after["tangent"][2]))
        md, below = float(before["md"]), float(after["md"])
        if self._method is Method.MINIMUM_CURVATURE and dogleg(math, i1, a1, i2, a2) > math.pi - OPPOSITE:
            raise SurveyError(f"trajectory: the hole turns back on itself between {md:g} and {below:g} m")
        return np.array(leg_displacement(math, self._method, below - md, i1, a1, i2, a2))


def runs_of(shared: Array, widths: npt.NDArray[np.intp]) -> list[Array]:
    """Parts of columns (n, 3, s) with as many columns as were known of each, those with equally many together."""
    borders = [0, *(np.flatnonzero(np.diff(widths)) + 1).tolist(), len(widths)]
    return [shared[a:b, :, : int(widths[a])] for a, b in itertools.pairwise(borders)]


def interpolate_point(points: list[TrajectoryPoint], md: float) -> TrajectoryPoint:
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


def on_arc(upper: TrajectoryPoint, lower: TrajectoryPoint, f: float) -> TrajectoryPoint:
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
    shared = add_shared_errors((1.0 - f) * upper.shared, f * lower.shared)
    return TrajectoryPoint(upper.md + f * (lower.md - upper.md), tangent, position, cov, shared)
