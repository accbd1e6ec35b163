"""What the watch tells of a rig, word by word: each alarm held, raised and cleared, at its bound and beside it.

The string, hole and places that it looks at are plain values, so that every number that it prints is known; each look
is done twice, and once after what was wrong is over.
"""

import math
from types import SimpleNamespace
from typing import Any

import pytest
from watched_rig import Rig, event, state

from groundstation.service.hole.placement import UNTRUSTED
from telemetry.messages import EPOCH_UNKNOWN, NodeFlag, NodeMode


@pytest.fixture
def rig() -> Rig:
    return Rig()


def test_nothing_wrong_says_nothing_and_looks_twice_a_second(rig: Rig) -> None:
    assert rig.watch.is_due(0.0)
    assert rig.look(10.0) == []
    assert rig.alarms.told == []
    assert (rig.watch.is_due(10.499), rig.watch.is_due(10.5)) == (False, True)
    rig.watch.look(10.5)
    assert rig.alarms.told[0] == ("advance", "10.5", "100")
    assert rig.stops.judged == (4, 100.0)


def test_a_tube_that_is_silent_or_was_never_heard(rig: Rig) -> None:
    rig.stale, rig.ages[1] = {1, 2}, math.inf
    told = [
        ("hold", "tube_silent", "tube 1", "not heard since the ground station started"),
        ("hold", "tube_silent", "tube 2", "silent"),
    ]
    assert rig.look() == told
    assert rig.look() == told
    rig.stale = {1}
    assert rig.look() == [told[0], ("clear", "tube_silent", "tube 2")]


def test_two_tubes_of_one_number(rig: Rig) -> None:
    rig.doubled.untold = [2]
    told = (
        "hold", "same_number", "tube 2",
        "tube 3 from the top, shown as tube 1002, and tube 7 from the top; see the command same_number",
    )  # fmt: skip
    assert rig.look() == [told]
    assert rig.look() == [told]
    rig.doubled.untold = []
    assert rig.look() == [("clear", "same_number", "tube 2")]
    assert rig.look() == []


def test_what_a_node_says_of_itself(rig: Rig) -> None:
    rig.watch.on_state(state())
    assert rig.alarms.new() == []
    flags = NodeFlag.SENSOR_FAULT | NodeFlag.YAW_UNTRUSTED | NodeFlag.RATE_EXCEEDED | NodeFlag.NOT_SAVED
    rig.watch.on_state(state(flags=flags, epoch=3, numbered=8))
    assert rig.alarms.new() == [
        ("hold", "tube_sensor", "tube 2", "yaw_untrusted, rate_exceeded, sensor_fault"),
        ("hold", "tube_disk", "tube 2", "its disk refuses"),
        ("hold", "clock", "tube 2", "it counts from epoch 3, the encoder from 4"),
    ]
    rig.numbers.anew = {11}
    rig.watch.on_state(state(numbered=11))
    assert rig.alarms.new() == [
        ("clear", "tube_sensor", "tube 2"), ("clear", "tube_disk", "tube 2"), ("clear", "clock", "tube 2"),
        ("alert", "tube_counts_anew", "tube 2", "newest number 11"),
    ]  # fmt: skip
    rig.doubled.add(2)
    rig.watch.on_state(state(numbered=11))
    assert rig.alarms.new() == []


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"at": 100.5}, ""),
        ({"at": math.nextafter(100.5, 101.0)}, "its rig time is 0.5 s ahead"),
        ({"at": 103.25, "epoch": EPOCH_UNKNOWN}, "its rig time is 3.2 s ahead"),
        ({"at": 103.25, "flags": NodeFlag.CLOCK_UNSYNCHRONISED}, ""),
        (
            {"at": 103.25, "flags": NodeFlag.CLOCK_UNSYNCHRONISED, "epoch": 9},
            "it counts from epoch 9, the encoder from 4",
        ),
        ({"epoch": EPOCH_UNKNOWN}, ""),
    ],
)
def test_a_clock_that_is_ahead_or_of_another_epoch(rig: Rig, change: dict[str, Any], told: str) -> None:
    rig.watch.on_state(state(**change))
    assert rig.alarms.new() == ([("hold", "clock", "tube 2", told)] if told else [])


def test_yaws_are_compared_at_rest_and_trusted_alone(rig: Rig) -> None:
    rig.watch.on_state(state())
    rig.watch.on_state(state(mode=NodeMode.SURVEY, at=98.0))
    assert rig.yaws == [([1, 2], 2, 99.0, 1.5, 0.25), ([1, 2], 2, 98.0, 1.5, 0.25)]
    moving = next(mode for mode in NodeMode if mode not in (NodeMode.STILL, NodeMode.SURVEY))
    rig.watch.on_state(state(mode=moving))
    rig.watch.on_state(state(flags=NodeFlag.BIAS_UNKNOWN))
    assert (rig.moved, len(rig.yaws)) == ([2, 2], 2)
    rig.alarms.new()
    rig.change = SimpleNamespace(by=math.radians(-12.34), pair=(2, 1))
    rig.watch.on_state(state())
    told = "the yaws part by -12.3 deg at 99 s; see the command accept_joints"
    assert rig.alarms.new() == [("alert", "joint", "joint of tubes 2 and 1", told)]


def test_what_the_adjustment_blames_stands_until_it_does_not(rig: Rig) -> None:
    rig.hole.examined.by_subject = {"tube 1": ["a", "b"], "north": ["c"]}
    held = [("hold", "blunder", "tube 1", "a; b"), ("hold", "blunder", "north", "c")]
    assert rig.look() == held
    rig.hole.examined.by_subject = {"north": ["c"]}
    assert rig.look() == [("clear", "blunder", "tube 1"), held[1]]
    rig.hole.is_unsolved = True
    (cleared, unsolved) = rig.look()
    assert (cleared, unsolved[:3]) == (("clear", "blunder", "north"), ("hold", "blunder", "hole"))
    rig.hole.is_adjusted = False
    assert rig.look() == [("clear", "blunder", "hole")]


def test_events_of_a_start_a_disk_a_queue_seals_and_marks(rig: Rig) -> None:
    later = 1 << 40
    for said, told in (
        (event("restored"), ("tube_restarted", "tube 3", "restored")),
        (event("booted", sequence=5), None),
        (event("booted", tube=0, sequence=later), ("tube_restarted", "encoder", "booted")),
        (
            event("saved_state_lost", detail="x" * 300),
            ("tube_restarted", "tube 3", "saved_state_lost: " + "x" * (200 - len("saved_state_lost: "))),
        ),
        (event("boot_counter_lost"), ("tube_restarted", "tube 3", "boot_counter_lost: ")),
        (event("parameters_fallback", detail="d"), ("tube_restarted", "tube 3", "parameters_fallback: d")),
        (event("queue_full", dropped=9), ("tube_queue", "tube 3", "9 dropped")),
        (
            event("joint_contradicts_marks", angle_deg=12.34, marks_deg=-5),
            (
                "joint", "joint above tube 3",
                "its angle by the yaws is 12.3 deg, by its marks -5.0 deg; see the command accept_joints",
            ),
        ),
        (
            event("joint_contradicts_marks", angle_deg="x"),
            (
                "joint", "joint above tube 3",
                "its angle by the yaws is nan deg, by its marks nan deg; see the command accept_joints",
            ),
        ),
        (event("anything"), None),
    ):  # fmt: skip
        rig.watch.on_event(said)
        assert rig.alarms.new() == ([("alert", *told)] if told else [])
    rig.watch.on_event(event("seal_refused", refused=7, mostly="old"))
    ((_, kind, subject, detail),) = rig.alarms.new()
    assert (kind, subject) == ("seal_refused", "tube 3")
    assert "7" in detail
    assert "old" in detail


def test_what_a_measurement_was_not_used_for(rig: Rig) -> None:
    said = SimpleNamespace(tube=2, sequence=17, station_at=45.67, flags=NodeFlag.YAW_UNTRUSTED | NodeFlag.RESTORED)
    rig.watch.on_measurement(said, UNTRUSTED)  # type: ignore[arg-type]
    told = ("alert", UNTRUSTED, "tube 2", "number 17 at 45.7 s: yaw_untrusted, restored")
    assert rig.alarms.new() == [told]
    plain = SimpleNamespace(tube=2, sequence=18, station_at=50.0, flags=NodeFlag.NONE)
    rig.untrusted = {2}
    rig.watch.on_measurement(plain, "")  # type: ignore[arg-type]
    assert rig.alarms.new() == []
    rig.untrusted = set()
    rig.watch.on_measurement(SimpleNamespace(**vars(plain) | {"tube": 1}), "")  # type: ignore[arg-type]
    assert rig.alarms.new() == []
    rig.watch.on_measurement(plain, "")  # type: ignore[arg-type]
    assert rig.alarms.new() == [("clear", UNTRUSTED, "tube 2")]
    rig.watch.on_measurement(plain, "survey_set_aside")  # type: ignore[arg-type]
    assert rig.alarms.new() == [("alert", "survey_set_aside", "tube 2", "number 18 at 50.0 s")]
    rig.watch.on_epoch(6)
    assert rig.alarms.new() == [("alert", "epoch", "encoder", "epoch 6")]


def test_a_gap_is_asked_for_three_times_and_given_up(rig: Rig) -> None:
    ask, new = rig.watch.gaps_to_ask, rig.alarms.new
    rig.numbers.gaps = {2: (7, 9)}
    assert ask(1000.0) == []
    assert ask(1029.9) == []
    assert new() == []
    held = ("hold", "numbers_missing", "tube 2", "numbers 7 to 9")
    assert ask(1030.0) == [(2, (7, 9))]
    assert new() == [held]
    assert ask(1149.9) == []
    assert ask(1150.0) == [(2, (7, 9))]
    rig.stale = {2}
    assert ask(1270.0) == []  # it cannot hear an order
    rig.stale = set()
    assert ask(1270.1) == [(2, (7, 9))]
    new()
    assert ask(1390.0) == []
    assert rig.numbers.given_up == []
    assert ask(1390.1) == []
    assert rig.numbers.given_up == [(2, (7, 9))]
    assert new()[-1] == ("alert", "numbers_lost", "tube 2", "numbers 7 to 9, which were events")
    rig.numbers.gaps = {}
    ask(1400.0)
    assert new() == [("clear", "numbers_missing", "tube 2")]


def test_what_was_sent_again_comes_within_ten_seconds_and_what_is_gone_is_given_up(rig: Rig) -> None:
    ask, resent = rig.watch.gaps_to_ask, rig.watch.on_resent
    rig.numbers.gaps = {2: (7, 9)}
    ask(1000.0)
    assert ask(1030.0)
    resent(2, 8, 5, 20, 1031.0)  # of another range
    resent(2, 7, 2, 9, 1031.0)
    assert ask(1040.9) == []
    assert ask(1041.0) == [(2, (7, 9))]
    resent(2, 7, 0, 9, 1042.0)
    rig.alarms.new()
    assert ask(1042.0) == []
    told = "numbers 7 to 9; surveys may be among those before 9"
    assert rig.alarms.new()[-1] == ("alert", "numbers_lost", "tube 2", told)
    assert rig.numbers.given_up == [(2, (7, 9))]
    # the next range was given out when the one before was found, so it is missing for as long; a later one is not
    rig.numbers.gaps = {2: (12, 200)}
    assert ask(1043.0) == [(2, (12, 200))]
    rig.numbers.gaps = {2: (150, 201)}
    assert ask(1044.0) == []
    assert ask(1073.9) == []
    assert ask(1074.0) == [(2, (150, 201))]
    rig.doubled.add(2)
    assert ask(2000.0) == []


def test_a_belt_that_slips_says_by_how_much_and_which_way(rig: Rig) -> None:
    def scales(*found: float) -> None:
        rig.string.tubes = list(range(1, len(found) + 1))
        rig.ages.update(dict.fromkeys(rig.string.tubes, 0.5))
        rig.states.newest = {tube: state(scale_factor=one) for tube, one in enumerate(found, 1)}

    scales(0.02, 0.02, 0.02, 0.02, 0.02, 0.02)
    assert rig.look() == [("hold", "belt", "encoder", "it turns 2.00 % less than 6 gyroscopes say")]
    scales(-0.03, -0.03, -0.03, -0.03, -0.03)
    assert rig.look() == [("hold", "belt", "encoder", "it turns 3.00 % more than 5 gyroscopes say")]
    scales(0.0, 0.0, 0.0, 0.0)
    assert rig.look() == [("clear", "belt", "encoder")]
