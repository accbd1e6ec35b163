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
from operator import attrgetter, itemgetter
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from groundstation.config import GroundConfig
from groundstation.service.hole.deviation_alarms import AlarmList
from groundstation.service.hole.history import SAME_STOP, History
from groundstation.service.hole.resolved_stops import ResolvedStops
from groundstation.service.hole.station import SurveyStation
from groundstation.survey.fusion.fusion import DEPARTED, Evidence, Weighting, departures_from, judge_departure
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
    dropped: int  # earlier stops that no longer count
    evidence: Evidence


class PlacedStop(NamedTuple):
    """What one tube found at a stop of the string: rig time (s), depth (m), place at its station, row of the table."""

    at: float
    md: float
    place: int
    row: int
    station: SurveyStation


class SurveyedHole:
    """Every measurement of a hole that was placed, and what follows from them.

    Parameters
    ----------
    config : design, tolerance and weighting
    shared : the errors that its readings share
    """

    def __init__(self, config: GroundConfig, shared: SharedErrors) -> None:
        self._config = config
        self._shared = shared
        self._design = config.design
        self._stops = ResolvedStops()
        self._station_of: list[SurveyStation] = []  # of each of its rows
        self._touched: dict[float, SurveyStation] = {}  # by depth (m), to which a stop has come
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
        self.newest = 0  # number of the measurement that came last, revisions included

    def add_stop(self, stops: ResolvedStops, row: int, epoch: int) -> bool:
        """Take a stop with rig time of an epoch; a revision of one that is known takes its place, unless it is older.

        Returns whether it was taken.
        """
        at, md = stops.rows["at"].item(row), stops.rows["md"].item(row)
        if self._history.begins_stop(epoch, at):
            self.settle()
            self._history.add(self._deviations, self._projection)
        stops.rows["number"][row] = self.newest + 1
        station = self._station_at(md)
        revised = station.stops.revised_by(stops, row)
        if revised is None:
            station.add_stop(stops, row)
            self._station_of.append(station)
        elif not station.revise_stop(revised, stops, row):
            return False
        self.version += 1
        self.newest += 1
        self._history.on_survey(epoch, at)
        self._touched[station.md] = station
        self._unsettled_since = min(self._unsettled_since, at)
        self._newest_at = max(self._newest_at, at)
        return True

    def has_untrusted(self, tube: int) -> bool:
        """Whether the yaw of any measurement of a tube is not believed."""
        column = self._stops.column
        return bool(((column("tube") == tube) & (column("trust") != Trust.FULL)).any())

    @property
    def stops(self) -> ResolvedStops:
        """Every resolved stop in the order of their coming."""
        return self._stops

    @property
    def stations(self) -> list[SurveyStation]:
        """Stations from the collar down."""
        self.settle()
        return self._stations

    def has_survey_of(self, tube: int) -> bool:
        """Whether a tube has surveyed below the collar."""
        return bool(np.any((self._stops.column("tube") == tube) & (self._stops.column("md") > 0.0)))

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
        """Work out what follows from the stops that have come since the last time."""
        since, self._unsettled_since = self._unsettled_since, math.inf
        if since < math.inf:
            changed = self._judge_movement(since)
            self._touched = {}
            self._fuse(changed)
            self._work_out(changed)

    def _fuse(self, changed: Sequence[SurveyStation]) -> None:
        """Fuse the stations of which something may have changed, together those that have one more stop."""
        weighting = self._config.weighting
        if weighting is Weighting.BAYES and (grown := [station for station in changed if station.lacks_newest]):
            newest = self._stops.stack([station.stops.rows[-1] for station in grown])
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
        tolerance = self._config.station_tolerance
        first = bisect_left(self._stations, md - 2.0 * tolerance, key=attrgetter("md"))
        for station in itertools.islice(self._stations, first, None):
            if abs(station.md - md) <= tolerance:
                return station
            if station.md > md:
                break
        station = SurveyStation(md, self._stops)
        insort(self._stations, station, key=attrgetter("md"))
        return station

    def _judge_movement(self, since: float) -> list[SurveyStation]:
        """Drop earlier stops of tubes where the hole moved, at every stop of the string from rig time ``since`` (s) on.

        Each stop of the string is judged as a whole, so the order in which its measurements arrive changes nothing.
        Returns the stations that may be others than before.
        """
        judged = self._stops_since(since)
        begin = judged[0][0].at
        self._moved = [moved for moved in self._moved if moved.at < begin]
        changed = dict(self._touched)
        for one in itertools.chain.from_iterable(judged):
            if one.place in one.station.drops:
                one.station.drops.remove(one.place)
                changed[one.station.md] = one.station
        for together in judged:
            for station in self._judge_stop(together):
                changed[station.md] = station
        return [changed[md] for md in sorted(changed)]

    def _stops_since(self, since: float) -> list[list[PlacedStop]]:
        """Stops of the string that lasted to rig time ``since`` (s) or came later, each as what its tubes found.

        They are parted where the string was not read for a while.
        """
        begin, recent = since, self._stops_after(since - SAME_STOP)
        while recent and recent[0].at < begin:
            begin = recent[0].at
            recent = self._stops_after(begin - SAME_STOP)
        stops: list[list[PlacedStop]] = []
        last = -math.inf
        for one in recent:
            if one.at - last >= SAME_STOP:
                stops.append([])
            stops[-1].append(one)
            last = one.at
        return stops

    def _stops_after(self, time: float) -> list[PlacedStop]:
        """What tubes found later than a rig time (s), in the order of time."""
        all_at, found = self._stops.column("at"), []
        rows = np.flatnonzero(all_at > time)
        for row, at in zip(rows.tolist(), all_at[rows].tolist(), strict=True):
            station = self._station_of[row]
            found.append(PlacedStop(at, station.md, station.stops.rows.index(row), row, station))
        return sorted(found)

    def _judge_stop(self, found_there: list[PlacedStop]) -> list[SurveyStation]:
        """Drop what was found before at the stations of a stop of the string where the hole moved; returns these.

        Neighbours are the nearest stations above and below that were read at the same stop.
        """
        by_depth = sorted(found_there, key=itemgetter(1, 2))
        self._find_departures(by_depth)
        rows = [one.row for one in by_depth]
        sizes = self._stops.rows["departure"][rows].tolist()  # NaN of the first of its hole
        found = []
        for k, size in enumerate(sizes):
            if size > DEPARTED and (evidence := self._evidence(rows, k)).moved:
                one = by_depth[k]
                self._moved.append(Moved(one.md, one.at, one.place - one.station.first_before(one.place), evidence))
                one.station.drops.append(one.place)
                found.append(one.station)
        return found

    def _evidence(self, rows: list[int], k: int) -> Evidence:
        """Why the hole is held for moved at one of the stops in some rows, in the order of depth, or not."""
        around = [*rows[max(k - 1, 0) : k], *rows[k + 1 : k + 2]]
        table = self._stops.rows
        departed = [(table["departed"][row], table["departure"].item(row)) for row in (rows[k], *around)]
        return judge_departure(departed[0], [one for one in departed[1:] if not math.isnan(one[1])])

    def _find_departures(self, found_there: list[PlacedStop]) -> None:
        """Work out how far stops departed from what those before them came to, together where that is known."""
        sizes, known, alone = self._stops.rows["departure"], [], []
        for one in found_there:
            if one.place and math.isnan(sizes.item(one.row)):
                earlier = one.station.known_before(one.place)
                alone += [one] if earlier is None else []
                known += [] if earlier is None else [(one, earlier)]
        if known:
            newest = self._stops.stack([one.row for one, _ in known])
            departed = departures_from([earlier for _, earlier in known], newest)
            for (one, _), departure in zip(known, departed, strict=True):
                one.station.stops.keep_departure(one.place, departure)
        for one in alone:
            one.station.departure(one.place)
