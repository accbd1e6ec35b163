"""One end of a CAN joint as a pure state machine: payloads in and out of frames, one frame at a time.

Never more than one frame is with the controller, so an urgent payload waits for the end of one frame and no longer: it
begins between two frames of a less urgent one. A frame unacknowledged for ``ACKNOWLEDGE_LIMIT`` means that
the joint is open. Then everything waits in the bounded queue but that frame, a mere sign of life, which the controller
repeats until it is acknowledged.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from typing import NamedTuple

from telemetry.errors import TelemetryError
from telemetry.media.can_identifier import (
    FLOW_CONTROL,
    PART_MASK,
    PRESENCE,
    PRIORITIES,
    SOURCE_SHIFT,
    TUNNEL,
    packed_identifier,
)
from telemetry.media.can_profile import NativePart, Profile, Split
from telemetry.media.can_timing import CLASSIC_LARGEST, BitRates
from telemetry.media.isotp import FLOW, Receiver, Sender, TransferError
from telemetry.media.port import MAX_FRAME, PortFrame, Priority
from telemetry.media.send_queue import SendQueue
from telemetry.unwritten import Content

ACKNOWLEDGE_LIMIT = 0.1  # s; a frame takes 1.3 ms at 125 kbit/s
PRESENCE_EVERY = 0.25  # s without any other acknowledged frame
STEPPED_LIMIT = 60.0  # s, instead of the limits above and below where a stepper waits for every frame
FLOW_LIMIT = 1.0  # s, that a receiver may take to answer, and a sender between two frames (N_Bs, N_Cr)
PAUSE_LIMIT = 0.5  # s, that a transfer may stand still before it begins anew: its receiver has not given it up by then
HEAVY = 0.55  # share of a bus beyond which node states wait; what goes on anyway brings it to 0.6 at most
MEMORY = 1.0  # s, of the mean load
BUDGETS = {
    Priority.TIME: 20.0,
    Priority.AIDING: 20.0,
    Priority.HELLO: 20.0,
    Priority.COMMAND: 200.0,
    Priority.SURVEY: 200.0,
    Priority.STATE: 1000.0,
    Priority.BLOCK: 200.0,
}  # payloads a second; 250 tubes send 475 states
BUDGET_BURST = 2.0  # s of a budget at once
SILENCE = 3.5  # s after which another end may take the place of one that fell silent


HELD = tuple(
    tuple(frozenset(p for p in PRIORITIES if p >= urgent or p in heavy) for urgent in range(len(PRIORITIES) + 1))
    for heavy in ((), (Priority.STATE,))
)  # what waits: by whether the bus is heavy and by what is on its way, or nothing


class CanData(NamedTuple):
    """Identifier and data of a frame to send."""

    identifier: int
    data: bytes


def part_data(part: NativePart, address: int) -> CanData:
    """Frame of one part of a message."""
    return CanData(part.identifier | address << SOURCE_SHIFT, part.data)


class Outgoing:
    """A payload on its way out: the parts that have a form of their own, then the rest by ISO-TP."""

    def __init__(self, frame: PortFrame, split: Split, largest: int, now: float) -> None:
        self.frame = frame
        self.moved_at = now
        self._parts = deque(split.parts)
        self._sender = Sender(split.rest, largest) if split.rest is not None else None

    @property
    def awaits_flow(self) -> bool:
        """Whether the receiver must answer first."""
        return not self._parts and self._sender is not None and self._sender.awaits_flow

    @property
    def is_done(self) -> bool:
        """Whether all is sent."""
        return not self._parts and (self._sender is None or self._sender.is_done)

    def next_frame(self, address: int) -> CanData:
        """Return the next frame; not while it awaits flow control, nor when it is done."""
        if self._parts:
            return part_data(self._parts.popleft(), address)
        if self._sender is None:
            raise ValueError("payload: expected something left to send, got none")
        return CanData(packed_identifier(self.frame.priority, TUNNEL, address), self._sender.next_frame())

    def on_flow(self, data: bytes) -> None:
        """Take the receiver's flow control, see ``isotp.Sender``."""
        if self._sender is not None and not self._parts:
            self._sender.on_flow(data)


class Incoming:
    """A payload on its way in."""

    def __init__(self) -> None:
        self.receiver = Receiver(MAX_FRAME)
        self.moved_at = -math.inf


class BusLoadMeter:
    """Share of time in which the bus was busy lately, both directions: a mean that forgets with ``MEMORY``."""

    def __init__(self, rates: BitRates, *, fd: bool) -> None:
        self._rates, self._fd = rates, fd
        self._busy = 0.0  # s, of the last MEMORY
        self._at = 0.0

    def add(self, length: int, now: float) -> None:
        """Count a frame with ``length`` bytes of data."""
        if self._rates.is_paced:
            self._busy = self._busy_at(now) + self._rates.duration(length, fd=self._fd)
            self._at = now

    def is_heavy(self, now: float) -> bool:
        """Whether node states have to wait."""
        return self._busy > 0.0 and self._busy_at(now) > HEAVY * MEMORY

    def _busy_at(self, now: float) -> float:
        return self._busy * math.exp(-max(now - self._at, 0.0) / MEMORY)


class Budget:
    """Limit on incoming payloads by priority: a babbling neighbour must not fill the links above."""

    def __init__(self) -> None:
        self._left = {priority: (BUDGET_BURST * rate, 0.0) for priority, rate in BUDGETS.items()}  # and since when

    def allows(self, priority: Priority, now: float) -> bool:
        """Take one payload from the budget of its priority; returns whether any was left."""
        left, at = self._left[priority]
        rate = BUDGETS[priority]
        left = min(left + rate * max(now - at, 0.0), BUDGET_BURST * rate)
        self._left[priority] = (left - 1.0 if left >= 1.0 else left), now
        return left >= 1.0


class CanExchange:
    """The exchange of one end.

    Parameters
    ----------
    address : of the process
    largest : bytes of data in a frame, 8 or 64
    queue : what waits to be sent
    nonce : random number of 32 bit that tells this end from another one of its address
    begun : s, since when this end is on the bus
    profile : forms of messages of their own; None: ISO-TP carries everything
    rates : bit rates of the bus, where they are known; then node states are thinned out before it is full
    is_stepped : a stepper waits for every frame, as long as it takes, and hands frames as fast as it can
    """

    def __init__(
        self,
        address: int,
        largest: int,
        queue: SendQueue,
        nonce: int,
        begun: float,
        profile: Profile | None = None,
        rates: BitRates | None = None,
        *,
        is_stepped: bool = False,
    ) -> None:
        self.profile = profile
        self.budget = None if is_stepped else Budget()
        self._acknowledge_limit = STEPPED_LIMIT if is_stepped else ACKNOWLEDGE_LIMIT
        self._flow_limit = STEPPED_LIMIT if is_stepped else FLOW_LIMIT
        self.traffic = BusLoadMeter(rates if rates is not None else BitRates(), fd=largest > CLASSIC_LARGEST)
        self.address, self.largest = address, largest
        self.queue = queue
        self.counters: Counter[str] = queue.counters
        self.is_up = False
        self.is_mute = False  # an older end with the same address is on the bus
        self.partner: int | None = None
        self._nonce, self._begun = nonce, begun
        self._in_flight_since: float | None = None
        self._acknowledged_at = -math.inf
        self._heard_at = -math.inf
        self._presence_is_due = True
        self._answers: dict[Priority, CanData] = {}  # of receivers, to senders that wait for them
        self._outgoing: dict[Priority, Outgoing] = {}
        self._incoming: dict[Priority, Incoming] = {}

    def on_acknowledged(self, now: float) -> None:
        """Note that the frame with the controller has arrived."""
        self._in_flight_since = None
        self._acknowledged_at = now
        self.is_up = not self.is_mute

    def is_alone(self, now: float) -> bool:
        """Return whether the other end has been silent for longer than ``SILENCE`` s, or ever."""
        return not self.is_up and now - self._acknowledged_at > SILENCE

    def on_refused(self) -> None:
        """Note that the controller refused its frame, or lost it."""
        self._in_flight_since = None
        self._go_down()
        self._put_back()
        self._presence_is_due = True

    def on_frame(self, bits: int, data: bytes, now: float) -> Content | None:
        """Take a frame of another controller; returns the payload it completes. Garbage is counted."""
        self.traffic.add(len(data), now)
        payload = self._take(bits, data, now)
        if payload is not None and self.budget is not None and not self.budget.allows(PRIORITIES[bits >> 26], now):
            self.counters["babbling"] += 1
            return None
        return payload

    def _take(self, bits: int, data: bytes, now: float) -> Content | None:
        urgency, type_, source = bits >> 26, bits >> 21 & 0x1F, bits >> 13 & 0xFF
        if urgency >= len(PRIORITIES):
            self.counters["unknown_identifier"] += 1
            return None
        if source == self.address:
            self._on_double(type_, data, now)
            return None
        if not self._is_partner(source, now):
            self.counters["third_talker"] += 1
            return None
        if type_ == TUNNEL:
            return self._on_data(PRIORITIES[urgency], data, now)
        if type_ == FLOW_CONTROL:
            self._on_flow(PRIORITIES[urgency], data, now)
        elif type_ != PRESENCE:
            return self._on_part(source, type_, bits & PART_MASK, data)
        return None

    def advance(self, now: float) -> None:
        """Advance to ``now`` (s): find an end that does not acknowledge, and transfers that stand still."""
        since = self._in_flight_since
        if since is not None and now - since > self._acknowledge_limit:
            self._go_down()
            if now - since > PAUSE_LIMIT:
                self._put_back()
        for priority, outgoing in list(self._outgoing.items()):
            if outgoing.awaits_flow and now - outgoing.moved_at > self._flow_limit:
                self.counters["no_flow_control"] += 1
                del self._outgoing[priority]
        for priority, incoming in self._incoming.items():
            if incoming.receiver.is_open and now - incoming.moved_at > self._flow_limit:
                self.counters["interrupted"] += 1
                incoming.receiver.abandon()
                self._answers.pop(priority, None)

    def next_frame(self, now: float) -> CanData | None:
        """The frame to hand to the controller now; None while it has one, or when nothing is to be sent."""
        if self._in_flight_since is not None or (self.is_mute and not self._presence_is_due):
            return None
        frame = self._choose(now)
        if frame is not None:
            self._in_flight_since = now
            self.traffic.add(len(frame.data), now)
        return frame

    def _choose(self, now: float) -> CanData | None:
        if self._presence_is_due or now - self._acknowledged_at > PRESENCE_EVERY:
            self._presence_is_due = False
            return self._presence(now)
        if not self.is_up:
            return None
        if self._answers:
            return self._answers.pop(min(self._answers))
        whole = self._start(now) if len(self.queue) else None
        if whole is not None or not self._outgoing:
            return whole
        ready = [p for p, o in self._outgoing.items() if not o.awaits_flow]
        return self._continue(min(ready), now) if ready else None

    def _presence(self, now: float) -> CanData:
        """Sign of life: age of this end (ms) and its nonce, which tells two ends of one address apart."""
        age = min(int(1e3 * (now - self._begun)), 0xFFFFFFFF)
        identifier = packed_identifier(Priority.HELLO, PRESENCE, self.address, self._nonce & PART_MASK)
        return CanData(identifier, age.to_bytes(4) + self._nonce.to_bytes(4))

    def _start(self, now: float) -> CanData | None:
        """Begin the most urgent waiting payload, if it is more urgent than all under way.

        Returns its frame where one part of a form of its own is all of it.
        """
        urgent = min(self._outgoing, default=len(PRIORITIES))
        frame = self.queue.take(HELD[self.traffic.is_heavy(now)][urgent])
        if frame is None:
            return None
        if self.profile is None:
            split = Split([], frame.payload)
        else:
            split = self.profile.split(frame.content, now, fd=self.largest > CLASSIC_LARGEST)
            if split.rest is None and len(split.parts) == 1:
                return part_data(split.parts[0], self.address)
        self._outgoing[frame.priority] = Outgoing(frame, split, self.largest, now)
        return None

    def _continue(self, priority: Priority, now: float) -> CanData:
        outgoing = self._outgoing[priority]
        data = outgoing.next_frame(self.address)
        outgoing.moved_at = now
        if outgoing.is_done:
            del self._outgoing[priority]
        return data

    def _on_part(self, source: int, type_: int, part: int, data: bytes) -> Content | None:
        """Take a part of a message that has signals of its own."""
        if self.profile is None:
            self.counters["unknown_identifier"] += 1
            return None
        try:
            return self.profile.join(source, type_, part, data)
        except TelemetryError as error:  # of an invalid message, or one that no encoder could have written
            name, _, why = str(error).partition(":")  # counted without the value, of which there is no end
            self.counters[f"refused: {name}" if why else name] += 1
        return None

    def _on_data(self, priority: Priority, data: bytes, now: float) -> bytes | None:
        incoming = self._incoming.setdefault(priority, Incoming())
        incoming.moved_at = now
        payload = None
        try:
            payload = incoming.receiver.on_frame(data)
        except TransferError as error:
            self.counters[str(error)] += 1
        if (answer := incoming.receiver.flow) is not None:
            incoming.receiver.flow = None
            self._answers[priority] = CanData(packed_identifier(priority, FLOW_CONTROL, self.address), answer)
        if payload is not None and self.profile is not None:
            self.profile.observe(payload)
        return payload

    def _on_flow(self, priority: Priority, data: bytes, now: float) -> None:
        outgoing = self._outgoing.get(priority)
        if outgoing is None or not data or data[0] >> 4 != FLOW:
            self.counters["bad_flow_control"] += 1
            return
        outgoing.moved_at = now
        try:
            outgoing.on_flow(data)
        except TransferError as error:
            self.counters[str(error)] += 1
            del self._outgoing[priority]

    def _go_down(self) -> None:
        """Take the other end for absent: hold transfers that must not be lost, drop the others under way.

        A busy machine may be as silent; what was held then goes on where it stopped.
        """
        self.is_up = False
        for priority, outgoing in list(self._outgoing.items()):
            if outgoing.frame.topic is not None:
                self.counters["interrupted"] += 1
                del self._outgoing[priority]
        self.queue.forget_outdated()

    def _put_back(self) -> None:
        """Put everything under way back into the queue, to begin anew."""
        for outgoing in self._outgoing.values():
            self.queue.put_back(outgoing.frame)
        self._outgoing.clear()

    def _is_partner(self, source: int, now: float) -> bool:
        """Return whether ``source`` is the other end of the joint; a third talker is ignored while that is heard."""
        if source != self.partner and now - self._heard_at <= SILENCE and self.partner is not None:
            return False
        self.partner, self._heard_at = source, now
        return True

    def _on_double(self, type_: int, data: bytes, now: float) -> None:
        """Handle another controller with this address: the younger falls silent, the older shows itself."""
        self.counters["same_address"] += 1
        if type_ != PRESENCE or len(data) != 8:
            self._presence_is_due = not self.is_mute
            return
        theirs = int.from_bytes(data[:4]) / 1e3, int.from_bytes(data[4:])
        if theirs > (now - self._begun, self._nonce):
            self.is_mute = True
            self._go_down()
            self._put_back()
        else:
            self._presence_is_due = True
