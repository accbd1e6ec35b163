"""How the hole came to be: what was known of it at the end of every stop. No I/O.

A hole that is adjusted is worked out as a whole, so what was known of it once is kept and not worked out again for
every stop of a day when the ground station starts. Where nothing is kept, or was told since of the rig, it is made anew
of the stored surveys: all of the first stops, and of a long hole then fewer and fewer.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

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
LOOKED_AT_ALL = 5_000  # surveys, summed over the stops that are worked out anew, up to which it is every stop
SPARSER = 1.5  # times the surveys of the one before, that the next such stop has from there on


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
        return self.end.ends if self.end else self.worst()

    def worst(self, first: int = 0) -> Deviation:
        """Deviation that uses most of its tolerance among the stations from ``first`` on, 0 that of the collar."""
        sizes = np.hypot(self.found[first:, 1], self.found[first:, 2]).astype(np.float64)
        limits = self.where[first:, 1]
        used = np.where(limits > 0.0, sizes / np.where(limits > 0.0, limits, 1.0), np.where(sizes > 0.0, np.inf, 0.0))
        place = first + int(np.argmax(used))
        return replace(self, where=self.where[place : place + 1], found=self.found[place : place + 1]).rows[0]


class History:
    """Moments, the oldest first.

    Parameters
    ----------
    kept : moments of before, which are taken over when their stop ends again
    """

    def __init__(self, kept: Iterable[Moment] = ()) -> None:
        self.moments: list[Moment] = []
        self._kept = {moment.number: moment for moment in kept}
        self._newest = (0, -math.inf)  # epoch, and s of rig time in it
        self._where = np.empty((0, 2))  # of the newest moment, with room for the stations below
        self.count = 0
        self._looked_at = self._next = 0  # surveys of stops that were worked out anew, and of the next such stop

    def begins_stop(self, epoch: int, at: float) -> bool:
        """Whether a survey at ``at`` (s, rig time of an epoch) is the first of a later stop than those before it."""
        newest_epoch, newest_at = self._newest
        if not math.isfinite(newest_at):
            return False
        return epoch > newest_epoch or (epoch == newest_epoch and at > newest_at + SAME_STOP)

    def take_over(self, surveys: int) -> Moment | None:
        """Add what was kept of the stop that ends now, with so many surveys; None where nothing was."""
        moment = self._kept.get(self.count + 1)
        if moment is None or moment.at != self._newest[1]:
            return None
        self.count += 1
        self._note_worth(surveys)
        self._append(replace(moment, where=self._kept_once(moment.where)))
        return self.moments[-1]

    def is_worth(self, surveys: int) -> bool:
        """Whether to work out anew what was known at the end of a stop, by so many surveys, or to pass over it."""
        if (number := self.count + 1) not in self._kept and number < max(self._kept, default=0):
            return False  # it was passed over before
        is_due = self._looked_at <= LOOKED_AT_ALL or surveys >= self._next
        if is_due:
            self._note_worth(surveys)
        return is_due

    def _note_worth(self, surveys: int) -> None:
        self._looked_at += surveys
        self._next = math.ceil(SPARSER * surveys)

    def pass_over(self) -> None:
        """A stop has ended of which nothing is kept."""
        self.count += 1

    def add(self, rows: Deviations, projection: ProjectedEnd | None) -> None:
        """Keep what is known at the end of a stop."""
        self.count += 1
        where = self._kept_once(np.stack([rows.md, rows.limit], axis=1))
        covs = rows.cov.reshape(-1, 4)
        found = np.column_stack([rows.along, rows.offset, covs[:, UPPER]]).astype(np.float32)
        end = None if projection is None else packed_end(projection)
        self._append(Moment(self.count, self._newest[1], where, found, end))

    def _append(self, moment: Moment) -> None:
        self.moments.append(moment)
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
