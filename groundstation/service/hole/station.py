"""One depth of the hole and every resolved stop of a tube there. No I/O."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator, Sequence
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from groundstation.service.hole.resolved_stops import ResolvedStop, ResolvedStops, Rows
from groundstation.survey.fusion.fusion import Departure, GrowingBayes, Weighting, departure_from, fuse_by_scheme
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.sphere_direction import UNKNOWN_YAW_VAR, SphereDirection
from groundstation.survey.fusion.trust_level import Trust


class StationStops:
    """The stops of a station in the order of time, and of each how far it departed from those before it, once known.

    Parameters
    ----------
    table : that holds them

    Attributes
    ----------
    rows : of the table, in the order of time
    """

    def __init__(self, table: ResolvedStops) -> None:
        self._table = table
        self.rows = array("I")

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[ResolvedStop]:
        return (self._table.stop(row) for row in self.rows)

    @overload
    def __getitem__(self, place: int) -> ResolvedStop: ...
    @overload
    def __getitem__(self, place: slice) -> list[ResolvedStop]: ...
    def __getitem__(self, place: int | slice) -> ResolvedStop | list[ResolvedStop]:
        if isinstance(place, slice):
            return [self[one] for one in range(*place.indices(len(self)))]
        if not -len(self) <= place < len(self):
            raise IndexError(f"stop {place}: expected one of {len(self)}")
        return self._table.stop(self.rows[place])

    def direction(self, place: int) -> Direction:
        """Direction of the stop at a place."""
        return self._table.direction(self.rows[place])

    def column(self, name: str) -> npt.NDArray[Any]:
        """One number of every stop, (n,) or (n, ...)."""
        return np.asarray(self._table.rows[name][np.array(self.rows)])

    def numbers(self, places: Sequence[int]) -> Rows:
        """Numbers of the stops at some places, side by side."""
        return self._table.rows[[self.rows[place] for place in places]]

    def insert_stop(self, other: ResolvedStops, row: int) -> int:
        """Insert a stop of another table in the order of time; returns its place."""
        place = self._place_behind(other, row)
        self.rows.insert(place, self._table.append_stop(other, row))
        self.forget_departures(place)
        return place

    def revised_by(self, other: ResolvedStops, row: int) -> int | None:
        """Place of the stop that one of another table is again, with another yaw; None of a new one."""
        place = self._place_behind(other, row) - 1
        return place if place >= 0 and self._table.is_revised_by(self.rows[place], other, row) else None

    def replace_stop(self, place: int, other: ResolvedStops, row: int) -> None:
        """Put a stop in the place of the one that it revises."""
        self._table.replace_stop(self.rows[place], other, row)
        self.forget_departures(place)

    def departure(self, place: int) -> Departure | None:
        """How far a stop departed from those before it; None where that is not worked out yet."""
        row = self.rows[place]
        size = self._table.rows["departure"].item(row)
        return None if math.isnan(size) else (self._table.rows["departed"][row].copy(), size)

    def keep_departure(self, place: int, departure: Departure) -> None:
        """Keep how far a stop departed from those before it."""
        row = self._table.rows[self.rows[place]]
        row["departed"], row["departure"] = departure

    def forget_departures(self, place: int) -> None:
        """Forget those of the stops from a place on."""
        if place < len(self.rows) - 1:
            self._table.rows["departure"][np.array(self.rows[place:])] = np.nan

    def _place_behind(self, other: ResolvedStops, row: int) -> int:
        """Place behind all stops that are not later than one of another table."""
        all_at, tubes, place = self._table.rows["at"], self._table.rows["tube"], len(self.rows)
        at, tube = other.rows["at"][row], other.rows["tube"][row]
        while place and (all_at[self.rows[place - 1]], tubes[self.rows[place - 1]]) > (at, tube):
            place -= 1
        return place


class SurveyStation:
    """One depth of the hole (m) and every stop of a tube there, oldest first.

    Parameters
    ----------
    md : m
    table : that holds the stops

    Attributes
    ----------
    drops : places of stops that found another hole than those before them
    untrusted : stops whose yaw is not believed
    revised : stops that were put in the place of others
    """

    __slots__ = ("_all", "_fused", "_shown", "_trusted", "drops", "md", "revised", "stops", "untrusted")

    def __init__(self, md: float, table: ResolvedStops) -> None:
        self.md = md
        self.stops = StationStops(table)
        self.drops: list[int] = []
        self.untrusted = 0
        self.revised = 0
        self._fused: tuple[tuple[int, ...], Direction] | None = None  # with what it was made of
        self._shown: tuple[tuple[int, ...], dict[str, Any]] | None = None
        self._all = GrowingBayes()
        self._trusted: GrowingBayes | None = None

    @property
    def count(self) -> int:
        """Stops measured here."""
        return len(self.stops.rows)

    @property
    def first(self) -> int:
        """Place of the first stop that counts."""
        return max(self.drops) if self.drops else 0

    def first_before(self, place: int) -> int:
        """Place of the first stop that counted when the one at ``place`` came."""
        return max((drop for drop in self.drops if drop < place), default=0) if self.drops else 0

    def add_stop(self, other: ResolvedStops, row: int) -> None:
        """Add a stop in the order of time; what was judged of later ones is forgotten."""
        place = self.stops.insert_stop(other, row)
        self.untrusted += bool(other.rows["trust"][row] != Trust.FULL)
        self._forget(place)

    def revise_stop(self, place: int, other: ResolvedStops, row: int) -> bool:
        """Put a stop in the place of the one that it is again, unless a newer one of it is known: False."""
        before = self.stops.numbers([place])[0]
        if other.rows["sequence"][row] <= before["sequence"]:
            return False
        self.untrusted += int(other.rows["trust"][row] != Trust.FULL) - int(before["trust"] != Trust.FULL)
        self.stops.replace_stop(place, other, row)
        self.revised += 1
        self._forget(place)
        return True

    def _forget(self, place: int) -> None:
        """What was judged of the stop at a place and of later ones is to be judged anew."""
        if self.drops:
            self.drops = [drop for drop in self.drops if drop < place]
        self._all.forget(place)
        if self._trusted is not None:
            self._trusted.forget(place)

    @property
    def counting(self) -> list[int]:
        """Places of the stops that count: of those since the hole moved the trusted ones, or all where none is."""
        since = range(self.first, self.count)
        if not self.untrusted:
            return list(since)
        is_trusted = self.stops.column("trust") == Trust.FULL
        return [place for place in since if is_trusted[place]] or list(since)

    @property
    def is_trusted(self) -> bool:
        """Whether the yaw of a stop that counts is believed."""
        return bool((self.stops.column("trust")[self.counting] == Trust.FULL).any())

    def mean_variances(self) -> tuple[float, float, float]:
        """Of the stops that count: of the yaw as it is fused, systematic (both rad^2), of the force (m/s^2)^2."""
        rows = self.stops.numbers(self.counting)
        unknown = UNKNOWN_YAW_VAR * (rows["trust"] == Trust.UNKNOWN_YAW)
        each = (rows["yaw_var"] + unknown, rows["systematic_var"], rows["force_var"])
        yaw, systematic, force = (float(values.sum()) / len(values) for values in each)
        return yaw, systematic, force

    @property
    def _made_of(self) -> tuple[int, ...]:
        """What changes with every stop that comes, is revised or does not count any more."""
        return len(self.stops.rows), self.revised, *self.drops

    @property
    def shown(self) -> dict[str, Any] | None:
        """What a view showed last of the stops that count; None where another has come since."""
        return self._shown[1] if self._shown is not None and self._shown[0] == self._made_of else None

    def show(self, view: dict[str, Any]) -> None:
        """Keep what a view shows of the stops that count."""
        self._shown = self._made_of, view

    def forget_view(self) -> None:
        """Its direction is another one, although no stop has come to it."""
        self._shown = None

    def fused(self, weighting: Weighting) -> Direction:
        """Direction from the stops that count; worked out anew where another has come."""
        made_of = self._made_of
        if self._fused is None or self._fused[0] != made_of:
            self._fused = made_of, self._fuse(weighting)
        return self._fused[1]

    def _fuse(self, weighting: Weighting) -> Direction:
        if weighting is not Weighting.BAYES:
            return fuse_by_scheme([self.stops.direction(place) for place in self.counting], weighting)
        if not self.untrusted or len(self.counting) == self.count - self.first:
            return self._sum_of_all(self.count)
        if self._trusted is None:
            self._trusted = GrowingBayes()
        return self._trusted.of(self.first, self.count, self._trusted_directions)

    @property
    def lacks_newest(self) -> bool:
        """Whether the direction is that of all stops that count, of which the newest alone is not in it yet."""
        return not self.untrusted and self._all.lacks_one(self.first, self.count)

    @staticmethod
    def fuse_together(stations: Sequence[SurveyStation], table: ResolvedStops) -> None:
        """Fuse the stops that count of several stations, all of which are believed, in one."""
        ranges, rows, growing = [], array("I"), []
        for one in stations:
            first, end = one.first, len(one.stops.rows)
            ranges.append((first, end))
            growing.append(one._all)
            rows += one.stops.rows[first:end]
        GrowingBayes.fuse_each(growing, ranges, table.stack(rows))

    def known_before(self, place: int) -> SphereDirection | None:
        """What the stops before one came to, where that is known."""
        begin = self.first_before(place)
        return self._all.known(begin, place) if begin < place else None

    def _sum_of_all(self, end: int) -> SphereDirection:
        """Direction from the stops before a place since the hole moved, whether they are believed or not."""
        return self._all.of(self.first_before(end), end, self._directions)

    def _directions(self, begin: int, end: int) -> Iterator[Direction]:
        return map(self.stops.direction, range(begin, end))

    def _trusted_directions(self, begin: int, end: int) -> Iterator[Direction]:
        trust = self.stops.column("trust")
        return (self.stops.direction(place) for place in range(begin, end) if trust[place] == Trust.FULL)

    def departure(self, place: int) -> Departure | None:
        """How far the stop at ``place`` departed from those before; None for the first of its hole."""
        if self.first_before(place) == place:
            return None
        known = self.stops.departure(place)
        if known is None:
            known = departure_from(self._sum_of_all(place), self.stops.direction(place))
            self.stops.keep_departure(place, known)
        return known
