"""Steps: a process whose time comes from outside is handed its events one step at a time.

Such a process owns no clock. Each step names the events that are due for it, in order, with its own local time, and
``run_step`` hands them over, wherever the step came from: an object in this process, or the bus (``step_client``).
The answer names every frame that was sent and the next timer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from enum import IntEnum
from typing import Any, Final, NamedTuple

import msgpack

from telemetry.errors import DecodeError, MediumError
from telemetry.media.port import PortFrame
from telemetry.messages import Side
from telemetry.runtime.marked_frames import UNMARKED
from telemetry.runtime.process_interface import Process
from telemetry.unwritten import Content


class Due(IntEnum):
    """Kinds of events in a step."""

    UPPER_FRAME = 0
    LOWER_FRAME = 1
    CYCLE = 2
    TIMER = 3
    DEPTH = 4


class DueEvent(NamedTuple):
    """One event for a process: its kind, its local time (s) and what belongs to it."""

    kind: Due
    at: float
    data: Any = None  # CYCLE: [start, *sample]; DEPTH: the reading's payload; of a frame by radio its margin, dB
    mark: bytes = UNMARKED  # of a frame that comes by the bus, see ``marked_frames``


class Sent(NamedTuple):
    """A frame that left the process at the local time ``at`` (s)."""

    side: Side
    at: float
    mark: bytes = UNMARKED  # of a frame that goes by the bus, see ``marked_frames``


CYCLE, DEPTH = Due.CYCLE, Due.DEPTH
SIDE_OF: Final = {Due.UPPER_FRAME: Side.UPPER, Due.LOWER_FRAME: Side.LOWER}  # that a frame comes in at


def pack_step(number: int, events: Iterable[DueEvent]) -> bytes:
    """Step on the wire."""
    return bytes(msgpack.packb([number, [[int(e.kind), e.at, e.data, e.mark] for e in events]]))


def unpack_step(payload: bytes) -> tuple[int, list[DueEvent]]:
    """Number of the step and its events.

    Raises
    ------
    MediumError
        When the stepper is of another version.
    DecodeError
        When the bytes are no step.
    """
    try:
        number, rows = msgpack.unpackb(payload)
        is_step = isinstance(number, int) and all(len(row) == 4 and isinstance(row[1], float) for row in rows)
    except (ValueError, TypeError, msgpack.UnpackException):
        is_step = False
    if not is_step:
        raise DecodeError("step: expected its number and events, got something else")
    try:
        return number, [DueEvent(Due(kind), at, data, mark) for kind, at, data, mark in rows]
    except ValueError as error:
        raise MediumError(f"stepper: step {number}: {error}; is it of another version?") from error


class Done(NamedTuple):
    """Answer to a step: its number, frames sent in order, next timer (local time, s), foreign frames so far."""

    number: int
    sent: list[Sent]
    wake_at: float
    foreign: int = 0


def pack_done(done: Done) -> bytes:
    """Answer to a step on the wire."""
    return bytes(msgpack.packb([done.number, [list(s) for s in done.sent], done.wake_at, done.foreign]))


def unpack_done(payload: bytes) -> Done:
    """Answer to a step.

    Raises
    ------
    DecodeError
        When the bytes are none.
    """
    try:
        number, sent, wake_at, foreign = msgpack.unpackb(payload)
        done = Done(number, [Sent(Side(side), at, mark) for side, at, mark in sent], wake_at, foreign)
    except (ValueError, TypeError, msgpack.UnpackException) as error:
        raise DecodeError(f"answer to a step: expected what a process of the rig sends, got {error}") from error
    if not isinstance(number, int) or not isinstance(foreign, int) or not isinstance(wake_at, float):
        raise DecodeError("answer to a step: expected its number, frames, timer and count")
    return done


def run_step(
    process: Process, events: Iterable[tuple[DueEvent, Content]], send: Callable[[Sent, PortFrame], None]
) -> float:
    """Hand ``process`` the events of a step and ``send`` what leaves it after each; returns its next timer (s)."""
    now = -math.inf
    for event, frame in events:
        now = event.at
        dispatch_event(process, event, frame)
        for side, outgoing in process.take_frames(now):
            send(Sent(side, now), outgoing)
    return process.next_wake(now)


def dispatch_event(process: Process, event: DueEvent, frame: Content) -> None:
    """Hand one event to the process; the data of a frame that came by radio are its margin (dB)."""
    kind, at, data, _ = event
    side = SIDE_OF.get(kind)
    if side is not None and data is None:
        process.on_frame(side, frame, at)
    elif side is not None:
        process.on_frame(side, frame, at, float(data))
    elif kind is CYCLE:
        process.on_cycle(data, at)
    elif kind is DEPTH:
        process.on_depth(data, at)
    else:
        process.on_timer(at)
