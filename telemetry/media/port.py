"""The contract of a medium: ports that carry frames over a joint, one at each end.

A medium knows nothing of what frames mean and may lose, repeat, delay and reorder them; the link above it
(``transport.hop``) repairs that. A port never blocks for want of another end: what it cannot send waits in a bounded
queue (``send_queue``), and what the queue cannot hold is dropped and counted.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple, Protocol

from telemetry.messages import Side
from telemetry.unwritten import Content, Unwritten

MAX_FRAME = 49152  # bytes, largest frame of the hop link: states of 170 tubes; zenoh takes 64 KiB in one piece
STEPPER = 254  # in place of a neighbour's address: what hands a stepped process its frames


class Priority(IntEnum):
    """Class of a frame; the smaller number goes first, as with the identifiers of a CAN bus."""

    TIME = 0  # a clock exchange; once it had to wait it is worthless
    AIDING = 1
    HELLO = 2
    COMMAND = 3  # commands, receipts, acknowledgements
    SURVEY = 4  # surveys, events, replies
    STATE = 5
    BLOCK = 6


class PortFrame(NamedTuple):
    """A frame of a link for its port.

    Parameters
    ----------
    content : the bytes on the wire, or what they are made of where a medium asks for them
    priority : class of its most urgent content
    topic : best effort: a newer frame of the same topic replaces one that still waits; None: must not be lost
    """

    content: Content
    priority: Priority = Priority.SURVEY
    topic: Hashable | None = None

    @property
    def payload(self) -> bytes:
        """Bytes on the wire."""
        return bytes(self.content)

    def is_larger_than(self, largest: int) -> bool:
        """Return whether the frame is larger than ``largest`` bytes."""
        content = self.content
        if isinstance(content, Unwritten) and content.most <= largest:
            return False
        return len(content) > largest


@dataclass(frozen=True, slots=True)
class TubeEnd:
    """End that a port serves, and the one it faces."""

    rig: str
    address: int
    side: Side
    neighbour: int | None = None  # address at the other side of the joint; None: a stepper joins

    @property
    def facing(self) -> TubeEnd:
        """End at the other side of the joint.

        Raises
        ------
        ValueError
            When a stepper decides that from moment to moment.
        """
        if self.neighbour is None:
            raise ValueError(f"end of {self.address}: expected a neighbour, got none")
        opposite = Side.LOWER if self.side is Side.UPPER else Side.UPPER
        return TubeEnd(self.rig, self.neighbour, opposite, self.address)


class Port(Protocol):
    """One end of a joint on some bus; calls come one at a time, some maybe from within ``deliver``."""

    @property
    def largest_payload(self) -> int:
        """Bytes of the largest frame that is accepted."""

    @property
    def bundle_limit(self) -> int:
        """Bytes of payloads that the link may put into one frame; 0: one payload a frame, each with its priority."""

    @property
    def is_up(self) -> bool:
        """Whether there is a listener at the other end."""

    @property
    def counters(self) -> Counter[str]:
        """Frames that did not leave, by reason: ``too_large``, ``replaced``, ``dropped``, ``outdated``."""

    def send(self, frame: PortFrame) -> bool:
        """Send a frame now, or as soon as the other end is there; returns False for one that is too large.

        Raises
        ------
        MediumError
            When the port is closed or the bus is lost.
        """

    def flush(self) -> None:
        """Send what waits, if the other end is there.

        Raises
        ------
        MediumError
            When the port is closed or the bus is lost.
        """

    def listen(self, deliver: Callable[[Content], object]) -> None:
        """Call ``deliver``, which must never wait, for every frame that arrives; maybe on another thread."""

    def close(self) -> None:
        """Close this end; the other end sees that it has no listener. A second call does nothing."""


class Medium(Protocol):
    """A bus that was opened."""

    def open_port(self, end: TubeEnd) -> Port:
        """Port of one end.

        Raises
        ------
        MediumError
            When the bus is lost or the end is taken.
        """
