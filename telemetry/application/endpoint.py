"""One process of the string in conversation with its neighbours, and through them with the ground station.

An endpoint owns a link at each end. What is for one hop it handles itself (neighbours, time); what travels it passes
on as the bytes that came; what is for it or comes from it is for its ``mail``. All of it is driven from outside by
``receive``, ``advance`` and ``take_frames``; there is no clock, thread or socket in here.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

from telemetry.application.clock import ClockFilter
from telemetry.application.delivery_rules import ONE_HOP, PRIORITIES, RELIABLE
from telemetry.application.end_to_end import EndToEndDelivery
from telemetry.application.endpoint_state import parse_state
from telemetry.application.place import StringPlace
from telemetry.application.standstill import Standstill, is_undated
from telemetry.errors import DecodeError
from telemetry.media.port import PortFrame, Priority
from telemetry.messages import BASE, ENCODER, Aiding, Hello, Message, NodeMode, NodeState, Side, TimeReply, TimeRequest
from telemetry.presentation.msgpack_codec import (
    DOWNWARD,
    Opened,
    decode_opened,
    encode_message,
    open_payload,
    state_origin,
    unwritten_message,
)
from telemetry.schema import MessageKind
from telemetry.transport.hop import BUNDLE_LIMIT, HopLink
from telemetry.unwritten import Content

if TYPE_CHECKING:
    from telemetry.application.seals import Seals

HELLO_EVERY = 1.0  # s
HELLO_WAIT = 0.6  # s for which a hello waits for an aiding or a state to go with, once both ends know each other
SYNC_BURST = 30  # exchanges at the quick pace after a start
SYNC_QUICK = 1.0  # s
SYNC_SLOW = 10.0  # s
STATE_WAIT = 1.15  # s for which a node's state waits for those of the nodes below, to go up with them
HOP_WAIT = 0.005  # s, longer by a frame's way where fewer hops are left: after a loss the lowest goes first again
WAITING_HOPS = 100
REPORT_EVERY = 60.0  # s between two looks at what queues dropped
DROPS = ("reliable_dropped", "best_effort_dropped")  # counters of what found no place in a link's queue


class Received(NamedTuple):
    """A message for this process and the end it came in at."""

    message: Message
    side: Side


class Endpoint:
    """Telemetry of one process.

    Parameters
    ----------
    address : ``BASE``, ``ENCODER`` or the tube's number
    sides : ends that exist; the base has only its lower one
    boot_count : starts so far, kept by the process
    is_clock_root : whether the own clock is rig time
    restored : bytes of ``export_state`` before the restart, or None; damaged ones are counted and not used
    reach : tubes away that are heard; beyond 1 the nearest that speaks is the neighbour, with silent tubes between
    seals : what is said and heard under keys; None: everybody is believed
    """

    def __init__(
        self,
        address: int,
        sides: frozenset[Side],
        *,
        boot_count: int,
        is_clock_root: bool = False,
        restored: bytes | None = None,
        reach: int = 1,
        seals: Seals | None = None,
    ) -> None:
        self.address = address
        self.seals = seals
        self.boot_count = boot_count
        self.clock = ClockFilter(is_root=is_clock_root, epoch=boot_count)
        self.counters: Counter[str] = Counter()
        self.mode = NodeMode.BOOT
        self.place = StringPlace(address, reach, self.counters)
        self._links = {side: HopLink(address, boot_count, self.place.nearest(side)) for side in sorted(sides)}
        toward_encoder = Side.LOWER if address == BASE else Side.UPPER
        self._sync_side = None if is_clock_root else toward_encoder
        links = self._links.get(Side.UPPER), self._links.get(Side.LOWER)
        self.mail = EndToEndDelivery(address, boot_count, *links, self.counters, seals)
        self._passed: set[int] = set()  # tubes whose states are in the frame that is looked at
        self._hello_at = -math.inf
        self._sync_at = -math.inf
        self._standstill = Standstill()
        if restored is not None:
            try:
                saved = parse_state(restored)
            except DecodeError:
                self.counters["bad_saved_state"] += 1
            else:
                self.place.hops = saved.hops
                self.mail.restore(saved)

    def limit_bundles(self, side: Side, limit: int) -> None:
        """Limit the frames of several payloads at one end to ``limit`` bytes: a large frame delays an urgent one."""
        if side in self._links:
            self._links[side].bundle_limit = min(limit, BUNDLE_LIMIT)

    def receive(self, side: Side, frame: Content, now: float, margin: float = math.inf) -> list[Received]:
        """Take a frame from one end, heard with a ``margin`` (dB); returns the messages for this process.

        Garbage is counted.
        """
        link = self._links.get(side)
        if link is None:
            self.counters["no_such_end"] += 1
            return []
        self._standstill.move(now)
        if self.seals is not None:
            opened = self.seals.joints[side].open(bytes(frame), now)
            if opened is None:
                return []
            frame = opened
        before = link.peer
        payloads = link.receive(frame, now, margin)
        if link.peer != before:
            self._hello_at = -math.inf
            if side is self._sync_side and before is not None and link.peer is not None:
                if link.peer[0] != before[0]:
                    self.clock.change_neighbour()
                else:
                    self.clock.suspect_neighbour()
                self._sync_at = -math.inf
        received = []
        is_relay = self.address != BASE and not self._standstill.may_have_waited(now)
        for payload in payloads:
            try:
                content = payload if self.seals is None else self.seals.content(bytes(payload))
                tube = state_origin(content) if is_relay else None
                if tube is not None:  # the usual case
                    self._pass_state(tube, payload)
                    continue
                message = self._handle(side, open_payload(content), payload, now)
            except DecodeError:
                self.counters["bad_payloads"] += 1
                continue
            if message is not None:
                received.append(Received(message, side))
        if self._passed:
            self._passed.clear()
            self._links[Side.UPPER].release()
            self.mail.go_with_states(now)
        return received

    def advance(self, now: float) -> None:
        """Advance to ``now`` (s): drop silent neighbours, send hello and time requests, repeat what is unreceipted."""
        self._standstill.move(now)
        for side, link in self._links.items():
            if self.place.neighbours[side] is not None and not link.is_up(now):
                self.place.neighbours[side] = None
        if self.seals is not None:
            self.seals.advance(now)
            self.mail.send_offers()
        if now >= self._hello_at + HELLO_EVERY:
            is_news = self._hello_at == -math.inf
            self._hello_at = now
            self._send_hello(now if is_news else now + HELLO_WAIT)
        if self._sync_side in self._links and now >= self._sync_at + self._sync_pace():
            self._sync_at = now
            self._links[self._sync_side].send_best_effort(
                unwritten_message(TimeRequest(now)), MessageKind.TIME_REQUEST, Priority.TIME
            )
        self.mail.send_due(now)

    def take_frames(self, now: float) -> list[tuple[Side, PortFrame]]:
        """Return the frames to send now, each with its end."""
        seals = self.seals
        if seals is None:
            frames: list[tuple[Side, PortFrame]] = []
            for side, link in self._links.items():
                if taken := link.take_frames(now):
                    frames += [(side, frame) for frame in taken]
            return frames
        return [
            (side, frame)
            for side, link in self._links.items()
            for frame in seals.frames_of(side, link.take_frames(now), now)
        ]

    def next_wake(self, now: float) -> float:
        """Local time (s) at which ``advance`` and ``take_frames`` have work that no frame brings."""
        wake = math.inf
        for link in self._links.values():
            if (due := link.next_wake(now)) < wake:
                wake = due
        return wake if self.seals is None else min(wake, self.seals.next_wake())

    def send_aiding(self, aiding: Aiding, now: float) -> None:
        """Hand the reference to the tube below; the newest replaces one that still waits. The encoder seals it."""
        del now
        if self.seals is not None and self.address == ENCODER:
            aiding = self.seals.measurement.close(aiding)
        if Side.LOWER in self._links:
            self._links[Side.LOWER].send_best_effort(unwritten_message(aiding), MessageKind.AIDING, Priority.AIDING)
            self._links[Side.LOWER].release()

    def ask_time(self, now: float) -> None:
        """Compare clocks again at the quick pace, because the epoch of rig time has changed."""
        self._sync_at = min(self._sync_at, now - SYNC_SLOW + SYNC_QUICK)

    def send_state(self, state: NodeState, now: float) -> None:
        """Send the node's account of itself up the string, with those from below: the lowest node sets the pace."""
        self.mode = state.mode
        if (link := self._links.get(Side.UPPER)) is not None:
            below = self._links.get(Side.LOWER)
            wait = STATE_WAIT + HOP_WAIT * max(WAITING_HOPS - self.place.hops, 0)
            until = now + wait if below is not None and below.is_up(now) else now
            payload = unwritten_message(state) if self.seals is None else self.seals.close_up(encode_message(state))
            link.send_with_others(payload, (MessageKind.NODE_STATE, state.tube), Priority.STATE, until)
            self.mail.has_states = True
            if until == now:
                self.mail.go_with_states(now)

    def margin(self, side: Side) -> float:
        """Margin (dB) of the frames heard at one end over the radio's threshold; inf without radio or neighbour."""
        return math.inf if self.place.neighbours[side] is None else self._links[side].margin

    @property
    def skipped(self) -> int:
        """Silent tubes between this one and its upper neighbour."""
        return self.place.skipped(self._upper)

    @property
    def waiting(self) -> int:
        """Payloads queued or on their way in both links."""
        return sum(link.waiting for link in self._links.values())

    def link_counters(self) -> dict[str, int]:
        """Counts of all that went wrong or was dropped, of both ends."""
        total = Counter(self.counters)
        if self.seals is not None:
            total.update(self.seals.counters())
        for link in self._links.values():
            total.update(link.counters)
        total["outbox_dropped"] = self.mail.dropped
        return dict(total)

    @property
    def dropped(self) -> int:
        """Number of messages without room in a queue since the start."""
        links = [link.counters for link in self._links.values()]
        return self.mail.dropped + sum([counters[name] for counters in links for name in DROPS])

    def export_state(self) -> bytes:
        """Pack what a restart needs: numbers, unreceipted messages, answered commands."""
        return self.mail.export_state(self.place.hops)

    def _handle(self, side: Side, opened: Opened, payload: Content, now: float) -> Message | None:
        kind = opened.kind
        if kind in ONE_HOP:
            return self._handle_one_hop(side, decode_opened(opened), now)
        if kind in DOWNWARD:
            if opened.target == self.address:
                return self.mail.open_from_base(opened, payload, now)
            self._pass(Side.LOWER, opened, payload)
            return None
        return self._handle_upward(opened, payload, now)

    def _handle_one_hop(self, side: Side, message: Message, now: float) -> Message | None:
        match message:
            case Aiding():
                return message if side is Side.UPPER and self._is_measured(message, now) else None
            case Hello():
                self._meet(side, message, now)
            case TimeRequest() if self.clock.synchronised and side is not self._sync_side:
                clock = self.clock
                var = min(clock.variance(now), 1e9)
                rig_now = clock.rig_from_local(now)
                reply = TimeReply(message.asked_at, now, now, rig_now, clock.rig_rate, var, clock.epoch)
                self._links[side].send_best_effort(unwritten_message(reply), MessageKind.TIME_REPLY, Priority.TIME)
            case TimeReply() if side is self._sync_side:
                self.clock.exchange(message, now)
        return None

    def _meet(self, side: Side, hello: Hello, now: float) -> None:
        if self.place.meet(side, hello, self._upper, self._links[side].quality, now):
            self._hello_at = -math.inf

    def _handle_upward(self, opened: Opened, payload: Content, now: float) -> Message | None:
        if opened.kind is MessageKind.DEPTH_READING:
            raise DecodeError("depth reading: expected on its own key")
        waited = opened.kind is MessageKind.NODE_STATE and self._standstill.may_have_waited(now)
        if waited and is_undated(decode_opened(opened)):
            self.counters["old_states"] += 1
            return None
        if self.address != BASE:
            self._pass(Side.UPPER, opened, payload)
            return None
        return self.mail.open_from_tube(opened, payload, now)

    def _is_measured(self, aiding: Aiding, now: float) -> bool:
        """Return whether an aiding is the encoder's measurement; without keys every one counts as such."""
        if self.seals is None or not self.clock.synchronised:
            return True  # what comes before rig time is known is not used
        return self.seals.measurement.admits(aiding, self.clock.epoch, self.clock.rig_from_local(now))

    def _pass(self, side: Side, opened: Opened, payload: Content) -> None:
        """Relay the bytes that came, unchanged."""
        link, kind = self._links.get(side), opened.kind
        if link is None:
            self.counters["nowhere_to_go"] += 1
        elif kind is MessageKind.NODE_STATE:
            self._pass_state(opened.origin, payload)
        elif kind in RELIABLE:
            link.send_reliable(bytes(payload), PRIORITIES[kind])
        else:
            link.send_best_effort(payload, (kind, opened.origin), PRIORITIES[kind])

    def _pass_state(self, tube: int, payload: Content) -> None:
        if (link := self._links.get(Side.UPPER)) is None:
            self.counters["nowhere_to_go"] += 1
            return
        # a second state of one number in a frame is another tube's, which the ground station is to hear of
        topic = (MessageKind.NODE_STATE, tube, tube in self._passed or tube == self.address)
        self._passed.add(tube)
        link.send_best_effort(payload, topic, Priority.STATE)

    @property
    def _upper(self) -> int | None:
        """Address of the neighbour at the upper end."""
        link = self._links.get(Side.UPPER)
        return None if link is None or link.peer is None else link.peer[0]

    def _send_hello(self, until: float) -> None:
        for link in self._links.values():
            hello = Hello(self.address, self.boot_count, self.place.hops, self.mode, link.quality)
            link.send_with_others(unwritten_message(hello), MessageKind.HELLO, Priority.HELLO, until)

    def _sync_pace(self) -> float:
        return SYNC_QUICK if self.clock.exchanges < SYNC_BURST else SYNC_SLOW
