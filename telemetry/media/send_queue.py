"""Frames that wait for a port: a bounded queue by priority, in which the newest of a topic replaces what waits."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Container

from telemetry.media.port import PortFrame, Priority

SEND_LIMIT = 64  # frames


class SendQueue:
    """Frames on their way out: urgent ones first, and of one priority the oldest first.

    When it is full, best effort goes first: the least urgent frame with a topic, the oldest of those. Frames that must
    not be lost are refused only where nothing else waits; the link repeats them.

    Parameters
    ----------
    largest : bytes, of a payload
    limit : frames that may wait
    """

    def __init__(self, largest: int, limit: int = SEND_LIMIT) -> None:
        self.largest = largest
        self.limit = limit
        self._waiting: list[PortFrame] = []  # by age
        self.counters: Counter[str] = Counter()

    def __len__(self) -> int:
        return len(self._waiting)

    def offer(self, frame: PortFrame) -> bool:
        """Queue a frame; returns False for one that is too large."""
        if frame.is_larger_than(self.largest):
            self.counters["too_large"] += 1
            return False
        if not self._replace(frame):
            self._waiting.append(frame)
        while len(self._waiting) > self.limit:
            self._remove("dropped", [self._most_dispensable()])
        return True

    def drain(self, is_up: Callable[[], bool], put: Callable[[bytes], None]) -> None:
        """Hand frames to ``put`` while ``is_up``; a clock exchange that has to wait is dropped."""
        while self._waiting and is_up():
            frame = self.take()
            if frame is not None:
                put(frame.payload)
        self.forget_outdated()

    def take(self, held: Container[Priority] = ()) -> PortFrame | None:
        """The next frame, of a priority that is not ``held`` back; None where there is none."""
        chosen = None
        for place, frame in enumerate(self._waiting):
            if frame.priority not in held and (chosen is None or frame.priority < self._waiting[chosen].priority):
                chosen = place
        return None if chosen is None else self._waiting.pop(chosen)

    def put_back(self, frame: PortFrame) -> None:
        """Put a frame that was taken back before the others."""
        self._waiting.insert(0, frame)
        if len(self._waiting) > self.limit:
            self._remove("dropped", [self._most_dispensable()])

    def forget_outdated(self) -> None:
        """Forget clock exchanges: they had to wait."""
        if self._waiting:
            self._remove("outdated", [f for f in self._waiting if f.priority is Priority.TIME])

    def _replace(self, frame: PortFrame) -> bool:
        """Replace the waiting frame of the same topic in its place, so that of many topics none is always last."""
        if frame.topic is None:
            return False
        for place, other in enumerate(self._waiting):
            if other.topic == frame.topic:
                self._waiting[place] = frame
                self.counters["replaced"] += 1
                return True
        return False

    def _most_dispensable(self) -> PortFrame:
        best_effort = [frame for frame in self._waiting if frame.topic is not None]
        return max(best_effort, key=lambda f: f.priority) if best_effort else self._waiting[-1]

    def _remove(self, reason: str, frames: list[PortFrame]) -> None:
        for frame in frames:
            self._waiting.remove(frame)
            self.counters[reason] += 1
