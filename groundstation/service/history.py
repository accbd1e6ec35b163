"""How the hole came to be: what was known of it at the end of every stop. No I/O.

It is made of the stored surveys as they are applied, so it is the same after a restart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.columns import Deviation

Array = npt.NDArray[np.float64]
KEPT = 512  # moments; of more every second of the older half goes
SAME_STOP = 15.0  # s, within which two surveys were taken at one stop


@dataclass(frozen=True, slots=True)
class Moment:
    """What was known at one time: deviations at the stations from the collar down, and at the target.

    The deviations are kept as one array, a row a station: as objects those of a day would need a hundred megabytes.
    """

    number: int
    at: float  # s, rig time of the newest survey
    table: Array  # (n, 9): measured depth, along, offset (2), covariance (4), limit
    projection: Deviation | None

    @property
    def rows(self) -> list[Deviation]:
        """Deviations from the collar down."""
        values = zip(*(self.table[:, k].tolist() for k in (0, 1, -1)), self.table, strict=True)
        return [Deviation(md, along, row[2:4], row[4:8].reshape(2, 2), limit) for md, along, limit, row in values]

    @property
    def deepest(self) -> float:
        """Measured depth of the newest station, m."""
        return float(self.table[-1, 0])

    @property
    def about(self) -> Deviation:
        """What matters: the end, or before that is known the worst station."""
        return self.projection or max(self.rows, key=lambda row: row.ratio)


class History:
    """Moments, the oldest first."""

    def __init__(self) -> None:
        self.moments: list[Moment] = []
        self._newest = (0, -math.inf)  # epoch, and s of rig time in it
        self.count = 0

    def begins_stop(self, epoch: int, at: float) -> bool:
        """Whether a survey at ``at`` (s, rig time of an epoch) is the first of a later stop than those before it."""
        newest_epoch, newest_at = self._newest
        if not math.isfinite(newest_at):
            return False
        return epoch > newest_epoch or (epoch == newest_epoch and at > newest_at + SAME_STOP)

    def add(self, rows: Sequence[Deviation], projection: Deviation | None) -> None:
        """Keep what is known at the end of a stop."""
        self.count += 1
        table = np.array([(d.md, d.along, *d.offset, *d.cov.ravel(), d.limit) for d in rows])
        self.moments.append(Moment(self.count, self._newest[1], table, projection))
        if len(self.moments) > KEPT:
            half = KEPT // 2
            self.moments = self.moments[:half:2] + self.moments[half:]

    def on_survey(self, epoch: int, at: float) -> None:
        """Follow the time of the surveys."""
        self._newest = max(self._newest, (epoch, at))

    def find(self, number: int) -> Moment | None:
        """Moment of a number that is still kept."""
        return next((moment for moment in self.moments if moment.number == number), None)
