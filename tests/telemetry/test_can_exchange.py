"""One end of a CAN joint: what goes first, what waits, and what two talkers, silence and garbage do."""

from __future__ import annotations

import random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.media.can_exchange import (
    ACKNOWLEDGE_LIMIT,
    BUDGET_BURST,
    BUDGETS,
    FLOW_LIMIT,
    PRESENCE_EVERY,
    SILENCE,
    CanData,
    CanExchange,
)
from telemetry.media.can_identifier import FLOW_CONTROL, PRESENCE, TUNNEL, Identifier
from telemetry.media.port import PortFrame, Priority
from telemetry.media.send_queue import SEND_LIMIT, SendQueue
from telemetry.messages import Hello, NodeMode
from telemetry.presentation.can_native import open_profile
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.transport.hop import HopLink

STEP = 1e-3  # s, of a frame on the wire


def end(address: int, largest: int = 8, nonce: int = 1, begun: float = 0.0) -> CanExchange:
    return CanExchange(address, largest, SendQueue(16384), nonce, begun)


class Wire:
    """Two ends and a wire between them that takes a frame each ``STEP``, the lower identifier first."""

    def __init__(self, *ends: CanExchange) -> None:
        self.ends = ends
        self.now = 0.0
        self.heard: dict[int, list[bytes]] = {e.address: [] for e in ends}
        self.sent: list[tuple[float, Identifier]] = []
        self._waiting: dict[int, CanData] = {}
        self.is_open = False
        self.is_lost = lambda: False  # of the next frame: arrives, and the other end can make nothing of it

    def step(self) -> bool:
        """Carry one frame; returns whether there was any."""
        for number, e in enumerate(self.ends):
            e.advance(self.now)
            if number not in self._waiting and (frame := e.next_frame(self.now)) is not None:
                self._waiting[number] = frame
        self.now += STEP
        if not self._waiting or self.is_open:
            return False
        number = min(self._waiting, key=lambda n: self._waiting[n].identifier)
        frame = self._waiting.pop(number)
        identifier = Identifier.unpack(frame.identifier)
        assert identifier is not None
        self.sent.append((self.now, identifier))
        self.ends[number].on_acknowledged(self.now)
        for other in self.ends:
            if other is not self.ends[number] and not self.is_lost():
                payload = other.on_frame(frame.identifier, frame.data, self.now)
                if payload is not None:
                    self.heard[other.address].append(payload)
        return True

    def run(self, duration: float) -> None:
        until = self.now + duration
        while self.now < until:
            self.step()


def joined(largest: int = 8) -> tuple[CanExchange, CanExchange, Wire]:
    upper, lower = end(2, largest, 7), end(1, largest, 8)
    wire = Wire(upper, lower)
    wire.run(0.01)
    assert upper.is_up
    assert lower.is_up
    return upper, lower, wire


@given(st.integers(0, 6), st.integers(0, 31), st.integers(0, 255), st.integers(0, 31), st.integers(0, 255))
def test_an_identifier_survives_and_urgent_ones_are_lower(
    priority: int, kind: int, source: int, part: int, destination: int
) -> None:
    identifier = Identifier(Priority(priority), kind, source, part, destination)
    assert 0 <= identifier.pack() < 2**29
    assert Identifier.unpack(identifier.pack()) == identifier
    if priority < 6:
        assert identifier.pack() < Identifier(Priority(priority + 1), 0, 0, 0, 0).pack()


def test_an_upload_delays_an_aiding_by_one_frame_and_no_more() -> None:
    upper, _, wire = joined()
    for k in range(8):
        upper.queue.offer(PortFrame(bytes([k]) * 310, Priority.BLOCK))
    delays = []
    random_times = random.Random(1)
    for _ in range(20):
        wire.run(random_times.uniform(0.01, 0.02))
        upper.queue.offer(PortFrame(b"aiding", Priority.AIDING, "aiding"))
        offered, before = wire.now, len(wire.sent)
        wire.run(3 * STEP)
        first = next(at for at, identifier in wire.sent[before:] if identifier.priority is Priority.AIDING)
        delays.append(first - offered)
    assert max(delays) <= 2 * STEP + 1e-9  # the frame that is on the wire, and itself
    wire.run(2.0)
    assert [p for p in wire.heard[1] if p != b"aiding"] == [bytes([k]) * 310 for k in range(8)]


def test_an_open_joint_keeps_little_and_hands_out_the_newest_first() -> None:
    upper, _, wire = joined()
    wire.is_open = True
    wire.run(ACKNOWLEDGE_LIMIT + PRESENCE_EVERY + 0.01)
    assert not upper.is_up
    for k in range(1140):  # ten minutes of aidings and states
        upper.queue.offer(PortFrame(b"aiding %d" % k, Priority.AIDING, "aiding"))
        upper.queue.offer(PortFrame(b"state %d" % k, Priority.STATE, "state"))
        wire.step()
    assert len(upper.queue) == 2 <= SEND_LIMIT
    wire.is_open = False
    wire.run(0.1)
    assert wire.heard[1] == [b"aiding 1139", b"state 1139"]


def test_what_must_not_be_lost_survives_a_joint_that_opens_in_its_middle() -> None:
    upper, _, wire = joined()
    upper.queue.offer(PortFrame(bytes(500), Priority.SURVEY))
    upper.queue.offer(PortFrame(bytes(300), Priority.STATE, "state"))
    wire.run(20 * STEP)
    wire.is_open = True
    wire.run(1.0)
    assert not upper.is_up
    wire.is_open = False
    wire.run(1.0)
    assert bytes(500) in wire.heard[1]
    assert len(upper.queue) == 0


def test_a_transfer_goes_on_where_it_was_after_a_moment_in_which_nothing_moved() -> None:
    upper, lower, wire = joined()
    upper.queue.offer(PortFrame(bytes(500), Priority.SURVEY))
    wire.run(20 * STEP)
    wire.is_open = True
    wire.run(ACKNOWLEDGE_LIMIT + 0.1)
    assert not upper.is_up
    wire.is_open = False
    wire.run(0.5)
    assert wire.heard[1] == [bytes(500)]
    assert not upper.counters
    assert not lower.counters


def test_an_answer_waits_as_long_as_its_transfer() -> None:
    first = Identifier(Priority.SURVEY, TUNNEL, 2).pack(), b"\x10\x64" + bytes(6)
    for pause, answers in ((ACKNOWLEDGE_LIMIT + 0.1, 1), (FLOW_LIMIT + 0.1, 0)):
        lower = end(1)
        assert lower.next_frame(0.0) is not None  # its sign of life
        lower.on_acknowledged(0.0)
        lower.queue.offer(PortFrame(b"mine"))
        assert lower.next_frame(0.0) is not None
        lower.on_frame(*first, 0.0)
        lower.advance(pause)
        assert not lower.is_up
        lower.on_acknowledged(pause)
        sent = []
        while (frame := lower.next_frame(pause)) is not None:
            sent.append(Identifier.unpack(frame.identifier))
            lower.on_acknowledged(pause)
        assert [identifier.type for identifier in sent if identifier is not None].count(FLOW_CONTROL) == answers


@pytest.mark.slow
@pytest.mark.parametrize("largest", [8, 64])
def test_links_on_the_native_profile_lose_nothing_over_a_wire_that_does(largest: int) -> None:
    draw = random.Random(5)
    ends = [CanExchange(address, largest, SendQueue(16384), address, 0.0, open_profile()) for address in (2, 1)]
    links = {e.address: HopLink(e.address, 1) for e in ends}
    wire, heard = Wire(*ends), {2: [], 1: []}
    wire.is_lost = lambda: draw.random() < 0.02
    told = {address: [bytes([address, k]) * 40 for k in range(60)] for address in links}
    while wire.now < 120.0 and any(len(heard[3 - a]) < len(told[a]) for a in links):
        for e in ends:
            link = links[e.address]
            link.bundle_limit = 0
            if draw.random() < 0.02:
                link.send_best_effort(
                    encode_message(Hello(e.address, 1, 1, NodeMode.STILL, 1.0)), "hello", Priority.HELLO
                )
            if draw.random() < 0.02 and (waiting := told[e.address][link.counters["told"] :]):
                link.send_reliable(waiting[0])
                link.counters["told"] += 1
            for payload in wire.heard[e.address]:
                heard[e.address] += [p for p in link.receive(payload, wire.now) if p in told[3 - e.address]]
            wire.heard[e.address].clear()
            for frame in link.take_frames(wire.now):
                e.queue.offer(frame)
        wire.step()
    assert {a: sorted(heard[a]) for a in heard} == {a: sorted(told[3 - a]) for a in heard}


def test_a_missing_answer_ends_a_transfer_and_the_next_one_goes_on() -> None:
    upper, lower, wire = joined()
    upper.queue.offer(PortFrame(bytes(100), Priority.SURVEY))
    upper.queue.offer(PortFrame(b"next", Priority.SURVEY))
    deaf = wire.ends[1].on_frame

    def hear_no_first(bits: int, data: bytes, now: float) -> bytes | None:
        return None if data[:1] == b"\x10" else deaf(bits, data, now)

    lower.on_frame = hear_no_first  # type: ignore[method-assign]
    wire.run(FLOW_LIMIT + 0.1)
    assert upper.counters["no_flow_control"] == 1
    assert wire.heard[1] == [b"next"]


def test_a_sender_that_falls_silent_in_the_middle_is_given_up() -> None:
    lower = end(1)
    identifier = Identifier(Priority.SURVEY, TUNNEL, 2).pack()
    lower.on_frame(identifier, b"\x10\x64" + bytes(6), 0.0)
    lower.advance(FLOW_LIMIT + 0.1)
    assert lower.counters["interrupted"] == 1
    assert lower.on_frame(identifier, b"\x21" + bytes(7), 2.0) is None
    assert lower.counters["unexpected"] == 1


def test_a_third_talker_is_not_heard_while_the_other_end_is() -> None:
    lower = end(1)
    mine, third = (Identifier(Priority.SURVEY, TUNNEL, source).pack() for source in (2, 9))
    assert lower.on_frame(mine, b"\x01a", 0.0) == b"a"
    assert lower.on_frame(third, b"\x01b", 1.0) is None
    assert lower.counters["third_talker"] == 1
    assert lower.on_frame(third, b"\x01b", SILENCE + 0.1) == b"b"
    assert lower.on_frame(mine, b"\x01a", SILENCE + 0.2) is None


def test_of_two_ends_with_one_address_the_younger_falls_silent() -> None:
    older, younger = end(5, nonce=1, begun=0.0), end(5, nonce=2, begun=10.0)
    other = end(6, nonce=3)
    wire = Wire(older, other, younger)
    wire.now = 10.0
    for e in (older, younger):
        e.queue.offer(PortFrame(b"%d" % e._nonce))
    wire.run(1.0)
    assert (older.is_mute, younger.is_mute) == (False, True)
    assert not younger.is_up
    assert older.counters["same_address"] > 0
    before = len(wire.sent)
    older.queue.offer(PortFrame(b"mine"))
    younger.queue.offer(PortFrame(b"not mine"))
    wire.run(1.0)
    assert wire.heard[6][-1] == b"mine"
    assert b"not mine" not in wire.heard[6]
    assert all(identifier.part != 2 for _, identifier in wire.sent[before:] if identifier.type == PRESENCE)


@pytest.mark.parametrize("bits", [7 << 26, Identifier(Priority.TIME, 28, 2).pack()])
def test_an_unknown_identifier_is_counted(bits: int) -> None:
    lower = end(1)
    assert lower.on_frame(bits, b"\x01a", 0.0) is None
    assert lower.counters == {"unknown_identifier": 1}


def test_an_answer_to_nothing_is_counted() -> None:
    lower = end(1)
    lower.on_frame(Identifier(Priority.SURVEY, FLOW_CONTROL, 2).pack(), b"\x30\x00\x00", 0.0)
    assert lower.counters == {"bad_flow_control": 1}


frames = st.tuples(st.integers(0, 2**29 - 1), st.binary(max_size=64), st.floats(0.0, 5.0))
known = st.builds(
    lambda priority, kind, data, wait: (Identifier(priority, kind, 2).pack(), data, wait),
    st.sampled_from(Priority),
    st.sampled_from([TUNNEL, FLOW_CONTROL, PRESENCE]),
    st.binary(max_size=64),
    st.floats(0.0, 5.0),
)


@given(st.lists(frames | known, max_size=60), st.booleans())
def test_whatever_comes_nothing_raises_and_sound_payloads_still_arrive(arriving: list[Any], busy: bool) -> None:
    lower, now = end(1), 0.0
    for bits, data, wait in arriving:
        now += wait
        if busy:
            lower.queue.offer(PortFrame(bytes(100), Priority.STATE))
        lower.advance(now)
        if lower.next_frame(now) is not None:
            lower.on_acknowledged(now)
        lower.on_frame(bits, data, now)
    assert len(lower._answers) <= len(Priority)
    lower.advance(now + SILENCE + FLOW_LIMIT)
    sound = Identifier(Priority.TIME, TUNNEL, 2).pack()
    assert lower.on_frame(sound, b"\x02ok", now + SILENCE + FLOW_LIMIT) == b"ok"


def test_a_babbling_neighbour_is_heard_as_much_as_it_may_and_others_classes_are_heard() -> None:
    lower, heard = end(1), 0
    babble = Identifier(Priority.TIME, TUNNEL, 2).pack()
    for k in range(10_000):
        heard += lower.on_frame(babble, b"\x01x", 0.001 * k) is not None
    assert heard <= (10.0 + BUDGET_BURST) * BUDGETS[Priority.TIME]
    assert lower.counters["babbling"] == 10_000 - heard
    survey = Identifier(Priority.SURVEY, TUNNEL, 2).pack()
    assert lower.on_frame(survey, b"\x01s", 10.0) == b"s"
