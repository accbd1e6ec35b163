"""In which order a ground station takes in, stores, learns, acknowledges and publishes, call by call."""

from __future__ import annotations

import math
from collections import Counter, deque
from types import SimpleNamespace
from typing import Any

import pytest
from noted_parts import NotedPart, bare, message_of

from groundstation.errors import SelectorError, StoreError
from groundstation.service.answers.revisions import BEATS
from groundstation.service.process import ground_process
from groundstation.service.process.ground_process import GroundProcess
from telemetry.messages import (
    EPOCH_UNKNOWN,
    BlockStatus,
    DepthReading,
    Event,
    NodeState,
    Reply,
    StaticRecord,
    SurveyMeasurement,
)

Noted = list[Any]


class Clock:
    def __init__(self, epoch: int = 2, synchronised: bool = True) -> None:
        self.epoch, self.synchronised = epoch, synchronised

    def rig_from_local(self, local: float) -> float:
        return local + 1000.0


def ground(noted: Noted, **parts: Any) -> Any:
    """A ground station all of whose parts note what they are asked."""
    orders, recalibration, setup = (NotedPart(noted, name) for name in ("orders", "recalibration", "setup"))
    rig_alarms = NotedPart(noted, "alarms", {"drain_changed": False})
    crew = NotedPart(noted, "crew", {"drain_changed": []})
    revisions = NotedPart(noted, "revisions")
    model = SimpleNamespace(
        orders=orders, recalibration=recalibration, setup=setup, rig_alarms=rig_alarms, crew_alarms=crew,
        revisions=revisions, wall=None, hole=SimpleNamespace(stops=[1, 2, 3]),
    )  # fmt: skip
    mail = NotedPart(noted, "mail")
    states = SimpleNamespace(newest={1: 0, 2: 0, 3: 0}, is_stale=lambda tube: tube == 2)
    string = NotedPart(
        noted, "string", {"on_state": True, "on_depth": ""}, states=states,
        time=SimpleNamespace(now=5.0, epoch=2, rig_now=1005.0),
    )  # fmt: skip
    learnt = {"learn_arrived": ([], []), "find_consequences": [], "place_waiting": [], "follow_setup": []}
    asked: dict[str, Any] = {"take_pending": [], "due_requests": []}
    plain = {
        "model": model, "_string": string, "clock": Clock(), "tape": NotedPart(noted, "tape"),
        "watch": NotedPart(noted, "watch", {"gaps_to_ask": [], "is_due": False}),
        "listeners": [noted.append],
        "_keeper": NotedPart(noted, "keeper"), "_doubled": NotedPart(noted, "doubled", {"state_apart": None}),
        "operator": NotedPart(noted, "operator", asked, barred="", has_pending=False),
        "endpoint": SimpleNamespace(mail=mail, seals=None, counters=Counter(), dropped=0, receive=lambda *_: []),
        "_learner": NotedPart(noted, "learner", learnt),
        "_time": NotedPart(noted, "time", {"times_at": SimpleNamespace(utc="u")}, follow=lambda now: now,
                           shown_at=lambda at: at + 0.5),
        "store": NotedPart(noted, "store", refusal="", damaged=0, parted=""), "_stale": set(),
        "_early": deque(maxlen=64),
        "_beat_at": -math.inf, "_setup_marks": (), "_plane": -1, "_certificates": None, "_uploads": None,
        "_seal_watch": NotedPart(noted, "seal watch"),
    }  # fmt: skip
    return bare(GroundProcess, **plain | parts)


def calls(noted: Noted, *left_out: str) -> Noted:
    """What was noted, without parts that are looked at elsewhere."""
    return [one for one in noted if isinstance(one, list) or one[0].partition(".")[0] not in left_out]


def test_what_is_stored_alone_is_acknowledged_and_then_published() -> None:
    noted: Noted = []
    one = ground(noted)
    one._keep_arrived()
    assert noted == [("learner.learn_arrived",)]
    noted.clear()
    one._learner = NotedPart(noted, "learner", {"learn_arrived": (["a", "b"], ["events"])})
    one._keep_arrived()
    assert noted == [
        ("learner.learn_arrived",), ("mail.acknowledge", "a"), ("mail.acknowledge", "b"),
        ("revisions.on_published", ["events"]), ["events"],
    ]  # fmt: skip
    noted.clear()
    one._learner = NotedPart(noted, "learner", {"place_waiting": ["stations"]})
    one._place_waiting()
    assert noted == [("learner.place_waiting",), ("revisions.on_published", ["stations"]), ["stations"]]


@pytest.mark.parametrize("kind", [SurveyMeasurement, Event, StaticRecord])
def test_what_must_be_kept_is_handed_to_who_stores_it_and_orders_are_published_after_all(kind: type) -> None:
    noted: Noted = []
    one, message = ground(noted), message_of(kind)
    one.on_message(message, 5.0)
    assert calls(noted, "revisions", "string") == [
        ("tape.add", "message", 5.0, 1005.0, 2, message), ("learner.take", message), ("operator.publish_orders",),
    ]  # fmt: skip


def test_a_state_is_told_to_all_and_kept_and_one_of_no_news_is_not() -> None:
    noted: Noted = []
    state = message_of(NodeState, hops=2, flags=5)
    one = ground(noted, _doubled=NotedPart(noted, "doubled", {"state_apart": state}))
    one.on_message(message_of(NodeState, tube=1), 5.0)
    assert calls(noted, "tape", "revisions", "doubled", "string") == [
        ("recalibration.on_state", state), ("setup.on_flags", 3, 2, 5), ("watch.on_state", state),
        ("keeper.keep_tally",), ("keeper.keep_joints",), ["nodes/3"], ("operator.publish_orders",),
    ]  # fmt: skip
    noted.clear()
    one._keeper = NotedPart(noted, "keeper", {"keep_tally": StoreError("full")})
    one.on_message(message_of(NodeState), 5.0)
    assert ["nodes/3"] in noted  # a disk that refuses hides no tube
    noted.clear()
    one._string = NotedPart(noted, "string", {"on_state": False}, time=one._string.time)
    one.on_message(message_of(NodeState), 5.0)
    assert calls(noted, "tape", "revisions", "doubled", "string") == [("operator.publish_orders",)]


def test_answers_go_to_who_asked() -> None:
    noted: Noted = []
    one, reply, status = ground(noted), message_of(Reply), message_of(BlockStatus)
    one.on_message(reply, 6.0)
    one.on_message(status, 6.0)
    assert calls(noted, "tape", "revisions", "string") == [
        ("orders.on_reply", reply), ("recalibration.on_reply", reply, 6.0), ("operator.publish_orders",),
        ("operator.on_block_status", status), ("operator.publish_orders",),
    ]  # fmt: skip


def test_frames_come_after_orders_that_wait_and_after_a_clock_that_stood(monkeypatch: pytest.MonkeyPatch) -> None:
    noted: Noted = []
    one = ground(noted)
    one.endpoint.receive = lambda *given: [SimpleNamespace(message=given)]
    monkeypatch.setattr(one, "_advance_time", lambda now: noted.append(("advance", now)))
    monkeypatch.setattr(one, "_send_pending", lambda now: noted.append(("pending", now)))
    monkeypatch.setattr(one, "on_message", lambda *given: noted.append(("message", *given)))
    for now, stood in ((6.0, False), (6.001, True)):  # a second after 5.0 at the latest
        one.on_frame("side", "frame", now, 3.0)
        message = ("message", ("side", "frame", now, 3.0), now)
        assert noted == [*([("advance", now)] if stood else []), ("pending", now), message]
        noted.clear()


def test_a_depth_is_kept_after_what_came_before_it_and_rubbish_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    noted: Noted = []
    reading = message_of(DepthReading, at=3.0, md=2.0, stands=())
    monkeypatch.setattr(ground_process, "decode_message", lambda content: reading if content == b"good" else 7)
    one = ground(noted)
    monkeypatch.setattr(one, "_on_reading", lambda *given: noted.append(("reading", *given)))
    one.on_depth(b"good", 5.0)
    assert calls(noted, "revisions", "string") == [
        ("learner.learn_arrived",), ("tape.add", "depth", 5.0, 1005.0, 2, b"good"), ("reading", reading, 5.0),
    ]  # fmt: skip
    for count in (1, 2):
        noted.clear()
        one.on_depth(b"rubbish", 5.0)
        assert one.endpoint.counters["bad_depths"] == count
        assert noted[-1] == ("alarms.alert", "bad_input", "depth", "bytes that are no reading of the depth")
    one.clock.synchronised = False
    noted.clear()
    one.on_depth(b"good", 5.0)
    assert (list(one._early), "reading" in str(noted)) == ([reading], False)
    one.clock.synchronised = True
    one._advance_time(6.0)
    assert (list(one._early), noted[-1]) == ([], ("reading", reading, 6.0))
    for content, is_next, taken in ((None, True, False), (b"good", False, False), (b"good", True, True)):
        noted.clear()
        one.endpoint.seals = SimpleNamespace(
            depth_content=lambda _p, content=content: content, is_next_depth=lambda _s, is_next=is_next: is_next
        )  # fmt: skip
        one.on_depth(b"payload", 5.0)
        assert (("reading", reading, 5.0) in noted) is taken
        assert ("tape.add" in str(noted)) is (content is not None)  # unsealed, and repeated ones too


@pytest.mark.parametrize(("before", "now", "is_told"), [(2, 2, None), (2, 3, True), (EPOCH_UNKNOWN, 3, False)])
def test_a_new_epoch_is_kept_and_told_where_there_was_one_before(before: int, now: int, is_told: bool | None) -> None:
    noted: Noted = []
    one = ground(noted, clock=Clock(now))
    one._string.time.epoch = before
    one._advance_time(8.0)
    assert one._string.time.now == 8.0
    told = [("watch.on_epoch", 3)] if is_told else []
    kept = [("store.keep_epoch", 3)] if is_told is not None else []
    assert noted == [("revisions.on_event",), ("string.on_rig_time", 1008.0, now), *told, *kept]
    one.clock.synchronised = False
    noted.clear()
    one._advance_time(9.0)
    assert noted == [("revisions.on_event",)]


@pytest.mark.parametrize("refused", ["", "repeated", "jump"])
def test_a_reading_that_is_refused_places_nothing_and_a_repeated_one_is_no_trouble(refused: str) -> None:
    noted: Noted = []
    one = ground(noted)
    one._string = NotedPart(noted, "string", {"on_depth": refused})
    reading = message_of(DepthReading, at=3.0, md=2.0, stands=("first", "second"))
    one._on_reading(reading, 5.0)
    begins = [
        ("string.on_depth", reading, 5.0), ("watch.on_depth", "jump" if refused == "jump" else ""),
        ("keeper.keep_depth_doubt",),
    ]  # fmt: skip
    then = [
        ("string.on_told_stand", "first", 3.0), ("string.on_told_stand", "second", 3.0), ("keeper.keep_stand", reading),
        ("learner.place_waiting",), ("revisions.on_published", ["status", "string"]), ["status", "string"],
    ]  # fmt: skip
    assert noted == [*begins, *([] if refused else then)]


def test_a_wall_is_published_where_the_bit_has_passed_another_plane() -> None:
    noted: Noted = []
    one = ground(noted)
    one.model.wall = SimpleNamespace(plane_of=int)
    for md, is_told in ((2.0, True), (2.9, False), (3.0, True), (2.0, True)):
        noted.clear()
        one._on_reading(message_of(DepthReading, at=3.0, md=md, stands=()), 5.0)
        assert (["wall"] in noted) is is_told


def test_a_timer_sends_what_waits_then_orders_then_segments_and_looks_when_it_is_due(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    noted: Noted = []
    one = ground(noted, _uploads=NotedPart(noted, "uploads", {"due_segments": ["s1", "s2"]}))
    one.operator = NotedPart(noted, "operator", {"take_pending": ["p"], "due_requests": ["r1", "r2"]})
    monkeypatch.setattr(ground_process.Process, "on_timer", lambda _self, now: noted.append(("timer", now)))
    monkeypatch.setattr(one, "_look", lambda now: noted.append(("look", now)))
    sent = [
        ("operator.take_pending",), ("mail.command", "p", 7.0), ("operator.due_requests", 7.0),
        ("mail.command", "r1", 7.0), ("mail.command", "r2", 7.0), ("uploads.due_segments", 7.0),
        ("mail.send_segment", "s1"), ("mail.send_segment", "s2"), ("timer", 7.0),
    ]  # fmt: skip
    one.on_timer(7.0)
    assert calls(noted, "watch", "revisions", "string") == [("learner.learn_arrived",), *sent]
    noted.clear()
    one.watch = NotedPart(noted, "watch", {"is_due": True})
    one.operator = NotedPart(noted, "operator", {"take_pending": ["p"], "due_requests": StoreError("full")})
    one.on_timer(7.0)
    told = calls(noted, "watch", "revisions", "string")
    assert told[1] == ("tape.add", "timer", 7.0, 1007.0, 2, None)
    assert told[-2:] == [("timer", 7.0), ("look", 7.0)]
    assert ("mail.send_segment", "s2") in told  # a disk that refuses holds no upload up


def test_it_wakes_at_once_for_an_order_else_by_what_is_first(monkeypatch: pytest.MonkeyPatch) -> None:
    one = ground([])
    monkeypatch.setattr(ground_process.Process, "next_wake", lambda _self, now: now + 3.0)
    assert one.next_wake(10.0) == 13.5
    one._uploads = SimpleNamespace(next_due=lambda: 11.0)
    assert one.next_wake(10.0) == 11.5
    one.operator.has_pending = True
    assert one.next_wake(10.0) == 10.0


def test_a_look_tells_what_is_wrong_asks_for_gaps_and_beats_once_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    noted: Noted = []
    one = ground(noted, watch=NotedPart(noted, "watch", {"gaps_to_ask": [(3, (5, 9)), (1, (2, 2))]}))
    one.store.refusal, one.store.damaged, one.store.parted, one.endpoint.dropped = "full", 4, "another file", 6
    one.endpoint.seals = SimpleNamespace(trouble="it is gone")
    one._learner = NotedPart(
        noted, "learner", {"find_consequences": ["history"], "place_waiting": [], "follow_setup": []}
    )
    monkeypatch.setattr(one, "_ask_again", lambda *given: noted.append(("ask again", *given)))
    monkeypatch.setattr(ground_process, "shown_marks", lambda *_: ("marks",))
    monkeypatch.setattr(ground_process, "conditions_of", lambda *_: ["a condition"])
    one._look(20.0)
    assert calls(noted, "revisions", "watch") == [
        ("store.check_place",), ("keeper.keep_depth_doubt",), ("learner.place_waiting",), ("learner.follow_setup",),
        ("learner.find_consequences",), ["history"], ("time.look",), ("alarms.hold", "disk", "database", "full"),
        ("alarms.hold", "database", "database", "4 rows"), ("alarms.hold", "database", "journal", "another file"),
        ("alarms.hold", "queue", "ground station", "6 dropped"), ("seal watch.look", 20.0),
        ("alarms.hold", "key_file", "ground station", "it is gone"), ("ask again", 3, 5, 9), ("ask again", 1, 2, 2),
        ("operator.expire_orders", 20.0), ["nodes/2", "status", "string"], ["setup"], ("time.times_at", 20.0, 1005.0),
        ("time.look_at_date", one.model.crew_alarms, "u"), ("crew.update", ["a condition"], SimpleNamespace(utc="u")),
        ("crew.drain_changed",), ("alarms.drain_changed",), list(BEATS),
    ]  # fmt: skip
    for now, beats in ((20.999, False), (21.0, True), (21.5, False), (22.0, True)):
        noted.clear()
        one._look(now)
        assert (list(BEATS) in noted) is beats
        assert ["nodes/2", "status", "string"] not in noted  # it is known by now
        assert ["setup"] not in noted
    one._string.states.is_stale = lambda tube: tube == 3
    one.store.damaged = one.endpoint.dropped = 0
    one.model.rig_alarms = NotedPart(noted, "alarms", {"drain_changed": True})
    noted.clear()
    one._look(22.5)
    assert ["nodes/2", "nodes/3", "status", "string"] in noted
    assert ("alarms.hold", "database", "database", "") in noted
    assert ("alarms.hold", "queue", "ground station", "") in noted
    assert noted[-1] == ["alarms", "status", "verdict"]
    noted.clear()
    one.model.rig_alarms = NotedPart(noted, "alarms", {"drain_changed": False})
    one._look(23.0)
    assert list(BEATS) not in noted  # the verdict was published half a second ago


def test_alarms_of_the_crew_are_kept_and_published_where_they_change(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ground_process, "conditions_of", lambda *_: [])
    for store_error in (None, StoreError("full")):
        noted: Noted = []
        one = ground(noted, store=NotedPart(noted := [], "store", {"keep_alarms": store_error}))
        one.listeners = [noted.append]
        one.model.crew_alarms = NotedPart(noted, "crew", {"drain_changed": ["an alarm"]})
        one._tell_crew(5.0)
        assert noted[-2:] == [("store.keep_alarms", ["an alarm"]), ["alarms"]]


def test_a_gap_is_asked_for_and_what_is_left_of_it_is_told() -> None:
    noted: Noted = []
    values: dict[str, Any] = {"sent": 4, "complete_from": 6}
    order = SimpleNamespace(values=values, done=True, tube=3, when_answered=lambda call: call())
    one = ground(noted, operator=NotedPart(noted, "operator", {"command": order}))
    one._ask_again(3, 5, 9)
    assert noted == [
        ("operator.command", 3, "resend", {"first": 5, "last": 9}, {"by": "ground station"}),
        ("watch.on_resent", 3, 5, 4, 6, 5.0),
    ]  # fmt: skip
    values.clear()
    one._ask_again(3, 5, 9)
    assert noted[-1] == ("watch.on_resent", 3, 5, 0, 0, 5.0)
    noted.clear()
    order.done = False
    one._ask_again(3, 5, 9)
    one.operator = NotedPart(noted, "operator", {"command": SelectorError("unknown")})
    one._ask_again(3, 5, 9)
    assert [call[0] for call in noted] == ["operator.command"] * 2


def test_a_barred_ground_station_says_why_and_that_it_is_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ground_process, "conditions_of", lambda *_: [])
    noted: Noted = []
    one = ground(noted)
    for trouble in ("another holds it", ""):
        one.bar(trouble, 5.0)
        assert one.operator.barred == trouble
        assert noted[0] == ("alarms.hold", "lease", "ground station", trouble)
        assert noted[-1] == ["alarms", "status", "verdict"]
        noted.clear()
