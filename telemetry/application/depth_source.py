"""What sends the depth of the bit: numbers the readings and repeats the last stands in each.

A reading that was lost is not repeated, so each carries what the ground station needs of those before: where the bit
stood, and from when to when.
"""

from __future__ import annotations

from collections import deque

from telemetry.messages import EPOCH_UNKNOWN, DepthReading, Stand
from telemetry.quantities import MAX_STANDS


class DepthSource:
    """Makes readings of the depth of the bit.

    Parameters
    ----------
    first_sequence : number of the first reading; a source that starts again goes on with a larger one
    """

    def __init__(self, first_sequence: int = 1) -> None:
        self._sequence = first_sequence - 1
        self._stands: deque[Stand] = deque(maxlen=MAX_STANDS)
        self._last: tuple[int, float, float] | None = None

    def measure(self, at: float, md: float, epoch: int = EPOCH_UNKNOWN) -> DepthReading:
        """Reading of the depth ``md`` (m) at rig time ``at`` (s); two alike one after the other are a stand."""
        if self._last is not None and self._last[0] == epoch:
            if at < self._last[1]:
                self._stands.clear()  # rig time counts anew, whether or not the source knows its epoch
            elif self._last[2] == md:
                self._extend_stand(epoch, self._last[1], at, md)
        self._last = (epoch, at, md)
        self._sequence += 1
        return DepthReading(self._sequence, at, md, tuple(self._stands), epoch)

    def _extend_stand(self, epoch: int, before: float, at: float, md: float) -> None:
        newest = self._stands[-1] if self._stands else None
        if newest is not None and (newest.epoch, newest.ended_at, newest.md) == (epoch, before, md):
            self._stands[-1] = Stand(epoch, newest.begun_at, at, md)
        else:
            self._stands.append(Stand(epoch, before, at, md))
