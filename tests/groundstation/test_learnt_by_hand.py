"""What a ground station learns of what it has stored, in order, and who contradicts the encoder at each bound."""

from __future__ import annotations

import math
from collections import deque
from types import SimpleNamespace
from typing import Any

import pytest
from noted_parts import NotedPart, bare, message_of

from groundstation.errors import StoreError
from groundstation.service.alarms.encoder_cross_check import EncoderCrossCheck
from groundstation.service.process.learner import Learner
from groundstation.service.string.stored import Stored
from telemetry.messages import (
    EPOCH_UNKNOWN,
    Event,
    Severity,
    StaticRecord,
    SurveyMeasurement,
)

Noted = list[Any]


# who learns


def learner(noted: Noted, store: dict[str, Any] | None = None, **parts: Any) -> Any:
    numbers, rows = NotedPart(noted, "numbers"), NotedPart(noted, "rows")
    doubled = NotedPart(
        noted, "doubled", {"survey_apart": message_of(SurveyMeasurement, tube=9, hops=1, flags=0)}, places=()
    )
    string = NotedPart(
        noted, "string", {"length_below": 2.0, "depth_of": 12.0}, numbers=numbers, events=rows, static_records=rows,
        doubled=doubled,
    )  # fmt: skip
    plain = {
        "_store": NotedPart(noted, "store", {"add_messages": []} | (store or {})), "_arrived": [], "_string": string,
        "_watch": NotedPart(noted, "watch"), "_keeper": NotedPart(noted, "keeper"), "_by_survey": ("b", "a"),
        "_placement": NotedPart(noted, "placement", waiting=[]), "_orders": NotedPart(noted, "orders"),
        "_recalibration": NotedPart(noted, "recalibration"), "_setup": NotedPart(noted, "setup"),
    }  # fmt: skip
    return bare(Learner, **plain | parts)


def test_messages_that_came_together_are_stored_with_the_tally_before_any_is_learnt() -> None:
    noted: Noted = []
    event, again, record = message_of(Event), message_of(Event, sequence=8), message_of(StaticRecord)
    one = learner(noted, {"add_messages": [True, False, True]})
    for message in (event, again, record):
        one.take(message)
    arrived = [Stored(message, None, None) for message in (event, again, record)]
    assert one.learn_arrived() == ([event, again, record], ["events", "static_records"])
    assert noted == [
        ("keeper.keep_tally",), ("store.add_messages", arrived), ("numbers.add_number", 3, 7),
        ("rows.append_row", event), ("orders.on_event", event), ("watch.on_known_event", event),
        ("watch.on_event", event),
        ("numbers.add_number", 3, 7), ("rows.append_row", record), ("orders.on_static_record", record),
        ("recalibration.on_static_record", record),
    ]  # fmt: skip
    noted.clear()
    assert one.learn_arrived() == ([], [])
    assert noted == []


@pytest.mark.parametrize("refused", ["keep_tally", "add_messages"])
def test_what_a_disk_refuses_is_not_acknowledged_and_an_event_of_it_still_warns(refused: str) -> None:
    noted: Noted = []
    event, record = message_of(Event), message_of(StaticRecord)
    one = learner(noted, {"add_messages": StoreError("full")})
    if refused == "keep_tally":
        one._keeper = NotedPart(noted, "keeper", {"keep_tally": StoreError("full")})
    one.take(record)
    one.take(event)
    assert one.learn_arrived() == ([], [])
    assert noted[-1] == ("watch.on_known_event", event)
    assert ("store.add_messages" in str(noted)) is (refused == "add_messages")
    assert one._arrived == []


@pytest.mark.parametrize("is_doubled", [True, False])
def test_a_survey_has_the_depth_of_its_tube_as_it_comes_and_waits_for_its_own(is_doubled: bool) -> None:
    noted: Noted = []
    one, survey = learner(noted, {"add_messages": [True]}), message_of(SurveyMeasurement, hops=4, flags=2)
    one._string.doubled.places = (1,) if is_doubled else ()
    apart = one._string.doubled._answers["survey_apart"] if is_doubled else survey
    one.take(survey)
    assert one._arrived == [Stored(survey, 12.0, 2.0)]
    assert noted[-2:] == [("string.length_below", apart), ("string.depth_of", apart, 2.0)]
    one._placement = NotedPart(noted, "placement", {"wait_for_depth": "a place"}, waiting=[])
    assert one.learn_arrived() == ([survey], ["b", "a"])
    assert noted[-4:] == [
        ("setup.on_flags", apart.tube, apart.hops, apart.flags), ("string.on_measurement", apart, {"is_placed": False}),
        ("placement.wait_for_depth", Stored(survey, 12.0, 2.0)), ("watch.on_measurement", survey, "a place"),
    ]  # fmt: skip
    one._string = NotedPart(noted, "string", {"length_below": None}, doubled=one._string.doubled)
    one.take(survey)
    assert one._arrived == [Stored(survey, None, None)]


def test_what_is_placed_is_stored_first_and_waits_on_where_the_disk_refuses() -> None:
    """The first keeps the depth that is stored, the second has another one, the third waits without one from now on."""
    messages = [message_of(SurveyMeasurement, sequence=k) for k in range(4)]
    placeable = [(Stored(messages[0], 5.0, 1.0), 5.0), (Stored(messages[1], 5.0, 1.0), 6.0)]
    for error in (None, StoreError("full")):
        noted: Noted = []
        waiting = [Stored(messages[2], 7.0, 1.0), Stored(messages[3], None, 1.0)]
        answers = {"take_placeable": placeable, "resolve_measurements": ["f0", "f1"], "place": "placed"}
        one = learner(
            noted, {"place_messages": error}, _placement=NotedPart(noted, "placement", answers, waiting=waiting)
        )
        changed = one.place_waiting()
        assert noted[1] == ("store.place_messages", [(messages[1], 6.0), (messages[2], None)])
        if error is not None:
            assert (changed, one._placement.waiting[2:]) == ([], [placeable[0][0], placeable[1][0]])
            assert len(noted) == 2
            continue
        assert changed == ["a", "b"]
        assert [stored.md for stored in one._placement.waiting] == [None, None]
        assert noted[2] == ("placement.resolve_measurements", messages[:2], [5.0, 6.0])
        assert noted[3:6] == [
            ("string.on_measurement", messages[0], {"is_placed": True}), ("placement.place", messages[0], "f0"),
            ("watch.on_measurement", messages[0], "placed"),
        ]  # fmt: skip
        assert noted[7][1:] == (messages[1], "f1")


def test_nothing_is_stored_where_nothing_has_moved() -> None:
    noted: Noted = []
    one = learner(noted)
    one._placement = NotedPart(noted, "placement", {"take_placeable": []}, waiting=[])
    assert one.place_waiting() == []
    assert noted == [("placement.take_placeable",)]


def test_a_hole_has_rested_once_after_each_survey() -> None:
    one = bare(Learner, _hole=SimpleNamespace(version=4), _rested=4, _shown=4)
    assert [one._has_rested() for _ in range(2)] == [False, False]
    for version in (5, 7):
        one._hole.version = version
        assert [one._has_rested() for _ in range(4)] == [False, True, False, False]
    one._hole.version = 8
    assert not one._has_rested()
    one._hole.version = 9
    assert [one._has_rested() for _ in range(3)] == [False, True, False]


# who contradicts the encoder


def event(
    tube: int = 1, sequence: int = 1, at: float = 100.0, epoch: int = 1, code: str = "x", **arguments: Any
) -> Event:
    return Event(tube, sequence, at, Severity.INFO, code, arguments, epoch)


def test_events_are_together_within_half_a_minute_whichever_was_first() -> None:
    check = EncoderCrossCheck()
    for at, together in ((130.0, True), (130.001, False), (70.0, True), (69.999, False)):
        assert check._is_beside(event(), event(at=at)) is together
        assert check._is_beside(event(at=at), event()) is together


def test_time_apart_goes_over_the_end_of_one_epoch_and_the_begin_of_the_next() -> None:
    check = EncoderCrossCheck()
    for at, epoch in ((50.0, 1), (110.0, 1), (105.0, 1), (7.0, 2), (3.0, 2), (4.0, 4)):
        check._add_to_span(event(at=at, epoch=epoch))
    assert check._apart(event(at=100.0), event(at=8.0, epoch=2)) == (110.0 - 100.0) + (8.0 - 3.0)
    assert check._apart(event(at=100.0), event(at=140.0)) == 40.0
    assert check._apart(event(at=100.0), event(at=5.0, epoch=4)) == math.inf  # another one lies between
    assert check._apart(event(at=100.0), event(at=5.0, epoch=9)) == math.inf  # of which nothing is known
    assert check._apart(event(at=100.0, epoch=EPOCH_UNKNOWN), event(at=101.0)) == math.inf
    assert check._is_beside(event(at=18.0, epoch=2), event(at=95.0))  # 15 and 15 s
    assert not check._is_beside(event(at=18.1, epoch=2), event(at=95.0))


def test_the_newest_epochs_are_kept() -> None:
    check = EncoderCrossCheck()
    for epoch in range(1, 103):
        check._add_to_span(event(epoch=epoch))
    assert sorted(check._spans) == list(range(3, 103))


def test_a_blind_time_ends_once_the_newest_first_and_one_without_a_begin_is_as_long_as_it_says() -> None:
    check, place = EncoderCrossCheck(), (1, 1)
    check._blind[place] = deque([(10.0, math.inf), (50.0, math.inf), (200.0, math.inf)])
    check._end_blind(place, event(at=100.0))
    assert list(check._blind[place]) == [(10.0, math.inf), (50.0, 100.0), (200.0, math.inf)]
    check._end_blind(place, event(at=120.0))
    assert check._blind[place][0] == (10.0, 120.0)
    check._end_blind(place, event(at=120.0, cycles=19))
    since, until = check._blind[place][-1]
    assert (since, until) == (pytest.approx(110.0), 120.0)  # 19 cycles are ten seconds
    for nothing in ({}, {"cycles": 0}, {"cycles": "many"}):
        check._end_blind((2, 1), event(at=120.0, **nothing))
        assert (2, 1) not in check._blind


@pytest.mark.parametrize(
    ("at", "epoch", "since"),
    [(100.0, 1, 99.4737), (110.0, 1, 99.4737), (110.001, 1, 110.001), (99.0, 1, 99.0), (105.0, 2, 105.0)],
)  # fmt: skip
def test_a_gyroscope_gave_nothing_since_it_began_to_contradict(at: float, epoch: int, since: float) -> None:
    check = EncoderCrossCheck()
    check._rejected[1] = event(at=100.0)
    assert check._blind_since(event(at=at, epoch=epoch)) == pytest.approx(since, abs=1e-4)
    assert check._rejected == {}
    assert check._blind_since(event(at=at, epoch=epoch)) == pytest.approx(at - 10.0 / 19.0)


def test_the_start_of_an_event_is_the_newest_before_it_by_number_and_epoch() -> None:
    check = EncoderCrossCheck()
    starts = [event(sequence=k, at=at, epoch=epoch) for k, at, epoch in ((3, 10.0, 1), (9, 5.0, 2), (20, 50.0, 2))]
    check._starts[1] = deque(starts)
    assert check._start_before(event(sequence=9, epoch=2)) is starts[1]
    assert check._start_before(event(sequence=19, epoch=2)) is starts[1]
    assert check._start_before(event(sequence=19, epoch=1)) is starts[0]
    assert check._start_before(event(sequence=2, epoch=2)) is None
    assert check._start_before(event(tube=2, sequence=9, epoch=2)) is None
    assert check._was_settled(event(sequence=25, at=60.0, epoch=2))
    assert not check._was_settled(event(sequence=25, at=59.99, epoch=2))
    assert check._was_settled(event(tube=2))
    assert not check._was_settled(event(tube=2, epoch=EPOCH_UNKNOWN))
