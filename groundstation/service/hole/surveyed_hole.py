"""The hole as it was surveyed: stations, what moved, trajectory, deviations and their alarms. No I/O.

Surveys come many at a time, one of every tube at a stop. What follows from all of them is worked out once, when
a query asks for it: fifty tubes would keep the ground station busy for the length of the stop otherwise.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_left, insort
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.config import GroundConfig
from groundstation.service.hole.deviation_alarms import AlarmList
from groundstation.service.hole.history import SAME_STOP, History
from groundstation.service.hole.resolved_stops import Cluster, Clusters, Table
from groundstation.service.hole.station import SurveyStation
from groundstation.survey.fusion.fusion import Evidence, Weighting, departures_from, judge_departure
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.shared import SharedErrors
from groundstation.survey.fusion.survey_trust import Trust
from groundstation.survey.fusion.transport import Carried, carry_directions
from groundstation.survey.wall.column_deviation import Deviation, Deviations, axis_deviations, project_to_target
from groundstation.survey.well.trajectory import Trajectory

Array = npt.NDArray[np.float64]


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
        self._stations: list[SurveyStation] = []
        self._moved: list[Moved] = []
        self._alarms = AlarmList()
        self._history = History()
        self._carried: dict[float, Carried] = {}  # by the depth of a station, where the string turns in a bent hole
        self._trajectory = Trajectory(collar=config.collar, keeps_columns=False)
        self._deviations = self._deviate()
        self._projection: Deviation | None = None
        self._unsettled_since = math.inf  # s, rig time of the oldest survey from which nothing follows yet
        self._newest_at = -math.inf  # s, rig time of the newest survey
        self.version = 0  # grows with every survey

    def add_cluster(self, cluster: Cluster, epoch: int) -> bool:
        """Take a survey with rig time of an epoch; a revision of one that is known takes its place, unless it is older.

        Returns whether it was taken.

        Raises
        ------
        numpy.linalg.LinAlgError
            When it cannot be weighed; it was not taken.
        """
        _ = cluster.direction.information
        if self._history.begins_stop(epoch, cluster.at):
            self.settle()
            self._history.add(self._deviations, self._projection)
        station = self._station_at(cluster.md)
        revised = station.clusters.revised_by(cluster)
        if revised is None:
            station.add_cluster(cluster)
            self._station_of.append(station)
        elif not station.revise_cluster(revised, cluster):
            return False
        self.version += 1
        self._history.on_survey(epoch, cluster.at)
        self._unsettled_since = min(self._unsettled_since, cluster.at)
        self._newest_at = max(self._newest_at, cluster.at)
        return True

    def has_untrusted(self, tube: int) -> bool:
        """Whether the yaw of any survey of a tube is not believed."""
        column = self._surveys.column
        return bool(((column("tube") == tube) & (column("trust") != Trust.FULL)).any())

    @property
    def surveys(self) -> Table:
        """Every survey in the order of their coming."""
        return self._surveys

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
    def trajectory(self) -> Trajectory:
        """From the collar down."""
        self.settle()
        return self._trajectory

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

    @property
    def variances(self) -> Array:
        """Variances (n, kinds, 3) of the positions along the trajectory (m^2) by what their stations share.

        They are worked out when they are asked for: a start goes through hundreds of stops and shows none of them.
        """
        return np.concatenate([self._shared.variances(columns) for columns in self.trajectory.columns()])

    def place_of(self, station: SurveyStation) -> int:
        """Place of a station in the trajectory; that of the collar for one at its depth."""
        return int(np.searchsorted(self.trajectory.md, station.md)) if station.md > 0.0 else 0

    @property
    def deviations(self) -> Deviations:
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
            changed = self._judge_movement(since)
            self._fuse(changed)
            self._work_out(changed)

    def _fuse(self, changed: Sequence[SurveyStation]) -> None:
        """Fuse the stations of which something may have changed, together those that have one more cluster."""
        weighting = self._config.weighting
        if weighting is Weighting.BAYES and (grown := [station for station in changed if station.lacks_newest]):
            newest = self._surveys.stack([station.clusters.row(station.count - 1) for station in grown])
            SurveyStation.add_newest(grown, newest)

    def _work_out(self, changed: Sequence[SurveyStation]) -> None:
        self._trajectory.put(self._directions(changed))
        self._deviations = self._deviate()
        worst = self._deviations.worst(first=1)
        if worst is None:
            return
        self._projection = project_to_target(self._trajectory[-1], self.direction_of(self._stations[-1]), self._design)
        self._alarms.judge_deviation("deviation", worst, self._newest_at)
        self._alarms.judge_deviation("projection", self._projection, self._newest_at)

    def _directions(self, changed: Sequence[SurveyStation]) -> list[tuple[float, Direction]]:
        """Stations in the hole (m, direction) that may be others than before.

        Where the string turns in a bent hole these are all: what it turns by is that of the stations above, and of the
        one below too.
        """
        weighting = self._config.weighting
        if not self.has_transport:
            return [(one.md, one.fused(weighting)) for one in changed if one.md > 0.0]
        measured = [(one.md, one.fused(weighting)) for one in self._stations if one.md > 0.0]
        if not measured:
            return []
        mds, directions = zip(*measured, strict=True)
        places = self._shared.transport_places(len(measured) + 1)
        self._carried = dict(zip(mds, carry_directions(self._config.collar, directions, places), strict=True))
        return [(md, carried.direction) for md, carried in self._carried.items()]

    def _deviate(self) -> Deviations:
        """Deviations of the trajectory as it is drawn."""
        drawn = self._trajectory
        return axis_deviations(drawn.md, drawn.positions, drawn.covs, self._design)

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

    def _judge_movement(self, since: float) -> list[SurveyStation]:
        """Drop earlier clusters where the hole moved, at every stop from the one at rig time ``since`` (s) on.

        Each stop is judged as a whole, so the order in which its surveys arrive changes nothing. Returns the stations
        of these stops; to none of the others anything has happened.
        """
        stops = self._stops(since)
        begin = stops[0][0][0]
        self._moved = [moved for moved in self._moved if moved.at < begin]
        for stop in stops:
            for _, number, place in stop:
                self._stations[number].drops = [d for d in self._stations[number].drops if d != place]
        for stop in stops:
            self._judge_stop(stop)
        return [self._stations[number] for number in sorted({number for stop in stops for _, number, _ in stop})]

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
        all_at, found = self._surveys.column("at"), []
        rows = np.flatnonzero(all_at > time)
        numbers = {id(station): number for number, station in enumerate(self._stations)} if len(rows) else {}
        for row, at in zip(rows.tolist(), all_at[rows].tolist(), strict=True):
            station = self._station_of[row]
            found.append((at, numbers[id(station)], station.clusters.place_of(row)))
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
