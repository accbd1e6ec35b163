"""The hole as it was surveyed: stations, what moved, trajectory, deviations and their alarms. No I/O.

Surveys come many at a time, one of every tube at a stop. What follows from all of them is worked out once, when
somebody asks for it: fifty tubes would keep the ground station busy for the length of the stop otherwise.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_left, insort
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from groundstation.config import GroundConfig
from groundstation.service.alarms import AlarmList
from groundstation.service.history import SAME_STOP, History
from groundstation.survey.columns import Deviation, deviations, project
from groundstation.survey.fusion import (
    Departure,
    Evidence,
    GrowingBayes,
    Weighting,
    departure_from,
    judge_departure,
    weighted,
)
from groundstation.survey.resolve import Direction, Quality
from groundstation.survey.shared import SharedErrors
from groundstation.survey.trajectory import Point, Trajectory
from groundstation.survey.trust import UNKNOWN_YAW_VAR, Trust
from telemetry.messages import SurveyMeasurement


@dataclass(frozen=True, slots=True)
class ResolvedStop:
    """One resolved survey measurement."""

    measurement: SurveyMeasurement
    md: float
    direction: Direction
    quality: Quality
    trust: Trust = Trust.FULL
    seq: int = 0  # place in the order in which surveys were placed

    @property
    def at(self) -> float:
        """Rig time of the stop, s."""
        return self.measurement.station_at

    @property
    def yaw_var(self) -> float:
        """Random variance of the yaw (rad^2) with which it is fused."""
        return self.measurement.yaw_var + (UNKNOWN_YAW_VAR if self.trust is Trust.UNKNOWN_YAW else 0.0)


def _in_time(cluster: ResolvedStop) -> tuple[float, int]:
    """What the clusters of a station are ordered by."""
    return cluster.at, cluster.measurement.tube


@dataclass(slots=True)
class SurveyStation:
    """One depth of the hole and every cluster measured there, oldest first.

    ``drops`` are the places of clusters that found another hole than those before them.
    """

    md: float
    clusters: list[ResolvedStop] = field(default_factory=list)
    drops: list[int] = field(default_factory=list)
    _departures: dict[int, Departure] = field(default_factory=dict)
    _fused: tuple[tuple[int, ...], Direction] | None = None  # with what it was made of
    _shown: tuple[tuple[int, ...], dict[str, Any]] | None = None
    _counted: GrowingBayes = field(default_factory=GrowingBayes)
    _with_untrusted: GrowingBayes | None = None

    @property
    def count(self) -> int:
        """Clusters measured here."""
        return len(self.clusters)

    @property
    def first(self) -> int:
        """Place of the first cluster that counts."""
        return self.first_before(self.count)

    def first_before(self, place: int) -> int:
        """Place of the first cluster that counted when the one at ``place`` came."""
        return max((drop for drop in self.drops if drop < place), default=0)

    def add_stop(self, cluster: ResolvedStop) -> None:
        """Add a cluster in the order of time; what was judged of later ones is forgotten."""
        place = self.count
        while place and _in_time(self.clusters[place - 1]) > _in_time(cluster):
            place -= 1
        self.clusters.insert(place, cluster)
        self.forget(place)

    def forget(self, place: int) -> None:
        """Forget decisions from ``place`` on."""
        self.drops = [drop for drop in self.drops if drop < place]
        self._departures = {k: d for k, d in self._departures.items() if k < place}

    @property
    def counting(self) -> list[ResolvedStop]:
        """Clusters that count: of those since the hole moved the trusted ones, or all where none is."""
        since = self.clusters[self.first :]
        return [cluster for cluster in since if cluster.trust is Trust.FULL] or since

    @property
    def untrusted(self) -> int:
        """Clusters measured here whose yaw is not believed."""
        return sum(cluster.trust is not Trust.FULL for cluster in self.clusters)

    def readings(self) -> list[Direction]:
        """Directions of the clusters that count."""
        return [cluster.direction for cluster in self.counting]

    @property
    def _made_of(self) -> tuple[int, ...]:
        """What changes with every cluster that comes or does not count any more."""
        return self.count, *self.drops

    def shown(self, show: Callable[[SurveyStation], dict[str, Any]]) -> dict[str, Any]:
        """What one view shows of the clusters that count; made anew where another has come."""
        made_of = self._made_of
        if self._shown is None or self._shown[0] != made_of:
            self._shown = made_of, show(self)
        return self._shown[1]

    def fused(self, weighting: Weighting) -> Direction:
        """Direction from the clusters that count; worked out anew where another has come."""
        made_of = self._made_of
        if self._fused is None or self._fused[0] != made_of:
            readings = self.readings()
            is_sum = weighting is Weighting.BAYES
            self._fused = made_of, self._counted.of(readings) if is_sum else weighted(readings, weighting)
        return self._fused[1]

    def _sum_of_all(self) -> GrowingBayes:
        """Sum of the clusters since the hole moved, whether they are believed or not."""
        if not self.untrusted:
            return self._counted  # of which it is a part: what comes next is added to it
        if self._with_untrusted is None:
            self._with_untrusted = GrowingBayes()
        return self._with_untrusted

    def departure(self, place: int) -> Departure | None:
        """How far the cluster at ``place`` departed from those before; None for the first of its hole."""
        first = self.first_before(place)
        if first == place:
            return None
        if place not in self._departures:
            earlier = self._sum_of_all().of([c.direction for c in self.clusters[first:place]])
            self._departures[place] = departure_from(earlier, self.clusters[place].direction)
        return self._departures[place]


@dataclass(frozen=True, slots=True)
class Moved:
    """The decision that the hole moved at a station, with its evidence."""

    md: float
    at: float  # s
    dropped: int  # earlier clusters that no longer count
    evidence: Evidence


class Hole:
    """Every survey of a hole that was placed, and what follows from them.

    Parameters
    ----------
    config : design, tolerance and weighting
    shared : the errors that its readings share
    """

    def __init__(self, config: GroundConfig, shared: SharedErrors) -> None:
        self._config = config
        self._shared = shared
        self._design = config.design
        self._stations: list[SurveyStation] = []
        self._moved: list[Moved] = []
        self._alarms = AlarmList()
        self._history = History()
        self._trajectory = self._at_collar()
        self._drawn: list[tuple[float, Direction]] = []  # stations of the trajectory, m and direction
        self._deviations = deviations(self._trajectory.points, self._design)
        self._point_at: dict[float, Point] = {}  # of every station below the collar, by its depth
        self._projection: Deviation | None = None
        self._unsettled_since = math.inf  # s, rig time of the oldest survey from which nothing follows yet
        self._newest_at = -math.inf  # s, rig time of the newest survey
        self.version = 0  # grows with every survey

    def add_stop(self, stop: ResolvedStop, epoch: int) -> None:
        """Take a survey with rig time of an epoch.

        Raises
        ------
        numpy.linalg.LinAlgError
            When it cannot be weighed; it was not taken.
        """
        _ = stop.direction.information
        self.version += 1
        if self._history.begins_stop(epoch, stop.at):
            self.settle()
            self._history.add(self._deviations, self._projection)
        self._history.on_survey(epoch, stop.at)
        self._station_at(stop.md).add_stop(stop)
        self._unsettled_since = min(self._unsettled_since, stop.at)
        self._newest_at = max(self._newest_at, stop.at)

    @property
    def stations(self) -> list[SurveyStation]:
        """Stations from the collar down."""
        self.settle()
        return self._stations

    @property
    def moved(self) -> list[Moved]:
        """Where the hole moved."""
        self.settle()
        return self._moved

    @property
    def alarms(self) -> AlarmList:
        """Levels of the tolerance that were reached."""
        self.settle()
        return self._alarms

    @property
    def history(self) -> History:
        """What was known at the end of every stop."""
        return self._history

    @property
    def trajectory(self) -> list[Point]:
        """Points from the collar down."""
        self.settle()
        return self._trajectory.points

    def point_of(self, station: SurveyStation) -> Point:
        """Point of the trajectory at a station; the collar for one at its depth."""
        self.settle()
        return self._point_at.get(station.md, self._trajectory.points[0])

    @property
    def deviations(self) -> list[Deviation]:
        """Deviation from the design axis at every point of the trajectory."""
        self.settle()
        return self._deviations

    @property
    def projection(self) -> Deviation | None:
        """Deviation at the target, if the hole goes on straight; None before the first station."""
        self.settle()
        return self._projection

    def settle(self) -> None:
        """Work out what follows from the surveys that have come since the last time."""
        since, self._unsettled_since = self._unsettled_since, math.inf
        if since < math.inf:
            self._judge_movement(since)
            self._work_out()

    def _work_out(self) -> None:
        self._draw([(one.md, one.fused(self._config.weighting)) for one in self._stations if one.md > 0.0])
        if not self._drawn:
            return
        worst = max(self._deviations[1:], key=lambda d: d.ratio)
        self._projection = project(self._trajectory.points[-1], self._drawn[-1][1], self._design)
        self._alarms.judge_deviation("deviation", worst, self._newest_at)
        self._alarms.judge_deviation("projection", self._projection, self._newest_at)

    def _draw(self, stations: list[tuple[float, Direction]]) -> None:
        """Trajectory through stations (m, direction); where none has changed the new ones are added to it."""
        same = zip(stations, self._drawn, strict=False)
        if len(stations) < len(self._drawn) or any(new[1] is not old[1] for new, old in same):
            self._trajectory, self._drawn, self._deviations = self._at_collar(), [], []
        added = stations[len(self._drawn) :]
        self._trajectory.extend(added)
        self._drawn += added
        self._point_at = {point.md: point for point in self._trajectory.points[1:]}
        self._deviations += deviations(self._trajectory.points[len(self._deviations) :], self._design)

    def _at_collar(self) -> Trajectory:
        """A trajectory without stations; a point of it keeps the variances of its position by kind, (kinds, 3)."""
        return Trajectory(keep=self._shared.variances)

    def _station_at(self, md: float) -> SurveyStation:
        first = bisect_left(self._stations, md - 2.0 * self._config.station_tolerance, key=lambda known: known.md)
        for station in itertools.islice(self._stations, first, None):
            if abs(station.md - md) <= self._config.station_tolerance:
                return station
            if station.md > md:
                break
        station = SurveyStation(md)
        insort(self._stations, station, key=lambda known: known.md)
        return station

    def _judge_movement(self, since: float) -> None:
        """Drop earlier clusters where the hole moved, at every stop from the one at rig time ``since`` (s) on.

        Each stop is judged as a whole, so the order in which its surveys arrive changes nothing.
        """
        stops = self._stops(since)
        begin = stops[0][0][0]
        self._moved = [moved for moved in self._moved if moved.at < begin]
        for stop in stops:
            for _, number, place in stop:
                self._stations[number].drops = [d for d in self._stations[number].drops if d != place]
        for stop in stops:
            self._judge_stop(stop)

    def _stops(self, since: float) -> list[list[tuple[float, int, int]]]:
        """Stops that lasted to rig time ``since`` (s) or came later: clusters as (time, station, place) in their order.

        They are parted where the string was not read for a while.
        """
        begin, recent = since, self._clusters_after(since - SAME_STOP)
        while recent and recent[0][0] < begin:
            begin = recent[0][0]
            recent = self._clusters_after(begin - SAME_STOP)
        stops: list[list[tuple[float, int, int]]] = []
        for cluster in recent:
            if not stops or cluster[0] - stops[-1][-1][0] >= SAME_STOP:
                stops.append([])
            stops[-1].append(cluster)
        return stops

    def _clusters_after(self, time: float) -> list[tuple[float, int, int]]:
        """Clusters read later than a rig time (s) as (time, station, place), in their order."""
        found = []
        for number, station in enumerate(self._stations):
            for place in range(station.count - 1, -1, -1):
                if station.clusters[place].at <= time:
                    break
                found.append((station.clusters[place].at, number, place))
        return sorted(found)

    def _judge_stop(self, stop: list[tuple[float, int, int]]) -> None:
        """Neighbours are the nearest stations above and below that were read at the same stop."""
        by_depth = sorted(stop, key=lambda cluster: cluster[1:])
        seen = [self._stations[number].departure(place) for _, number, place in by_depth]
        for k, (at, number, place) in enumerate(by_depth):
            own = seen[k]
            if own is None:
                continue
            around = [d for d in (*seen[max(k - 1, 0) : k], *seen[k + 1 : k + 2]) if d is not None]
            evidence = judge_departure(own, around)
            if evidence.moved:
                station = self._stations[number]
                self._moved.append(Moved(station.md, at, place - station.first_before(place), evidence))
                station.drops.append(place)
