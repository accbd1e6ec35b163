"""Ports whose time comes from outside: a stepper hands a process its events step by step.

A process on a stepper owns no clock. Each step names the events that are due for it, in order, with its own local
time; frames wait in the queue of their port until a step names them, so that neither the load of the machine nor the
order of arrival has any influence on what the process does. The answer names every frame that was sent and the next
timer. ``serve`` is the whole main loop of such a process.
"""

from __future__ import annotations

import math
import queue
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import partial
from typing import Any, Protocol

import msgpack

from telemetry import keys
from telemetry.errors import MediumError
from telemetry.media.port import Port
from telemetry.media.zenoh_bus import ZenohBus, ZenohPort
from telemetry.messages import Side, address_name


class Due(IntEnum):
    """Kinds of events in a step."""

    UPPER_FRAME = 0
    LOWER_FRAME = 1
    CYCLE = 2
    TIMER = 3
    DEPTH = 4


@dataclass(frozen=True, slots=True)
class DueEvent:
    """One event for a process: its kind, its local time (s) and what belongs to it."""

    kind: Due
    at: float
    data: Any = None  # CYCLE: [start, *sample]; frames and depths travel on keys of their own


@dataclass(frozen=True, slots=True)
class Sent:
    """A frame that left the process at the local time ``at`` (s)."""

    side: Side
    at: float


class Stepped(Protocol):
    """What a process must offer to be stepped."""

    def on_frame(self, side: Side, frame: bytes, now: float) -> None:
        """A frame arrived at one end."""

    def on_cycle(self, data: Any, now: float) -> None:
        """A cycle has ended at ``now`` with the sample ``data``."""

    def on_depth(self, rig_time: float, md: float) -> None:
        """The rig measured the depth of the bit (m)."""

    def on_timer(self, now: float) -> None:
        """A timer named by ``next_wake`` is due."""

    def take_frames(self, now: float) -> list[tuple[Side, bytes]]:
        """Frames to send now."""

    def next_wake(self, now: float) -> float:
        """Local time of the next timer, infinite if none."""


def pack_step(number: int, events: Iterable[DueEvent]) -> bytes:
    """Step on the wire."""
    return bytes(msgpack.packb([number, [[int(e.kind), e.at, e.data] for e in events]]))


def pack_done(number: int, sent: Iterable[Sent], wake_at: float) -> bytes:
    """Answer to a step on the wire."""
    return bytes(msgpack.packb([number, [[int(s.side), s.at] for s in sent], wake_at]))


def unpack_done(payload: bytes) -> tuple[int, list[Sent], float]:
    """Number of the step, frames sent in order and next timer (local time, s)."""
    number, sent, wake_at = msgpack.unpackb(payload)
    return number, [Sent(Side(side), at) for side, at in sent], wake_at


class StepClient:
    """A process's end of the stepper: its ports, its steps, its liveliness token.

    Parameters
    ----------
    bus, rig, address : where the steps come from and who this is
    ports : the ends of the tube, on whatever medium carries frames
    hears_depth : whether the rig's depth is for this process
    """

    STEP, UPPER, LOWER, DEPTH, STOP = range(5)

    def __init__(
        self, bus: ZenohBus, rig: str, address: int, ports: Mapping[Side, Port], *, hears_depth: bool = False
    ) -> None:
        name = address_name(address)
        self._arrived: queue.SimpleQueue[tuple[int, bytes]] = queue.SimpleQueue()
        self._waiting: tuple[deque[bytes], ...] = tuple(deque() for _ in range(5))
        self._done = bus.publisher(keys.DONE.format(rig=rig, process=name))
        self._ports = ports
        for side, port in ports.items():
            port.listen(partial(self._arrive, self.UPPER + int(side)))
        bus.subscribe(keys.STEP.format(rig=rig, process=name), lambda _key, step: self._arrive(self.STEP, step))
        if hears_depth:
            bus.subscribe(keys.DEPTH.format(rig=rig), lambda _key, depth: self._arrive(self.DEPTH, depth))
        bus.liveliness_token(keys.LIVELINESS.format(rig=rig, process=name))

    def stop(self) -> None:
        """Make ``next_step`` return None; may be called from a signal handler or another thread."""
        self._arrived.put((self.STOP, b""))

    def next_step(self) -> tuple[int, list[tuple[DueEvent, bytes]]] | None:
        """Next step with the frame of each frame event, or None after ``stop``."""
        payload = self._take(self.STEP)
        if payload is None:
            return None
        number, rows = msgpack.unpackb(payload)
        events: list[tuple[DueEvent, bytes]] = []
        for kind, at, data in rows:
            channel = {Due.UPPER_FRAME: self.UPPER, Due.LOWER_FRAME: self.LOWER, Due.DEPTH: self.DEPTH}.get(kind)
            frame = b"" if channel is None else self._take(channel)
            if frame is None:
                return None
            events.append((DueEvent(Due(kind), at, data), frame))
        return number, events

    def send(self, side: Side, frame: bytes) -> None:
        """Put a frame on the wire of one end."""
        self._ports[side].send(frame)

    def finish(self, number: int, sent: list[Sent], wake_at: float) -> None:
        """Answer the step."""
        self._done.put(pack_done(number, sent, wake_at))

    def _arrive(self, channel: int, payload: bytes) -> None:
        self._arrived.put((channel, payload))

    def _take(self, channel: int) -> bytes | None:
        waiting = self._waiting[channel]
        while not waiting:
            arrived, payload = self._arrived.get()
            if arrived == self.STOP:
                return None
            self._waiting[arrived].append(payload)
        return waiting.popleft()


def zenoh_ports(bus: ZenohBus, rig: str, address: int, sides: Iterable[Side]) -> dict[Side, Port]:
    """Ends of a tube on zenoh's port keys."""
    return {
        side: ZenohPort(bus, keys.port_key(rig, address, side, "tx"), keys.port_key(rig, address, side, "rx"))
        for side in sides
    }


def serve(process: Stepped, client: StepClient) -> None:
    """Run ``process`` step by step until ``client.stop`` ends it.

    Raises
    ------
    MediumError
        When the bus is lost.
    """
    while (step := client.next_step()) is not None:
        number, events = step
        sent: list[Sent] = []
        now = -math.inf
        for event, frame in events:
            now = event.at
            dispatch(process, event, frame)
            for side, outgoing in process.take_frames(now):
                client.send(side, outgoing)
                sent.append(Sent(side, now))
        client.finish(number, sent, process.next_wake(now))


def dispatch(process: Stepped, event: DueEvent, frame: bytes) -> None:
    """Hand one event to the process."""
    match event.kind:
        case Due.UPPER_FRAME:
            process.on_frame(Side.UPPER, frame, event.at)
        case Due.LOWER_FRAME:
            process.on_frame(Side.LOWER, frame, event.at)
        case Due.CYCLE:
            process.on_cycle(event.data, event.at)
        case Due.DEPTH:
            rig_time, md = msgpack.unpackb(frame)
            process.on_depth(rig_time, md)
        case Due.TIMER:
            process.on_timer(event.at)
        case _:
            raise MediumError(f"stepper: a step of kind {event.kind} is unknown to this version")
