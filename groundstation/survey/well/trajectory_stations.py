"""The stations of a trajectory: direction, depth and errors of each, and how these go on down the hole.

What stations share may become more columns as the hole grows; the columns of a point are those known when it was added.
Frame: north, east, down; m.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import attrgetter
from typing import Final

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.direction_run import DirectionRun
from groundstation.survey.fusion.packed import Packed
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.sphere_direction import tangent_errors
from groundstation.survey.fusion.tangents import tangents_of
from groundstation.survey.well.depth_errors import EXACT, StationDepth
from groundstation.survey.well.trajectory_rows import FEWEST, GROWTH, ROW, Followed, TrajectorySums, runs_of

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
BLOCK = 64  # stations from mark to mark
PLACES, VALUES = map(attrgetter, ("places", "values"))
DEPTH_PLACES, DEPTH_VALUES = map(attrgetter, ("columns.places", "columns.values"))
NONE: Final = Packed(np.zeros((3, 0)))
NOTHING: Final = np.zeros(0)
OWN = ("own", "width", "count", "depths", "depth_var")  # fields that each station has by itself
NO_PLACES: Final = np.zeros(0, np.intp)


class TrajectoryStations:
    """Collar and stations in the order of depth.

    Attributes
    ----------
    rows : numbers of each, some of them not used yet
    depths : of each
    """

    def __init__(self) -> None:
        self.rows = np.zeros(FEWEST, ROW)
        self.depths: list[StationDepth] = []
        self._single: list[Direction] = []  # above those that are side by side
        self._columns: list[Packed] = []  # (3, s), of each of these
        self._run: DirectionRun | None = None
        self._depths_share = False  # whether any depth ever had columns

    @property
    def directions(self) -> list[Direction]:
        """Of each, one by one."""
        if self._run is not None:
            self._part_run(self._run)
        return self._single

    def _part_run(self, run: DirectionRun) -> None:
        """Have those that are side by side one by one."""
        self._run = None
        for direction in run:
            self._single.append(direction)
            self._columns.append(direction.packed)

    def insert(self, place: int, md: float, direction: Direction) -> None:
        """Insert a row for a station; what follows from its direction is not in it yet."""
        directions, known, count = self.directions, self.rows, len(self.depths)
        if count == len(known):
            self.rows = np.zeros(count + 1 + count // GROWTH, ROW)
            self.rows[:count] = known
        self.rows[place + 1 : count + 1] = self.rows[place:count]
        self.rows["md"][place] = md
        directions.insert(place, direction)
        self._columns.insert(place, NONE)
        self.depths.insert(place, EXACT)

    def append_all(self, stations: Sequence[tuple[float, Direction]], depths: Mapping[float, StationDepth]) -> None:
        """Append stations (m, direction) in their order; a depth that is not told is exact."""
        if self._run is not None:
            self._part_run(self._run)
        self._append_depths([md for md, _ in stations], depths)
        self._single += [direction for _, direction in stations]
        self._columns += [NONE] * len(stations)

    def append_run(self, mds: Sequence[float], run: DirectionRun, depths: Mapping[float, StationDepth]) -> None:
        """Append stations (m) side by side, with what depends on their own direction alone; see ``append_all``."""
        self._single, begin = self.directions, len(self.depths)
        self._append_depths(mds, depths)
        self._run, rows = run, self.rows[begin : len(self.depths)]
        rows["tangent"], rows["own"], rows["count"] = run.tangents, run.owns, len(run.places)
        rows["depth_var"] = [depth.own_var for depth in self.depths[begin:]]
        by_depth = [depth.columns for depth in self.depths[begin:]]
        rows["depths"] = [len(columns.places) for columns in by_depth]
        widths = [columns.width for columns in by_depth]
        rows["width"] = np.maximum(widths, run.width)
        self._depths_share |= any(widths)

    def _append_depths(self, mds: Sequence[float], depths: Mapping[float, StationDepth]) -> None:
        """Append rows of stations (m) with their depths."""
        count, more = len(self.depths), len(mds)
        if count + more > len(self.rows):
            known, self.rows = self.rows[:count], np.zeros(count + more + count // GROWTH, ROW)
            self.rows[:count] = known
        self.rows["md"][count : count + more] = mds
        self.depths += [depths.get(md, EXACT) for md in mds]

    def direct(self, places: Sequence[int], tangents: Array | None = None) -> None:
        """Compute the rows at some places that depend on their own direction alone.

        Parameters
        ----------
        places : all of them, or a range of consecutive ones
        tangents : (n, 3), where they are known already
        """
        if not places:
            return
        if self._run is not None:
            self._part_run(self._run)
        directions = [*map(self._single.__getitem__, places)]
        if tangents is None:
            tangents = tangents_of(directions)
        rows = self.rows
        at = slice(places.start, places.stop) if isinstance(places, range) else np.array(places)
        rows["tangent"][at] = tangents
        found = []
        for place, direction, tangent in zip(places, directions, tangents, strict=True):
            (own, columns), depth = tangent_errors(direction, tangent), self.depths[place]
            self._columns[place], by_depth = columns, depth.columns
            width = max(columns.width, by_depth.width)
            found.append((own, width, len(columns.places), len(by_depth.places), depth.own_var))
            self._depths_share |= bool(by_depth.width)
        for name, values in zip(OWN, zip(*found, strict=True), strict=True):
            rows[name][at] = values

    def shared_depth_vars(self) -> Array:
        """Variances (n, 3) of the positions by what their depths share, m^2; as of ``follow``, of those alone."""
        shared = np.zeros((len(self.depths), max(depth.columns.width for depth in self.depths)))
        for own, depth in zip(shared, self.depths, strict=True):
            own[depth.columns.places] = depth.columns.values[0]
        shared = shared[:, shared.any(axis=0)]
        along = self.rows["along"][: len(self.depths)]
        kinks = (along[:-1] - along[1:])[:, :, None] * shared[:-1, None]
        found = along[:, :, None] * shared[:, None]
        found[1:] += np.cumsum(kinks, axis=0)
        return np.asarray(np.sum(found * found, axis=2))

    def tangent_columns(self, place: int) -> Array:
        """Shared columns (3, s) of the tangent at a station."""
        above = len(self._columns)
        found = self._columns[place] if self._run is None or place < above else self._run[place - above].packed
        return found.columns()

    def _flat_columns(self, begin: int, end: int) -> tuple[Places, Array]:
        """Places (c,) and values (3, c) of the columns of stations from one place up to another, one after another."""
        above, run = len(self._columns), self._run
        columns = self._columns[begin:end]
        places, values = [*map(PLACES, columns)], [*map(VALUES, columns)]
        if run is not None:
            beside = run.columns[:, max(begin - above, 0) : max(end - above, 0)]
            places.append(np.tile(run.places, beside.shape[1]))
            values.append(beside.reshape(3, -1))
        return np.concatenate(places).astype(np.intp, copy=False), np.concatenate(values, axis=1)

    def follow(self, sums: TrajectorySums, begin: int, end: int, *, with_columns: bool) -> Followed:
        """Continue ``sums`` from one place to another."""
        from groundstation.survey.well.kernels.position_errors import (
            add_stations,  # reading alone needs no compiler
        )

        rows, depths = self.rows[begin : end + 1], self.depths[begin : end + 1]
        count, known = end - begin, sums.passed.shape[1]
        widths = np.maximum(np.maximum.accumulate(rows["width"])[1:], known)
        places, values = self._flat_columns(begin, end + 1)
        lean, down = values[:2], values[2]
        depth_places, by_depth = NO_PLACES, NOTHING
        if self._depths_share:
            depth_places = np.concatenate([*map(DEPTH_PLACES, depths)]).astype(np.intp, copy=False)
            by_depth = np.concatenate([*map(DEPTH_VALUES, depths)], axis=1)[0]
        width, first = int(widths[-1]), BLOCK - begin % BLOCK - 1
        marked = range(first, count, BLOCK)
        marks, own_marks = np.empty((len(marked), 3, width)), np.empty((len(marked), 3, 3))
        passed, own = np.zeros((3, width)), sums.own.copy()
        passed[:, :known] = sums.passed
        shared, covs = np.empty((count if with_columns else 0, 3, width)), np.empty((count, 3, 3))
        add_stations(
            rows, sums.length, known, places, lean, down, depth_places, by_depth, passed, np.empty_like(passed), own,
            first if marked else count, BLOCK, marks, own_marks, shared, covs,
        )  # fmt: skip
        md = rows["md"]
        return Followed(
            TrajectorySums(own, passed, float(md[-1] - md[-2])),
            [
                TrajectorySums(
                    own_marks[number].copy(), marks[number, :, : int(widths[k])].copy(), float(md[k + 1] - md[k])
                )
                for number, k in enumerate(marked)
            ]
            if marked
            else [],
            runs_of(shared, widths) if with_columns else [],
            covs,
        )
