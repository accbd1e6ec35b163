"""The surveys of a station as rows of one table. No I/O.

A ground station keeps every survey of a hole, ten thousand of them after a day. As objects each would take two
kilobytes; as a row it takes a sixth of that, and is an object again where somebody looks at it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final, overload

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion import Departure
from groundstation.survey.resolve import Direction, Quality
from groundstation.survey.shared import CAUSES, Places, Reading
from groundstation.survey.trust import UNKNOWN_YAW_VAR, Trust
from telemetry.messages import NodeFlag, SurveyMeasurement

Array = npt.NDArray[np.float64]
AXES = 3
GROWTH = 8  # share of its rows by which a table grows; most stations know one survey, some a hundred
ROW: Final = np.dtype(
    [
        *((name, np.int64) for name in ("sequence", "hops", "samples", "flags", "number")),
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
    direction: Reading

    @property
    def order(self) -> tuple[float, int]:
        """What the clusters of a station are ordered by."""
        return self.at, self.tube

    @property
    def fused_yaw_var(self) -> float:
        """Random variance of the yaw (rad^2) with which it is fused."""
        return self.yaw_var + (UNKNOWN_YAW_VAR if self.trust is Trust.UNKNOWN_YAW else 0.0)


def cluster_of(
    measurement: SurveyMeasurement, md: float, direction: Reading, quality: Quality, trust: Trust, number: int
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
    variances = [sum(imu.force_cov[axis][axis] for axis in range(AXES)) / AXES for imu in measurement.imus]
    first = variances[0]
    return first / sum(first / variance for variance in variances) if min(variances) > 0.0 else 0.0


class Clusters:
    """Clusters in the order of time, and of each how far it departed from those before it, once that is known."""

    def __init__(self) -> None:
        self._rows = np.empty(1, ROW)
        self._forces: list[bytes] = []
        self._places: list[Places] = []

    def __len__(self) -> int:
        return len(self._forces)

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
        place %= len(self)
        row = self._rows[place]
        forces = np.frombuffer(self._forces[place]).reshape(-1, AXES).tolist()
        return Cluster(
            **{name: row[name].item() for name in PLAIN},
            forces=tuple(tuple(force) for force in forces),
            flags=NodeFlag(int(row["flags"])),
            quality=Quality(int(row["quality"])),
            trust=Trust(int(row["trust"])),
            direction=self.reading(place),
        )

    def reading(self, place: int) -> Reading:
        """Direction of the cluster at a place."""
        row = self._rows[place]
        bare = Direction(row["lean"].copy(), float(row["down"]), row["cov"].copy(), NOTHING)
        causes, information = row["causes"].copy(), row["information"].copy()
        return Reading(bare, causes, self._places[place], int(row["width"]), information)

    def column(self, name: str) -> npt.NDArray[Any]:
        """One number of every cluster, (n,) or (n, ...): a look at the table, which the next insertion may end."""
        return self._rows[name][: len(self)]

    def insert(self, cluster: Cluster) -> int:
        """Insert a cluster in the order of time; returns its place.

        Raises
        ------
        numpy.linalg.LinAlgError
            When it cannot be weighed; it was not inserted.
        """
        direction = cluster.direction
        information = direction.information
        place, count, known = self._place_of(cluster.order), len(self), self._rows
        if count == len(self._rows):
            self._rows = np.empty(count + 1 + count // GROWTH, ROW)
            self._rows[:count] = known
        self._rows[place + 1 : count + 1] = self._rows[place:count]
        c, d = cluster, direction
        self._rows[place] = (
            c.sequence, c.hops, c.samples, c.flags, c.number, c.tube, d.width, c.trust, c.quality, c.at, c.md, c.yaw,
            c.yaw_var, c.systematic_var, c.force_var, c.settle_time, d.lean, d.down, d.cov, information, d.causes,
            0.0, np.nan,
        )  # fmt: skip
        self._forces.insert(place, np.array(cluster.forces).tobytes())
        self._places.insert(place, direction.places)
        self.forget_departures(place)
        return place

    def departure(self, place: int) -> Departure | None:
        """How far a cluster departed from those before it; None where nobody has worked it out."""
        size = float(self._rows["departure"][place])
        return None if np.isnan(size) else (self._rows["departed"][place].copy(), size)

    def keep_departure(self, place: int, departure: Departure) -> None:
        """Keep how far a cluster departed from those before it."""
        self._rows["departed"][place], self._rows["departure"][place] = departure

    def forget_departures(self, place: int) -> None:
        """Forget those of the clusters from a place on."""
        self._rows["departure"][place : len(self)] = np.nan

    def _place_of(self, order: tuple[float, int]) -> int:
        """Place behind all clusters that are not later."""
        at, tube = self._rows["at"], self._rows["tube"]
        place = len(self)
        while place and (at[place - 1], tube[place - 1]) > order:
            place -= 1
        return place


PLAIN = (
    "tube", "sequence", "at", "hops", "md", "yaw", "yaw_var", "systematic_var", "force_var", "samples", "settle_time",
    "number",
)  # fmt: skip
NOTHING: Final = np.zeros((2, 0))
