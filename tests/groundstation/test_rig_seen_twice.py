"""What the ground station makes of a rig: each transition a second time, each sum of unequal parts, each bound.

Every number that goes into a sum is different from every other, so that one left out or counted twice is seen.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_edges_of_the_ground import GAP, RATE, Alarms, Reader, condition, end, tally
from test_resolved_stops import stops_of

from groundstation.config import GroundConfig
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
from groundstation.service.hole.history import History
from groundstation.service.hole.resolved_stops import ResolvedStops
from groundstation.service.hole.station import SurveyStation
from groundstation.service.orders.order_book import OrderBook, OrderState, SentOrder
from groundstation.service.orders.recalibration.solution import propose_bias
from groundstation.service.orders.uploads import Uploads
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.setup_correction import corrected_yaw, depth_shift
from groundstation.service.setup.setup_items import JOINT_STD
from groundstation.service.setup.setup_priors import uncertain_direction
from groundstation.service.setup.told_value import DRIVE, SetupKind, ToldValue
from groundstation.service.string.depth import CONTRADICTION, LATE, SLACK, DepthLog
from groundstation.service.string.message_numbers import MessageNumbers
from groundstation.service.string.stands import take_stand
from groundstation.service.string.stops import SETTLED, SHORTEST, Stops
from groundstation.survey.fusion.force_biases import ForceBias
from groundstation.survey.fusion.fusion import DEPARTED, Departure, judge_departure
from groundstation.survey.fusion.sphere_direction import UNKNOWN_YAW_VAR
from groundstation.survey.fusion.trust_level import Trust
from groundstation.survey.wall.column_deviation import Deviation, Deviations
from telemetry.application.commands import find_command
from telemetry.messages import BlockStatus, DepthReading, NodeFlag, Stand, UploadPhase
from telemetry.parameters import ParameterBlock, SensorParameters

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
        ((151.0, 180.0), True),
        ((80.0, 99.0), False),
    ],
)
def test_a_stand_is_more_of_a_stop_where_it_does_not_end_before_it(told: tuple[float, float], is_known: bool) -> None:
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


def joint(pair: str, correction: float, sigma: float, used: float | None = None) -> ToldValue:
    values = (correction,) if used is None else (correction + used,)
    return ToldValue(1, SetupKind.JOINT, pair, values, sigma, "anna", "", used=used)


def test_a_joint_that_was_not_told_once_was_not_told_whatever_comes_after(tmp_path: Path) -> None:
    book = SetupBook(GroundConfig(folder=tmp_path))
    for tube in (4, 3, 2):
        book.on_flags(tube, 5 - tube, NodeFlag.LOWER_UNTOLD)
    for tube in (4, 3, 2):
        book.on_flags(tube, 5 - tube, NodeFlag.NONE)
    assert [book.was_untold(pair) for pair in ((4, 3), (3, 2), (2, 1), (1, 9))] == [True, True, True, True]
    book.on_flags(1, 4, NodeFlag.NONE)
    assert not book.was_untold((1, 9))


def test_the_second_look_at_north_and_stick_up_keeps_its_own_value_and_sigma(tmp_path: Path) -> None:
    book = SetupBook(
        GroundConfig(
            folder=tmp_path, north_deg=10.0, north_std_deg=0.5, north_check_deg=10.3, north_check_std_deg=0.8,
            stick_up_m=0.4, stick_up_std_m=0.01, stick_up_check_m=0.42, stick_up_check_std_m=0.03,
        )
    )  # fmt: skip
    told = [book.standing(kind) for kind in (SetupKind.NORTH, SetupKind.STICK_UP)]
    again = [book.check_of(kind) for kind in (SetupKind.NORTH, SetupKind.STICK_UP)]
    numbers = [(one.values[0], one.sigma) for one in (*told, *again) if one is not None]
    rad = math.radians
    expected = [(rad(10.0), rad(0.5)), (0.4, 0.01), (rad(10.3), rad(0.8)), (0.42, 0.03)]
    assert numbers == [pytest.approx(pair) for pair in expected]


def test_each_joint_of_a_chain_adds_its_own_error_to_a_yaw(tmp_path: Path) -> None:
    """Tube 1 under 2, 3, 4 and 5: one joint told here, one told to the node and corrected, one nowhere, two marked."""
    book = SetupBook(GroundConfig(folder=tmp_path))
    book.joints = {(2, 1): joint("2-1", 0.3, 0.02), (3, 2): joint("3-2", 0.1, 0.05, used=0.04)}
    for tube, hops in ((5, 1), (4, 2), (3, 3), (2, 4), (1, 5)):
        book.on_flags(tube, hops, NodeFlag.LOWER_UNTOLD if tube in (4, 2) else NodeFlag.NONE)
    chain = [(2, 1), (3, 2), (4, 3), (5, 4), (DRIVE, 5)]
    turn, var = corrected_yaw(UNKNOWN_YAW_VAR + 1e-4, chain, book)
    assert turn == pytest.approx(book.joints[(2, 1)].correction + book.joints[(3, 2)].correction)
    assert var == pytest.approx(0.05**2 + 1e-4 + 3 * JOINT_STD**2 + UNKNOWN_YAW_VAR + 0.02**2)


def length(tube: int, metres: float) -> ToldValue:
    return ToldValue(1, SetupKind.LENGTH, str(tube), (metres,), 0.001, "anna", "")


def test_a_tube_hangs_higher_by_the_stick_up_and_by_what_tubes_below_it_are_longer(tmp_path: Path) -> None:
    book = SetupBook(GroundConfig(folder=tmp_path))
    book.stick_up = 0.25
    assert depth_shift(2, [3, 2, 1], 2.0, book) == -0.25
    book.lengths = {3: length(3, 2.4), 2: length(2, 2.2), 1: length(1, 2.1)}
    shifts = [depth_shift(tube, [3, 2, 1], 2.0, book) for tube in (3, 2, 1, 9)]
    assert shifts == [pytest.approx(shift) for shift in (-0.2 - 0.1 - 0.25, -0.1 - 0.25, -0.25, -0.25)]


@pytest.mark.parametrize("inclination_deg", [0.0, 20.0, 60.0])
@pytest.mark.parametrize("azimuth_deg", [0.0, 70.0])
def test_a_direction_known_each_way_alike_is_known_less_along_its_lean(
    inclination_deg: float, azimuth_deg: float
) -> None:
    """A lean is the sine of the inclination: it changes by its cosine."""
    inclination, azimuth = math.radians(inclination_deg), math.radians(azimuth_deg)
    cov = uncertain_direction(inclination, azimuth, 0.01).cov
    along = np.array([math.cos(azimuth), math.sin(azimuth)])
    across = np.array([-along[1], along[0]])
    assert along @ cov @ along == pytest.approx((0.01 * math.cos(inclination)) ** 2)
    assert across @ cov @ across == pytest.approx(0.01**2)
    assert along @ cov @ across == pytest.approx(0.0, abs=1e-12)


# orders


def test_a_status_of_another_tube_says_nothing_of_an_order() -> None:
    book = OrderBook()
    spec = find_command("upload_parameters")
    book.add(SentOrder(5, spec, 1, {}, "anna", 10.0, "2026-05-04T06:00:00Z"))

    def status(tube: int, phase: UploadPhase) -> BlockStatus:
        return BlockStatus(tube, 5, b"\x01" * 32, phase, 1, 3, b"\x02" * 32, "")

    for ended in (False, True):
        book.on_block_status(status(2, UploadPhase.APPLIED), ended=ended)
        kept = book.get(5)
        assert kept is not None
        assert kept.state is OrderState.SENT
    for _ in range(2):
        book.on_block_status(status(1, UploadPhase.APPLIED), ended=True)
        assert kept.state is OrderState.DONE


def test_the_last_word_on_an_upload_is_said_once() -> None:
    uploads = Uploads(lambda _tube: b"k" * 32)
    block = ParameterBlock(1, 4)
    assert uploads.start(block, 9, 0.0) is None
    assert uploads.due_segments(0.0)
    applied = BlockStatus(1, 9, block.sha256(), UploadPhase.APPLIED, 1, 4, block.sha256(), "")
    assert [uploads.on_status(applied) for _ in range(2)] == [True, False]
    assert (uploads.next_due(), uploads.due_segments(1e6), uploads.cancel(1)) == (math.inf, [], None)


def test_a_bias_is_told_with_its_sigmas_as_the_block_turns_them() -> None:
    matrix = ((2.0, 0.0, 0.0), (0.0, 3.0, 0.0), (0.0, 0.0, 5.0))
    before = ParameterBlock(1, 4, accelerometer=SensorParameters(matrix=matrix, bias=(0.1, 0.2, 0.3)))
    cov = np.diag([0.01**2, 0.02**2, 0.03**2])
    found = ForceBias(np.array([0.003, 0.004, 0.012]), cov, 7, 0.001, "0" * 64)
    shown = propose_bias(found, before, 10.0, "2026-05-04").found
    assert shown.bias_std == pytest.approx((0.02, 0.06, 0.15))
    assert shown.condition == pytest.approx(3.0)
    assert shown.inclination_before == pytest.approx(0.005 / math.sqrt(2.0) / 10.0)
    assert shown.inclination_after == pytest.approx(math.sqrt(0.01**2 + 0.02**2) / math.sqrt(2.0) / 10.0)


# the hole


def test_a_moment_gives_back_what_was_known_with_every_entry_in_its_place() -> None:
    history = History()
    offsets = np.array([[0.01, -0.02], [0.03, -0.04]])
    covs = np.array([[[4e-6, 1e-6], [1e-6, 9e-6]], [[16e-6, -2e-6], [-2e-6, 25e-6]]])
    history.add(Deviations(np.array([2.0, 4.0]), np.array([1.9, 3.8]), offsets, covs, np.array([0.1, 0.2])), None)
    rows = history.moments[-1].rows
    assert [(row.md, row.limit) for row in rows] == [(2.0, 0.1), (4.0, 0.2)]
    assert [row.along for row in rows] == pytest.approx([1.9, 3.8], rel=1e-6)
    assert np.allclose([row.offset for row in rows], offsets, rtol=1e-6)
    assert np.allclose([row.cov for row in rows], covs, rtol=1e-6)


def departure(north: float, size: float) -> Departure:
    return np.array([north, 0.0]), size


@pytest.mark.parametrize(
    ("own", "seen", "moved"),
    [
        (departure(1.0, 9.0), [], False),
        (departure(1.0, 9.0), [departure(2.0, 9.0)], True),
        (departure(1.0, 9.0), [departure(2.0, 9.0), departure(2.0, 8.0)], True),
        (departure(1.0, 9.0), [departure(2.0, 9.0), departure(-2.0, 9.0)], False),
        (departure(1.0, 9.0), [departure(2.0, 9.0), departure(2.0, DEPARTED)], False),
        (departure(1.0, DEPARTED), [departure(2.0, 9.0)], False),
        (departure(1.0, DEPARTED + 1e-9), [departure(2.0, DEPARTED + 1e-9)], True),
    ],
)
def test_a_hole_moved_where_every_neighbour_that_can_say_so_does(
    own: Departure, seen: list[Departure], moved: bool
) -> None:
    assert judge_departure(own, seen).moved == moved


def test_a_station_tells_the_mean_of_the_variances_of_the_stops_that_count() -> None:
    station, told = SurveyStation(2.0, ResolvedStops()), (1e-6, 2e-6, 6e-6)
    for number, var in enumerate(told):
        one = stops_of(1, 2 * number, 10.0 * number)
        one.rows["trust"] = Trust.FULL
        one.rows["yaw_var"], one.rows["systematic_var"], one.rows["force_var"] = var, 2.0 * var, 3.0 * var
        station.add_stop(one, 0)
    assert station.mean_variances() == pytest.approx((3e-6, 6e-6, 9e-6))
    station.drops = [1]
    assert station.mean_variances() == pytest.approx((4e-6, 8e-6, 12e-6))
    assert [station.first_before(place) for place in (0, 1, 2, 3)] == [0, 0, 1, 1]


@pytest.mark.parametrize(("later", "counts"), [(-1, False), (0, False), (1, True)])
def test_a_stop_is_revised_by_a_later_message_alone(later: int, counts: bool) -> None:
    station = SurveyStation(2.0, ResolvedStops())
    first, again = stops_of(1, 2, 10.0), stops_of(1, 2, 10.0)
    station.add_stop(first, 0)
    again.rows["sequence"], again.rows["yaw"] = first.rows["sequence"] + later, 2.0
    for _ in range(2):
        assert station.revise_stop(0, again, 0) == counts
        assert (station.stops[0].yaw == 2.0) == counts
        again.rows["sequence"] += int(counts)
