"""One depth of the hole and every resolved stop of a tube there. No I/O."""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Sequence
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from groundstation.service.hole.resolved_stops import ResolvedStop, ResolvedStops, Rows
from groundstation.survey.fusion.fusion import Weighting, fuse_by_scheme
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.survey_trust import UNKNOWN_YAW_VAR, Trust


class StationStops:
    """The stops of a station in the order of time.

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

    @property
    def table_rows(self) -> npt.NDArray[np.int64]:
        """Rows (n,) of the table that hold the stops."""
        return np.array(self.rows, np.int64)

    def insert_stop(self, other: ResolvedStops, row: int) -> None:
        """Insert a stop of another table in the order of time."""
        self.rows.insert(self._place_behind(other, row), self._table.append_stop(other, row))

    def revised_by(self, other: ResolvedStops, row: int) -> int | None:
        """Place of the stop that one of another table is again, with another yaw; None of a new one."""
        place = self._place_behind(other, row) - 1
        return place if place >= 0 and self._table.is_revised_by(self.rows[place], other, row) else None

    def replace_stop(self, place: int, other: ResolvedStops, row: int) -> None:
        """Put a stop in the place of the one that it revises."""
        self._table.replace_stop(self.rows[place], other, row)

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
    untrusted : stops whose yaw is not believed
    revised : stops that were put in the place of others
    """

    __slots__ = ("md", "revised", "stops", "untrusted")

    def __init__(self, md: float, table: ResolvedStops) -> None:
        self.md = md
        self.stops = StationStops(table)
        self.untrusted = 0
        self.revised = 0

    @property
    def count(self) -> int:
        """Stops measured here."""
        return len(self.stops.rows)

    def add_stop(self, other: ResolvedStops, row: int) -> None:
        """Add a stop in the order of time."""
        self.stops.insert_stop(other, row)
        self.untrusted += bool(other.rows["trust"][row] != Trust.FULL)

    def revise_stop(self, place: int, other: ResolvedStops, row: int) -> bool:
        """Put a stop in the place of the one that it is again, unless a newer one of it is known: False."""
        before = self.stops.numbers([place])[0]
        if other.rows["sequence"][row] <= before["sequence"]:
            return False
        self.untrusted += int(other.rows["trust"][row] != Trust.FULL) - int(before["trust"] != Trust.FULL)
        self.stops.replace_stop(place, other, row)
        self.revised += 1
        return True

    @property
    def counting(self) -> list[int]:
        """Places of the stops whose yaw counts: of the trusted ones, or of all where none is."""
        if not self.untrusted:
            return list(range(self.count))
        is_trusted = self.stops.column("trust") == Trust.FULL
        return np.flatnonzero(is_trusted).tolist() or list(range(self.count))

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

    def fused(self, weighting: Weighting) -> Direction:
        """Direction from the stops that count, by a scheme of their own weights."""
        return fuse_by_scheme([self.stops.direction(place) for place in self.counting], weighting)
