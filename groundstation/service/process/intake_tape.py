"""What a ground station takes in, event by event: enough to give another one the same knowledge, bit for bit.

An event is what came and the time at which it came, on the own clock and in rig time; frames, receipts and what was
sent are not in it. A tape keeps the newest events for listeners that come a moment later.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import msgpack

from groundstation.errors import GroundError
from telemetry.errors import DecodeError
from telemetry.messages import Message
from telemetry.presentation.msgpack_codec import decode_message, encode_message

KEPT = 4096  # events
VERSION = 1
BEGIN, MESSAGE, DEPTH, TIMER, ORDER = "begin", "message", "depth", "timer", "order"
KINDS = (BEGIN, MESSAGE, DEPTH, TIMER, ORDER)
LENGTH = 7  # values of an event


class IntakeError(GroundError, ValueError):
    """The bytes are no event of an intake."""


@dataclass(frozen=True, slots=True)
class Intake:
    """One event: its number from 1, s of the own clock, rig time (s, NaN before it is known) and its epoch."""

    number: int
    kind: str
    now: float
    rig_now: float
    epoch: int
    content: Any = None  # a message, bytes, an order's name, parameters and who, or the settings of the ground station


@dataclass(slots=True)
class Tape:
    """Newest events, the oldest first."""

    newest: int = 0
    events: deque[Intake] = field(default_factory=lambda: deque(maxlen=KEPT))

    def add(self, kind: str, now: float, rig_now: float, epoch: int, content: Any = None) -> None:
        """Keep an event."""
        self.newest += 1
        self.events.append(Intake(self.newest, kind, now, rig_now, epoch, content))

    def after(self, number: int) -> Iterator[Intake]:
        """Events later than a number that are still kept."""
        begin = max(0, len(self.events) - (self.newest - number))
        return (self.events[k] for k in range(begin, len(self.events)))


def pack_intake(event: Intake) -> bytes:
    """An event on the wire."""
    content = encode_message(event.content) if event.kind == MESSAGE else event.content
    return bytes(msgpack.packb([VERSION, event.number, event.kind, event.now, event.rig_now, event.epoch, content]))


def unpack_intake(payload: bytes) -> Intake:
    """An event of the wire.

    Raises
    ------
    IntakeError
        When it is none, or of another version.
    """
    try:
        row = msgpack.unpackb(payload)
    except (ValueError, TypeError, msgpack.UnpackException) as error:
        raise IntakeError(f"expected an event of an intake, got {payload[:20]!r}") from error
    if not isinstance(row, list) or len(row) != LENGTH or row[0] != VERSION:
        raise IntakeError(f"expected an event of version {VERSION}, got {row!s:.40}")
    _, number, kind, now, rig_now, epoch, content = row
    numbers = all(isinstance(value, int) and not isinstance(value, bool) for value in (number, epoch))
    if not numbers or kind not in KINDS or not isinstance(now, float) or not isinstance(rig_now, float):
        raise IntakeError(f"expected an event of an intake, got {row!s:.40}")
    return Intake(number, kind, now, rig_now, epoch, _checked_content(kind, content))


def _checked_content(kind: str, content: Any) -> Any:
    if kind == MESSAGE:
        try:
            message: Message = decode_message(content)
        except (DecodeError, TypeError) as error:
            raise IntakeError(f"expected a message, got {content!s:.40}") from error
        return message
    types: dict[str, type[Any]] = {DEPTH: bytes, ORDER: list, BEGIN: dict, TIMER: type(None)}
    wanted = types[kind]
    if not isinstance(content, wanted):
        raise IntakeError(f"{kind}: expected {wanted.__name__}, got {content!s:.40}")
    return content
