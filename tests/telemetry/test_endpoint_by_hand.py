"""An endpoint over links that note what they are given: what goes where, when and under which topic.

Expected are the rules themselves, written out: no figure here is one that the endpoint computed.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest
from noted_links import AIDING, LOWER, STATE, STATUS, UPPER, noted
from sealed_string import state
from test_endpoint import survey

from telemetry.frozen import replace
from telemetry.messages import (
    BASE,
    ENCODER,
    Command,
    Hello,
    NodeFlag,
    NodeMode,
    Side,
    TimeReply,
    TimeRequest,
)
from telemetry.presentation.msgpack_codec import decode_message, encode_message
from telemetry.schema import MessageKind

# states


@pytest.mark.parametrize(
    ("hops", "below", "wait"),
    [(0, True, 1.65), (3, True, 1.635), (99, True, 1.155), (100, True, 1.15), (130, True, 1.15), (3, False, 0.0)],
)
def test_a_state_waits_for_those_below_a_frames_way_longer_for_each_hop_that_is_left(
    hops: int, below: bool, wait: float
) -> None:
    made, links = noted(7, UPPER, LOWER)
    made.place.hops, links[LOWER].up = hops, below
    for now in (20.0, 31.0):  # and the next one alike
        made.send_state(STATE, now)
        (row,) = links[UPPER].taken()
        assert row[0] == "others"
        assert row[2:4] == ((MessageKind.NODE_STATE, STATE.tube), "STATE")
        assert row[4] == pytest.approx(now + wait, abs=1e-9)
    assert made.mode is STATE.mode


def test_of_states_in_a_frame_each_tube_has_its_place_and_a_second_of_one_number_another() -> None:
    made, links = noted(7, UPPER, LOWER)
    made._standstill.move(9.9)
    for now in (10.0, 10.5):  # what was passed of one frame says nothing of the next
        links[LOWER].heard = [encode_message(state(*one)) for one in ((1, 3), (1, 2), (2, 3), (9, 7))]
        assert made.receive(LOWER, b"frame", now) == []
        rows = links[UPPER].taken()
        kind = MessageKind.NODE_STATE
        assert [row[2] for row in rows] == [(kind, 3, False), (kind, 2, False), (kind, 3, True), (kind, 7, True)]
        assert {(row[0], row[3]) for row in rows} == {("best", "STATE")}
        assert [row[1] for row in rows] == links[LOWER].heard
        made._standstill.move(now + 0.4)
    assert links[UPPER].released == 2


def test_states_that_come_to_an_end_with_nothing_above_are_counted() -> None:
    made, links = noted(7, LOWER)
    made._standstill.move(9.9)
    links[LOWER].heard = [encode_message(STATE)] * 3
    assert made.receive(LOWER, b"frame", 10.0) == []
    assert made.counters["nowhere_to_go"] == 3


# neighbours


@pytest.mark.parametrize("address", [BASE, 7])
@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        ((5, 1), (6, 1), "change"), ((5, 1), (5, 2), "suspect"), ((5, 1), (5, 1), ""), (None, (5, 1), ""),
        ((5, 1), None, ""),
    ],
)  # fmt: skip
def test_another_clock_beside_us_is_another_and_one_that_started_anew_is_in_doubt(
    address: int, before: Any, after: Any, told: str
) -> None:
    sides = (LOWER,) if address == BASE else (UPPER, LOWER)
    for side in sides:
        made, links = noted(address, *sides)
        done: list[str] = []
        made.clock.change_neighbour = lambda done=done: done.append("change")  # type: ignore[method-assign,misc]
        made.clock.suspect_neighbour = lambda done=done: done.append("suspect")  # type: ignore[method-assign,misc]
        made._hello_at = made._sync_at = 50.0
        links[side].peer, links[side].peer_after = before, after
        made.receive(side, b"", 51.0)
        toward_encoder = side is (LOWER if address == BASE else UPPER)
        assert done == ([told] if told and toward_encoder else [])
        assert (made._hello_at == -math.inf) == (before != after)
        assert (made._sync_at == -math.inf) == bool(told and toward_encoder)


def test_one_that_is_the_clock_follows_no_neighbour() -> None:
    made, links = noted(ENCODER, UPPER, LOWER, is_root=True)
    made.clock.change_neighbour = lambda: pytest.fail("it is the clock")  # type: ignore[method-assign]
    links[LOWER].peer, links[LOWER].peer_after = (5, 1), (6, 1)
    made.receive(LOWER, b"", 1.0)
    made.advance(100.0)
    assert MessageKind.TIME_REQUEST not in [row[2] for row in links[LOWER].taken() + links[UPPER].taken()]


def test_time_is_told_away_from_the_encoder_and_taken_from_its_side_alone() -> None:
    made, links = noted(ENCODER, UPPER, LOWER, is_root=True)
    for side in (UPPER, LOWER):
        links[side].heard = [encode_message(TimeRequest(3.25))]
        made.receive(side, b"", 40.0)
        ((way, payload, topic, priority),) = links[side].taken()
        assert (way, topic, priority) == ("best", MessageKind.TIME_REPLY, "TIME")
        reply = decode_message(payload)
        assert isinstance(reply, TimeReply)
        assert (reply.asked_at, reply.received_at, reply.replied_at, reply.rig_at) == (3.25, 40.0, 40.0, 40.0)
        assert (reply.epoch, reply.rig_rate) == (4, 1.0)
        assert links[LOWER if side is UPPER else UPPER].taken() == []
    tube, below = noted(7, UPPER, LOWER)
    heard: list[Any] = []
    tube.clock.exchange = lambda message, now: heard.append((message, now))  # type: ignore[method-assign,assignment]
    answer = TimeReply(39.0, 39.5, 39.6, 90.0, 1.0, 1e-8, 2)
    for side in (UPPER, LOWER):
        below[side].heard = [encode_message(answer), encode_message(TimeRequest(1.0))]
        tube.receive(side, b"", 40.0)
    assert heard == [(answer, 40.0)]
    assert below[UPPER].taken() == below[LOWER].taken() == []  # it does not know the time itself


def test_a_hello_goes_to_each_end_at_once_where_it_is_news_and_later_with_others() -> None:
    made, links = noted(7, UPPER, LOWER)
    links[UPPER].quality, links[LOWER].quality = 0.25, 0.5
    made.place.hops, made.mode = 6, NodeMode.TRACKING
    for now, until in ((10.0, 10.0), (10.9, None), (11.0, 11.6), (12.0, 12.6)):
        made.advance(now)
        for side, quality in ((UPPER, 0.25), (LOWER, 0.5)):
            rows = [row for row in links[side].taken() if row[2] == MessageKind.HELLO]
            assert len(rows) == (until is not None)
            for way, payload, _, priority, at in rows:
                assert (way, priority, at) == ("others", "HELLO", pytest.approx(until))
                assert decode_message(payload) == Hello(7, 4, 6, NodeMode.TRACKING, quality)


def test_aidings_are_of_the_upper_end_and_go_down_at_once() -> None:
    made, links = noted(7, UPPER, LOWER)
    for side in (UPPER, LOWER):
        links[side].heard = [encode_message(AIDING)]
    assert made.receive(LOWER, b"", 1.0) == []
    ((message, side),) = made.receive(UPPER, b"", 1.0)
    assert (message, side) == (AIDING, UPPER)
    made.send_aiding(AIDING, 1.0)
    assert links[LOWER].taken() == [("best", encode_message(AIDING), MessageKind.AIDING, "AIDING")]
    assert (links[LOWER].released, links[UPPER].said) == (1, [])
    made, links = noted(7, UPPER)
    made.send_aiding(AIDING, 1.0)
    assert links[UPPER].said == []


def test_what_travels_goes_on_as_it_came_the_way_it_came() -> None:
    made, links = noted(7, UPPER, LOWER)
    order = encode_message(Command(3, 9, "take_survey"))
    links[UPPER].heard, links[LOWER].heard = [order], [encode_message(survey(3, 1)), encode_message(STATUS)]
    assert made.receive(UPPER, b"", 1.0) == []
    assert made.receive(LOWER, b"", 1.0) == []
    assert links[LOWER].taken() == [("reliable", order, "COMMAND")]
    assert links[UPPER].taken() == [("reliable", payload, "SURVEY") for payload in links[LOWER].heard]
    mine = encode_message(Command(7, 10, "take_survey"))
    links[UPPER].heard = [mine, b"\xff\xff", mine]
    assert [one.message for one in made.receive(UPPER, b"", 2.0)] == [decode_message(mine)] * 2
    assert made.counters["bad_payloads"] == 1
    assert made.receive(Side.UPPER, b"", 3.0) != []
    assert links[LOWER].taken() == links[UPPER].taken() == []


def test_what_of_the_links_is_shown_is_of_both_and_the_earliest() -> None:
    made, links = noted(7, UPPER, LOWER)
    links[UPPER].wake, links[LOWER].wake = 9.0, 4.0
    assert made.next_wake(1.0) == 4.0
    links[LOWER].wake = 11.0
    assert made.next_wake(1.0) == 9.0
    links[UPPER].waiting = 5
    assert made.waiting == 8
    links[UPPER].counters.update(reliable_dropped=2, lost=40)
    links[LOWER].counters.update(best_effort_dropped=3, reliable_dropped=7)
    made.mail._outbox.dropped = 11
    assert made.dropped == 23
    assert made.link_counters() == {
        "reliable_dropped": 9, "best_effort_dropped": 3, "lost": 40, "outbox_dropped": 11,
    }  # fmt: skip
    assert made.margin(UPPER) == math.inf
    made._meet(UPPER, Hello(8, 1, 5, NodeMode.BOOT, 1.0), 2.0)
    assert made.margin(UPPER) == 12.5
    links[UPPER].up = False
    made.advance(3.0)
    assert made.margin(UPPER) == math.inf


def test_no_flag_of_a_state_is_needed_to_pass_it() -> None:
    """A relay reads the tube alone: every flag goes on."""
    made, links = noted(7, UPPER, LOWER)
    made._standstill.move(9.9)
    links[LOWER].heard = [encode_message(replace(STATE, flags=NodeFlag(1 << bit))) for bit in range(len(NodeFlag))]
    made.receive(LOWER, b"", 10.0)
    assert [row[1] for row in links[UPPER].taken()] == links[LOWER].heard


@pytest.mark.parametrize(("later", "kept"), [(1.0, False), (1.001, True)])
def test_an_undated_state_that_may_have_waited_is_counted_and_a_dated_one_goes_on(later: float, kept: bool) -> None:
    made, links = noted(7, UPPER, LOWER)
    for now in (0.0, 2.001):
        made._standstill.move(now)  # it stood still for more than two seconds
    undated, dated = replace(STATE, epoch=0), replace(STATE, epoch=2)
    links[LOWER].heard = [encode_message(undated), encode_message(dated)]
    made.receive(LOWER, b"", 2.001 + later)
    assert [row[1] for row in links[UPPER].taken()] == [encode_message(one) for one in (undated, dated)[not kept :]]
    assert made.counters["old_states"] == (not kept)


def test_an_aiding_under_keys_is_judged_by_epoch_and_rig_time_once_that_is_known() -> None:
    made, links = noted(7, UPPER, LOWER)
    asked: list[Any] = []

    def admits(*question: Any) -> bool:
        asked.append(question)
        return len(asked) > 1

    made.seals = SimpleNamespace(  # type: ignore[assignment]
        joints={UPPER: SimpleNamespace(open=lambda frame, now: frame)},
        content=lambda payload: payload,
        measurement=SimpleNamespace(admits=admits),
    )
    links[UPPER].heard = [encode_message(AIDING)]
    assert len(made.receive(UPPER, b"", 5.0)) == 1  # before rig time is known none is used
    made.clock = SimpleNamespace(synchronised=True, epoch=3, rig_from_local=lambda now: now + 100.0)  # type: ignore[assignment]
    assert made.receive(UPPER, b"", 6.0) == []
    assert len(made.receive(UPPER, b"", 7.0)) == 1
    assert asked == [(AIDING, 3, 106.0), (AIDING, 3, 107.0)]


def test_clocks_are_compared_at_once_after_a_start_and_soon_after_a_change_of_epoch() -> None:
    made, links = noted(7, UPPER, LOWER)
    made.clock.exchanges = 30  # the quick pace is over
    asked = []
    for tenth in range(400):
        now = 100.0 + 0.1 * tenth
        if tenth == 155:
            made.ask_time(now)
        made.advance(now)
        asked += [now for row in links[UPPER].taken() if row[2] == MessageKind.TIME_REQUEST]
        assert [row for row in links[LOWER].taken() if row[2] == MessageKind.TIME_REQUEST] == []
    assert asked == pytest.approx([100.0, 110.0, 116.5, 126.5, 136.5], abs=0.11)
