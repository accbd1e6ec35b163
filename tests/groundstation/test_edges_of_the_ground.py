"""What the ground station knows of the string and the hole, at each of its bounds and when its lists are full.

Every bound has a number on either side of it, taken from the constant itself; every list that is bounded is filled
beyond its limit, and what it keeps is asserted with its order.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from groundstation.service.alarms import crew_alarms as alarms_room
from groundstation.service.alarms.crew_alarms import (
    DELAYS,
    FLOOD_FROM,
    OPEN_AT_MOST,
    TEN_MINUTES,
    AlarmState,
    Condition,
    CrewAlarms,
    Times,
)
from groundstation.service.alarms.rig_alarms import Level
from groundstation.service.alarms.verdict import (
    Known,
    compass_point,
    correction_deadline,
    deviation_azimuth,
    judge_hole,
)
from groundstation.service.alarms.verdict_words import Word
from groundstation.service.disk import ground_store as store_room
from groundstation.service.disk.ground_store import Store, is_depth
from groundstation.service.string import depth as depth_room
from groundstation.service.string import stops as stops_room
from groundstation.service.string.depth import AHEAD, RETURNED, SLACK, DepthDoubt, DepthLog, Track
from groundstation.service.string.stops import SHORTEST, Stop, Stops, Taken
from groundstation.service.string.tally import FITS, Tally
from groundstation.survey.path.normal_mixture import NormalMixture
from groundstation.survey.wall.column_deviation import Deviation
from groundstation.survey.wall.projected_end import ProjectedEnd
from telemetry.messages import DepthReading, Stand

GAP, RATE, LENGTH = 1.5, 0.2, 2.0


def track(*readings: tuple[float, float]) -> Track:
    made = Track(GAP)
    for at, md in readings:
        made.append_reading(at, md)
    return made


def test_a_depth_between_two_readings_is_nearer_to_the_nearer_one() -> None:
    found = track((10.0, 4.0), (11.0, 4.8))
    assert [found.depth_at(t) for t in (10.0, 10.25, 10.75, 11.0)] == [pytest.approx(d) for d in (4.0, 4.2, 4.6, 4.8)]


@pytest.mark.parametrize(("apart", "is_known"), [(GAP - 1e-6, True), (GAP, True), (GAP + 1e-6, False)])
def test_readings_up_to_exactly_a_gap_apart_bracket_a_time(apart: float, is_known: bool) -> None:
    found = track((10.0, 4.0), (10.0 + apart, 4.1))
    assert (found.depth_at(10.5) is not None) == is_known
    assert (found.depth_at(9.9), found.depth_at(10.0 + apart + 0.1)) == (None, None)


def test_of_too_many_readings_the_newest_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(depth_room, "LIMIT", 10)
    found = track(*((float(k), 0.1 * k) for k in range(25)))
    assert list(found.at) == [float(k) for k in range(25 - len(found.at), 25)]
    assert 5 <= len(found.at) <= 10
    assert found.depth_at(23.5) == pytest.approx(2.35)
    assert len(found.md) == len(found.run) == len(found.at)


def test_of_too_many_stands_and_epochs_the_newest_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(depth_room, "STANDS_KEPT", 5)
    log = DepthLog(RATE, GAP)
    for k in range(9):
        assert log.add_stand(Stand(1, 100.0 * k, 100.0 * k + 40.0, 2.0 + 0.5 * k)) is not None
    assert [stand.md for stand in log.stands] == [4.0, 4.5, 5.0, 5.5, 6.0]
    log = DepthLog(RATE, GAP)
    for epoch in range(1, depth_room.EPOCHS_KEPT + 4):
        assert Reader(log, epoch).say(10.0, 4.0) == ""
        assert log.at(epoch, 10.0) == 4.0
    known = [epoch for epoch in range(1, depth_room.EPOCHS_KEPT + 4) if log.at(epoch, 10.0) is not None]
    assert known == list(range(4, depth_room.EPOCHS_KEPT + 4))


class Reader:
    """Readings of a depth, each as it comes."""

    def __init__(self, log: DepthLog, epoch: int = 1) -> None:
        self.log, self.epoch, self.sequence = log, epoch, 100 * epoch

    def say(self, at: float, md: float, rig_now: float | None = None, skip: int = 0, deepest: float = 50.0) -> str:
        self.sequence += 1 + skip
        now = at if rig_now is None else rig_now
        return self.log.on_reading(DepthReading(self.sequence, at, md, (), self.epoch), self.epoch, now, now, deepest)


@pytest.mark.parametrize(("early", "is_taken"), [(AHEAD - 1e-6, True), (AHEAD, True), (AHEAD + 1e-6, False)])
def test_a_reading_may_be_ahead_of_rig_time_by_exactly_so_much(early: float, is_taken: bool) -> None:
    reader = Reader(DepthLog(RATE, GAP))
    assert (reader.say(100.0, 4.0, rig_now=100.0 - early) == "") == is_taken


def test_a_reading_of_the_same_moment_is_a_repetition() -> None:
    reader = Reader(DepthLog(RATE, GAP))
    assert reader.say(100.0, 4.0) == ""
    assert reader.say(100.0, 4.0) == "repeated"
    assert reader.say(99.9, 4.0, rig_now=100.0) == "repeated"
    assert reader.say(100.1, 4.0) == ""


@pytest.mark.parametrize(("md", "is_taken"), [(6.0 - 1e-9, True), (6.0, True), (6.0 + 1e-6, False)])
def test_a_bit_may_be_exactly_as_deep_as_the_string_reaches(md: float, is_taken: bool) -> None:
    assert (Reader(DepthLog(RATE, GAP)).say(100.0, md, deepest=6.0) == "") == is_taken


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(("beyond", "is_taken"), [(-1e-6, True), (1e-6, False)])
def test_a_bit_moves_as_fast_as_it_may_and_no_faster_up_or_down(
    direction: float, beyond: float, is_taken: bool
) -> None:
    reader = Reader(DepthLog(RATE, GAP))
    reader.say(100.0, 20.0)
    assert (reader.say(101.0, 20.0 + direction * (RATE + SLACK + beyond)) == "") == is_taken


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_jump_ends_near_the_depth_of_before_it_on_either_side_and_not_elsewhere(side: float) -> None:
    log = DepthLog(RATE, GAP)
    reader = Reader(log)
    for turn in range(2):
        at = 100.0 + 100.0 * turn
        assert reader.say(at, 20.0) == ""
        assert reader.say(at + 1.0, 20.0 + side * 5.0) == "after a jump"
        assert reader.say(at + 2.0, 20.0 + side * 3.0) == "after a jump"
        assert reader.say(at + 3.0, 20.0 + side * (RETURNED + 1e-3)) == "after a jump"
        assert reader.say(at + 4.0, 20.0 + side * RETURNED * 0.999) == ""
        assert reader.say(at + 5.0, 20.0) == ""


def test_what_the_crew_accepts_is_believed_however_far_from_what_came_before() -> None:
    log = DepthLog(RATE, GAP)
    reader = Reader(log)
    for turn in range(2):
        at = 100.0 + 100.0 * turn
        reader.say(at, 20.0 if not turn else 5.0)
        assert reader.say(at + 1.0, 12.0) == "after a jump"
        log.accept()
        assert reader.say(at + 2.0, 5.0) == ""
        assert log.jumped == ""
    assert reader.say(300.0, 5.0) == ""


def test_readings_that_never_came_are_counted_one_by_one() -> None:
    log = DepthLog(RATE, GAP)
    reader = Reader(log)
    for k, skip in enumerate((0, 0, 1, 3, 0)):
        reader.say(100.0 + k, 4.0, skip=skip)
    assert log.lost == 4


def tally(*tubes: int) -> Tally:
    made = Tally(LENGTH)
    made.restore(list(tubes))
    return made


def test_tubes_above_and_below_are_told_from_the_tube_on() -> None:
    it = tally(9, 4, 7, 2)  # from the top down
    assert it.below(4) == [2, 7]  # from the bit up
    assert it.below(2) == []
    assert [it.above(2, hops) for hops in (1, 2, 3, 4, 5)] == [[], [7], [7, 4], [7, 4, 9], None]
    assert it.above(9, 1) == []


@pytest.mark.parametrize(("beyond", "fits"), [(0.0, True), (1e-6, False)])
def test_a_depth_fits_the_tubes_up_to_exactly_half_of_one(beyond: float, fits: bool) -> None:
    it = tally(1, 2, 3)
    assert (it.misfit(3 * LENGTH + FITS * LENGTH + beyond, ()) == "") == fits
    assert (it.misfit((2 - FITS) * LENGTH - beyond, (1, 2, 3)) == "") == fits


def test_a_node_exactly_at_a_depth_is_not_below_it() -> None:
    it = tally(1, 2, 3)  # nodes at 6, 4 and 2 m above the bit's 6: 2, 4, 6 m
    assert it.tubes_below(2.0, 6.0) == [2, 3]
    assert it.tubes_below(2.0 - 1e-9, 6.0) == [1, 2, 3]


@pytest.mark.parametrize(("lasted", "is_owed"), [(SHORTEST - 1e-6, False), (SHORTEST, True)])
def test_a_stop_of_exactly_the_shortest_time_owes_its_survey(lasted: float, is_owed: bool) -> None:
    stops = Stops(tally(1), due=60.0)
    stops.on_stand(Stand(1, 100.0, 100.0 + lasted, 2.0))
    stops.judge(1, 1000.0)
    (stop,) = stops
    assert (stop.judged, stop.missing == {1}) == (is_owed, is_owed)


@pytest.mark.parametrize(("late", "is_judged"), [(-1e-6, False), (0.0, True)])
def test_a_survey_is_overdue_from_exactly_its_time_on(late: float, is_judged: bool) -> None:
    stops = Stops(tally(1), due=64.0)
    stops.on_stand(Stand(1, 128.0, 168.0, 2.0))
    stops.judge(1, 128.0 + 64.0 + late)
    (stop,) = stops
    assert stop.judged == is_judged


def test_of_too_many_stops_and_surveys_the_newest_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stops_room, "STOPS_KEPT", 4)
    monkeypatch.setattr(stops_room, "SURVEYS_KEPT", 8)
    stops, taken = Stops(tally(1), due=60.0), Taken()
    for k in range(9):
        stops.on_stand(Stand(1, 100.0 * k, 100.0 * k + 40.0, 2.0 + k))
        taken.add_survey(1, 100.0 * k + 10.0, k + 1)
    assert [stop.stand.md for stop in stops] == [7.0, 8.0, 9.0, 10.0]
    found = [taken.tubes_of(Stop(Stand(1, 100.0 * k, 100.0 * k + 40.0, 2.0), ())) for k in range(9)]
    assert found[5:] == [{6}, {7}, {8}, {9}]
    assert found[0] == set()


class Alarms:
    """Alarms and a clock."""

    def __init__(self) -> None:
        self.alarms, self.now = CrewAlarms(), 1000.0

    def look(self, *conditions: Condition, after: float = 0.5) -> None:
        self.now += after
        self.alarms.update(conditions, Times(self.now, self.now, self.now))


def condition(subject: int, level: Level = Level.BAD) -> Condition:
    return Condition("code", f"tube {subject}", level)


def test_a_full_list_of_alarms_gives_the_oldest_of_the_mildest_for_what_is_graver() -> None:
    it, levels = Alarms(), {}
    for subject in range(OPEN_AT_MOST):
        levels[subject] = (Level.DEGRADED, Level.BAD, Level.NOTICE)[subject % 3]
    standing = [condition(subject, level) for subject, level in levels.items()]
    it.look(*standing)
    it.look(*standing, after=DELAYS[Level.DEGRADED] + 1.0)
    assert len(list(it.alarms)) == OPEN_AT_MOST
    numbers = {alarm.condition.subject: alarm.number for alarm in it.alarms}
    mildest = sorted((s for s in levels if levels[s] is Level.NOTICE), key=lambda s: numbers[f"tube {s}"])
    grave = []
    for extra in range(3):
        grave.append(condition(100 + extra))
        it.look(*standing, *grave)
        open_ = {alarm.condition.subject for alarm in it.alarms}
        assert f"tube {100 + extra}" in open_
        assert {s for s in mildest if f"tube {s}" not in open_} == set(mildest[: extra + 1])
    assert all(f"tube {s}" in open_ for s in levels if levels[s] is Level.BAD)


def test_alarms_stand_there_the_gravest_first_and_of_equals_the_newest() -> None:
    it = Alarms()
    standing = []
    for subject, level in ((1, Level.NOTICE), (2, Level.BAD), (3, Level.NOTICE), (4, Level.BAD)):
        standing.append(condition(subject, level))
        it.look(*standing)
    assert [alarm.condition.subject for alarm in it.alarms] == ["tube 4", "tube 2", "tube 3", "tube 1"]


@pytest.mark.parametrize("times", [1, 2, 3])
def test_an_alarm_that_was_acknowledged_wants_it_again_when_it_is_worse_or_back(times: int) -> None:
    it = Alarms()
    for _ in range(times):
        it.look(condition(1, Level.NOTICE))
        (alarm,) = it.alarms
        it.alarms.put(it.alarms.acknowledged(alarm.number, "anna", it.now))
        it.look(condition(1, Level.BAD))
        (alarm,) = it.alarms
        assert alarm.state(it.now) is AlarmState.RAISED
        assert (alarm.acknowledged_by, math.isnan(alarm.acknowledged_utc)) == ("", True)
        it.alarms.put(it.alarms.acknowledged(alarm.number, "bert", it.now))
        it.look()
        assert list(it.alarms) == []


@pytest.mark.parametrize("times", [1, 2])
def test_a_condition_that_comes_back_has_its_delay_anew(times: int) -> None:
    it, mild = Alarms(), condition(1, Level.DEGRADED)
    for _ in range(times):
        for _ in range(3):
            it.look(mild)
            assert list(it.alarms) == []
            it.look(mild, after=0.9 * DELAYS[Level.DEGRADED])
            assert list(it.alarms) == []
            it.look(after=0.5)
    it.look(mild)
    it.look(mild, after=DELAYS[Level.DEGRADED])
    assert len(list(it.alarms)) == 1


def test_a_flood_begins_beyond_exactly_its_number_and_ends_below_its_other() -> None:
    it, standing = Alarms(), []
    for subject in range(FLOOD_FROM + 1):
        standing.append(condition(subject))
        it.look(*standing)
        assert it.alarms.in_flood == (subject == FLOOD_FROM)
    it.look(*standing, after=TEN_MINUTES - 0.5 * (FLOOD_FROM + 1) + 0.5 * (FLOOD_FROM - alarms_room.FLOOD_UNTIL) + 0.75)
    assert it.alarms.in_flood == (it.alarms.raised_within(TEN_MINUTES) >= alarms_room.FLOOD_UNTIL)
    it.look(*standing, after=TEN_MINUTES)
    assert not it.alarms.in_flood


@pytest.mark.parametrize(("late", "state"), [(-1e-3, AlarmState.SHELVED), (0.0, AlarmState.RAISED)])
def test_an_alarm_is_on_the_shelf_until_exactly_its_time(late: float, state: AlarmState) -> None:
    it = Alarms()
    it.look(condition(1))
    (alarm,) = it.alarms
    it.alarms.put(it.alarms.shelved(alarm.number, "anna", 2048.0))
    (alarm,) = it.alarms
    assert alarm.state(2048.0 + late) is state


LIMIT, TARGET, CURVATURE = 0.5, 20.0, math.radians(0.5)


def off(north: float, east: float, std: float = 0.01, md: float = TARGET) -> Deviation:
    return Deviation(md, md, np.array([north, east]), std**2 * np.eye(2), LIMIT)


def end(north: float, east: float, std: float = 0.01, surveyed: float = 0.001) -> ProjectedEnd:
    ends = off(north, east, std)
    foreseen = NormalMixture(np.ones(1), ends.offset[None], ends.cov[None])
    return ProjectedEnd(ends, foreseen, surveyed**2 * np.eye(2))


def known(foreseen: ProjectedEnd, bit: float | None = 10.0, worst: Deviation | None = None) -> Known:
    return Known(TARGET, CURVATURE, 2.0, bit, worst or off(0.01, 0.0, md=10.0), foreseen)


def test_the_last_depth_of_a_correction_is_where_a_full_bend_brings_the_end_within() -> None:
    """An end known to a millimetre 0.8 m off: bent from z on it moves by k (L - z)^2 / 2, and 0.3 m are to be moved."""
    deadline = correction_deadline(end(0.0, 0.8, std=1e-3), known(end(0.0, 0.8, std=1e-3), bit=12.0))
    moved = 0.5 * CURVATURE * (TARGET - deadline.before) ** 2
    assert moved == pytest.approx(0.3, abs=3e-3)
    assert deadline.left == pytest.approx(deadline.before - 12.0)
    # from a bit beyond it the end still moves by as much as is left: to exactly the limit it is one chance in two
    left = math.sqrt(2.0 * 0.3 / CURVATURE)
    late = correction_deadline(end(0.0, 0.8, std=1e-3), known(end(0.0, 0.8, std=1e-3), bit=TARGET - left))
    assert late.best == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize(("surveyed", "word"), [(0.249, Word.ON_TARGET), (0.2501, Word.DONT_KNOW)])
def test_surveys_leave_an_end_open_from_half_of_the_limit_on(surveyed: float, word: Word) -> None:
    assert judge_hole(known(end(0.0, 0.1, surveyed=surveyed))).word is word


@pytest.mark.parametrize(("used", "word"), [(LIMIT - 1e-9, Word.WATCH), (LIMIT, Word.OUT)])
def test_a_hole_is_out_from_exactly_its_tolerance_on(used: float, word: Word) -> None:
    assert judge_hole(known(end(0.0, 0.1), worst=off(0.0, used, md=10.0))).word is word


@pytest.mark.parametrize(("at", "word"), [(1.4, Word.OUT), (1.0, Word.DONT_KNOW)])
def test_an_open_end_is_out_where_its_near_side_is(at: float, word: Word) -> None:
    """Open by 0.6 m on either side: from 1.1 m on all of it is beyond the limit, whatever the surveys leave."""
    assert judge_hole(known(end(0.0, at, std=0.31, surveyed=0.3), bit=TARGET)).word is word


def test_a_direction_is_named_by_the_nearest_wind_clockwise_from_north() -> None:
    names = {0.0: "N", 45.0: "NE", 90.0: "E", 180.0: "S", 270.0: "W", 11.2: "N", 11.3: "NNE", 348.8: "N", 348.7: "NNW"}
    assert {deg: compass_point(math.radians(deg)) for deg in names} == names
    for north, east, deg in (
        (1.0, 0.0, 0.0),
        (0.0, 1.0, 90.0),
        (-1.0, 0.0, 180.0),
        (0.0, -1.0, 270.0),
        (1.0, 0.5, 26.565),
    ):
        assert math.degrees(deviation_azimuth(off(north, east))) == pytest.approx(deg, abs=1e-3)


@pytest.mark.parametrize(
    ("value", "is_one"), [(None, True), (0.0, True), (1e-9, True), (-1e-9, False), (math.nan, False), (math.inf, False)]
)
def test_a_stored_depth_is_zero_or_more(value: float | None, is_one: bool) -> None:
    assert is_depth(value) == is_one


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(f"sqlite:///{tmp_path / 'rig.db'}")


def test_a_stand_that_lasts_takes_the_place_of_what_it_was(store: Store) -> None:
    for begun_at, ended_at in ((100.0, 110.0), (100.0, 150.0), (300.0, 310.0), (290.0, 340.0)):
        store.keep_stand(Stand(1, begun_at, ended_at, 4.0))
    assert store.stands() == [Stand(1, 100.0, 150.0, 4.0), Stand(1, 290.0, 340.0, 4.0)]


def test_a_doubt_of_the_depth_that_is_over_is_so_in_the_store(store: Store) -> None:
    doubt = DepthDoubt((1, 100.0, 4.0), (1, 90.0), (Stand(1, 100.0, 120.0, 4.0),))
    for _ in range(2):
        store.keep_depth_doubt(doubt)
        assert store.depth_doubt() == doubt
        store.keep_depth_doubt(DepthDoubt(None, (1, 130.0), ()))
        assert store.depth_doubt() == DepthDoubt(None, (1, 130.0), ())


def test_so_many_alarms_are_stored_and_they_are_the_newest(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store_room, "ALARMS_KEPT", 5)
    it, standing = Alarms(), []
    for subject in range(9):
        standing.append(condition(subject))
        it.look(*standing)
        store.keep_alarms(it.alarms.drain_changed())
    assert [alarm.number for alarm in store.alarms()] == [5, 6, 7, 8, 9]
