"""What an endpoint may not be made to believe: forged receipts and neighbours, damaged state, old numbers."""

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.application.endpoint import Endpoint
from telemetry.application.endpoint_state import STATE_LAYOUT
from telemetry.application.outbox import LIMIT, Outbox
from telemetry.application.series import SERIES_SHIFT
from telemetry.errors import DecodeError
from telemetry.messages import (
    BASE,
    ENCODER,
    HOPS_UNKNOWN,
    MAX_TUBE,
    Command,
    Event,
    Hello,
    NodeMode,
    Receipt,
    Reply,
    Severity,
    Side,
)
from telemetry.presentation.content import content_of_message
from telemetry.presentation.msgpack_codec import decode_message, encode_message
from telemetry.transport.hop import HopLink

EVENT = Event(3, 1, 5.0, Severity.ERROR, "stopped")


class Neighbour:
    """The upper neighbour of tube 3, which says whatever a test likes."""

    def __init__(self, tube: Endpoint) -> None:
        self.tube, self.link, self.now = tube, HopLink(ENCODER, 1), 100.0
        self.say()
        self.listen()

    def say(self, *payloads: bytes, reliable: bool = True) -> None:
        for k, payload in enumerate(payloads):
            if reliable:
                self.link.send_reliable(payload)
            else:
                self.link.send_best_effort(payload, k)
        self.link.send_best_effort(encode_message(Hello(ENCODER, 1, 0, NodeMode.BOOT, 1.0)), "hello")
        for frame in self.link.take_frames(self.now):
            self.tube.receive(Side.UPPER, frame.payload, self.now)

    def listen(self) -> list[object]:
        self.now += 1.5
        self.tube.advance(self.now)
        said: list[object] = []
        for side, frame in self.tube.take_frames(self.now):
            if side is Side.UPPER:
                said += [decode_message(payload) for payload in self.link.receive(frame.payload, self.now)]
        return said


@pytest.fixture
def tube() -> Endpoint:
    return Endpoint(3, frozenset(Side), boot_count=1)


def test_a_receipt_for_other_content_empties_no_outbox(tube: Endpoint) -> None:
    above = Neighbour(tube)
    tube.mail.submit(EVENT, above.now)
    above.say(encode_message(Receipt(3, 1)), encode_message(Receipt(3, 1, bytes(16))))
    assert tube.mail.outbox_size == 1
    assert tube.counters["foreign_receipts"] == 2
    above.say(encode_message(Receipt(3, 1, content_of_message(EVENT))))
    assert tube.mail.outbox_size == 0


@given(st.integers(HOPS_UNKNOWN, BASE))
def test_whatever_hop_count_a_neighbour_names_the_endpoint_speaks_on(hops: int) -> None:
    tube = Endpoint(3, frozenset(Side), boot_count=1)
    above = Neighbour(tube)
    above.say(encode_message(Hello(ENCODER, 1, hops, NodeMode.BOOT, 1.0)), reliable=False)
    above.listen()
    assert tube.place.hops <= MAX_TUBE
    restored = Endpoint(3, frozenset(Side), boot_count=2, restored=tube.export_state())
    assert restored.counters["bad_saved_state"] == 0
    assert Neighbour(restored).listen() is not None


BAD = st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary() | st.lists(st.integers())


@given(
    st.tuples(BAD, BAD, BAD, BAD, BAD)
    | st.tuples(
        st.just(STATE_LAYOUT), st.just(5), st.lists(st.tuples(BAD, BAD)), st.just([]), st.integers(), st.integers()
    )
)
def test_a_state_that_is_none_is_not_believed(rows: tuple[object, ...]) -> None:
    try:
        saved = msgpack.packb(rows)
    except (OverflowError, ValueError, UnicodeEncodeError):
        return
    restored = Endpoint(3, frozenset(Side), boot_count=2, restored=saved)
    restored.advance(10.0)
    assert restored.take_frames(10.0) is not None
    assert HOPS_UNKNOWN <= restored.place.hops <= MAX_TUBE


@given(st.binary(max_size=200))
def test_any_bytes_for_a_state_are_survived(saved: bytes) -> None:
    restored = Endpoint(3, frozenset(Side), boot_count=2, restored=saved)
    restored.advance(10.0)


def test_a_tube_that_lost_its_numbers_gives_none_out_twice() -> None:
    first = Endpoint(3, frozenset(Side), boot_count=1)
    assert first.mail.series.take() == 1
    lost = Endpoint(3, frozenset(Side), boot_count=4)
    assert lost.mail.series.newest == 0
    assert lost.mail.series.take() == (4 << SERIES_SHIFT) + 1
    assert lost.mail.series.newest == (4 << SERIES_SHIFT) + 1


def test_a_full_outbox_drops_what_may_be_lost_first_and_never_the_newest() -> None:
    outbox = Outbox()
    for number in range(1, LIMIT + 1):
        outbox.keep_payload(number, b"x", 0.0, needed=number % 2 == 0)
    for number in range(LIMIT + 1, LIMIT + 11):
        outbox.keep_payload(number, b"y", 0.0)
    kept = {number for number, _ in outbox.contents()}
    assert outbox.dropped == 10
    assert kept == set(range(1, LIMIT + 11)) - set(range(1, 20, 2))
    for number in range(LIMIT + 11, 3 * LIMIT):
        outbox.keep_payload(number, b"z", 0.0)
    assert len(outbox) == LIMIT
    assert outbox.payload(3 * LIMIT - 1) == b"z"


def test_what_waits_for_others_goes_with_the_next_or_alone_in_time_and_once() -> None:
    outbox = Outbox()
    outbox.keep_waiting(1, b"with others", 2.0)
    assert list(outbox.due_payloads(1.0)) == []
    assert outbox.release(1.0)
    assert list(outbox.due_payloads(1.0)) == [b"with others"]
    outbox.keep_waiting(2, b"alone", 3.0)
    assert list(outbox.due_payloads(3.0)) == [b"alone"]
    assert not outbox.release(3.0)
    assert list(outbox.due_payloads(3.0)) == []


def test_a_depth_on_a_joint_is_no_message(tube: Endpoint) -> None:
    from telemetry.messages import DepthReading

    above = Neighbour(tube)
    above.say(encode_message(DepthReading(1, 1.0, 1.0, ())))
    assert tube.counters["bad_payloads"] == 1
    with pytest.raises(DecodeError):
        decode_message(b"")


def test_only_who_was_asked_answers_an_order() -> None:
    base = Endpoint(BASE, frozenset({Side.LOWER}), boot_count=1)
    link = HopLink(ENCODER, 1)
    link.send_best_effort(encode_message(Hello(ENCODER, 1, 0, NodeMode.BOOT, 1.0)), "hello")
    base.mail.command(Command(3, 9, "take_survey"), 100.0)
    heard: list[object] = []
    for reply in (None, Reply(2, 9, False, "stolen"), Reply(3, 9, True, ""), Reply(3, 9, True, "again")):
        if reply is not None:
            link.send_best_effort(encode_message(reply), reply.detail)
        for frame in link.take_frames(100.0):
            heard += [received.message for received in base.receive(Side.LOWER, frame.payload, 100.0)]
    assert heard == [Reply(3, 9, True, "")]
