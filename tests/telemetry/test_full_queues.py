"""What a full queue keeps, in which order: each bounded queue of the telemetry, filled beyond its limit."""

from __future__ import annotations

import pytest

from telemetry.application.endpoint import Endpoint
from telemetry.application.endpoint_state import is_needed, parse_state
from telemetry.application.order_answers import KEPT, Answers
from telemetry.application.outbox import LIMIT, Outbox
from telemetry.media.port import PortFrame, Priority
from telemetry.media.send_queue import SendQueue
from telemetry.messages import CONTENT_SIZE, Event, ImuMean, NodeFlag, Receipt, Severity, Side, SurveyMeasurement
from telemetry.presentation.content import content_of_message
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.transport.hop import HopLink

COV = ((1e-6, 0.0, 0.0), (0.0, 1e-6, 0.0), (0.0, 0.0, 1e-6))


def survey(sequence: int) -> SurveyMeasurement:
    imu = ImuMean((0.1, 0.0, -9.8), COV)
    return SurveyMeasurement(3, sequence, 100.0, 1, (imu,), 1.0, 1e-6, 1e-6, 32, 20.0, NodeFlag.NONE)


def event(sequence: int, severity: Severity = Severity.INFO) -> Event:
    return Event(3, sequence, 100.0, severity, "said")


def queued(limit: int, *frames: PortFrame) -> SendQueue:
    queue = SendQueue(100, limit)
    for frame in frames:
        assert queue.offer(frame)
    return queue


def drained(queue: SendQueue) -> list[bytes]:
    """What leaves a queue, the first to go first."""
    return [frame.payload for _ in range(len(queue)) if (frame := queue.take()) is not None]


def state(name: str, priority: Priority = Priority.STATE) -> PortFrame:
    return PortFrame(name.encode(), priority, name)


def kept(name: str, priority: Priority = Priority.SURVEY) -> PortFrame:
    return PortFrame(name.encode(), priority, None)


def test_a_full_port_drops_the_least_urgent_that_may_be_lost_the_oldest_of_those() -> None:
    waiting = [state("aiding", Priority.AIDING), state("state 1"), state("state 2"), kept("survey"), state("state 3")]
    queue = queued(5, *waiting)
    assert queue.offer(kept("survey 2"))
    assert drained(queue) == [b"aiding", b"survey", b"survey 2", b"state 2", b"state 3"]
    queue = queued(5, *waiting)
    for name in ("a", "b", "c"):
        assert queue.offer(kept(name, Priority.BLOCK))
    assert drained(queue) == [b"aiding", b"survey", b"a", b"b", b"c"]
    assert queue.counters["dropped"] == 3


def test_a_port_full_of_what_must_arrive_refuses_the_newest() -> None:
    queue = queued(3, *(kept(f"{k}") for k in range(6)))
    assert drained(queue) == [b"0", b"1", b"2"]
    assert queue.counters["dropped"] == 3


@pytest.mark.parametrize("beyond", [0, 1])
def test_what_is_put_back_goes_first_and_makes_nothing_go_where_there_is_room(beyond: int) -> None:
    queue = queued(3, kept("a"), kept("b"), kept("c"))
    first = queue.take()
    assert first is not None
    if beyond:
        queue.offer(state("late"))
    queue.put_back(first)
    assert drained(queue) == [b"a", b"b", b"c"]
    assert queue.counters["dropped"] == beyond


def test_a_topic_told_again_keeps_the_place_of_the_first() -> None:
    queue = queued(3, state("x"), state("y"))
    queue.offer(PortFrame(b"x again", Priority.STATE, "x"))
    assert drained(queue) == [b"x again", b"y"]


def numbers_of(endpoint: Endpoint) -> list[int]:
    """Numbers of what a tube keeps for the ground station."""
    return [number for number, _, _ in parse_state(endpoint.export_state()).parcels]


@pytest.mark.parametrize("restarts", [0, 1, 2])
def test_surveys_are_kept_for_events_over_every_restart(restarts: int) -> None:
    """The oldest is a survey; a tube that forgot which of them may be lost would drop it first."""
    tube = Endpoint(3, frozenset(Side), boot_count=1)
    tube.mail.submit(survey(1), 100.0)
    for number in range(2, LIMIT + 1):
        tube.mail.submit(event(number), 100.0)
    for boot in range(restarts):
        tube = Endpoint(3, frozenset(Side), boot_count=2 + boot, restored=tube.export_state())
    for number in range(LIMIT + 1, LIMIT + 6):
        tube.mail.submit(survey(number), 200.0)
    assert numbers_of(tube) == [1, *range(7, LIMIT + 6)]


def test_an_outbox_of_surveys_drops_the_oldest_and_one_of_events_too() -> None:
    for needed in (True, False):
        outbox = Outbox(4)
        for number in range(1, 8):
            outbox.keep_payload(number, b"%d" % number, 0.0, needed=needed)
        assert [number for number, _ in outbox.contents()] == [4, 5, 6, 7]


@pytest.mark.parametrize(
    ("message", "needed"),
    [
        (survey(1), True),
        (event(1, Severity.INFO), False),
        (event(1, Severity.WARNING), False),
        (event(1, Severity.ERROR), True),
    ],
)
def test_what_may_be_lost_for_want_of_room(message: Event | SurveyMeasurement, needed: bool) -> None:
    assert is_needed(message) is needed


@pytest.mark.parametrize("byte", range(CONTENT_SIZE))
def test_a_receipt_settles_what_it_names_by_every_byte(byte: int) -> None:
    tube = Endpoint(3, frozenset(Side), boot_count=1)
    base = HopLink(4, 1)
    tube.mail.submit(survey(1), 100.0)
    content = bytearray(content_of_message(survey(1)))
    for wrong in (1 << (byte % 8), 0):
        told = bytearray(content)
        told[byte] ^= wrong
        base.send_best_effort(encode_message(Receipt(3, 1, bytes(told))), "receipt")
        for frame in base.take_frames(100.0):
            tube.receive(Side.UPPER, frame.payload, 100.0)
        assert tube.mail.outbox_size == (1 if wrong else 0)


def test_answers_are_kept_for_the_newest_orders_and_one_too_old_is_exactly_the_first_that_is_forgotten() -> None:
    answers = Answers()
    for session in range(3):  # each begins anew, with numbers that begin anew
        first = 1000 - 300 * session
        answers.begin_session()
        assert answers.too_old == 0
        for number in range(first, first + KEPT):
            answers.keep(number, b"%d" % number)
            assert answers.too_old == 0
        assert all(number in answers for number in range(first, first + KEPT))
        answers.keep(first + KEPT, b"one more")
        assert answers.too_old == first
        assert first not in answers
        assert answers.payload(first + KEPT) == b"one more"
    assert [number for number, _ in answers.contents()] == list(range(first + 1, first + KEPT + 1))
