"""Frames that a step or an answer names by a mark of their bytes, among those that others have put on the same key.

A stepped rig must not get out of step by a frame that no process of it sent: each frame is taken for the one that was
meant only where its bytes are those. A foreign frame with the very bytes does no harm, since it is the same frame.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from hashlib import blake2b

MARK_SIZE = 8  # bytes
MOST_WAITING = 4096  # frames of a port; of more the oldest go, which are foreign: a step has fewer
UNMARKED = b""  # of a frame whose medium may write it otherwise, such as native CAN: counted, not compared


def mark_frame(frame: bytes) -> bytes:
    """Mark of a frame."""
    return blake2b(frame, digest_size=MARK_SIZE).digest()


class MarkedFrames:
    """What has arrived on one port, and what of it belongs to the step that is put together.

    Attributes
    ----------
    foreign : frames that were dropped because no step named them
    """

    def __init__(self) -> None:
        self.foreign = 0
        self._waiting: deque[bytes] = deque()
        self._found: list[bytes] = []

    def add(self, frame: bytes) -> None:
        """A frame has arrived."""
        if len(self._waiting) >= MOST_WAITING:
            self._waiting.popleft()
            self.foreign += 1
        self._waiting.append(frame)

    def has_all(self, marks: Sequence[bytes]) -> bool:
        """Whether the frames of these marks are here, in this order; what is between them is dropped."""
        while len(self._found) < len(marks) and self._waiting:
            frame, mark = self._waiting.popleft(), marks[len(self._found)]
            if mark == UNMARKED or mark == mark_frame(frame):
                self._found.append(frame)
            else:
                self.foreign += 1
        return len(self._found) >= len(marks)

    def take(self, *, is_marked: bool) -> deque[bytes]:
        """The frames that ``has_all`` has found; where frames are marked all else that is here is foreign.

        Nothing is on its way: the next frames are sent after the step is answered.
        """
        found, self._found = deque(self._found), []
        if is_marked:
            self.foreign += len(self._waiting)
            self._waiting.clear()
        return found

    def clear(self) -> None:
        """Forget what a dead process left half-said."""
        self._found.clear()
        self._waiting.clear()
