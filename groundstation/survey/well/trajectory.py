"""From directions at measured depths to positions with their covariance, one station appended at a time.

A station enters two legs, so its weight in the position is half their summed length, and half the last leg for the last
station: the Jacobian of the balanced tangential method, used for every method as the industry's error model does. Of
an arc that bends by b it leaves out b/3 along the hole and b^2/12 across it of what one leg makes of an error: of first
order in the error it is right to first order in the bend, at 3 deg a leg to two hundredths along and to two parts in
ten thousand across. An error of a depth, e, changes how long a leg is, and so moves what is below it along the leg,
tau (e_k - e_(k-1)) with the leg's displacement a metre tau. What the path does between stations is in ``leg_wander``.
Errors are kept by running sums in a compiled loop: appending costs the same however many stations there are, and
where one changes, those below are drawn from the nearest mark above. What stations share may become more columns as the
hole grows; the columns of a point are those known when it was added.
Source: thesis 2.1-2.3 and eqs. I.1-I.12; Definition of the ISCWSA error model, revision 5. Frame: north, east, down.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from operator import itemgetter
from typing import Final

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.fusion.direction_run import DirectionRun
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.shared import add_shared_errors
from groundstation.survey.fusion.tangents import tangents_of
from groundstation.survey.path.leg_wander import STEADY, UNTIED, CollarTie, LegWander
from groundstation.survey.well.arcs import on_arc
from groundstation.survey.well.depth_errors import EXACT, StationDepth
from groundstation.survey.well.methods import Method
from groundstation.survey.well.north_swing import inward_covs
from groundstation.survey.well.trajectory_legs import check_bends, leg_displacements
from groundstation.survey.well.trajectory_rows import (
    TrajectoryPoint,
    TrajectorySums,
    across_of,
)
from groundstation.survey.well.trajectory_stations import BLOCK, TrajectoryStations

Array = npt.NDArray[np.float64]
UNKNOWN: Final = np.zeros((3, 0))
NOTHING: Final = np.zeros(0)
ALL_EXACT: Final[Mapping[float, StationDepth]] = {}
TURNED_BACK = math.cos(math.radians(120.0))  # of the bend of one leg, beyond which it is no hole any more


class Trajectory:
    """Positions of stations in order of depth.

    Parameters
    ----------
    method : of the legs
    collar : direction at the first depth, known: vertical by default
    start_md : m
    wander : of the path between the stations
    keeps_columns : whether every point keeps its shared columns, which of a string of fifty tubes are 750 numbers
    """

    def __init__(
        self,
        method: Method = Method.MINIMUM_CURVATURE,
        collar: Direction | None = None,
        start_md: float = 0.0,
        *,
        wander: LegWander = STEADY,
        keeps_columns: bool = True,
    ) -> None:
        self.method = method
        self._wander = wander
        self._ties = UNTIED
        self._north_std = 0.0
        self._driven = NOTHING  # (s,), variance by which each leg is driven over that of the curvature; 1 of the others
        self._keeps_columns = keeps_columns
        first = collar or Direction(np.zeros(2), 1.0, np.zeros((2, 2)), np.zeros((2, 0)))
        self._stations = TrajectoryStations()
        self._stations.insert(0, start_md, first)
        self._stations.direct([0])
        self._kept = [UNKNOWN]  # shared columns of every point that is drawn
        self._sums = TrajectorySums(np.zeros((3, 3)), np.zeros((3, 0)), 0.0)
        self._marks = [self._sums]  # at the collar and every BLOCK stations from there

    def __len__(self) -> int:
        """Number of points."""
        return len(self._stations.depths)

    def __getitem__(self, place: int) -> TrajectoryPoint:
        place = range(len(self))[place]
        row = self._stations.rows[place]
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
        return np.asarray(self._stations.rows["md"][: len(self._stations.depths)])

    @property
    def tangent_covs(self) -> Array:
        """Covariances (n, 3, 3) of the directions, of each the part that no other shares."""
        return np.asarray(self._stations.rows["own"][: len(self._stations.depths)])

    @property
    def positions(self) -> Array:
        """Positions (n, 3) of the points, m."""
        return np.asarray(self._stations.rows["position"][: len(self._stations.depths)])

    @property
    def tangents(self) -> Array:
        """Tangents (n, 3) at the points."""
        return np.asarray(self._stations.rows["tangent"][: len(self._stations.depths)])

    @property
    def covs(self) -> Array:
        """Covariances (n, 3, 3) of the positions, m^2."""
        return np.asarray(self._stations.rows["cov"][: len(self._stations.depths)])

    @property
    def path_covs(self) -> Array:
        """Covariances (n, 3, 3), m^2, that the path between the stations makes of ``covs``."""
        return np.asarray(self._stations.rows["path"][: len(self._stations.depths)])

    @property
    def depth_covs(self) -> Array:
        """Covariances (n, 3, 3), m^2, that the own errors of depths make of ``covs``; what they share has columns."""
        rows = self._stations.rows[: len(self._stations.depths)]
        along = rows["along"]
        return np.asarray(rows["kinks"] + rows["depth_var"][:, None, None] * (along[:, :, None] * along[:, None]))

    @property
    def turned_back(self) -> list[float]:
        """Depths (m) of the stations that point back against the one above: the hole is not what is drawn there."""
        tangents = self._stations.rows["tangent"][: len(self._stations.depths)]
        return [float(md) for md in self.md[1:][(tangents[:-1] * tangents[1:]).sum(axis=1) < TURNED_BACK]]

    def append(self, md: float, direction: Direction, depth: StationDepth = EXACT) -> TrajectoryPoint:
        """Add the station at ``md`` (m).

        Raises
        ------
        SurveyError
            When the depth does not grow, or the two directions are opposite.
        """
        self.extend([(md, direction)], {md: depth})
        return self[-1]

    def extend(
        self, stations: Sequence[tuple[float, Direction]], depths: Mapping[float, StationDepth] = ALL_EXACT
    ) -> None:
        """Add stations (m, direction); the same bit for bit as one after the other, and several times as fast.

        Parameters
        ----------
        stations : in the order of depth
        depths : errors of their depths, by these; those that are missing are exact

        Raises
        ------
        SurveyError
            When a depth does not grow, or two directions are opposite; then none is added.
        """
        mds = [float(self._stations.rows["md"][len(self) - 1]), *(md for md, _ in stations)]
        for before, md in itertools.pairwise(mds):
            if not 0.0 < md - before < math.inf:
                raise SurveyError(f"trajectory: expected a depth beyond {before:g} m, got {md:g} m")
        tangents = tangents_of([direction for _, direction in stations])
        known = len(self)
        check_bends(self.method, mds, np.concatenate([self._stations.rows["tangent"][known - 1 : known], tangents]))
        self._stations.append_all(stations, depths)
        self._stations.direct(range(known, len(self)), tangents)
        self._draw(known)

    def put(
        self, stations: Iterable[tuple[float, Direction]], depths: Mapping[float, StationDepth] = ALL_EXACT
    ) -> None:
        """Put stations (m, direction) between the others, or in the place of those at the same depth.

        What is above the first of them stays as it is; the whole is bit for bit as one that is drawn anew. Directions
        are taken as they come: a station that turns back is told by ``turned_back``.

        Parameters
        ----------
        depths : errors of their depths, by these; one that is missing stays as it was, which is exact at first

        Raises
        ------
        SurveyError
            When a depth is not below the first; then none is put.
        """
        changed, collar, known = list[int](), float(self._stations.rows["md"][0]), len(self._stations.depths)
        stations = sorted(stations, key=itemgetter(0))
        for md, _ in stations:
            if not collar < md < math.inf:
                raise SurveyError(f"trajectory: expected a depth beyond {collar:g} m, got {md:g} m")
        if stations and stations[0][0] > self._stations.rows["md"][known - 1]:
            self._stations.append_all(stations, depths)
            changed, stations = list(range(known, len(self))), []
        directions = self._stations.directions if stations else []
        for md, direction in stations:
            count = len(self._stations.depths)
            place = int(np.searchsorted(self._stations.rows["md"][:count], md))
            if place == count or self._stations.rows["md"][place] != md:
                self._stations.insert(place, md, direction)
            elif directions[place] is direction:
                continue
            directions[place] = direction
            self._stations.depths[place] = depths.get(md, self._stations.depths[place])
            changed.append(place)
        self._stations.direct(changed)
        if changed:
            self._draw(changed[0])

    def put_below(
        self, mds: Sequence[float], directions: Sequence[Direction], depths: Mapping[float, StationDepth] = ALL_EXACT
    ) -> None:
        """Put stations below all others; the same bit for bit as ``put``, and faster where they are side by side.

        Parameters
        ----------
        mds : m, growing
        directions : at these
        depths : errors of their depths, by these; one that is missing is exact

        Raises
        ------
        SurveyError
            When a depth does not grow; then none is put.
        """
        known = len(self)
        for before, md in itertools.pairwise([float(self._stations.rows["md"][known - 1]), *mds]):
            if not before < md < math.inf:
                raise SurveyError(f"trajectory: expected a depth beyond {before:g} m, got {md:g} m")
        if isinstance(directions, DirectionRun):
            self._stations.append_run(mds, directions, depths)
        else:
            self._stations.append_all([*zip(mds, directions, strict=True)], depths)
            self._stations.direct(range(known, len(self)))
        if mds:
            self._draw(known)

    def bend_as(self, wander: LegWander, driven: Array, ties: Sequence[CollarTie] = UNTIED) -> None:
        """Take another wander of the path, for what is drawn from now on.

        Parameters
        ----------
        driven : (s,), of each leg from the collar down the variance by which it is driven over that of the curvature
        ties : of the direction at the collar with each of the first legs
        """
        self._wander, self._driven, self._ties = wander, driven, tuple(ties)

    def swing_by(self, north_std: float) -> None:
        """Take in, for what is drawn from now on, that a north known so well (rad) moves positions on arcs."""
        self._north_std = north_std

    @property
    def swung_covs(self) -> Array:
        """What ``covs`` (n, 3, 3) have of these arcs beyond the way across, m^2."""
        return inward_covs(self.positions, self._north_std)

    @property
    def tied_covs(self) -> Array:
        """What ``covs`` (n, 3, 3) have of errors of the collar's direction that the first legs undo, m^2."""
        found = np.zeros((len(self), 3, 3))
        for place in range(min(len(self._ties), len(self) - 1)):
            found[place + 1 :] += self._tied(place, 1.0) * across_of(self._stations.rows["along"][place + 1])
        return found

    def _tied(self, place: int, share: float) -> float:
        """Variance each way across the hole, m^2, at a share of a leg by what it and the collar have in common."""
        if place >= len(self._ties):
            return 0.0
        first, leg = float(self.md[1] - self.md[0]), float(self.md[place + 1] - self.md[place])
        weight = 0.5 * first * (1.0 if place else share * (2.0 - share))  # of the direction at the collar in a place
        return 2.0 * weight * self._ties[place].moment_covariance(leg, share, self._wander.length)

    def _moments(self, begin: int, lengths: Array) -> Array:
        """Moments (n, 4) of the path over legs (n,), m, from the one below a place on."""
        found = self._wander.moments(lengths)
        if len(driven := self._driven[begin : begin + len(found)]):
            found[: len(driven), [0, 2]] *= driven[:, None]  # of itself, and of it with the curvature at its end
        return found

    @property
    def shared_depth_vars(self) -> Array:
        """Variances (n, 3) of the positions by what their depths share, m^2."""
        return self._stations.shared_depth_vars()

    def at(self, md: float) -> TrajectoryPoint:
        """Point at a depth (m): on the arc between two stations, with its own covariance.

        It is as one more station there would be whose direction is the share of the two around, and knows in addition
        how far the path may have left the arc.

        Raises
        ------
        SurveyError
            When ``md`` is outside the trajectory.
        """
        first, last = float(self._stations.rows["md"][0]), float(self._stations.rows["md"][len(self) - 1])
        if not first <= md <= last:
            raise SurveyError(f"trajectory: expected a depth of {first:g}..{last:g} m, got {md:g} m")
        place = int(np.searchsorted(self.md, md))
        return self[place] if self._stations.rows["md"][place] == md else self._between(place - 1, md)

    def _between(self, k: int, md: float) -> TrajectoryPoint:
        """Point between the station at a place and the next."""
        upper, lower = self._stations.rows[k], self._stations.rows[k + 1]
        leg = float(lower["md"] - upper["md"])
        f = (md - float(upper["md"])) / leg
        place, tangent = on_arc(upper["tangent"], lower["tangent"], lower["position"] - upper["position"], leg, f)
        along = place / (f * leg)
        sums = self._sums_at(k)
        weights = (0.5 * (sums.length + leg * f * (2.0 - f)), 0.5 * leg * f * f)
        by_depth = (upper["along"] - f * along, f * along)
        shared, cov = sums.passed, sums.own + upper["kinks"] + upper["path"]
        moment = self._wander.moment(leg, f)
        driven = float(self._driven[k]) if k < len(self._driven) else 1.0
        moment = moment._replace(variance=driven * moment.variance)
        cov = cov + self._wander.grown(float(upper["memory"]), moment) * across_of(along)
        if self._ties:
            cov = cov + self.tied_covs[k] + self._tied(k, f) * across_of(along)
        for row, own, weight, moved in zip((upper, lower), (k, k + 1), weights, by_depth, strict=True):
            cov = cov + weight**2 * row["own"] + float(row["depth_var"]) * np.outer(moved, moved)
            shared = add_shared_errors(shared, weight * self._stations.tangent_columns(own))
            shared = add_shared_errors(shared, moved[:, None] * self._stations.depths[own].columns.columns())
        if self._north_std:
            cov = cov + inward_covs(upper["position"] + place, self._north_std)
        return TrajectoryPoint(md, tangent, upper["position"] + place, cov + shared @ shared.T, shared)

    def _sums_at(self, place: int) -> TrajectorySums:
        """Running sums at a station."""
        begin = place - place % BLOCK
        mark = self._marks[begin // BLOCK]
        return mark if begin == place else self._stations.follow(mark, begin, place, with_columns=False).sums

    def columns(self) -> Iterator[Array]:
        """Shared columns (n, 3, s) of the points from the collar down, some at a time, as many as were known there."""
        yield UNKNOWN[None]
        for begin, mark in zip(range(0, len(self) - 1, BLOCK), self._marks, strict=False):
            yield from self._stations.follow(mark, begin, min(begin + BLOCK, len(self) - 1), with_columns=True).runs

    def _draw(self, first: int) -> None:
        """Compute the positions from a place on."""
        begin = first - 1
        if begin < len(self._kept) - 1:
            begin -= begin % BLOCK
            del self._kept[begin + 1 :], self._marks[begin // BLOCK + 1 :]
            self._sums = self._marks[-1]
        end = len(self._stations.depths)
        rows = self._stations.rows[begin:end]
        legs = leg_displacements(self.method, rows["md"], rows["tangent"])
        more = self._go_along(begin, rows, legs)
        followed = self._stations.follow(self._sums, begin, end - 1, with_columns=self._keeps_columns)
        rows["cov"][1:] = followed.covs + more
        if self._north_std:
            rows["cov"][1:] += self.swung_covs[begin + 1 :]
        if self._ties:
            rows["cov"][1:] += self.tied_covs[begin + 1 :]
        self._sums = followed.sums
        self._marks += followed.marks
        if self._keeps_columns:
            self._kept += itertools.chain.from_iterable(followed.runs)
        else:
            self._kept += [UNKNOWN] * (len(rows) - 1)

    def _go_along(self, begin: int, rows: npt.NDArray[np.void], legs: Array) -> Array:
        """Compute positions, and what depths and the path between stations come to (n, 3, 3), m^2, from a place on."""
        from groundstation.survey.well.kernels.position_errors import (
            follow_legs,  # reading alone needs no compiler
        )

        more = np.empty((len(legs), 3, 3))
        follow_legs(rows, legs, self._moments(begin, rows["md"][1:] - rows["md"][:-1]), self._wander.std, more)
        return more
