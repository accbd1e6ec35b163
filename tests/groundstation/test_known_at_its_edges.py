"""What a ground station knows and orders, at exactly its bounds, a second time, and with its lists full."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from test_edges_of_the_ground import GAP, RATE, Alarms, condition, tally, track
from test_encoder_cross_check import event
from test_signs_of_life import node_state

from groundstation.config import GroundConfig
from groundstation.errors import SelectorError
from groundstation.service.alarms import encoder_cross_check as cross_room
from groundstation.service.alarms import rig_alarms as rig_alarms_room
from groundstation.service.alarms.encoder_cross_check import OUTCOME_WITHIN, EncoderCrossCheck
from groundstation.service.alarms.rig_alarms import KINDS, NOTICE_S, Level, RigAlarms
from groundstation.service.alarms.spread_text import spread_text
from groundstation.service.hole import history as history_room
from groundstation.service.hole.history import SAME_STOP, History, Moment
from groundstation.service.orders.order_book import KEPT, OrderBook, OrderState, SentOrder
from groundstation.service.orders.recalibration.procedure import CLOCK_TOLERANCE, FieldProcedure
from groundstation.service.orders.recalibration.recalibration_progress import (
    RecalibrationProgress,
    RecalibrationStage,
    TubePhase,
)
from groundstation.service.orders.uploads import Uploads
from groundstation.service.process.intake_tape import KEPT as TAPE_KEPT
from groundstation.service.process.intake_tape import TIMER, Tape
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.setup_checks import APART, counted_std, least_slip, say_contradiction
from groundstation.service.setup.told_value import SetupKind, ToldValue
from groundstation.service.string import stops as stops_room
from groundstation.service.string.depth import DepthLog
from groundstation.service.string.node_states import NodeStates
from groundstation.service.string.rig_time import RigTime
from groundstation.service.string.stops import Stops
from groundstation.service.string.tally import Tally
from telemetry.application.commands import find_command
from telemetry.frozen import replace
from telemetry.messages import EPOCH_UNKNOWN, BlockStatus, Reply, Stand, StaticRecord, UploadPhase
from telemetry.parameters import ParameterBlock

# where the bit is


@pytest.mark.parametrize(("apart", "kept"), [(0.5 * GAP, 2), (GAP, 2), (GAP + 1e-9, 3)])
def test_a_bit_at_rest_is_two_readings_as_long_as_they_come_within_the_gap(apart: float, kept: int) -> None:
    found = track((10.0, 4.0), (10.0 + 0.5 * GAP, 4.0), (10.0 + 0.5 * GAP + apart, 4.0))
    assert len(found.at) == kept
    assert found.depth_at(10.0 + 0.5 * GAP + 0.5 * apart) == (4.0 if apart <= GAP else None)


@pytest.mark.parametrize("again", [(110.0, 120.0), (100.0, 150.0), (90.0, 120.0), (110.0, 160.0), (150.0, 170.0)])
def test_a_stand_told_again_is_never_shorter_than_it_was(again: tuple[float, float]) -> None:
    log = DepthLog(RATE, GAP)
    log.add_stand(Stand(1, 100.0, 150.0, 4.0))
    for _ in range(2):
        whole = Stand(1, min(100.0, again[0]), max(150.0, again[1]), 4.0)
        assert log.add_stand(Stand(1, *again, 4.0)) == whole
        assert log.stands == [whole]


@pytest.mark.parametrize("tubes", [1, 3, 5])
def test_a_tube_may_have_all_others_above_it(tubes: int) -> None:
    order = Tally(2.0)
    order.restore(list(range(tubes, 0, -1)))
    lowest = order.tubes[-1]
    assert order.above(lowest, tubes) == order.tubes[:-1][::-1]
    assert order.above(lowest, 1) == []
    assert order.above(lowest, tubes + 1) is None
    assert order.above(lowest, 0) is None


def test_tubes_that_speak_hang_below_the_collar_but_for_one() -> None:
    """Of three tubes of 2 m that speak two are in the hole: the bit is 3 m deep at least, half a tube less than 4."""
    order = Tally(2.0)
    order.restore([3, 2, 1])
    for md, fits in ((2.99, False), (3.0, True), (7.0, True), (7.01, False)):
        assert (order.misfit(md, [3, 2, 1]) == "") == fits
    assert order.misfit(1.0, [3, 2]) == ""
    assert order.misfit(0.0, [3]) == ""


# who speaks


def states_at(now: float) -> tuple[NodeStates, RigTime]:
    time = RigTime()
    time.now = now
    return NodeStates(time, 10.0), time


def test_an_epoch_that_is_heard_first_makes_no_tube_fresher() -> None:
    states, time = states_at(0.0)
    states.on_state(replace(node_state(1, at=5.0, cycles=1), epoch=7), 0.0)
    for step in range(1, 3):
        time.now = 20.0 * step
        time.follow_rig_time(1000.0, 20 + step)  # another epoch than the state's: its time says nothing
        states.on_new_epoch()
        assert states.age(1) == 20.0 * step
        assert states.is_stale(1)


@pytest.mark.parametrize("epoch", [EPOCH_UNKNOWN, 3])
def test_the_same_state_twice_is_no_news_and_one_that_is_newer_by_either_is(epoch: int) -> None:
    states, _ = states_at(0.0)
    first = replace(node_state(1, at=100.0, cycles=50), epoch=epoch)
    assert states.on_state(first, 0.0)
    for _ in range(2):
        assert states.on_state(first, 1.0) is None
    assert states.on_state(replace(first, cycles=51), 2.0)
    assert states.on_state(replace(first, cycles=51), 3.0) is None


# alarms


@pytest.mark.parametrize(
    ("size", "half", "text"),
    [
        (0.438, 0.0020, "43.8 ± 0.2 cm"),
        (0.438, 0.0021, "43.8 ± 0.3 cm"),
        (0.438, 0.0004, "43.8 ± 0.1 cm"),
        (0.0, 0.0994, "0.0 ± 10.0 cm"),
        (0.384, 0.1, "38 ± 10 cm"),
        (0.384, 0.1004, "38 ± 11 cm"),
        (0.384, 0.1249, "38 ± 13 cm"),
        (0.384, math.inf, "38.4 ± ? cm"),
    ],
)
def test_a_spread_is_told_rounded_up(size: float, half: float, text: str) -> None:
    assert spread_text(size, half) == text


@given(size=st.floats(0.0, 5.0), half=st.floats(0.0, 2.0))
@example(size=0.0, half=0.1)
@example(size=0.0, half=0.001)
def test_no_spread_is_told_smaller_than_it_is(size: float, half: float) -> None:
    told = float(spread_text(size, half).split("±")[1].removesuffix("cm"))
    assert 100.0 * half - 1e-6 <= told <= max(100.0 * half, 0.1) + (1.0 if half >= 0.0999 else 0.1) + 1e-6


def kind_of(level: Level) -> str:
    return next(kind.code for kind in KINDS if kind.level is level)


def test_a_full_list_of_the_rigs_alarms_drops_the_oldest_of_the_mildest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rig_alarms_room, "STANDING", 6)
    alarms = RigAlarms()
    levels = [Level.BAD, Level.NOTICE, Level.DEGRADED, Level.NOTICE, Level.BAD, Level.DEGRADED]
    for number, level in enumerate(levels):
        alarms.alert(kind_of(level), f"tube {number}")
    for extra, gone in enumerate((1, 3, 2, 5)):
        alarms.alert(kind_of(Level.BAD), f"tube {10 + extra}")
        assert f"tube {gone}" not in {alarm.subject for alarm in alarms}
        assert (len(list(alarms)), alarms.dropped) == (6, extra + 1)
    assert [alarm.subject for alarm in alarms] == ["tube 0", "tube 4", *(f"tube {10 + k}" for k in range(4))]


@pytest.mark.parametrize("times", [1, 2, 3])
def test_a_notice_is_shown_for_its_time_from_the_last_time_on(times: int) -> None:
    alarms, code, now = RigAlarms(), kind_of(Level.NOTICE), 1000.0
    for _ in range(times):
        now += 0.5 * NOTICE_S
        alarms.advance(now, now)
        alarms.alert(code, "tube 1")
    for later, stands in ((NOTICE_S - 1e-6, True), (NOTICE_S, False)):
        alarms.advance(now + later, now)
        assert alarms.stands(code, "tube 1") == stands
    assert [alarm.count for alarm in alarms.cleared] == [times]


def test_open_alarms_are_the_newest_first_among_equals_and_an_acknowledgement_is_of_one_time() -> None:
    it = Alarms()
    for subject in range(3):
        it.look(*(condition(one) for one in range(subject + 1)))
        it.look(*(condition(one) for one in range(subject + 1)), after=60.0)
    assert [alarm.condition.subject for alarm in it.alarms] == ["tube 2", "tube 1", "tube 0"]


@pytest.mark.parametrize(("ahead", "counts"), [(1, True), (OUTCOME_WITHIN, True), (OUTCOME_WITHIN + 1, False)])
def test_an_outcome_that_was_lost_is_looked_for_within_exactly_so_many_numbers(ahead: int, counts: bool) -> None:
    check = EncoderCrossCheck()
    for tube in (1, 2):
        check.on_event(event(tube, 0.0, "restored", 1), (1, 2))
        check.on_event(event(tube, 100.0, "aiding_rejected", 10), (1, 2))
        said = check.on_lost(tube, (10 + ahead, 10 + ahead + 5), (1, 2), doubts=False)
    assert bool(said) == counts


def test_a_contradiction_that_was_counted_is_not_counted_by_the_next() -> None:
    """What was rejected before a reset began that contradiction and none of later."""
    check = EncoderCrossCheck()
    check.on_event(event(1, 0.0, "restored", 1), (1,))
    check.on_event(event(1, 100.0, "aiding_rejected", 10), (1,))
    check.on_event(event(1, 101.0, "yaw_reset", 11), (1,))
    check.on_event(event(1, 130.0, "yaw_reset", 12), (1,))
    assert {number: began.at for (_, number), began in check._began.items()} == {11: 100.0, 12: 130.0}


def test_of_too_many_epochs_the_newest_are_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cross_room, "EPOCHS_KEPT", 3)
    check = EncoderCrossCheck()
    for epoch in range(1, 7):
        check.on_event(event(1, 10.0 * epoch, "stopped", epoch, epoch), (1,))
        check.on_event(event(1, 10.0 * epoch + 4.0, "started", 20 + epoch, epoch), (1,))
    assert check._spans == {epoch: (10.0 * epoch, 10.0 * epoch + 4.0) for epoch in (4, 5, 6)}


# orders


def order(number: int, tube: int = 1, name: str = "take_survey") -> SentOrder:
    return SentOrder(number, find_command(name), tube, {}, "anna", 10.0, "2026-05-04T06:00:00Z")


@pytest.mark.parametrize("name", ["take_survey", "static_record"])
def test_an_answer_counts_once_and_of_the_tube_that_was_asked(name: str) -> None:
    book = OrderBook()
    book.add(order(5, 1, name))
    after = OrderState.ACKNOWLEDGED if find_command(name).goes_on else OrderState.DONE
    for reply, state in (
        (Reply(2, 5, True, "of another"), OrderState.SENT),
        (Reply(1, 6, True, "to another"), OrderState.SENT),
        (Reply(1, 5, True, "yes"), after),
        (Reply(1, 5, False, "no"), after),
        (Reply(1, 5, True, "again"), after),
    ):
        book.on_reply(reply)
        kept = book.get(5)
        assert kept is not None
        assert (kept.state, kept.detail) == (state, "" if state is OrderState.SENT else "yes")


def test_of_too_many_orders_the_oldest_that_ended_goes() -> None:
    book = OrderBook()
    for number in range(1, KEPT + 1):
        book.add(order(number))
    for number in (4, 2, 9):
        book.finish(number)
    for extra, gone in ((201, 2), (202, 4), (203, 9)):
        book.add(order(extra))
        assert book.get(gone) is None
    book.add(order(204))
    assert [one.number for one in book] == [n for n in range(1, KEPT + 1) if n not in (2, 4, 9)] + [201, 202, 203, 204]


def record(command: int, begun_at: float, ended_at: float) -> StaticRecord:
    cov, mean = ((1e-6, 0.0, 0.0), (0.0, 1e-6, 0.0), (0.0, 0.0, 1e-6)), (0.0, 0.0, -9.8)
    return StaticRecord(1, command, command, begun_at, ended_at, 20, mean, cov, mean, cov, 20.0, False)


@pytest.mark.parametrize(
    ("begun_at", "ended_at", "counts"),
    [
        (100.0 - CLOCK_TOLERANCE, 110.0, 1),
        (100.0 - CLOCK_TOLERANCE - 1e-6, 110.0, 0),
        (110.0, 150.0, 1),
        (110.0, 150.0 + 1e-6, 0),
    ],
)
def test_a_record_lies_in_its_attitude_from_a_tolerance_before_it_to_its_end(
    begun_at: float, ended_at: float, counts: int
) -> None:
    procedure = FieldProcedure(9.81)
    procedure.begin([1])
    procedure.attitude(0.0, 0.0, 10.0, 100.0)
    tube = procedure.progress.tubes[1]
    tube.orders[7] = 0
    procedure.attitude(0.0, 1.0, 10.0, 150.0)  # the next one ends the first
    assert procedure.progress.attitudes[0].left == 150.0
    assert procedure.progress.attitudes[1].left is None
    procedure.on_static_record(record(7, begun_at, ended_at))
    assert procedure.count_records(tube) == counts


@pytest.mark.parametrize("given_hash", ["", "a", "ab" * 31, "ab" * 32 + "0", "AB" * 32, "cd" * 32])
def test_only_the_whole_name_of_what_was_shown_is_uploaded(given_hash: str) -> None:
    procedure = FieldProcedure(9.81)
    procedure.begin([1])
    block = ParameterBlock(1, 2)
    tube = procedure.progress.tubes[1]
    tube.proposed, tube.phase = block.canonical().hex(), TubePhase.PROPOSED
    progress: RecalibrationProgress = procedure.progress
    progress.stage, progress.proposal = RecalibrationStage.SOLVED, "ab" * 32
    with pytest.raises(SelectorError, match="nothing is uploaded"):
        procedure.proposed(given_hash)
    assert [one.sha256() for one, _ in procedure.proposed("ab" * 32)] == [block.sha256()]


def test_an_upload_to_a_tube_that_was_revoked_meanwhile_ends_the_one_before() -> None:
    keys: dict[int, bytes | None] = {1: bytes(32)}
    uploads = Uploads(keys.get)
    assert uploads.start(ParameterBlock(1, 1), 11, 0.0) is None
    assert uploads.due_segments(0.0)
    keys[1] = None
    assert uploads.start(ParameterBlock(1, 2), 12, 1.0) == 11
    assert uploads.due_segments(100.0) == []
    assert uploads.next_due() == math.inf
    gone = BlockStatus(1, 11, ParameterBlock(1, 1).sha256(), UploadPhase.APPLIED, 1, 1, bytes(32), "")
    assert not uploads.on_status(gone)


# what is kept of a day


def test_of_too_many_moments_every_second_of_the_older_half_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(history_room, "KEPT", 8)
    history = History()
    kept: list[int] = []
    for number in range(1, 30):
        history._append(Moment(number, 10.0 * number, None, None, None))  # type: ignore[arg-type]
        kept.append(number)
        if len(kept) > 8:
            kept = [*kept[:4:2], *kept[4:]]
        assert [moment.number for moment in history.moments] == kept
    assert kept[0] == 1
    assert all(later > before for before, later in pairwise(kept))


@pytest.mark.parametrize(
    ("epoch", "at", "is_new"),
    [(1, 100.0, False), (1, 100.0 + SAME_STOP, False), (1, 100.0 + SAME_STOP + 1e-6, True), (1, 50.0, False),
     (2, 1.0, True), (0, 500.0, False)],
)  # fmt: skip
def test_a_survey_begins_a_stop_beyond_exactly_its_time_or_in_a_later_epoch(
    epoch: int, at: float, is_new: bool
) -> None:
    history = History()
    assert not history.begins_stop(1, 100.0)
    history.on_survey(1, 100.0)
    for _ in range(2):
        assert history.begins_stop(epoch, at) == is_new


def test_of_too_many_stops_that_owe_a_survey_the_newest_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stops_room, "STOPS_KEPT", 4)
    stops = Stops(tally(1), due=60.0)
    for k in range(7):
        stops.on_stand(Stand(1, 100.0 * k, 100.0 * k + 40.0, 2.0 + k))
        stops.judge(1, 100.0 * k + 90.0)
    assert [stop.stand.md for stop in stops._owed] == [5.0, 6.0, 7.0, 8.0]
    for k in range(7):
        stops.on_survey(1, 100.0 * k + 10.0, 1)
    assert stops._owed == []


@pytest.mark.parametrize("missed", [0, 1, TAPE_KEPT - 1, TAPE_KEPT, TAPE_KEPT + 5])
def test_a_tape_gives_every_event_after_a_number_that_it_still_has(missed: int) -> None:
    tape, count = Tape(), TAPE_KEPT + 10
    for k in range(count):
        tape.add(TIMER, float(k), float(k), 1)
    got = [one.number for one in tape.after(count - missed)]
    assert got == list(range(max(count - missed, 10) + 1, count + 1))


# what was told


@pytest.mark.parametrize(("told", "check"), [(3e-3, 4e-3), (4e-3, 3e-3), (0.012, 5e-3)])
def test_a_check_shows_a_slip_of_more_than_both_errors_together_and_nothing_counts_better_than_it(
    tmp_path: Path, told: float, check: float
) -> None:
    def value(number: int, kind: SetupKind, size: float, sigma: float, *, checks: bool = False) -> ToldValue:
        return ToldValue(number, kind, "", (size,), sigma, "anna", "2026-05-04T06:00:00Z", checks=checks)

    both = APART * math.sqrt(told * told + check * check)
    for kind in (SetupKind.NORTH, SetupKind.STICK_UP):
        for off, contradicts in ((0.999 * both, False), (1.001 * both, True), (-1.001 * both, True)):
            book = SetupBook(GroundConfig(folder=tmp_path))
            first, second = value(1, kind, 0.4, told), value(2, kind, 0.4 + off, check, checks=True)
            book.add([first, second])
            assert least_slip(first, second) == pytest.approx(both, rel=1e-12)
            assert bool(say_contradiction(book, kind)) == contradicts
            assert counted_std(book, first) == max(told, check)
