"""The hole as it was surveyed: stations, what moved, trajectory, deviations and their alarms. No I/O.

Surveys come many at a time, one of every tube at a stop. What follows from all of them is worked out once, when
somebody asks for it: fifty tubes would keep the ground station busy for the length of the stop otherwise.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_left, insort
from dataclasses import dataclass

import numpy as np

from groundstation.config import GroundConfig
from groundstation.service.alarms import AlarmList
from groundstation.service.clusters import Cluster, Clusters, Table
from groundstation.service.history import SAME_STOP, History
from groundstation.service.station import SurveyStation
from groundstation.survey.columns import Deviation, deviations, project
from groundstation.survey.fusion import Evidence, Weighting, departures_from, judge_departure
from groundstation.survey.resolve import Direction
from groundstation.survey.shared import SharedErrors
from groundstation.survey.trajectory import Point, Trajectory
from groundstation.survey.transport import Carried, carry


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
        self._surveys = Table()
        self._station_of: list[SurveyStation] = []  # of each of its rows
        self._surveyed: dict[float, SurveyStation] = {}  # since the last time, by depth
        self._stations: list[SurveyStation] = []
        self._moved: list[Moved] = []
        self._alarms = AlarmList()
        self._history = History()
        self._carried: dict[float, Carried] = {}  # by the depth of a station, where the string turns in a bent hole
        self._trajectory = self._at_collar()
        self._drawn: list[tuple[float, Direction]] = []  # stations of the trajectory, m and direction
        self._deviations = deviations(self._trajectory.points, self._design)
        self._point_at: dict[float, Point] = {}  # of every station below the collar, by its depth
        self._projection: Deviation | None = None
        self._unsettled_since = math.inf  # s, rig time of the oldest survey from which nothing follows yet
        self._newest_at = -math.inf  # s, rig time of the newest survey
        self.version = 0  # grows with every survey

    def add_cluster(self, cluster: Cluster, epoch: int) -> None:
        """Take a survey with rig time of an epoch.

        Raises
        ------
        numpy.linalg.LinAlgError
            When it cannot be weighed; it was not taken.
        """
        _ = cluster.direction.information
        self.version += 1
        if self._history.begins_stop(epoch, cluster.at):
            self.settle()
            self._history.add(self._deviations, self._projection)
        self._history.on_survey(epoch, cluster.at)
        station = self._station_at(cluster.md)
        station.add_cluster(cluster)
        self._station_of.append(station)
        self._surveyed[station.md] = station
        self._unsettled_since = min(self._unsettled_since, cluster.at)
        self._newest_at = max(self._newest_at, cluster.at)

    @property
    def stations(self) -> list[SurveyStation]:
        """Stations from the collar down."""
        self.settle()
        return self._stations

    def has_survey_of(self, tube: int) -> bool:
        """Whether a tube has surveyed below the collar."""
        return bool(np.any((self._surveys.column("tube") == tube) & (self._surveys.column("md") > 0.0)))

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

    def direction_of(self, station: SurveyStation) -> Direction:
        """Direction of the hole at a station, the transport of the string in it."""
        self.settle()
        carried = self._carried.get(station.md)
        return station.fused(self._config.weighting) if carried is None else carried.direction

    @property
    def has_transport(self) -> bool:
        """Whether the string turns against its head in a bent hole."""
        return self._config.string_transport == "parallel"

    def transport_of(self, station: SurveyStation) -> tuple[float, float]:
        """Transport of the string that is in the azimuth of a station, and its standard deviation (rad)."""
        self.settle()
        carried = self._carried.get(station.md)
        return (0.0, 0.0) if carried is None else (carried.gamma, carried.std)

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
            self._fuse_surveyed()
            self._work_out()

    def _fuse_surveyed(self) -> None:
        """Fuse together what stations have one more cluster of since the last time."""
        surveyed, self._surveyed = self._surveyed, {}
        if self._config.weighting is Weighting.BAYES and (grown := [s for s in surveyed.values() if s.lacks_newest]):
            newest = self._surveys.stack([station.clusters.row(station.count - 1) for station in grown])
            SurveyStation.add_newest(grown, newest)

    def _work_out(self) -> None:
        stations = [(one.md, one.fused(self._config.weighting)) for one in self._stations if one.md > 0.0]
        if not stations:
            return
        self._draw(self._with_transport(stations))
        worst = max(self._deviations[1:], key=lambda d: d.ratio)
        self._projection = project(self._trajectory.points[-1], self._drawn[-1][1], self._design)
        self._alarms.judge_deviation("deviation", worst, self._newest_at)
        self._alarms.judge_deviation("projection", self._projection, self._newest_at)

    def _with_transport(self, stations: list[tuple[float, Direction]]) -> list[tuple[float, Direction]]:
        """The same stations (m, direction) with the transport of their string, where it has one."""
        if not self.has_transport:
            return stations
        mds, measured = zip(*stations, strict=True)
        places = self._shared.transport_places(len(stations) + 1)
        self._carried = dict(zip(mds, carry(self._config.collar, measured, places), strict=True))
        return [(md, carried.direction) for md, carried in self._carried.items()]

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
        return Trajectory(collar=self._config.collar, keep=self._shared.variances)

    def _station_at(self, md: float) -> SurveyStation:
        first = bisect_left(self._stations, md - 2.0 * self._config.station_tolerance, key=lambda known: known.md)
        for station in itertools.islice(self._stations, first, None):
            if abs(station.md - md) <= self._config.station_tolerance:
                return station
            if station.md > md:
                break
        station = SurveyStation(md, Clusters(self._surveys))
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
        for row in np.flatnonzero(self._surveys.column("at") > time).tolist():
            station = self._station_of[row]
            number = bisect_left(self._stations, station.md, key=lambda known: known.md)
            found.append((float(self._surveys.rows["at"][row]), number, station.clusters.place_of(row)))
        return sorted(found)

    def _find_departures(self, stop: list[tuple[float, int, int]]) -> None:
        """Work out together how far clusters departed from what those before them are known to have come to."""
        around = [(self._stations[number], place) for _, number, place in stop]
        found = [(one, place, earlier) for one, place in around if (earlier := one.known_before(place)) is not None]
        if found:
            newest = self._surveys.stack([station.clusters.row(place) for station, place, _ in found])
            departed = departures_from([earlier for _, _, earlier in found], newest)
            for (station, place, _), departure in zip(found, departed, strict=True):
                station.clusters.keep_departure(place, departure)

    def _judge_stop(self, stop: list[tuple[float, int, int]]) -> None:
        """Neighbours are the nearest stations above and below that were read at the same stop."""
        by_depth = sorted(stop, key=lambda cluster: cluster[1:])
        self._find_departures(by_depth)
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
