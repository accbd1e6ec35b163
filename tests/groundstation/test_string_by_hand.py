"""The string as the ground station knows it, by hand: numbers, ages, stops and depths written out, each state twice."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from test_setup_by_hand import measured
from test_signs_of_life import node_state

from groundstation.config import GroundConfig
from groundstation.service.string import message_numbers as numbers_room
from groundstation.service.string.depth import DepthDoubt, DepthLog
from groundstation.service.string.doubled_numbers import OTHER, DoubledPlaces
from groundstation.service.string.known_string import KnownString
from groundstation.service.string.message_numbers import MessageNumbers
from groundstation.service.string.node_states import NodeStates
from groundstation.service.string.numbered_rows import NumberedRows
from groundstation.service.string.rig_time import RigTime
from groundstation.service.string.stands import take_stand, take_survey
from groundstation.service.string.stops import AROUND, SHORTEST, Stop, Stops, Taken, is_in_stand
from groundstation.service.string.tally import Tally
from telemetry.frozen import replace
from telemetry.messages import EPOCH_UNKNOWN, DepthReading, NodeFlag, Stand

LENGTH, RATE, GAP, STALE, DUE = 2.0, 0.5, 30.0, 5.0, 90.0


def string_of(folder: Path, *tubes: int, **settings: Any) -> KnownString:
    made = KnownString(
        GroundConfig(
            folder=folder, tube_length=LENGTH, depth_rate=RATE, depth_gap=GAP, stale_after=STALE, survey_after=DUE,
            **settings,
        )
    )  # fmt: skip
    made.restore_tubes(tubes)
    made.time.now = 1000.0
    return made


# numbers of messages


def test_what_is_missing_lies_between_what_came_and_what_was_told_series_by_series() -> None:
    numbers, second = MessageNumbers(), 3 << 24
    assert (numbers.gap(7), numbers.newest(7), numbers.tubes) == (None, 0, [])
    for number in (1, 2, 5, 9):
        numbers.add_number(7, number)
    assert (numbers.gap(7), numbers.newest(7)) == ((3, 4), 9)
    assert not numbers.on_told(7, 11)
    for came, gap in ((3, (4, 4)), (4, (6, 8)), (7, (6, 6)), (6, (8, 8)), (8, (10, 11)), (10, (11, 11)), (11, None)):
        numbers.add_number(7, came)
        assert numbers.gap(7) == gap
    assert numbers.on_told(7, second + 2)  # it counts anew, in a series of its start
    assert not numbers.on_told(7, second + 2)
    assert numbers.gap(7) == (second + 1, second + 2)
    assert numbers.newest(7) == second + 2
    numbers.add_number(7, second + 1)
    assert numbers.gap(7) == (second + 2, second + 2)
    assert numbers.on_told(7, second + 1)  # below what was told before
    assert not numbers.on_told(7, 0)
    assert numbers.on_told(7, 10)
    numbers.add_number(4, 1)
    assert (numbers.tubes, numbers.gap(4), numbers.newest(4)) == ([4, 7], None, 1)


def test_a_gap_that_is_given_up_is_not_asked_for_again_and_the_next_one_is() -> None:
    for first in (1, 4):  # a gap at the front, and one that lies behind another
        numbers = MessageNumbers()
        for number in (3, 6, 9):
            numbers.add_number(7, number)
        numbers.give_up(7, (first, first + 1))
        left = [(1, 2), (4, 5), (7, 8)]
        left.remove((first, first + 1))
        for gap in left:
            assert numbers.gap(7) == gap
            numbers.give_up(7, gap)
        assert numbers.gap(7) is None
        numbers.add_number(7, 11)
        assert numbers.gap(7) == (10, 10)


def test_of_too_many_series_the_oldest_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numbers_room, "SERIES_KEPT", 3)
    numbers = MessageNumbers()
    for start in (5, 6, 7):
        numbers.add_number(1, (start << 24) + 2)
    assert numbers.gap(1) == ((5 << 24) + 1, (5 << 24) + 1)
    numbers.add_number(1, (8 << 24) + 2)
    assert numbers.gap(1) == ((6 << 24) + 1, (6 << 24) + 1)


def test_rows_are_numbered_from_one_on_also_those_that_are_gone() -> None:
    rows: NumberedRows[str] = NumberedRows(3)
    assert (rows.newest, len(rows), list(rows.numbered())) == (0, 0, [])
    for row in "abcde":
        rows.append_row(row)
    assert (rows.newest, len(rows), list(rows), rows[0], rows[-1]) == (5, 3, ["c", "d", "e"], "c", "e")
    assert list(rows.numbered()) == [(3, "c"), (4, "d"), (5, "e")]


# time and states


def test_rig_time_is_followed_epoch_by_epoch_and_says_how_long_a_state_was_on_its_way() -> None:
    time = RigTime()
    assert not time.is_known
    time.now = 1000.0
    for epoch, rig_now, begins in ((4, 100.0, True), (4, 100.0, False), (5, 3.0, True), (4, 100.0, False)):
        assert time.follow_rig_time(rig_now, epoch) == begins
        assert (time.rig_now, time.epoch, time.is_known) == (rig_now, epoch, True)
    for epoch, at, flags, dated, away in (
        (4, 97.5, NodeFlag.NONE, True, 2.5), (5, 1.0, NodeFlag.NONE, True, 2.0), (4, 103.0, NodeFlag.NONE, True, 0.0),
        (6, 97.5, NodeFlag.NONE, False, 0.0), (4, 97.5, NodeFlag.CLOCK_UNSYNCHRONISED, False, 0.0),
    ):  # fmt: skip
        state = replace(node_state(1, at, 5), epoch=epoch, flags=flags)
        assert time.is_dated(state) == dated
        assert time.time_on_its_way(state) == pytest.approx(away)
    for epoch in range(6, 13):
        time.follow_rig_time(1.0, epoch)
    known = [epoch for epoch in range(4, 13) if time.is_dated(replace(node_state(1, 1.0, 5), epoch=epoch))]
    assert known == list(range(5, 13))


def test_a_node_is_as_old_as_its_newest_state_that_was_on_its_way() -> None:
    time = RigTime()
    states = NodeStates(time, STALE)
    time.now = 1000.0
    time.follow_rig_time(500.0, 2)
    assert (states.age(1), states.is_stale(1)) == (math.inf, True)
    first = replace(node_state(1, 497.0, 5), epoch=2, numbered=40)
    assert states.on_state(first, 1000.0) is True
    assert states.age(1) == pytest.approx(3.0)
    for _ in range(2):
        assert states.on_state(first, 1001.0) is None  # it has come before
    assert states.on_state(replace(node_state(1, 496.0, 6), epoch=2), 1000.0) is False  # an older one is no newest
    assert states.newest[1] == first
    assert states.age(1) == pytest.approx(3.0)
    for later, stale in ((5.0, False), (5.001, True)):
        time.now = 997.0 + later
        assert states.is_stale(1) == stale
    time.now = 1000.0
    assert states.on_state(replace(node_state(1, 499.0, 1), epoch=7), 1000.0) is None  # of no epoch that is
    undated = replace(node_state(1, 9.0, 1), numbered=39)
    assert states.on_state(undated, 1000.0) is None  # its number was given long ago
    assert states.on_state(replace(undated, numbered=40), 1000.0) is True
    assert states.on_state(replace(undated, numbered=40), 1000.0) is None
    assert states.on_state(replace(undated, numbered=0, cycles=2), 1000.0) is True


def test_a_state_of_before_the_epoch_was_heard_is_given_its_age_then() -> None:
    time = RigTime()
    states = NodeStates(time, STALE)
    time.now = 1000.0
    states.on_state(replace(node_state(1, 490.0, 5), epoch=2), 1000.0)
    assert states.age(1) == 0.0
    time.now = 1001.0
    time.follow_rig_time(500.0, 2)
    states.on_new_epoch()
    assert states.age(1) == pytest.approx(10.0)
    states.on_new_epoch()
    assert states.age(1) == pytest.approx(10.0)


# where tubes and the bit are


def test_a_tube_is_surveyed_as_deep_as_the_bit_less_the_string_below_it(tmp_path: Path) -> None:
    string = string_of(tmp_path, 9, 8, 7)
    string.on_rig_time(100.0, 3)
    assert string.depth_of(measured(8, 0.0, 0.0), None) is None  # no depth is known
    for sequence, (at, md) in enumerate(((90.0, 5.0), (96.0, 5.6)), 1):
        assert string.on_depth(DepthReading(sequence, at, md, (), 3), 1000.0 + sequence) == ""
    assert (string.bit, string.depth_heard_at) == (5.6, 1002.0)
    string.time.now = 1004.0
    assert string.depth_age == 2.0
    at_93 = replace(measured(8, 0.0, 0.0), station_at=93.0, hops=2)
    assert string.length_below(at_93) == 2.0
    assert string.depth_of(at_93, None) == pytest.approx(5.3 - 2.0)
    assert string.depth_of(replace(at_93, epoch=3), 4.5) == pytest.approx(0.8)
    assert string.depth_of(at_93, 5.305) == 0.0  # of rounding above the collar
    for change in ({"epoch": 2}, {"station_at": 97.0}, {"flags": NodeFlag.CLOCK_UNSYNCHRONISED}):
        assert string.depth_of(replace(at_93, **change), 2.0) is None
    assert string.depth_of(at_93, 5.32) is None  # it hangs above the collar
    assert string.depth_of(replace(at_93, hops=1), 1.0) is None  # one tube and a half do not reach so far
    assert [string.depth_of_node(tube) for tube in (7, 8, 9, 10)] == [5.6, pytest.approx(3.6), pytest.approx(1.6), None]


def test_a_string_whose_tubes_are_not_all_known_says_no_lengths(tmp_path: Path) -> None:
    string = string_of(tmp_path, 9, 8)
    string.on_rig_time(100.0, 3)
    string.on_depth(DepthReading(1, 90.0, 5.1, (), 3), 1000.0)
    survey = replace(measured(8, 0.0, 0.0), hops=2)
    assert string.length_below(survey) is None  # two tubes and a half reach 5 m
    assert string.length_below(replace(measured(7, 0.0, 0.0), hops=3)) == 0.0  # a third is met by its survey
    assert string.length_below(survey) == 2.0
    string._tubes_known_at = 1000.001
    assert (string.knows_tubes, string.length_below(survey)) == (False, None)
    string.time.now = 1000.001
    assert (string.knows_tubes, string.length_below(survey)) == (True, 2.0)


def test_tubes_speak_until_they_are_stale_and_the_rig_is_known_while_all_is_fresh(tmp_path: Path) -> None:
    string = string_of(tmp_path, 9, 8, 7)
    assert (string.heard, string.silent, string.is_known) == ([], [9, 8, 7], False)
    string.on_rig_time(100.0, 3)
    for tube, hops in ((9, 1), (7, 3)):
        assert string.on_state(replace(node_state(tube, 100.0, 5), hops=hops, epoch=3), 1000.0)
    assert (string.heard, string.silent, string.is_known) == ([9, 7], [8], False)
    string.on_depth(DepthReading(1, 100.0, 5.1, (), 3), 1000.0)
    assert string.is_known
    for later, known in ((STALE, True), (STALE + 1e-6, False)):
        string.time.now = 1000.0 + later
        assert string.is_known == known
    assert string.events.newest == string.static_records.newest == 0


def test_a_stand_is_believed_of_the_present_within_reach_and_once(tmp_path: Path) -> None:
    for told_epoch in (EPOCH_UNKNOWN, 3):
        string = string_of(tmp_path, 9, 8)
        string.on_rig_time(200.0, 3)
        for stand, at in (
            (Stand(2, 100.0, 150.0, 2.0), 200.0), (Stand(told_epoch, 100.0, 201.0, 2.0), 200.0),
            (Stand(told_epoch, 100.0, 150.0, 6.001), 200.0),
        ):  # fmt: skip
            string.on_told_stand(stand, at)
        assert string.depths.stands == []
        string.on_told_stand(Stand(told_epoch, 100.0, 200.0, 6.0), 200.0)
        assert string.depths.stands == [Stand(3, 100.0, 200.0, 6.0)]
        assert string.depths.at(3, 150.0) == 6.0
        string.on_rig_time(300.0, 4)
        string.on_told_stand(Stand(EPOCH_UNKNOWN, 100.0, 200.0, 6.0), 300.0)
        assert string.depths.stands == [Stand(3, 100.0, 200.0, 6.0)]  # it is that of before


def test_what_a_start_has_to_know_of_a_jump_is_kept_and_taken_up_again() -> None:
    log = DepthLog(RATE, GAP)
    assert (log.doubt, log.latest, log.accepted_at(1)) == (DepthDoubt(), None, -math.inf)
    for sequence, (at, md) in enumerate(((100.0, 20.0), (101.0, 30.0), (102.0, 31.0)), 1):
        log.on_reading(DepthReading(sequence, at, md, (), 1), 1, at, at, 50.0)
    kept = log.doubt
    assert kept == DepthDoubt((1, 100.0, 20.0), (-1, 0.0), (Stand(1, 100.0, math.inf, 20.0),))
    again = DepthLog(RATE, GAP)
    again.recall(kept)
    assert (again.latest, again.jumped) == (20.0, "from 20.00 m, before the ground station's start")
    assert again.add_stand(Stand(1, 101.0, 140.0, 30.0)) is None
    assert again.on_reading(DepthReading(9, 150.0, 20.05, (), 1), 1, 150.0, 150.0, 50.0) == ""
    assert (again.jumped, again.doubt.times) == ("", (Stand(1, 100.0, 150.0, 20.0),))
    again.accept()
    assert [again.accepted_at(epoch) for epoch in (1, 2)] == [150.0, -math.inf]
    fresh = DepthLog(RATE, GAP)
    fresh.restore([Stand(1, 10.0, 50.0, 2.0), Stand(1, 60.0, 90.0, 4.0)])
    assert (fresh.latest, fresh.at(1, 40.0), fresh.at(1, 75.0), fresh.at(1, 55.0)) == (4.0, 2.0, 4.0, None)
    assert fresh.on_reading(DepthReading(1, 90.0, 4.0, (), 1), 1, 91.0, 91.0, 50.0) == "repeated"


# stops


def tally(*tubes: int) -> Tally:
    made = Tally(LENGTH)
    made.restore(list(tubes))
    return made


@pytest.mark.parametrize(("lasted", "owed"), [(SHORTEST - 1e-6, False), (SHORTEST, True)])
@pytest.mark.parametrize(("later", "judged"), [(DUE - 1e-6, False), (DUE, True)])
def test_a_stop_owes_the_surveys_of_tubes_in_the_hole_once_it_lasted_and_is_due(
    lasted: float, owed: bool, later: float, judged: bool
) -> None:
    stops = Stops(tally(9, 8, 7), DUE)
    stand = Stand(1, 100.0, 100.0 + lasted, 3.0)
    stops.on_stand(stand)
    (stop,) = stops
    assert stop.tubes == (8, 7)  # the node of tube 9 is a metre above the collar
    stops.on_survey(1, 110.0, 7)
    stops.on_survey(2, 110.0, 8)  # of another epoch
    for _ in range(2):
        stops.judge(1, 100.0 + later)
    assert (stop.judged, stop.missing) == (owed and judged, {8} if owed and judged else set())
    stops.on_survey(1, 100.0 - AROUND - 1e-6, 8)
    assert stop.missing == ({8} if owed and judged else set())
    stops.on_survey(1, 100.0 + lasted + AROUND, 8)
    assert stop.missing == set()


def test_a_stop_goes_on_where_the_bit_stands_on_and_one_elsewhere_is_another() -> None:
    stops = Stops(tally(9, 8, 7), DUE)
    for end in (120.0, 150.0):
        stops.on_stand(Stand(1, 100.0, end, 3.0))
    stops.on_stand(Stand(1, 100.0, 150.0, 3.5))
    stops.on_stand(Stand(1, 160.0, 200.0, 3.0))
    stops.on_stand(Stand(2, 100.0, 150.0, 3.0))
    assert [(one.stand.epoch, one.stand.md, one.lasted) for one in stops] == [
        (1, 3.0, 50.0), (1, 3.5, 50.0), (1, 3.0, 40.0), (2, 3.0, 50.0)
    ]  # fmt: skip
    assert stops.know(Stand(1, 100.0, 155.0, 3.5))
    assert not stops.know(Stand(1, 100.0, 155.0, 3.6))
    assert stops.is_too_short(Stand(1, 1.0, 2.0, 3.0)) is False
    stops.on_later_stand(Stand(1, 160.0, 200.0, 3.0), Stand(2, 5.0, 9.0, 3.0))
    found = list(stops)[2]
    assert (found.lasted, found.age(2, 30.0), found.age(1, 300.0)) == (44.0, 44.0 + 21.0, math.inf)
    assert [found.has(1, at) for at in (157.9, 158.0, 9e9)] == [False, True, True]
    assert [found.has(2, at) for at in (2.9, 3.0, 11.0, 11.1)] == [False, True, True, False]
    assert found.covers(Stand(2, 5.0, 9.0, 3.0))
    assert next(iter(stops)).has(1, 110.0)  # its surveys are still those of its own time
    assert not found.covers(Stand(2, 5.0, 9.1, 3.0))


def test_a_stand_is_a_stop_that_lies_deeper_or_follows_one_too_short_and_not_where_the_string_is_lifted() -> None:
    for second, stops_there in ((4.5, True), (2.5, False)):
        for first_end, too_short in ((140.0, False), (120.0, True)):
            log, stops = DepthLog(RATE, GAP), Stops(tally(9, 8, 7), DUE)
            stops.on_survey(1, 110.0, 7)
            take_stand(log, stops, Stand(1, 100.0, first_end, 3.0))  # the first is one by its survey
            assert len(list(stops)) == 1
            take_stand(log, stops, Stand(1, 200.0, 240.0, second))
            assert len(list(stops)) == 1 + (stops_there or too_short)
    log, stops = DepthLog(RATE, GAP), Stops(tally(9, 8, 7), DUE)
    take_stand(log, stops, Stand(1, 100.0, 140.0, 3.0))
    assert list(stops) == []  # without a survey in it, and of an encoder that had never started before
    for at in (97.9, 142.1):
        take_survey(log, stops, 1, at)
        assert list(stops) == []
    assert not is_in_stand(log.stands[0], 2, 120.0)
    take_survey(log, stops, 1, 142.0)
    assert [one.stand.md for one in stops] == [3.0]
    later = Stops(tally(9, 8, 7), DUE)
    take_stand(DepthLog(RATE, GAP), later, Stand(2, 100.0, 140.0, 3.0))
    assert [one.stand.md for one in later] == [3.0]


def test_surveys_of_a_stop_are_found_by_epoch_and_time_and_the_newest_half_is_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("groundstation.service.string.stops.SURVEYS_KEPT", 6)
    taken, stop = Taken(), Stop(Stand(1, 100.0, 140.0, 3.0), ())
    for epoch, at, tube in ((1, 98.0, 1), (1, 97.9, 2), (2, 120.0, 3), (1, 142.0, 4), (1, 142.1, 5), (1, 120.0, 6)):
        taken.add_survey(epoch, at, tube)
    assert taken.tubes_of(stop) == {1, 4, 6}
    taken.add_survey(1, 121.0, 7)
    assert taken.tubes_of(stop) == {4, 6, 7}


def test_of_two_of_one_number_the_one_that_is_told_has_the_number_and_they_change_places(tmp_path: Path) -> None:
    string = string_of(tmp_path, 9, OTHER + 8, 8, 7)
    string.doubled.begin_anew([(8, DoubledPlaces(1, 5.0, 2, 3))], {8: True})
    for is_upper, order in ((True, [9, 8, OTHER + 8, 7]), (False, [9, OTHER + 8, 8, 7]), (False, [9, OTHER + 8, 8, 7])):
        string.doubled.is_upper = {8: is_upper}
        string.on_doubled()
        assert string.tubes == order
