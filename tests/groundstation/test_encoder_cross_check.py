"""Which contradictions of gyroscope and encoder speak against the encoder."""

import math
from collections.abc import Collection
from itertools import permutations

import pytest

from groundstation.service.alarms.encoder_cross_check import EncoderCrossCheck
from telemetry.application.series import SERIES_SHIFT
from telemetry.messages import Event, Scalar, Severity


def event(tube: int, at: float, code: str, number: int = 10, epoch: int = 1, **arguments: Scalar) -> Event:
    return Event(tube, number, at, Severity.WARNING, code, arguments, epoch)


BOTH_STARTED = [event(1, 0.0, "restored", 1), event(2, 0.0, "restored", 1)]


def told(events: list[Event], heard: Collection[int] = (1, 2)) -> list[str]:
    check = EncoderCrossCheck()
    return [said for one in events if (said := check.on_event(one, heard))]


def test_two_settled_tubes_that_contradict_the_encoder_are_told_once() -> None:
    assert told([*BOTH_STARTED, event(1, 100.0, "yaw_reset"), event(2, 101.0, "yaw_reset")]) == ["tubes 1, 2 at 100 s"]


def test_a_counter_that_one_tube_sees_stand_and_another_takes_for_its_own_step_is_told() -> None:
    stands, step = event(1, 100.0, "encoder_stands"), event(2, 101.0, "gyro_step")
    assert told([*BOTH_STARTED, stands, step]) == ["tubes 1, 2 at 100 s"]


@pytest.mark.parametrize("code", ["yaw_reset", "gyro_step", "gyro_scale", "encoder_stands"])
def test_a_gyroscope_that_stands_alone_against_the_encoder_and_another_tube_is_wrong_itself(code: str) -> None:
    assert told([*BOTH_STARTED, event(1, 100.0, code)]) == []


@pytest.mark.parametrize(
    "blind",
    [
        event(2, 91.0, "booted", 9),
        event(2, 99.0, "restored", 9),
        event(2, 103.0, "restored", 9),
        event(2, 60.0, "overrun", 9, missed=100),
        event(2, 60.0, "bad_sample", 9),
        event(2, 99.0, "gyro_stuck", 9),
    ],
    ids=str,
)
def test_a_tube_that_has_not_watched_is_no_witness_for_the_encoder_in_whatever_order_they_say_so(blind: Event) -> None:
    for events in permutations([blind, event(1, 100.0, "yaw_reset")]):
        assert told([*BOTH_STARTED, *events, event(2, 140.0, "stopped", 12)]) == ["tubes 1 at 100 s"]


@pytest.mark.parametrize(
    ("rejected_at", "said"),
    [(84.0, ["tubes 1 at 100 s"]), (95.0, []), (10.0, [])],
    ids=["before it listened", "since it listens", "an outlier of long ago"],
)
def test_who_began_to_listen_after_a_contradiction_had_begun_is_no_witness(rejected_at: float, said: list[str]) -> None:
    """The joints lost most frames after a slip, so that the reset came late; the other had started meanwhile."""
    began, reset = event(1, rejected_at, "aiding_rejected", 9), event(1, 100.0, "yaw_reset")
    assert told([*BOTH_STARTED, began, event(2, 82.0, "restored", 9), reset]) == said


def test_a_time_without_a_gyroscope_is_known_by_its_end_where_its_begin_went_with_the_database() -> None:
    recovered = event(2, 103.0, "sensor_recovered", 11, after="gyro_saturated", cycles=44)
    for events in permutations([recovered, event(1, 100.0, "yaw_reset")]):
        assert told([*BOTH_STARTED, *events]) == ["tubes 1 at 100 s"]
    short = event(2, 60.0, "sensor_recovered", 11, after="gyro_saturated", cycles=44)
    assert told([*BOTH_STARTED, short, event(1, 100.0, "yaw_reset")]) == []


def test_a_tube_that_has_just_started_is_enough_where_the_other_has_no_gyroscope() -> None:
    """What it saved says another thing, and no tube is left that could say that it is its own."""
    blind, against = event(2, 7.5, "gyro_saturated", 9), event(1, 9.0, "yaw_reset")
    for events in permutations([blind, against]):
        assert told([*BOTH_STARTED, *events, event(2, 40.0, "stopped", 12)]) == ["tubes 1 at 9 s"]
    assert told([*BOTH_STARTED, against, event(2, 40.0, "stopped", 12)]) == []


def test_a_tube_whose_clock_is_gone_contradicts_when_it_began_to() -> None:
    """A forged answer about the time left it without an epoch before its yaw was reset."""
    undated = event(2, 2.9e8, "yaw_reset", 12, epoch=0)
    began = [event(tube, 100.0, "aiding_rejected") for tube in (1, 2)]
    assert told([*BOTH_STARTED, *began, undated, event(1, 102.0, "yaw_reset", 12)]) == ["tubes 1, 2 at 100 s"]
    assert told([*BOTH_STARTED, undated, event(1, 102.0, "yaw_reset", 12)]) == []


@pytest.mark.parametrize(
    ("first_lost", "other", "said"),
    [
        (12, event(1, 120.0, "booted", 9), "tubes 2 at 100 s"),
        (20, event(1, 120.0, "booted", 9), ""),  # what came of it was known by then
        (12, event(1, 120.0, "stopped", 12), ""),  # the other has watched and seen nothing
    ],
)
def test_a_contradiction_whose_outcome_was_lost_with_the_database_counts(
    first_lost: int, other: Event, said: str
) -> None:
    check = EncoderCrossCheck()
    for one in (*BOTH_STARTED, event(2, 100.0, "aiding_rejected", 11), other, event(2, 121.0, "stopped", 14)):
        assert check.on_event(one, (1, 2)) == ""
    assert check.on_lost(2, (first_lost, 13), (1, 2), doubts=False) == said
    assert check.on_lost(2, (first_lost, 13), (1, 2), doubts=False) == ""


@pytest.mark.parametrize(
    ("doubts", "other", "said"),
    [
        (True, event(1, 120.0, "booted", 9), "tubes 2 at 121 s"),
        (False, event(1, 120.0, "booted", 9), ""),
        (True, event(1, 120.0, "stopped", 12), ""),  # the other has watched and seen nothing
    ],
)
def test_a_tube_that_doubts_its_yaw_contradicts_where_its_words_are_lost(doubts: bool, other: Event, said: str) -> None:
    check = EncoderCrossCheck()
    for one in (*BOTH_STARTED, event(2, 90.0, "stopped", 9), other, event(2, 121.0, "stopped", 14)):
        assert check.on_event(one, (1, 2)) == ""
    for _ in range(2):
        assert check.on_lost(2, (10, 13), (1, 2), doubts=doubts) == said
        said = ""


@pytest.mark.parametrize(("found_at", "said"), [(103.0, ["tubes 1 at 102 s"]), (120.0, [])])
def test_a_gyroscope_that_sticks_as_the_encoder_slips_was_no_witness_since_it_contradicted(
    found_at: float, said: list[str]
) -> None:
    """Both began to contradict at one time; what it would have made of the slip is unknown."""
    began = [event(1, 100.0, "aiding_rejected"), event(2, 100.0, "aiding_rejected")]
    events = [*began, event(1, 102.0, "yaw_reset", 11), event(2, found_at, "gyro_stuck", 11)]
    assert told([*BOTH_STARTED, *events, event(2, 140.0, "stopped", 12)]) == said


@pytest.mark.parametrize("cycles", ["many", -3, math.nan, math.inf, 1e300])
def test_a_recovery_that_says_nothing_sensible_of_its_length_does_no_harm(cycles: Scalar) -> None:
    recovered = event(2, 103.0, "sensor_recovered", 11, after="gyro_saturated", cycles=cycles)
    said = told([*BOTH_STARTED, recovered, event(1, 100.0, "yaw_reset"), event(2, 101.0, "yaw_reset")])
    assert said[-1] == "tubes 1, 2 at 100 s"


def test_what_a_tube_says_that_has_just_started_helps_nobody_against_one_that_watched() -> None:
    """The string may have turned while it was off; of three the one that says nothing has seen no slip."""
    events = [*BOTH_STARTED, event(3, 0.0, "restored", 1)]
    events += [event(2, 89.0, "restored", 9), event(2, 91.0, "yaw_reset"), event(1, 110.0, "yaw_reset")]
    assert told(events, (1, 2, 3)) == []
    assert told([*events, event(3, 111.0, "yaw_reset")], (1, 2, 3)) == ["tubes 1, 2, 3 at 91 s"]


def test_a_tube_that_has_settled_since_its_start_is_a_witness() -> None:
    assert told([*BOTH_STARTED, event(2, 89.0, "restored", 9), event(1, 100.0, "yaw_reset")]) == []


@pytest.mark.parametrize(
    "later",
    [
        [event(2, 150.0, "restored", 11)],
        [event(2, 150.0, "bad_sample", 11)],
        [event(2, 60.0, "bad_sample", 8), event(2, 70.0, "sensor_recovered", 9, after="bad_sample")],
    ],
    ids=["starts later", "is blind later", "saw again before"],
)
def test_a_tube_that_was_blind_at_another_time_is_a_witness(later: list[Event]) -> None:
    against = event(1, 100.0, "yaw_reset")
    for events in ([*later, against], [against, *later]):
        assert told([*BOTH_STARTED, *events]) == []


def test_a_scale_that_changed_is_the_gyroscopes_own_even_where_nobody_else_has_watched() -> None:
    assert told([*BOTH_STARTED, event(2, 99.0, "restored", 9), event(1, 100.0, "gyro_scale")]) == []


def test_tubes_that_find_their_first_yaw_contradict_nothing() -> None:
    assert told([event(1, 0.0, "booted", 1), event(1, 1.0, "yaw_reset")], heard=(1,)) == []


def test_every_saved_yaw_that_says_another_thing_than_the_encoder_is_told() -> None:
    resets = [event(1, 2.0, "yaw_reset"), event(2, 2.5, "yaw_reset")]
    assert told([*BOTH_STARTED, *resets]) == ["tubes 1, 2 at 2 s"]


def test_a_stranger_of_the_same_number_takes_no_witness_away() -> None:
    stranger = event(1, 95.0, "booted", 1)
    known = [event(1, 0.0, "restored", 5), event(2, 96.0, "restored", 5)]
    assert told([*known, stranger, event(1, 100.0, "yaw_reset", 8)]) == ["tubes 1 at 100 s"]
    assert told([*known, stranger, event(1, 100.0, "yaw_reset", 3)]) == []


SWAPPED = [
    event(2, 22.0, "restored", 12), event(2, 22.5, "reference_changed", 14),
    event(1, 23.0, "restored", 13), event(1, 23.1, "reference_changed", 14),
]  # fmt: skip


def test_where_all_start_upon_a_yaw_of_another_place_nobody_has_watched_the_encoder() -> None:
    said = ["no tube watched it before 23 s: what they had saved is of other places"]
    assert told(SWAPPED) == said
    assert told([*BOTH_STARTED, *SWAPPED]) == said
    assert told(SWAPPED, heard=(1, 2, 3)) == []  # tube 3 did
    ran_on = [event(1, 23.1, "reference_changed", 14), event(2, 23.1, "reference_changed", 14)]
    assert told([*BOTH_STARTED, *ran_on]) == []  # a tube was added above them


def test_a_stranger_that_has_just_started_does_not_hide_what_the_tube_of_its_number_saw() -> None:
    gone = event(1, 131.0, "restored", 13)
    stranger = [event(2, 114.2, "booted", 1), event(2, 114.2, "yaw_reset", 2)]
    began = [event(1, 0.0, "restored", 7), event(2, 0.0, "restored", 7)]
    assert told([*began, event(2, 114.1, "yaw_reset", 11), *stranger, gone]) == ["tubes 2 at 114 s"]
    # nor after the encoder has started again, when the last start of the tube is of another epoch
    later = [
        event(2, 14.0, "booted", 1, epoch=2), event(2, 16.0, "yaw_reset", 13, epoch=2),
        event(1, 20.0, "restored", 13, epoch=2),
    ]  # fmt: skip
    assert told([*began, event(2, 300.0, "stopped", 12), *later]) == ["tubes 2 at 16 s"]


def test_two_tubes_whose_contradiction_a_cut_of_power_has_ended_speak_against_the_encoder() -> None:
    rejections = [event(2, 117.9, "aiding_rejected", 10), event(1, 118.4, "aiding_rejected", 10)]
    starts = [event(2, 137.4, "restored", 13), event(1, 138.4, "restored", 14)]
    assert told([*BOTH_STARTED, *rejections, *starts]) == ["tubes 1, 2 at 118 s"]
    assert told([*BOTH_STARTED, *rejections, starts[0]]) == []  # the other one ran on, and took it for an outlier
    late = [event(2, 237.4, "restored", 13), event(1, 238.4, "restored", 14)]
    assert told([*BOTH_STARTED, *rejections, *late]) == []


def test_contradictions_of_two_times_are_not_added_up() -> None:
    late = event(2, 200.0, "yaw_reset")
    assert told([*BOTH_STARTED, event(1, 100.0, "yaw_reset"), late]) == []


@pytest.mark.parametrize(
    ("between", "second", "said"),
    [
        ([], 510.0, ["tubes 1, 2 at 100 s"]),
        ([], 540.0, []),
        ([event(1, 125.0, "stopped", 11)], 515.0, []),
        ([event(1, 900.0, "stopped", 11, epoch=2)], 510.0, []),
    ],
    ids=["at once", "long after the start", "long before the start", "an epoch between them"],
)
def test_contradictions_before_and_after_a_start_of_the_encoder_are_added_up(
    between: list[Event], second: float, said: list[str]
) -> None:
    """Rig time of the third epoch begins at 500 s, of which the one before knows nothing."""
    first = [*BOTH_STARTED, event(1, 100.0, "yaw_reset"), *between, event(1, 500.0, "stopped", 12, epoch=3)]
    assert told([*first, event(2, second, "yaw_reset", epoch=3)]) == said


VOID = [event(2, 22.0, "restored", 12, worth_h=0.0), event(1, 23.0, "restored", 13, worth_h=0.0)]


@pytest.mark.parametrize(
    ("events", "lately", "said"),
    [
        (VOID, (1, 2), "no tube watched it before 23 s: none has kept its yaw"),
        ([VOID[0], event(1, 23.0, "booted", (1 << SERIES_SHIFT) + 1)], (1, 2), "no tube watched it before 23 s: "),
        (VOID[:1], (2,), "no tube watched it before 22 s: "),  # the other one has been silent for long
        (VOID[:1], (1, 2), ""),
        ([VOID[0], event(1, 23.0, "restored", 13, worth_h=4.0)], (1, 2), ""),  # stood still when the power went
        ([VOID[0], event(1, 60.0, "restored", 13, worth_h=0.0)], (1, 2), ""),  # watched while the other was off
        ([event(2, 22.0, "booted", 1), event(1, 23.0, "booted", 1)], (1, 2), ""),  # for the first time
        (VOID, (1, 2, 3), ""),
        ([], (), ""),
    ],
)
def test_where_no_tube_has_kept_its_yaw_nobody_has_watched_the_encoder(
    events: list[Event], lately: Collection[int], said: str
) -> None:
    check = EncoderCrossCheck()
    for one in (event(1, 1.0, "restored", 1, worth_h=3.0), event(2, 1.0, "booted", 1), *events):
        assert check.on_event(one, lately) == ""
    assert check.look(1, 30.0, lately) == ""  # a tube that watched may be heard yet
    told = check.look(1, 80.0, lately)
    assert told.startswith(said)
    assert bool(told) == bool(said)
    assert check.look(1, 81.0, lately) == ""  # once


def test_tubes_without_a_yaw_are_told_at_once_where_rig_time_has_begun_anew() -> None:
    check = EncoderCrossCheck()
    for one in VOID:
        check.on_event(one, (1, 2))
    assert check.look(2, 3.0, (1, 2)).startswith("no tube watched")


@pytest.mark.parametrize(("start", "growth"), [("booted", 5.0), ("restored", 20.0)])
def test_what_an_event_costs_while_a_string_starts_grows_with_its_tubes_or_with_their_square(
    monkeypatch: pytest.MonkeyPatch, start: str, growth: float
) -> None:
    """Tubes that only booted cannot speak together; of those that had saved their yaw one more has yet to say."""
    compared = []
    is_beside = EncoderCrossCheck._is_beside
    monkeypatch.setattr(EncoderCrossCheck, "_is_beside", lambda *of: compared.append(1) or is_beside(*of))

    def comparisons_of_an_event(tubes: int) -> float:
        compared.clear()
        starts = [event(tube, 0.0, start, 1) for tube in range(tubes)]
        resets = [event(tube, 4.0 + 1e-3 * tube, "yaw_reset", 2) for tube in range(tubes)]
        assert told([*starts, *resets], range(tubes + 1)) == []
        return len(compared) / tubes

    assert comparisons_of_an_event(100) <= growth * max(comparisons_of_an_event(25), 1.0)
