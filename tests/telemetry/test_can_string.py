"""A whole string on CAN that is plugged together after ten minutes apart: bounded until then, fresh and whole after."""

from __future__ import annotations

from itertools import pairwise

import pytest

from sim.can.wire import CanWire
from telemetry.application.endpoint import Endpoint
from telemetry.frozen import replace
from telemetry.media.can_exchange import CanExchange
from telemetry.media.can_frame import EXTENDED, IDENTIFIER, CanFrame
from telemetry.media.port import MAX_FRAME
from telemetry.media.send_queue import SEND_LIMIT, SendQueue
from telemetry.messages import BASE, ENCODER, Aiding, Event, Message, NodeFlag, NodeMode, NodeState, Severity, Side
from telemetry.presentation.can_native import open_profile

TUBES = (3, 2, 1)  # from the top
ORDER = (BASE, ENCODER, *TUBES)
COARSE, FINE = 0.25, 0.02  # s, steps while all is apart and once it is not
CYCLE, EVENT_EVERY = 0.5, 10.0  # s
APART, TOGETHER = 600.0, 10.0  # s
ZERO = (0.0, 0.0, 0.0)


class End:
    """One end of a joint."""

    def __init__(self, address: int, side: Side, wire: CanWire) -> None:
        self.address, self.side, self.wire = address, side, wire
        self.queue = SendQueue(MAX_FRAME)
        self.exchange = CanExchange(address, 64, self.queue, address, 0.0, open_profile())
        wire.attach(self, fd=True)


class String:
    """Base, encoder and tubes, each joint a segment that takes no time."""

    def __init__(self) -> None:
        self.now = 0.0
        self.heard: dict[int, list[tuple[float, Message]]] = {address: [] for address in ORDER}
        self.wires: list[CanWire] = []
        self.ends: list[End] = []
        self.points = {
            address: Endpoint(
                address,
                frozenset({Side.LOWER} if address == BASE else Side),
                boot_count=1,
                is_clock_root=address == ENCODER,
            )
            for address in ORDER
        }
        for above, below in pairwise(ORDER):
            wire = CanWire()
            wire.is_cut = True
            self.wires.append(wire)
            self.ends += [End(above, Side.LOWER, wire), End(below, Side.UPPER, wire)]
        self._queues = {(end.address, end.side): end.queue for end in self.ends}
        for end in self.ends:
            self.points[end.address].limit_bundles(end.side, 0)

    def run(self, seconds: float, tick: float) -> None:
        """Let time pass; the encoder measures, tubes hand on, tell of themselves and of something that must be kept."""
        for _ in range(round(seconds / tick)):
            self.now = round(self.now + tick, 6)
            if self.now % CYCLE < tick:
                self._cycle(int(self.now / CYCLE), self.now % EVENT_EVERY < tick)
            for address, point in self.points.items():
                point.advance(self.now)
                for side, frame in point.take_frames(self.now):
                    if (address, side) in self._queues:  # nothing hangs below tube 1
                        self._queues[address, side].offer(frame)
            self._carry()

    def _cycle(self, number: int, is_told: bool) -> None:
        self.points[ENCODER].send_aiding(Aiding(1.0, 1e-8, 0.0, 0.0, 0.1, self.now, number, 0, epoch=1), self.now)
        for tube in TUBES:
            point = self.points[tube]
            point.send_state(
                NodeState(
                    tube, self.now, point.place.hops, NodeMode.TRACKING, 1.0, 1e-6, 1e-6, ZERO, 0.0, 0.0, 1e-7, 0.5,
                    1e-9,
                    NodeFlag.NONE, number, 0,
                ),
                self.now,
            )  # fmt: skip
            if is_told:
                event = Event(tube, point.mail.series.take(), self.now, Severity.INFO, "booted", {})
                point.mail.submit(event, self.now)

    def _carry(self) -> None:
        moving = True
        while moving:
            moving = False
            for end in self.ends:
                end.exchange.advance(self.now)
                if (frame := end.exchange.next_frame(self.now)) is not None:
                    end.wire.submit(end, CanFrame(EXTENDED | frame.identifier, frame.data, True), self.now)
                    moving = True
            for wire in self.wires:
                for to, frame_ in wire.advance(self.now):
                    assert isinstance(to, End)
                    self._deliver(to, frame_)

    def _deliver(self, end: End, frame: CanFrame) -> None:
        if frame.is_error:
            return
        if frame.own:
            end.exchange.on_acknowledged(self.now)
            return
        payload = end.exchange.on_frame(frame.can_id & IDENTIFIER, frame.data, self.now)
        point = self.points[end.address]
        for received in point.receive(end.side, payload, self.now) if payload is not None else []:
            message = received.message
            self.heard[end.address].append((self.now, message))
            if isinstance(message, Aiding):
                point.send_aiding(replace(message, hops=message.hops + 1), self.now)
            elif isinstance(message, Event):
                point.mail.acknowledge(message)


@pytest.fixture(scope="module")
def plugged() -> tuple[String, list[int]]:
    """String after it was plugged together, and how much waited in each end before."""
    string = String()
    string.run(APART, COARSE)
    waiting = [len(end.queue) for end in string.ends]
    for wire in string.wires:
        wire.is_cut = False
    string.run(TOGETHER, FINE)
    return string, waiting


pytestmark = pytest.mark.slow


def test_what_waits_at_an_open_joint_is_bounded(plugged: tuple[String, list[int]]) -> None:
    string, waiting = plugged
    assert len(waiting) == 2 * (len(ORDER) - 1)
    assert max(waiting) <= SEND_LIMIT
    assert all(not end.exchange.counters["no_flow_control"] for end in string.ends)


def test_every_tube_finds_its_place(plugged: tuple[String, list[int]]) -> None:
    string, _ = plugged
    assert [string.points[tube].place.hops for tube in TUBES] == [1, 2, 3]
    assert all(string.points[tube].clock.synchronised for tube in TUBES)


def test_the_first_aiding_after_joining_is_fresh(plugged: tuple[String, list[int]]) -> None:
    string, _ = plugged
    for tube in TUBES:
        at, first = next((at, m) for at, m in string.heard[tube] if isinstance(m, Aiding))
        assert APART < at <= APART + 5.0
        assert at - first.valid_at <= 2.0 * CYCLE


def test_nothing_kept_is_lost_and_nothing_comes_twice_after_its_receipt(plugged: tuple[String, list[int]]) -> None:
    string, _ = plugged
    arrived = {(m.tube, m.sequence) for _, m in string.heard[BASE] if isinstance(m, Event)}
    for tube in TUBES:
        numbers = sorted(sequence for address, sequence in arrived if address == tube)
        assert numbers == list(range(1, len(numbers) + 1))
        assert len(numbers) >= APART / EVENT_EVERY
        assert string.points[tube].mail.outbox_size <= 1
    states = [(at, m) for at, m in string.heard[BASE] if isinstance(m, NodeState)]
    assert {m.tube for _, m in states} == set(TUBES)
    assert max(at - m.at for at, m in states if at > APART + 5.0) <= 2.0 * CYCLE
