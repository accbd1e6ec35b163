"""Where a hole moved between two stops of the string. No I/O.

Where stations are fused one by one, what was found there before counts no more. Where the hole is adjusted in one it
is a blunder of the looks before, by whose size they are put right.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from groundstation.service.hole.examined_hole import ExaminedHole
from groundstation.service.hole.history import SAME_STOP
from groundstation.service.hole.resolved_stops import ResolvedStops
from groundstation.service.hole.station import SurveyStation
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.blunders import Blunder
from groundstation.survey.fusion.fusion import DEPARTED, Evidence, departures_from, judge_departure


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


class Movement:
    """Judges the stops of a string.

    Parameters
    ----------
    stops : of its tubes
    station_of : station of each row of them

    Attributes
    ----------
    moved : where the hole moved
    """

    def __init__(self, stops: ResolvedStops, station_of: list[SurveyStation]) -> None:
        self._stops, self._station_of = stops, station_of
        self.moved: list[Moved] = []

    def judge_since(self, since: float) -> dict[float, SurveyStation]:
        """Drop what was found before the hole moved, at every stop of the string from rig time ``since`` (s) on.

        Each stop of the string is judged as a whole, so the order in which its measurements arrive changes nothing.
        Returns the stations by depth (m) of which others count than before.
        """
        judged = self._stops_since(since)
        begin = judged[0][0].at
        self.moved = [moved for moved in self.moved if moved.at < begin]
        changed = {}
        for one in itertools.chain.from_iterable(judged):
            if one.place in one.station.drops:
                one.station.drops.remove(one.place)
                changed[one.station.md] = one.station
        for together in judged:
            for station in self._judge_stop(together):
                changed[station.md] = station
        return changed

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
                self.moved.append(Moved(one.md, one.at, one.place - one.station.first_before(one.place), evidence))
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


def moved_stations(examined: ExaminedHole, below: Sequence[SurveyStation]) -> list[Moved]:
    """Where an adjusted hole moved; the stations are told from which stop on they are where they are now.

    Parameters
    ----------
    below : stations below the collar in the order of depth
    """
    found: list[Moved] = []
    for station in below:
        station.drops = []
    for blunder in examined.examination.blunders:
        if blunder.best.hypothesis.kind is BlunderKind.HOLE_MOVED and not blunder.is_doubt:
            found += _moved_by(blunder, examined, below)
    return found


def _moved_by(blunder: Blunder, examined: ExaminedHole, below: Sequence[SurveyStation]) -> Iterator[Moved]:
    best = blunder.best
    (first, last), since = best.hypothesis.subject, float(examined.run.time[best.hypothesis.stop])
    evidence = Evidence(math.sqrt(float(best.size @ np.linalg.solve(best.cov, best.size))), (), agree=True)
    for station in below[first - 1 : last]:
        at = station.stops.column("at")
        place = int(np.searchsorted(at, since))
        if 0 < place < len(at) and place not in station.drops:
            yield Moved(station.md, float(at[place]), place - station.first_before(place), evidence)
            station.drops = sorted([*station.drops, place])
