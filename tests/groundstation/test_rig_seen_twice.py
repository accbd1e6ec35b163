"""What the ground station makes of a rig: each transition a second time, each sum of unequal parts, each bound.

Every number that goes into a sum is different from every other, so that one left out or counted twice is seen.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_edges_of_the_ground import GAP, RATE, Alarms, Reader, condition, end, tally

from groundstation.service.alarms import verdict as verdict_room
from groundstation.service.alarms.conditions import conditions_of
from groundstation.service.alarms.crew_alarms import (
    AGAIN_WITHIN,
    DELAYS,
    OPEN_AT_MOST,
    SETTLED_AFTER,
    AlarmState,
    CrewAlarm,
)
from groundstation.service.alarms.rig_alarms import Level, RigAlarms
from groundstation.service.alarms.verdict import Deadline, chance_text
from groundstation.service.alarms.verdict_words import Word
from groundstation.service.answers.alarm_views import tolerance_alarm_row
from groundstation.service.hole.deviation_alarms import AlarmList, DeviationAlarm
from groundstation.service.string.depth import CONTRADICTION, LATE, SLACK, DepthLog
from groundstation.service.string.message_numbers import MessageNumbers
from groundstation.service.string.stands import take_stand
from groundstation.service.string.stops import SETTLED, SHORTEST, Stops
from groundstation.survey.wall.column_deviation import Deviation
from telemetry.messages import DepthReading, Stand

# where the bit is


@pytest.mark.parametrize(("late", "is_taken"), [(LATE - 1e-6, True), (LATE, True), (LATE + 1e-6, False)])
def test_a_reading_may_be_behind_rig_time_by_exactly_so_much(late: float, is_taken: bool) -> None:
    said = Reader(DepthLog(RATE, GAP)).say(100.0, 4.0, rig_now=100.0 + late)
    assert said == ("" if is_taken else "behind rig time")


def test_the_crew_has_looked_at_the_depth_up_to_the_last_reading_of_its_epoch() -> None:
    log = DepthLog(RATE, GAP)
    reader = Reader(log, epoch=2)
    for turn in range(2):
        at = 100.0 + 50.0 * turn
        reader.say(at, 4.0 + 9.0 * turn)
        log.accept()
        assert [log.accepted_at(epoch) for epoch in (1, 2, 3)] == [-math.inf, at, -math.inf]


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize(("beyond", "agree"), [(-1e-6, True), (1e-6, False)])
def test_between_two_stands_a_bit_moves_as_fast_as_it_may_from_the_end_of_one_to_the_begin_of_the_next(
    sense: float, beyond: float, agree: bool
) -> None:
    for backwards in (False, True):
        log = DepthLog(RATE, GAP)
        apart = sense * (10.0 * RATE + SLACK + beyond)
        two = [Stand(1, 100.0, 150.0, 20.0), Stand(1, 160.0, 200.0, 20.0 + apart)]
        first, second = reversed(two) if backwards else two
        assert log.add_stand(first) == first
        assert (log.add_stand(second) is not None) == agree
        assert log.refusals[CONTRADICTION] == (0 if agree else 1)


def test_a_stand_that_contradicts_two_is_held_against_the_later_one() -> None:
    log = DepthLog(RATE, GAP)
    for stand in (Stand(1, 100.0, 140.0, 2.0), Stand(1, 200.0, 240.0, 3.0)):
        log.add_stand(stand)
    assert log.add_stand(Stand(1, 120.0, 220.0, 8.0)) is None
    assert log.jumped == "from 8.00 m to 3.00 m between two stands"
    assert log.stands == []


@pytest.mark.parametrize("late", [0.0, 20.0])
@pytest.mark.parametrize(("beyond", "is_taken"), [(-1e-6, True), (1e-6, False)])
def test_between_two_epochs_the_time_is_that_between_the_readings_as_made(
    late: float, beyond: float, is_taken: bool
) -> None:
    log = DepthLog(RATE, GAP)
    assert log.on_reading(DepthReading(1, 100.0, 10.0, (), 1), 1, 100.0 + late, 1000.0, 50.0) == ""
    seconds = 1010.0 - (1000.0 - late)
    moved = DepthReading(2, 5.0, 10.0 + RATE * seconds + SLACK + beyond, (), 2)
    assert (log.on_reading(moved, 2, 5.0, 1010.0, 50.0) == "") == is_taken


# which tubes hang there, and which stops were surveyed


def test_tubes_above_one_are_told_from_the_lowest_up_as_many_as_its_hops_say() -> None:
    order = tally(5, 4, 3, 2, 1)
    assert [order.above(1, hops) for hops in range(1, 6)] == [[], [2], [2, 3], [2, 3, 4], [2, 3, 4, 5]]


def test_a_tube_that_comes_on_top_after_a_restart_finds_its_place_when_all_have_spoken() -> None:
    order = tally()
    order.restore([3, 2, 1])
    order.on_hops(4, 1)
    assert order.tubes == [4, 3, 2, 1]
    for tube, hops in ((1, 1), (2, 2), (3, 3), (4, 4)):
        order.on_hops(tube, hops)
    assert order.tubes == [1, 2, 3, 4]


@pytest.mark.parametrize(
    ("told", "is_known"),
    [
        ((100.0, 150.0), True),
        ((90.0, 160.0), True),
        ((100.0, 149.9), False),
        ((120.0, 150.0), True),
        ((150.0, 180.0), True),
        ((150.1, 180.0), False),
        ((80.0, 99.0), False),
    ],
)
def test_a_stand_is_more_of_a_stop_that_it_touches_where_it_does_not_end_before_it(
    told: tuple[float, float], is_known: bool
) -> None:
    stops = Stops(tally(2, 1), 60.0)
    stops.on_stand(Stand(1, 100.0, 150.0, 4.0))
    assert stops.know(Stand(1, *told, 4.0)) == is_known
    assert not stops.know(Stand(1, *told, 4.5))
    assert not stops.know(Stand(2, *told, 4.0))


@pytest.mark.parametrize("epoch", [2, 3])
def test_a_stop_of_an_earlier_epoch_is_judged_once_the_new_one_has_settled(epoch: int) -> None:
    stops = Stops(tally(2, 1), 60.0)
    stops.on_stand(Stand(1, 100.0, 150.0, 4.0))
    stops.judge(1, 151.0)
    for new in range(2, epoch + 1):
        stops.judge(new, 3.0)
        stops.judge(new, 3.0 + SETTLED - 0.1)
    (stop,) = stops
    assert not stop.judged
    stops.judge(epoch, 3.0 + SETTLED)
    assert stop.judged
    assert stop.missing == {1} | ({2} if 4.0 - 2.0 > 0.01 else set())


@pytest.mark.parametrize(("lasted", "is_stop"), [(SHORTEST - 1.0, True), (SHORTEST, False), (100.0, False)])
def test_a_string_lifted_off_a_stop_stops_anew_only_where_the_first_was_too_short(lasted: float, is_stop: bool) -> None:
    log, stops = DepthLog(RATE, GAP), Stops(tally(2, 1), 600.0)
    for stand in (
        Stand(1, 0.0, 50.0, 2.0),
        Stand(1, 100.0, 100.0 + lasted, 4.0),
        Stand(1, 300.0, 400.0, 3.0),
    ):
        take_stand(log, stops, stand)
    assert [stop.stand.md for stop in stops] == ([4.0, 3.0] if is_stop else [4.0])


def test_a_tube_counts_anew_only_where_its_newest_number_is_smaller() -> None:
    numbers = MessageNumbers()
    assert [numbers.on_told(1, newest) for newest in (5, 5, 6, 6, 4, 4, 0, -1)] == [
        False, False, False, False, True, False, False, False,
    ]  # fmt: skip
    for number in range(1, 9):
        numbers.add_number(1, number)
    assert [numbers.on_told(1, newest) for newest in (8, 8, 7, 8)] == [False, False, True, False]


# alarms


def test_of_alarms_of_one_level_one_whose_condition_is_gone_makes_room_first() -> None:
    it = Alarms()
    all_ = [condition(subject) for subject in range(OPEN_AT_MOST)]
    it.look(*all_)
    gone = {5, 11}
    standing = [one for subject, one in enumerate(all_) if subject not in gone]
    it.look(*standing)
    extra = []
    for new, dropped in ((100, "tube 5"), (101, "tube 11"), (102, None)):
        extra.append(condition(new))
        before = {alarm.condition.subject for alarm in it.alarms}
        it.look(*standing, *extra)
        after = {alarm.condition.subject for alarm in it.alarms}
        assert before - after == ({dropped} if dropped else set())
        assert len(after) == OPEN_AT_MOST


@pytest.mark.parametrize(("apart", "is_same"), [(AGAIN_WITHIN - 0.5, True), (AGAIN_WITHIN, True), (60.5, False)])
def test_a_condition_that_returns_is_the_same_alarm_within_exactly_its_time(apart: float, is_same: bool) -> None:
    it = Alarms()
    for turn in range(1, 3):
        it.look(condition(1, Level.NOTICE))
        it.look()
        it.look(condition(1, Level.NOTICE), after=apart)
        (alarm,) = it.alarms
        assert alarm.times == (2 if is_same else 1)
        it.look()
        it.look(after=AGAIN_WITHIN + 1.0)
        assert alarm.number == (turn if is_same else 2 * turn)


def test_a_condition_that_returns_is_the_newest_of_its_alarms_that_were_cleared() -> None:
    it = Alarms()
    for _ in range(3):
        it.look(condition(1, Level.NOTICE))
        it.look()
        it.look(after=AGAIN_WITHIN + 1.0)
    it.look(condition(1, Level.NOTICE))
    it.look()
    it.look(condition(1, Level.NOTICE))
    assert [(alarm.number, alarm.times) for alarm in it.alarms] == [(4, 2)]
    assert [alarm.number for alarm in it.alarms.cleared] == [1, 2, 3]


def test_what_was_known_before_a_start_goes_once_it_had_its_time_to_show_itself() -> None:
    it = Alarms()
    it.alarms.restore([CrewAlarm(7, condition(1, Level.NOTICE), 1.0, 2.0)], [])
    it.look(after=0.0)
    for _ in range(3):
        it.look(after=SETTLED_AFTER / 4.0)
        assert [alarm.number for alarm in it.alarms] == [7]
    it.look(after=SETTLED_AFTER / 4.0)
    assert (list(it.alarms), [alarm.number for alarm in it.alarms.cleared]) == ([], [7])


@pytest.mark.parametrize("level", list(Level))
@pytest.mark.parametrize("by", ["", "anna"])
@pytest.mark.parametrize("stands", [True, False])
def test_only_a_grave_alarm_that_was_not_acknowledged_stays_when_its_condition_goes(
    level: Level, by: str, stands: bool
) -> None:
    alarm = CrewAlarm(1, condition(1, level), 1.0, 2.0, stands=stands, acknowledged_by=by)
    if stands:
        expected = AlarmState.ACKNOWLEDGED if by else AlarmState.RAISED
    else:
        expected = AlarmState.LATCHED if level is Level.BAD and not by else AlarmState.CLEARED
    assert alarm.state(10.0) is expected
    assert replace(alarm, shelved_until=10.0).state(10.0) is expected
    assert replace(alarm, shelved_until=10.1).state(10.0) is AlarmState.SHELVED
    assert replace(alarm, dropped=True).state(10.0) is AlarmState.CLEARED


def test_a_condition_seen_once_and_again_later_waits_its_delay_from_the_second_time() -> None:
    it, delay = Alarms(), DELAYS[Level.DEGRADED]
    it.look(condition(1, Level.DEGRADED))
    it.look(after=0.5 * delay)
    it.look(condition(1, Level.DEGRADED), after=delay)
    it.look(condition(1, Level.DEGRADED), after=delay - 0.1)
    assert list(it.alarms) == []
    it.look(condition(1, Level.DEGRADED), after=0.2)
    assert len(list(it.alarms)) == 1


def raised(*alarms: tuple[str, float]) -> Any:
    """A hole whose deviations have raised these kinds and levels, of a limit of 40 cm."""
    made = AlarmList()
    for kind, level in alarms:
        made.alarms.append(DeviationAlarm(kind, level, 10.0, 12.0, 0.3, 0.01, 0.02, 0.4, 5.0))
    return SimpleNamespace(alarms=made)


@pytest.mark.parametrize("order", list(itertools.permutations((0.5, 0.8, 1.0))))
def test_one_condition_a_kind_is_told_at_the_highest_level_with_its_threshold(order: tuple[float, ...]) -> None:
    hole = raised(*(("deviation", level) for level in order), ("projection", 0.5))
    string: Any = None  # of no tube is anything asked
    found = {one.code: one for one in conditions_of(RigAlarms(), string, hole)}
    assert {code: (one.level, one.threshold) for code, one in found.items()} == {
        "deviation": (Level.BAD, "100 % of 40 cm"),
        "projection": (Level.NOTICE, "50 % of 40 cm"),
    }
    lower = raised(*(("deviation", level) for level in order if level < 1.0))
    (only,) = conditions_of(RigAlarms(), string, lower)
    assert (only.level, only.threshold) == (Level.DEGRADED, "80 % of 40 cm")


@pytest.mark.parametrize("level", [0.5, 0.8, 1.0])
def test_the_threshold_of_an_alarm_is_its_part_of_the_limit(level: float) -> None:
    row = tolerance_alarm_row(DeviationAlarm("deviation", level, 10.0, 12.0, 0.3, 0.01, 0.02, 0.4, 5.0))
    assert (row.level_percent, row.threshold_cm) == (round(100.0 * level), pytest.approx(40.0 * level))
    assert (row.deviation_cm, row.sigma_cm, row.half_width_cm) == pytest.approx((30.0, 1.0, 2.0))


@pytest.mark.parametrize("azimuth_deg", [0.0, 45.0, 135.0, 225.0, 315.0, 359.0])
def test_an_alarm_of_a_deviation_names_its_azimuth_from_0_to_360(azimuth_deg: float) -> None:
    towards = math.radians(azimuth_deg)
    offset = 0.45 * np.array([math.cos(towards), math.sin(towards)])
    alarms = AlarmList()
    alarms.judge_deviation(Deviation(12.0, 12.0, offset, 1e-4 * np.eye(2), 0.4), 10.0)
    assert [math.degrees(one.direction) for one in alarms.alarms] == [pytest.approx(azimuth_deg, abs=1e-9)] * 3


@pytest.mark.parametrize(
    ("used", "std", "clears"),
    [(0.45, 0.001, True), (0.45, 0.2, False), (0.501, 0.001, False), (0.5, 0.0001, False)],
)
def test_an_alarm_of_the_end_goes_where_it_is_within_and_that_is_likely(used: float, std: float, clears: bool) -> None:
    alarms = AlarmList()
    limit = end(0.1, 0.0).limit
    alarms.judge_projection(end(0.6 * limit, 0.0), 10.0)
    alarms.judge_projection(end(used * limit, 0.0, std * limit), 20.0)
    assert [one.cleared_at for one in alarms.alarms] == [20.0 if clears else None]


# the verdict


@pytest.mark.parametrize(
    ("within", "word"), [(0.5 - 1e-9, Word.OUT), (0.5, Word.WATCH), (0.94, Word.WATCH), (0.95, Word.ON_TARGET)]
)
def test_at_its_depth_even_chances_are_watched(within: float, word: Word) -> None:
    foreseen = end(0.1, 0.0)
    foreseen.__dict__["within"] = within
    assert verdict_room._word_of(foreseen, None, 2.0)[0] is word


@pytest.mark.parametrize(
    ("left", "best", "word"),
    [
        (2.0, 0.99, Word.WATCH),
        (2.0 - 1e-9, 0.99, Word.STEER),
        (0.0, 0.99, Word.STEER),
        (-1e-9, 0.5, Word.STEER),
        (-1e-9, 0.5 - 1e-9, Word.OUT),
        (None, 0.99, Word.WATCH),
    ],
)
def test_a_correction_is_due_where_the_next_survey_comes_after_its_last_depth(
    left: float | None, best: float, word: Word
) -> None:
    foreseen = end(0.1, 0.0)
    foreseen.__dict__.update(within=0.8, centred=0.9)
    assert verdict_room._word_of(foreseen, Deadline(12.0, left, best), 2.0)[0] is word


@pytest.mark.parametrize(
    ("chance", "text"),
    [(0.0, "0 %"), (1e-9, "< 1 %"), (0.01, "1 %"), (0.5, "50 %"), (0.99, "99 %"), (0.9901, "> 99 %"), (1.0, "100 %")],
)
def test_a_chance_is_told_as_certain_only_where_it_is(chance: float, text: str) -> None:
    assert chance_text(chance) == text


# the setup


# orders


# the hole
