"""What ports share: frames wait in a bounded queue until the other end is there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter

from telemetry.errors import MediumError
from telemetry.media.port import MAX_FRAME, PortFrame
from telemetry.media.send_queue import SEND_LIMIT, SendQueue


class QueuedPort(ABC):
    """Base of a port, see ``port.Port``; a subclass says whether it is heard and puts what waits on its bus.

    Parameters
    ----------
    name : of the port, for errors
    largest : bytes of the largest payload
    limit : frames that may wait
    """

    def __init__(self, name: str, largest: int = MAX_FRAME, limit: int = SEND_LIMIT) -> None:
        self._name = name
        self._queue = SendQueue(largest, limit)
        self._closed = False

    @property
    def largest_payload(self) -> int:
        """Bytes of the largest frame that is accepted."""
        return self._queue.largest

    @property
    def bundle_limit(self) -> int:
        """Bytes of payloads that the link may put into one frame."""
        return MAX_FRAME

    @property
    def is_up(self) -> bool:
        """Whether there is a listener at the other end."""
        return not self._closed and self._is_heard()

    @property
    def counters(self) -> Counter[str]:
        """Frames that did not leave, by reason."""
        return self._queue.counters

    def send(self, frame: PortFrame) -> bool:
        """Send a frame now, or as soon as the other end is there."""
        accepted = self._queue.offer(frame)
        self.flush()
        return accepted

    def flush(self) -> None:
        """Send what waits, if the other end is there."""
        self._check_open()
        self._drain()

    def _check_open(self) -> None:
        if self._closed:
            raise MediumError(f"port {self._name}: it is closed")

    @abstractmethod
    def _is_heard(self) -> bool:
        """Return whether there is a listener at the other end of an open port."""

    @abstractmethod
    def _drain(self) -> None:
        """Put the queue on the bus while the other end is there."""
