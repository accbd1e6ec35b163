"""The stations of a hole in the order of depth, and which station each row of the table of stops belongs to. No I/O."""

from __future__ import annotations

import itertools
from array import array
from bisect import bisect_left, insort
from operator import attrgetter

import numpy as np
import numpy.typing as npt

from groundstation.service.hole.resolved_stops import ResolvedStops
from groundstation.service.hole.station import SurveyStation

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
DEPTH = attrgetter("md")


class HoleStations:
    """Stations to which stops are added one by one.

    Parameters
    ----------
    stops : table of all of them
    tolerance : m, within which two stops are at one station

    Attributes
    ----------
    all : from the collar down
    of_rows : station of each row of the table
    touched : those to which a stop has come, by depth (m), since this was emptied
    """

    def __init__(self, stops: ResolvedStops, tolerance: float) -> None:
        self._stops, self._tolerance = stops, tolerance
        self.all: list[SurveyStation] = []
        self.of_rows: list[SurveyStation] = []
        self.touched: dict[float, SurveyStation] = {}

    def take_stop(self, other: ResolvedStops, row: int) -> bool:
        """Take a stop of another table; a revision of a known one takes its place, unless it is older: False."""
        md, found = other.rows["md"].item(row), None
        first = bisect_left(self.all, md - 2.0 * self._tolerance, key=DEPTH)
        for station in itertools.islice(self.all, first, None):
            if abs(station.md - md) <= self._tolerance:
                found = station
            if found is not None or station.md > md:
                break
        if found is None:
            found = SurveyStation(md, self._stops)
            insort(self.all, found, key=DEPTH)
        revised = found.stops.revised_by(other, row)
        if revised is None:
            found.add_stop(other, row)
            self.of_rows.append(found)
        elif not found.revise_stop(revised, other, row):
            return False
        self.touched[found.md] = found
        return True

    @property
    def below(self) -> list[SurveyStation]:
        """Stations below the collar."""
        return [station for station in self.all if station.md > 0.0]

    def numbered(self) -> tuple[Places, Array]:
        """Station of every row (n,), from 1 below the collar down (0 there), and the depths (s,), m, of these."""
        below = self.below
        station_of_row, rows = np.zeros(len(self._stops), np.intp), array("I")
        for one in below:
            rows += one.stops.rows
        station_of_row[np.array(rows)] = np.arange(1, len(below) + 1).repeat([one.count for one in below])
        return station_of_row, np.array([one.md for one in below])
