"""What tubes found at their stops: one resolved stop a measurement, packed as rows of one table. No I/O.

A ground station keeps every measurement of a hole, ten thousand of them after a day. As objects each would take two
kilobytes; as a row it takes a sixth of that, and becomes an object again when it is read. What is worked out for
many stops at once (weights, departures, fused directions) is read from the table's columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.fusion import Stack
from groundstation.survey.fusion.resolve import Direction, Quality
from groundstation.survey.fusion.shared import CAUSES, Places, columns_of, weights_of
from groundstation.survey.fusion.survey_trust import UNKNOWN_YAW_VAR
from groundstation.survey.fusion.trust_level import Trust
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
        ("lean", np.float64, 2),
        ("down", np.float64),
        ("cov", np.float64, (2, 2)),
        ("information", np.float64, (2, 2)),
        ("causes", np.float64, (2, CAUSES)),
        ("departed", np.float64, 2),
        ("departure", np.float64),
    ]
)


@dataclass(frozen=True, slots=True, eq=False)
class ResolvedStop(Direction):
    """One tube at one stop: the direction that it found, how far that is trusted, and at which depth.

    ``shared`` (2, s) holds the columns of the direction, ``causes`` (2, 5) and ``places`` what they are made of.
    """

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
    rows : of the table, some of them not used yet
    forces : (imus, 3) of each stop as bytes, m/s^2
    places : of the columns of each stop, see ``groundstation.survey.fusion.shared``
    depth_places : of the columns of the depth of each
    """

    def __init__(self, count: int | None = None) -> None:
        self.rows: Rows = np.empty(FEWEST if count is None else count, ROW)
        self.forces: list[bytes] = [b""] * (count or 0)
        self.places: list[Places] = []
        self.depth_places: list[Places] = []

    def __len__(self) -> int:
        return len(self.forces)

    def weigh(self) -> None:
        """Work out the information of all stops.

        Raises
        ------
        numpy.linalg.LinAlgError
            When one of them cannot be weighed.
        """
        rows = self.rows[: len(self.forces)]
        rows["information"] = weights_of(rows["cov"], rows["causes"], self.places, int(rows["width"].max()))

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
        return own

    def replace_stop(self, own: int, other: ResolvedStops, row: int) -> None:
        """Put a stop of another table in the place of the one that it revises."""
        replaced = self.rows["sequence"].item(own)
        self.rows[own] = other.rows[row]
        self.rows["replaces"][own] = replaced
        self.places[own] = other.places[row]
        self.depth_places[own] = other.depth_places[row]

    def is_revised_by(self, own: int, other: ResolvedStops, row: int) -> bool:
        """Whether a stop of another table is that of a row again: of the same tube and time, and the same readings."""
        mine, its = self.rows, other.rows
        is_alike = mine["at"][own] == its["at"][row] and mine["tube"][own] == its["tube"][row]
        return bool(is_alike and self.forces[own] == other.forces[row])

    def column(self, name: str) -> npt.NDArray[Any]:
        """One number of every stop, (n,) or (n, ...): a look at the table."""
        return self.rows[name][: len(self.forces)]

    def mean_forces(self, numbers: npt.NDArray[np.intp]) -> Array:
        """Mean specific force (n, 3), m/s^2, of the IMUs of the stops in several rows."""
        kept = [self.forces[number] for number in numbers.tolist()]
        if len({*map(len, kept)}) == 1:
            return np.asarray(np.frombuffer(b"".join(kept)).reshape(len(kept), -1, AXES).mean(axis=1))
        return np.array([np.frombuffer(one).reshape(-1, AXES).mean(axis=0) for one in kept])

    def direction(self, row: int) -> Direction:
        """Direction of the stop in a row, with its columns."""
        found = self.stack([row])
        return Direction(found.lean[0], float(found.down[0]), found.cov[0], found.shared[0])

    def stack(self, numbers: Sequence[int]) -> Stack:
        """Directions of the stops in several rows, side by side."""
        rows, places = self.rows[numbers], [*map(self.places.__getitem__, numbers)]
        shared = columns_of(rows["causes"], places, int(rows["width"].max()))
        return Stack(rows["lean"], rows["down"], rows["cov"], rows["information"], shared)

    def covs(self, numbers: Sequence[int]) -> Array:
        """Covariances (n, 2, 2) of the leans of the stops in several rows, what they share with others included."""
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
            direction.lean, direction.down, direction.cov, direction.shared,
            **{name: row[name].item() for name in PLAIN},
            forces=tuple(tuple(force) for force in forces_of(self.forces[number])),
            flags=NodeFlag(int(row["flags"])),
            quality=Quality(int(row["quality"])),
            trust=Trust(int(row["trust"])),
            causes=row["causes"].copy(),
            places=self.places[number],
        )  # fmt: skip


def forces_of(kept: bytes) -> list[list[float]]:
    """Forces (imus, 3) as a table keeps them, m/s^2."""
    forces: list[list[float]] = np.frombuffer(kept).reshape(-1, AXES).tolist()
    return forces
