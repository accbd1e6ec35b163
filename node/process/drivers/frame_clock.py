"""When the newest frame of a sensor's FIFO was taken: its own crystal, found by counting frames between reads.

The period is that of the frames counted over the last minutes. At a read at t the newest frame was taken between t - p
and t, with p that period. The frames counted since the read before carry its time on; where it leaves those bounds it
is put back. It is then known to a millisecond.
"""

from __future__ import annotations

import math
from typing import Final

MEMORY: Final = 300.0  # s, over which frames are counted
PRIOR: Final = 0.5  # s, that the rate of the data sheet is worth
LARGEST_ERROR: Final = 0.2  # of a crystal; more is a FIFO that was read late


class FrameClock:
    """Of one sensor, whose frames come at about ``rate`` (Hz)."""

    def __init__(self, rate: float) -> None:
        self._nominal = 1.0 / rate  # s
        self._seconds, self._counted = PRIOR, PRIOR * rate
        self._read_at = math.nan
        self.newest = math.nan  # s, on the clock that reads it

    def begin(self) -> None:
        """Forget the phase: the FIFO was emptied. The crystal is the same."""
        self.newest = self._read_at = math.nan

    @property
    def period(self) -> float:
        """Of the frames, s."""
        return self._seconds / self._counted

    @property
    def end(self) -> float:
        """Until when the frames read so far stand for the motion, s: half a period beyond the newest."""
        return self.newest + 0.5 * self.period

    def on_read(self, at: float, frames: int) -> float:
        """Time of the newest of ``frames`` that were read at ``at`` (s)."""
        self._count(at - self._read_at, frames)
        self._read_at = at
        if math.isnan(self.newest):
            self.newest = at - 0.5 * self.period
            return self.newest
        self.newest = min(max(self.newest + frames * self.period, at - self.period), at)
        return self.newest

    def _count(self, seconds: float, frames: int) -> None:
        expected = seconds / self._nominal
        if not abs(frames - expected) <= LARGEST_ERROR * expected + 1.0:  # the first, or one that lost some
            return
        kept = max(1.0 - seconds / MEMORY, 0.0)
        self._seconds = kept * self._seconds + seconds
        self._counted = kept * self._counted + frames
