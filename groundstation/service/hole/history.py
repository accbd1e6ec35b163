"""How the hole came to be: what was known of it at the end of every stop. No I/O.

It is made of the stored surveys as they are applied, so it is the same after a restart.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.service.hole.packed_end import PackedEnd, packed_end
from groundstation.survey.wall.column_deviation import Deviation, Deviations
from groundstation.survey.wall.projected_end import ProjectedEnd

Array = npt.NDArray[np.float64]
Few = npt.NDArray[np.float32]
COVARIANCE = (3, 4, 4, 5)  # places of a covariance's entries in a row
UPPER = (0, 1, 3)  # of the entries of a covariance those that are not said twice
KEPT = 512  # moments; of more every second of the older half goes
ROOM = 8  # part of its length that a table of stations has left for those below
SAME_STOP = 15.0  # s, within which two surveys were taken at one stop


@dataclass(frozen=True, slots=True)
class Moment:
    """What was known at one time: deviations at the stations from the collar down, and at the target.

    The deviations are kept as one array, a row a station, to seven digits, and what many moments have in common is kept
    once: as objects those of a day would need a hundred megabytes.
    """

    number: int
    at: float  # s, rig time of the newest survey
    where: Array  # (n, 2) m: measured depth and limit of every station
    found: Few  # (n, 6) m and m^2: along, offset (2), covariance (north, both, east)
    end: PackedEnd | None

    @property
    def rows(self) -> list[Deviation]:
        """Deviations from the collar down."""
        found = self.found.astype(np.float64)
        covs = found[:, COVARIANCE].reshape(-1, 2, 2)
        values = zip(self.where.tolist(), found[:, 0].tolist(), found[:, 1:3], covs, strict=True)
        return [Deviation(md, along, offset, cov, limit) for (md, limit), along, offset, cov in values]

    @property
    def deepest(self) -> float:
        """Measured depth of the newest station, m."""
        return float(self.where[-1, 0])

    @property
    def projection(self) -> ProjectedEnd | None:
        """The end as it was foreseen, without the way there; None before the first station."""
        return None if self.end is None else self.end.unpacked()

    @property
    def about(self) -> Deviation:
        """What matters: the end, or before that is known the worst station."""
        return self.end.ends if self.end else max(self.rows, key=lambda row: row.ratio)


class History:
    """Moments, the oldest first."""

    def __init__(self) -> None:
        self.moments: list[Moment] = []
        self._newest = (0, -math.inf)  # epoch, and s of rig time in it
        self._where = np.empty((0, 2))  # of the newest moment, with room for the stations below
        self.count = 0

    def begins_stop(self, epoch: int, at: float) -> bool:
        """Whether a survey at ``at`` (s, rig time of an epoch) is the first of a later stop than those before it."""
        newest_epoch, newest_at = self._newest
        if not math.isfinite(newest_at):
            return False
        return epoch > newest_epoch or (epoch == newest_epoch and at > newest_at + SAME_STOP)

    def add(self, rows: Deviations, projection: ProjectedEnd | None) -> None:
        """Keep what is known at the end of a stop."""
        self.count += 1
        where = self._kept_once(np.stack([rows.md, rows.limit], axis=1))
        covs = rows.cov.reshape(-1, 4)
        found = np.column_stack([rows.along, rows.offset, covs[:, UPPER]]).astype(np.float32)
        end = None if projection is None else packed_end(projection)
        self.moments.append(Moment(self.count, self._newest[1], where, found, end))
        if len(self.moments) > KEPT:
            half = KEPT // 2
            self.moments = self.moments[:half:2] + self.moments[half:]

    def _kept_once(self, where: Array) -> Array:
        """The same depths and limits, where the newest moment has them or those above them: a look at its own."""
        known = self.moments[-1].where if self.moments else where[:0]
        if len(known) <= len(where) and np.array_equal(known, where[: len(known)]):
            if len(where) > len(self._where):
                self._where = np.empty((len(where) + len(where) // ROOM, 2))
                self._where[: len(known)] = known
            self._where[len(known) : len(where)] = where[len(known) :]
        else:
            self._where = where
        return self._where[: len(where)]

    def on_survey(self, epoch: int, at: float) -> None:
        """Follow the time of the surveys."""
        self._newest = max(self._newest, (epoch, at))

    def find(self, number: int) -> Moment | None:
        """Moment of a number that is still kept."""
        return next((moment for moment in self.moments if moment.number == number), None)
