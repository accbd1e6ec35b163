"""The surveys of a hole as rows of one table, and those of a station. No I/O.

A ground station keeps every survey of a hole, ten thousand of them after a day. As objects each would take two
kilobytes; as a row it takes a sixth of that, and becomes an object again when it is read.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, overload

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.fusion import Departure, Stack
from groundstation.survey.fusion.resolve import Direction, Quality
from groundstation.survey.fusion.shared import CAUSES, Places, StopDirection, columns_of
from groundstation.survey.fusion.survey_trust import UNKNOWN_YAW_VAR, Trust
from telemetry.messages import NodeFlag, SurveyMeasurement

Array = npt.NDArray[np.float64]
AXES = 3
TOGETHER = 256  # surveys whose columns are laid out at a time
FEWEST = 64  # rows of a table
NO_NUMBER = -1
GROWTH = 8  # share of its rows by which a table grows
ROW: Final = np.dtype(
    [
        *((name, np.int64) for name in ("sequence", "replaces", "hops", "samples", "flags", "number")),
        *((name, np.uint32) for name in ("tube", "width")),
        *((name, np.uint8) for name in ("trust", "quality")),
        *((name, np.float64) for name in ("at", "md", "yaw", "yaw_var", "systematic_var", "force_var", "settle_time")),
        ("lean", np.float64, 2),
        ("down", np.float64),
        ("cov", np.float64, (2, 2)),
        ("information", np.float64, (2, 2)),
        ("causes", np.float64, (2, CAUSES)),
        ("departed", np.float64, 2),
        ("departure", np.float64),
    ]
)


@dataclass(frozen=True, slots=True)
class Cluster:
    """One survey, resolved: what the IMUs of a tube found at one stop."""

    tube: int
    sequence: int
    at: float  # s, rig time
    hops: int
    md: float  # m
    yaw: float  # rad
    yaw_var: float  # rad^2, random
    systematic_var: float  # rad^2
    forces: tuple[tuple[float, ...], ...]  # m/s^2, (imus, 3)
    force_var: float  # (m/s^2)^2, of the mean of the cluster on one axis
    samples: int
    settle_time: float  # s
    flags: NodeFlag
    quality: Quality
    trust: Trust
    number: int  # place in the order in which surveys were placed
    direction: StopDirection
    replaces: int = NO_NUMBER  # the tube's number of the survey that this one revises

    @property
    def order(self) -> tuple[float, int]:
        """What the clusters of a station are ordered by."""
        return self.at, self.tube

    @property
    def fused_yaw_var(self) -> float:
        """Random variance of the yaw (rad^2) with which it is fused."""
        return self.yaw_var + (UNKNOWN_YAW_VAR if self.trust is Trust.UNKNOWN_YAW else 0.0)


def cluster_of(
    measurement: SurveyMeasurement, md: float, direction: StopDirection, quality: Quality, trust: Trust, number: int
) -> Cluster:
    """A stored measurement with its depth (m), and what it was resolved to."""
    m = measurement
    return Cluster(
        m.tube, m.sequence, m.station_at, m.hops, md, m.yaw, m.yaw_var, m.systematic_var,
        tuple(imu.force for imu in m.imus), force_var(m), m.samples, m.settle_time, m.flags, quality, trust, number,
        direction,
    )  # fmt: skip


def force_var(measurement: SurveyMeasurement) -> float:
    """Variance (m/s^2)^2 of the mean force of a cluster on one axis: its IMUs weigh by their own."""
    covs = (imu.force_cov for imu in measurement.imus)
    variances = [(x[0] + y[1] + z[2]) / AXES for x, y, z in covs]
    first = variances[0]
    return first / sum(first / variance for variance in variances) if min(variances) > 0.0 else 0.0


def forces_of(kept: bytes) -> list[list[float]]:
    """Forces (imus, 3) as a table keeps them, m/s^2."""
    forces: list[list[float]] = np.frombuffer(kept).reshape(-1, AXES).tolist()
    return forces


class Table:
    """The surveys of a hole in the order of their coming, whatever station they belong to.

    A table of each station would grow by a row or two at a time, and what those left behind them on the heap was as
    much as the surveys themselves.
    """

    def __init__(self) -> None:
        self.rows = np.empty(FEWEST, ROW)
        self.forces: list[bytes] = []
        self.places: list[Places] = []

    def __len__(self) -> int:
        return len(self.forces)

    def append_cluster(self, cluster: Cluster) -> int:
        """Add a survey from which no departure is known yet; returns its row.

        Raises
        ------
        numpy.linalg.LinAlgError
            When it cannot be weighed; it was not added.
        """
        information = cluster.direction.information
        row, known = len(self), self.rows
        if row == len(known):
            self.rows = np.empty(row + row // GROWTH, ROW)
            self.rows[:row] = known
        self.forces.append(np.array(cluster.forces).tobytes())
        self.places.append(cluster.direction.places)
        self._write(row, cluster, information)
        return row

    def replace_cluster(self, row: int, cluster: Cluster) -> None:
        """Put a survey in the place of the one that it revises; errors as ``append_cluster``."""
        information = cluster.direction.information
        self.places[row] = cluster.direction.places
        self._write(row, replace(cluster, replaces=int(self.rows[row]["sequence"])), information)

    def is_revised_by(self, row: int, cluster: Cluster) -> bool:
        """Whether a survey is that of a row again: of the same tube and time, and the same readings."""
        known = self.rows[row]
        is_alike = (known["at"], known["tube"]) == (cluster.at, cluster.tube)
        return bool(is_alike and self.forces[row] == np.array(cluster.forces).tobytes())

    def _write(self, row: int, cluster: Cluster, information: Array) -> None:
        c, d = cluster, cluster.direction
        self.rows[row] = (
            c.sequence, c.replaces, c.hops, c.samples, c.flags, c.number, c.tube, d.width, c.trust, c.quality, c.at,
            c.md, c.yaw, c.yaw_var, c.systematic_var, c.force_var, c.settle_time, d.lean, d.down, d.cov, information,
            d.causes, 0.0, np.nan,
        )  # fmt: skip

    def column(self, name: str) -> npt.NDArray[Any]:
        """One number of every survey, (n,) or (n, ...): a look at the table."""
        return self.rows[name][: len(self)]

    def reading(self, number: int) -> StopDirection:
        """Direction of the survey in a row."""
        row = self.rows[number]
        bare = Direction(row["lean"].copy(), float(row["down"]), row["cov"].copy(), NOTHING)
        causes, information = row["causes"].copy(), row["information"].copy()
        return StopDirection(bare, causes, self.places[number], int(row["width"]), information)

    def stack(self, numbers: Sequence[int]) -> Stack:
        """Directions of the surveys in several rows, side by side."""
        rows, places = self.rows[numbers], [self.places[number] for number in numbers]
        shared = columns_of(rows["causes"], places, int(rows["width"].max()))
        return Stack(rows["lean"], rows["down"], rows["cov"], rows["information"], shared)

    def covs(self, numbers: Sequence[int]) -> Array:
        """Covariances (n, 2, 2) of the leans of the surveys in several rows, what they share with others included."""
        widths = self.rows["width"][numbers]
        covs = self.rows["cov"][numbers]
        for width in np.unique(widths).tolist():
            alike = np.flatnonzero(widths == width)
            for some in np.split(alike, range(TOGETHER, len(alike), TOGETHER)):
                rows = [numbers[place] for place in some.tolist()]
                shared = columns_of(self.rows["causes"][rows], [self.places[row] for row in rows], width)
                covs[some] += shared @ shared.transpose(0, 2, 1)
        return covs

    def cluster(self, number: int) -> Cluster:
        """The survey in a row."""
        row = self.rows[number]
        forces = forces_of(self.forces[number])
        return Cluster(
            **{name: row[name].item() for name in PLAIN},
            forces=tuple(tuple(force) for force in forces),
            flags=NodeFlag(int(row["flags"])),
            quality=Quality(int(row["quality"])),
            trust=Trust(int(row["trust"])),
            direction=self.reading(number),
        )


class Clusters:
    """Clusters of a station in the order of time, and of each how far it departed from those before it, once known.

    Parameters
    ----------
    table : that holds them
    """

    def __init__(self, table: Table | None = None) -> None:
        self._table = Table() if table is None else table
        self._rows = array("I")  # of the table, in the order of time

    def __len__(self) -> int:
        return len(self._rows)

    def __iter__(self) -> Iterator[Cluster]:
        return (self[place] for place in range(len(self)))

    @overload
    def __getitem__(self, place: int) -> Cluster: ...
    @overload
    def __getitem__(self, place: slice) -> list[Cluster]: ...
    def __getitem__(self, place: int | slice) -> Cluster | list[Cluster]:
        if isinstance(place, slice):
            return [self[one] for one in range(*place.indices(len(self)))]
        if not -len(self) <= place < len(self):
            raise IndexError(f"cluster {place}: expected one of {len(self)}")
        return self._table.cluster(self._rows[place])

    def reading(self, place: int) -> StopDirection:
        """Direction of the cluster at a place."""
        return self._table.reading(self._rows[place])

    def column(self, name: str) -> npt.NDArray[Any]:
        """One number of every cluster, (n,) or (n, ...)."""
        return np.asarray(self._table.rows[name][np.array(self._rows)])

    def rows(self, places: Sequence[int]) -> npt.NDArray[np.void]:
        """Numbers of the clusters at some places, side by side."""
        return self._table.rows[[self._rows[place] for place in places]]

    @property
    def table_rows(self) -> npt.NDArray[np.int64]:
        """Rows (n,) of the table that hold the clusters."""
        return np.array(self._rows, np.int64)

    def row(self, place: int) -> int:
        """Row of the table that holds the cluster at a place."""
        return self._rows[place]

    def place_of(self, row: int) -> int:
        """Place of a row of the table."""
        return self._rows.index(row)

    def insert(self, cluster: Cluster) -> int:
        """Insert a cluster in the order of time; returns its place.

        Raises
        ------
        numpy.linalg.LinAlgError
            When it cannot be weighed; it was not inserted.
        """
        row = self._table.append_cluster(cluster)
        place = self._place_of(cluster.order)
        self._rows.insert(place, row)
        self.forget_departures(place)
        return place

    def revised_by(self, cluster: Cluster) -> int | None:
        """Place of the survey that a cluster is again, with another yaw; None of a new one."""
        place = self._place_of(cluster.order) - 1
        if place >= 0 and self._table.is_revised_by(self._rows[place], cluster):
            return place
        return None

    def replace_cluster(self, place: int, cluster: Cluster) -> None:
        """Put a cluster in the place of the one that it revises; errors as ``insert``."""
        self._table.replace_cluster(self._rows[place], cluster)
        self.forget_departures(place)

    def departure(self, place: int) -> Departure | None:
        """How far a cluster departed from those before it; None where it was not computed."""
        row = self._rows[place]
        size = self._table.rows["departure"].item(row)
        return None if math.isnan(size) else (self._table.rows["departed"][row].copy(), size)

    def knows_departure(self, place: int) -> bool:
        """Whether it is known how far a cluster departed from those before it."""
        return not math.isnan(self._table.rows["departure"].item(self._rows[place]))

    def keep_departure(self, place: int, departure: Departure) -> None:
        """Keep how far a cluster departed from those before it."""
        row = self._table.rows[self._rows[place]]
        row["departed"], row["departure"] = departure

    def forget_departures(self, place: int) -> None:
        """Forget those of the clusters from a place on."""
        if place < len(self) - 1:
            self._table.rows["departure"][np.array(self._rows[place:])] = np.nan

    def _place_of(self, order: tuple[float, int]) -> int:
        """Place behind all clusters that are not later."""
        rows, place = self._table.rows, len(self)
        while place and (rows["at"][self._rows[place - 1]], rows["tube"][self._rows[place - 1]]) > order:
            place -= 1
        return place


PLAIN = (
    "tube", "sequence", "replaces", "at", "hops", "md", "yaw", "yaw_var", "systematic_var", "force_var", "samples",
    "settle_time", "number",
)  # fmt: skip
NOTHING: Final = np.zeros((2, 0))
