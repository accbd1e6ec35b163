"""ISO-TP in C with Python's at the other end: whatever is lost, repeated, exchanged or late, both say the same."""

from __future__ import annotations

import ctypes
from collections import Counter

import pytest
from c_isotp import CReceiver, Inward, Outward, load_isotp
from hypothesis import example, given
from hypothesis import strategies as st
from needed_programs import needs_gcc

from telemetry.media.can_exchange import FLOW_LIMIT, CanExchange
from telemetry.media.can_identifier import FLOW_CONTROL, TUNNEL, packed_identifier
from telemetry.media.isotp import Receiver, Sender, TransferError, flow_control
from telemetry.media.port import MAX_FRAME, PortFrame, Priority
from telemetry.media.send_queue import SendQueue

LARGEST = st.sampled_from([8, 64])


@pytest.fixture(scope="module")
def isotp(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return load_isotp(tmp_path_factory.mktemp("isotp"))


def python_takes(receiver: Receiver, data: bytes) -> bytes | str | None:
    try:
        return receiver.on_frame(data)
    except TransferError as error:
        return str(error)


def python_answers(sender: Sender, data: bytes) -> str | None:
    try:
        sender.on_flow(data)
    except TransferError as error:
        return str(error)
    return None


def take_answer(receiver: Receiver) -> bytes | None:
    flow, receiver.flow = receiver.flow, None
    return flow


@st.composite
def payloads(draw: st.DrawFn) -> bytes:
    """Of any length, those about which the form changes more often than others."""
    edge = st.sampled_from([0, 1, 6, 7, 8, 61, 62, 63, 64, 231, 232, 238, 239, 2016, 2046, 2078, 2079, 4095, 4096])
    length = draw(st.integers(0, 5000) | edge)
    return bytes((draw(st.integers(0, 255)) + 7 * k) & 0xFF for k in range(length))


@needs_gcc
@given(payloads(), LARGEST)
def test_each_side_takes_the_others_payload_whole(isotp: ctypes.CDLL, payload: bytes, largest: int) -> None:
    outward, sender = Outward(isotp, payload, largest), Sender(payload, largest)
    receiver, inward = Receiver(MAX_FRAME), Inward(isotp, 5000)
    heard: list[bytes | str | None] = []
    while not sender.is_done:
        frame = outward.next_frame()
        assert frame == sender.next_frame()
        heard = [python_takes(receiver, frame), inward.on_frame(frame)]
        answer = take_answer(receiver)
        assert inward.take_flow() == answer
        assert outward.awaits_flow == (sender.awaits_flow and not sender.is_done)
        if answer is not None and not sender.is_done:
            assert outward.on_flow(answer) is None
            sender.on_flow(answer)
    assert heard == [payload, payload]
    assert not outward.is_open
    assert outward.next_frame() == b""


@st.composite
def disturbed(draw: st.DrawFn) -> list[bytes]:
    """Frames of a few payloads, of which some are lost, come again, change places, are cut, or are no frames at all."""
    frames: list[bytes] = []
    for _ in range(draw(st.integers(1, 3))):
        sender = Sender(draw(st.binary(max_size=400)), draw(LARGEST))
        while not sender.is_done:
            frames.append(sender.next_frame())
            if sender.awaits_flow:
                sender.on_flow(flow_control(0, draw(st.sampled_from([0, 1, 3, 32]))))  # type: ignore[arg-type]
    for _ in range(draw(st.integers(0, 4))):
        place = draw(st.integers(0, len(frames) - 1))
        match draw(st.integers(0, 4)):
            case 0 if len(frames) > 1:
                del frames[place]
            case 1:
                frames.insert(draw(st.integers(0, len(frames))), frames[place])
            case 2:
                other = draw(st.integers(0, len(frames) - 1))
                frames[place], frames[other] = frames[other], frames[place]
            case 3:
                frames[place] = frames[place][: draw(st.integers(0, len(frames[place])))]
            case _:
                frames.insert(place, draw(st.binary(max_size=64)))
    return frames


@needs_gcc
@given(disturbed(), st.sampled_from([62, 100, 399, 500]))
@example([b"\x10\x00\x00\x00\x01\x00ab", b"\x21cdefgh"], 62)  # a length in six bytes
@example([b"\x10\x00\xff\xff\xff\xffab"], 62)
@example([b"\x00\x05abcde"], 62)
@example([b"\x10\x3eabcdef"], 62)
@example([b"\x10\x3fabcdef"], 62)
@example([b"\x00"], 62)
def test_a_receiver_says_of_any_frames_what_pythons_says(isotp: ctypes.CDLL, frames: list[bytes], limit: int) -> None:
    receiver, inward = Receiver(limit), Inward(isotp, limit)
    for frame in frames:
        assert inward.on_frame(frame) == python_takes(receiver, frame)
        assert inward.is_open == receiver.is_open
        assert inward.take_flow() == take_answer(receiver)


FLOWS = st.builds(bytes, st.tuples(st.sampled_from([0x30, 0x31, 0x32, 0x33, 0x3F]), st.integers(0, 255), st.just(0)))


@needs_gcc
@given(st.binary(max_size=900), LARGEST, st.lists(FLOWS | st.just(b"\x30\x00\x00") | st.just(b"\x30\x02"), max_size=30))
def test_a_sender_does_of_any_answers_what_pythons_does(
    isotp: ctypes.CDLL, payload: bytes, largest: int, answers: list[bytes]
) -> None:
    outward, sender = Outward(isotp, payload, largest), Sender(payload, largest)
    for answer in answers:
        while not sender.is_done and not sender.awaits_flow:
            assert outward.next_frame() == sender.next_frame()
        assert outward.awaits_flow == (sender.awaits_flow and not sender.is_done)
        if sender.is_done:
            assert not outward.is_open
            return
        assert outward.next_frame() == b""  # it waits
        said = python_answers(sender, answer)
        assert outward.on_flow(answer) == said
        assert outward.is_open == (said is None)
        if said is not None:
            return


@needs_gcc
@pytest.mark.parametrize("data", [b"", b"\x20\x01\x00", b"\x00"])
def test_what_is_no_flow_control_is_named_and_the_payload_goes_on(isotp: ctypes.CDLL, data: bytes) -> None:
    outward = Outward(isotp, bytes(100), 8)
    outward.next_frame()
    assert outward.on_flow(data) == "bad_flow_control"
    assert outward.awaits_flow
    assert outward.on_flow(b"\x30\x00\x00") is None
    assert len(outward.next_frame()) == 8
    assert Outward(isotp, b"", 8).on_flow(b"\x30\x00") == "bad_flow_control"


def python_end(largest: int) -> CanExchange:
    """An exchange of the product, on a bus that acknowledges."""
    exchange = CanExchange(1, largest, SendQueue(MAX_FRAME), nonce=5, begun=0.0)
    exchange.next_frame(0.0)
    exchange.on_acknowledged(0.0)
    return exchange


LIMIT_MS = round(1e3 * FLOW_LIMIT)
PAUSES = st.lists(
    st.integers(0, 40) | st.sampled_from([LIMIT_MS, LIMIT_MS + 1, 5 * LIMIT_MS]), min_size=12, max_size=12
)
RUNS_OVER = 2**32 - 700  # ms


@needs_gcc
@given(st.binary(min_size=8, max_size=70), PAUSES, st.sampled_from([0, RUNS_OVER]))
def test_a_payload_that_stands_still_is_given_up_when_python_does(
    isotp: ctypes.CDLL, payload: bytes, pauses: list[int], begin: int
) -> None:
    inward, exchange = Inward(isotp, 500), python_end(8)
    sender, now = Sender(payload, 8), 0
    counted: Counter[str] = Counter()
    for pause in pauses:
        if sender.is_done:
            break
        now += pause
        at = begin + now & 0xFFFFFFFF
        exchange.advance(now / 1e3)
        counted[inward.advance(at) or ""] += 1
        frame = sender.next_frame()
        said = exchange.on_frame(packed_identifier(Priority.SURVEY, TUNNEL, 2), frame, now / 1e3)
        heard = inward.on_frame(frame, at)
        assert (heard if isinstance(heard, bytes) else None) == said
        counted[heard if isinstance(heard, str) else ""] += 1
        if sender.awaits_flow:
            sender.on_flow(b"\x30\x00\x00")
    del counted[""]
    assert counted == exchange.counters


@needs_gcc
@given(st.integers(0, 3 * LIMIT_MS) | st.sampled_from([LIMIT_MS, LIMIT_MS + 1]), st.sampled_from([0, RUNS_OVER]))
def test_an_answer_is_waited_for_as_long_as_python_does(isotp: ctypes.CDLL, pause: int, begin: int) -> None:
    exchange = python_end(8)
    exchange.queue.offer(PortFrame(bytes(30), Priority.SURVEY, None))
    first = exchange.next_frame(0.0)
    assert first is not None
    exchange.on_acknowledged(0.0)
    outward = Outward(isotp, bytes(30), 8, begin)
    assert outward.next_frame(begin) == first.data
    exchange.advance(pause / 1e3)
    at = begin + pause & 0xFFFFFFFF
    assert (outward.advance(at) == "no_flow_control") == (exchange.counters["no_flow_control"] == 1)
    exchange.on_frame(packed_identifier(Priority.SURVEY, FLOW_CONTROL, 2), b"\x30\x00\x00", pause / 1e3)
    outward.on_flow(b"\x30\x00\x00", at)
    exchange.is_up = True
    nexts = []
    while (frame := exchange.next_frame(pause / 1e3)) is not None:
        exchange.on_acknowledged(pause / 1e3)
        nexts += [frame.data] if frame.identifier == packed_identifier(Priority.SURVEY, TUNNEL, 1) else []
    ours = []
    while data := outward.next_frame(at):
        ours.append(data)
    assert ours == nexts


@needs_gcc
def test_a_payload_that_was_given_up_is_asked_for_no_longer(isotp: ctypes.CDLL) -> None:
    inward = Inward(isotp, 100)
    assert inward.on_frame(Sender(bytes(50), 8).next_frame(), 0) is None
    assert inward.advance(LIMIT_MS + 1) == "interrupted"
    assert inward.take_flow() is None
    assert inward.advance(LIMIT_MS + 1) is None


@needs_gcc
@pytest.mark.parametrize("now", [5, 2**32 - 5])
def test_a_time_from_before_the_frame_ends_nothing(isotp: ctypes.CDLL, now: int) -> None:
    inward, outward = Inward(isotp, 100), Outward(isotp, bytes(50), 8, now)
    inward.on_frame(outward.next_frame(now), now)
    before = now - 7 & 0xFFFFFFFF
    assert inward.advance(before) is outward.advance(before) is None
    assert inward.is_open
    assert outward.is_open


@needs_gcc
def test_room_for_less_than_a_single_frame_is_refused(isotp: ctypes.CDLL) -> None:
    room = (ctypes.c_uint8 * 62)()
    assert not isotp.isotp_listen(ctypes.byref(CReceiver()), room, 61)
    assert isotp.isotp_listen(ctypes.byref(CReceiver()), room, 62)
