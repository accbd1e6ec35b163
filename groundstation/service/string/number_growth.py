"""When the numbers of a tube's messages were first known to be given out, so that each gap waits from its own time."""

from __future__ import annotations

from collections import deque

REMEMBERED = 64  # growths of a tube; a gap from before the oldest waits from that one on


class NumberGrowth:
    """The largest number of each tube by time."""

    def __init__(self) -> None:
        self._grown: dict[int, deque[tuple[int, float]]] = {}

    def note(self, tube: int, newest: int, now: float) -> None:
        """Note the largest number that a tube is known to have given out at ``now`` (s, own clock)."""
        grown = self._grown.setdefault(tube, deque(maxlen=REMEMBERED))
        if not grown or newest > grown[-1][0]:
            grown.append((newest, now))

    def given_out_at(self, tube: int, number: int, now: float) -> float:
        """When (s, own clock) a number was first known to be given out; ``now`` where none as large is known."""
        return next((at for newest, at in self._grown.get(tube, ()) if newest >= number), now)
