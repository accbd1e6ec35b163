"""What tubes found at their stops: one resolved stop a measurement, packed as rows of one table. No I/O.

A ground station keeps every measurement of a hole, ten thousand of them after a day. As objects each would take two
kilobytes; as a row it takes a sixth of that, and becomes an object again when it is read. What is worked out for
many stops at once (weights, departures, fused directions) is read from the table's columns.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from groundstation.survey.bearings import planes_across
from groundstation.survey.fusion.packed import Packed
from groundstation.survey.fusion.resolve import Quality
from groundstation.survey.fusion.shared import CAUSES, Places, columns_of
from groundstation.survey.fusion.sphere_direction import UNKNOWN_YAW_VAR, SphereDirection
from groundstation.survey.fusion.sphere_fusion import Stack
from groundstation.survey.fusion.trust_level import Trust
from groundstation.survey.well.depth_errors import OF_ALL
from telemetry.messages import NodeFlag

Array = npt.NDArray[np.float64]
Rows = npt.NDArray[np.void]
AXES = 3
TOGETHER = 256  # stops whose columns are laid out at a time
FEWEST = 64  # rows of a table
NO_NUMBER = -1
GROWTH = 8  # share of its rows by which a table grows
ROW: Final = np.dtype(
    [
        *((name, np.int64) for name in ("sequence", "replaces", "hops", "samples", "flags", "number")),
        *((name, np.uint32) for name in ("tube", "width", "chain")),
        *((name, np.uint8) for name in ("trust", "quality")),
        *((name, np.float64) for name in ("at", "md", "yaw", "yaw_var", "systematic_var", "force_var", "settle_time")),
        ("tangent", np.float64, 3),
        ("cov", np.float64, (2, 2)),
        ("causes", np.float64, (2, CAUSES)),
        ("departed", np.float64, 2),
        ("departure", np.float64),
    ]
)


@dataclass(frozen=True, slots=True, eq=False)
class ResolvedStop:
    """One tube at one stop: the direction that it found, how far that is trusted, and at which depth.

    ``causes`` (3, 5) and ``places`` are what the shared columns of the direction are made of.
    """

    direction: SphereDirection
    tube: int
    sequence: int
    at: float  # s, rig time
    hops: int
    md: float  # m
    yaw: float  # rad
    yaw_var: float  # rad^2, random
    systematic_var: float  # rad^2
    forces: tuple[tuple[float, ...], ...]  # m/s^2, (imus, 3)
    force_var: float  # (m/s^2)^2, of the mean of the IMUs on one axis
    samples: int
    settle_time: float  # s
    flags: NodeFlag
    quality: Quality
    trust: Trust
    number: int  # place in the order in which measurements were placed
    replaces: int  # the tube's number of the measurement that this one revises
    causes: Array
    places: Places

    @property
    def order(self) -> tuple[float, int]:
        """What the stops of a station are ordered by."""
        return self.at, self.tube

    @property
    def fused_yaw_var(self) -> float:
        """Random variance of the yaw (rad^2) with which it is fused."""
        return self.yaw_var + (UNKNOWN_YAW_VAR if self.trust is Trust.UNKNOWN_YAW else 0.0)


PLAIN = (
    "tube", "sequence", "replaces", "at", "hops", "md", "yaw", "yaw_var", "systematic_var", "force_var", "samples",
    "settle_time", "number",
)  # fmt: skip


class ResolvedStops:
    """The packed form of resolved stops, in the order of their coming, whatever station they belong to.

    A table of each station would grow by a row or two at a time, and what those left behind them on the heap was as
    much as the stops themselves.

    Parameters
    ----------
    count : stops that are about to be filled in; none for a table that grows

    Attributes
    ----------
    rows : of the table, some of them not used yet; covariance and causes across the direction, see ``planes_across``
    forces : (imus, 3) of each stop as bytes, m/s^2
    places : of the columns of each stop, see ``groundstation.survey.fusion.shared``
    depth_places : of the columns of the depth of each
    below : tubes below each in a table that grows
    """

    def __init__(self, count: int | None = None) -> None:
        self.rows: Rows = np.empty(FEWEST if count is None else count, ROW)
        self.forces: list[bytes] = [b""] * (count or 0)
        self.places: list[Places] = []
        self.depth_places: list[Places] = []
        self.below = array("H")
        self._means: Array = np.empty((0, AXES))  # of the forces of stops, as far as they were asked for

    def __len__(self) -> int:
        return len(self.forces)

    def check_weights(self) -> None:
        """Refuse stops that cannot be weighed by the inverse of what they do not know.

        Raises
        ------
        numpy.linalg.LinAlgError
            When one of them has none.
        """
        np.linalg.inv(self._covs_across(list(range(len(self.forces)))))

    def append_stop(self, other: ResolvedStops, row: int) -> int:
        """Add a stop of another table, from which no departure is known yet; returns its row."""
        own, known = len(self.forces), self.rows
        if own == len(known):
            self.rows = np.empty(own + own // GROWTH, ROW)
            self.rows[:own] = known
        self.rows[own] = other.rows[row]
        self.forces.append(other.forces[row])
        self.places.append(other.places[row])
        self.depth_places.append(other.depth_places[row])
        self.below.append(len(other.depth_places[row]) - OF_ALL)
        return own

    def replace_stop(self, own: int, other: ResolvedStops, row: int) -> None:
        """Put a stop of another table in the place of the one that it revises."""
        replaced = self.rows["sequence"].item(own)
        self.rows[own] = other.rows[row]
        self.rows["replaces"][own] = replaced
        self.places[own] = other.places[row]
        self.depth_places[own] = other.depth_places[row]
        self.below[own] = len(other.depth_places[row]) - OF_ALL

    def is_revised_by(self, own: int, other: ResolvedStops, row: int) -> bool:
        """Whether a stop of another table is that of a row again: of the same tube and time, and the same readings."""
        mine, its = self.rows, other.rows
        is_alike = mine["at"][own] == its["at"][row] and mine["tube"][own] == its["tube"][row]
        return bool(is_alike and self.forces[own] == other.forces[row])

    def column(self, name: str) -> npt.NDArray[Any]:
        """One number of every stop, (n,) or (n, ...): a look at the table."""
        return self.rows[name][: len(self.forces)]

    def mean_forces(self, numbers: npt.NDArray[np.intp]) -> Array:
        """Mean specific force (n, 3), m/s^2, of the IMUs of the stops in several rows.

        That of a row is worked out once: a stop that is revised has the same readings.
        """
        if new := self.forces[len(self._means) :]:
            self._means = np.concatenate([self._means, means_of(new)])
        return np.asarray(self._means[numbers])

    def direction(self, row: int) -> SphereDirection:
        """Direction of the stop in a row, with its columns."""
        found = self.stack([row])
        random, systematic = found.yaw_vars[0].tolist()
        return SphereDirection(found.tangents[0], found.covs[0], Packed(found.shared[0]), (random, systematic))

    def stack(self, numbers: Sequence[int]) -> Stack:
        """Directions of the stops in several rows, side by side."""
        rows, places = self.rows[numbers], [*map(self.places.__getitem__, numbers)]
        back = planes_across(rows["tangent"]).transpose(0, 2, 1)
        shared = back @ columns_of(rows["causes"], places, int(rows["width"].max()))
        unknown = UNKNOWN_YAW_VAR * (rows["trust"] == Trust.UNKNOWN_YAW)
        yaw_vars = np.stack([rows["yaw_var"] + unknown, rows["systematic_var"]], axis=1)
        return Stack(rows["tangent"], back @ rows["cov"] @ back.transpose(0, 2, 1), shared, yaw_vars)

    def covs(self, numbers: Sequence[int]) -> Array:
        """Covariances (n, 3, 3) of the unit vectors of the stops in several rows, with what they share with others."""
        axes = planes_across(self.rows["tangent"][numbers])
        return np.asarray(axes.transpose(0, 2, 1) @ self._covs_across(numbers) @ axes)

    def _covs_across(self, numbers: Sequence[int]) -> Array:
        """The same (n, 2, 2), across the directions."""
        widths = self.rows["width"][numbers]
        covs = self.rows["cov"][numbers]
        for width in np.unique(widths).tolist():
            alike = np.flatnonzero(widths == width)
            for some in np.split(alike, range(TOGETHER, len(alike), TOGETHER)):
                rows = [numbers[place] for place in some.tolist()]
                shared = columns_of(self.rows["causes"][rows], [self.places[row] for row in rows], width)
                covs[some] += shared @ shared.transpose(0, 2, 1)
        return covs

    def stop(self, number: int) -> ResolvedStop:
        """The stop in a row."""
        row, direction = self.rows[number], self.direction(number)
        return ResolvedStop(
            direction,
            **{name: row[name].item() for name in PLAIN},
            forces=tuple(tuple(force) for force in forces_of(self.forces[number])),
            flags=NodeFlag(int(row["flags"])),
            quality=Quality(int(row["quality"])),
            trust=Trust(int(row["trust"])),
            causes=planes_across(row["tangent"]).T @ row["causes"],
            places=self.places[number],
        )


def means_of(kept: Sequence[bytes]) -> Array:
    """Mean forces (n, 3) of stops as a table keeps them, m/s^2."""
    if len({*map(len, kept)}) == 1:
        return np.asarray(np.frombuffer(b"".join(kept)).reshape(len(kept), -1, AXES).mean(axis=1))
    return np.array([np.frombuffer(one).reshape(-1, AXES).mean(axis=0) for one in kept])


def forces_of(kept: bytes) -> list[list[float]]:
    """Forces (imus, 3) as a table keeps them, m/s^2."""
    forces: list[list[float]] = np.frombuffer(kept).reshape(-1, AXES).tolist()
    return forces
