"""Small rooms of a process's link, by hand: each bound at its value, each order, each way twice."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import pytest

from telemetry.application.arguments import check_arguments
from telemetry.application.commands import find_command
from telemetry.application.depth_source import DepthSource
from telemetry.application.order_answers import Answers
from telemetry.application.place import StringPlace
from telemetry.application.seal_watch import SealWatch, refusal_of
from telemetry.application.series import SequenceCounter
from telemetry.application.standstill import Standstill, is_undated
from telemetry.errors import CommandError, MediumError
from telemetry.frozen import replace
from telemetry.media.memory import MemoryMedium, joined_ports
from telemetry.media.port import PortFrame, Priority, TubeEnd
from telemetry.messages import (
    BASE,
    ENCODER,
    EPOCH_UNKNOWN,
    HOPS_UNKNOWN,
    MAX_TUBE,
    Hello,
    NodeFlag,
    NodeMode,
    NodeState,
    Severity,
    Side,
    Stand,
)
from telemetry.quantities import MAX_STANDS
from telemetry.runtime.joint_watch import JointFault, JointWatch
from telemetry.runtime.own_clock import AbsenceWatch, Schedule
from telemetry.runtime.steady_time import SteadyTime

STATE = NodeState(
    1, 1000.0, 1, NodeMode.TRACKING, 1.0, 1e-6, 1e-6, (0.0, 0.0, 0.0), 0.0, 0.0, 1e-6, 0.1, 1e-8, NodeFlag.NONE, 5, 0
)


# what is old


def test_a_process_stood_still_where_it_saw_nothing_for_more_than_two_seconds() -> None:
    still = Standstill()
    for at in (100.0, 101.0, 103.0):
        still.move(at)
        assert not still.may_have_waited(at)
    still.move(105.001)
    assert [still.may_have_waited(at) for at in (105.001, 106.001, 106.002)] == [True, True, False]
    still.move(105.5)  # it goes on, and what waited comes meanwhile
    assert [still.may_have_waited(at) for at in (106.001, 106.002)] == [True, False]
    still.move(109.0)
    assert [still.may_have_waited(at) for at in (110.0, 110.001)] == [True, False]


def test_a_state_without_an_epoch_or_a_clock_is_undated_and_nothing_else_is() -> None:
    for epoch, flags, undated in (
        (3, NodeFlag.NONE, False), (EPOCH_UNKNOWN, NodeFlag.NONE, True), (3, NodeFlag.CLOCK_UNSYNCHRONISED, True),
        (3, NodeFlag.DRIVE_UNTOLD, False),
    ):  # fmt: skip
        assert is_undated(replace(STATE, epoch=epoch, flags=flags)) == undated
    assert not is_undated(hello(3, 1))


def test_a_clock_that_steps_back_by_more_than_a_second_goes_on_from_where_it_was() -> None:
    steady = SteadyTime()
    shown = [(100.0, 100.0), (99.0, 99.0), (98.999, 100.0), (99.999, 101.0), (90.0, 101.0), (91.0, 102.0)]
    for clock, time in shown:
        assert steady.follow(clock) == pytest.approx(time)
    assert steady.back == pytest.approx(1.001 + 9.999)
    assert steady.shown_at(102.0) == pytest.approx(91.0)


# the depth that is sent


def test_a_stand_is_two_alike_and_goes_on_while_they_stay_alike() -> None:
    source = DepthSource(7)
    told = [source.measure(at, md, 4) for at, md in ((1.0, 2.0), (2.0, 2.0), (3.0, 2.0), (4.0, 2.5), (5.0, 2.5))]
    assert [one.sequence for one in told] == [7, 8, 9, 10, 11]
    first, second = Stand(4, 1.0, 3.0, 2.0), Stand(4, 4.0, 5.0, 2.5)
    assert [one.stands for one in told] == [(), (Stand(4, 1.0, 2.0, 2.0),), (first,), (first,), (first, second)]
    assert source.measure(5.0, 2.5, 4).stands == (first, second)
    # back at a depth it had is another stand; another epoch begins one of its own, and keeps those of before
    for at, md in ((6.0, 2.0), (7.0, 2.0)):
        told = [source.measure(at, md, 4)]
    assert told[0].stands == (first, second, Stand(4, 6.0, 7.0, 2.0))
    assert source.measure(1.0, 2.0, 5).stands[-1] == Stand(4, 6.0, 7.0, 2.0)
    assert source.measure(2.0, 2.0, 5).stands[-1] == Stand(5, 1.0, 2.0, 2.0)
    assert source.measure(1.9, 2.0, 5).stands == ()  # rig time has begun anew
    assert source.measure(2.1, 2.0, 5).stands == (Stand(5, 1.9, 2.1, 2.0),)


def test_a_bit_that_was_away_for_one_reading_stands_anew() -> None:
    source = DepthSource()
    told = [source.measure(at, md, 4) for at, md in ((1.0, 2.0), (2.0, 2.0), (3.0, 2.5), (4.0, 2.0), (5.0, 2.0))]
    assert told[-1].stands == (Stand(4, 1.0, 2.0, 2.0), Stand(4, 4.0, 5.0, 2.0))


def test_the_newest_stands_are_sent() -> None:
    source, sent = DepthSource(), None
    for k in range(MAX_STANDS + 2):
        for at in (2.0 * k, 2.0 * k + 1.0):
            sent = source.measure(at, 0.1 * k, 4)
    assert sent is not None
    assert [stand.begun_at for stand in sent.stands] == [2.0 * k for k in range(2, MAX_STANDS + 2)]


# numbers, answers and seals


def test_numbers_of_a_start_lie_above_those_of_the_starts_before() -> None:
    for begun_at, base in ((0, 0), (3, 3 * 2**24)):
        counter = SequenceCounter(begun_at)
        assert counter.newest == 0
        for number in (base + 1, base + 2):
            assert (counter.following, counter.take(), counter.newest) == (number, number, number)


def test_of_sixty_four_answers_the_oldest_makes_room_and_of_a_session_no_older_order_is_obeyed() -> None:
    answers = Answers()
    for number in range(1, 65):
        answers.keep(number, b"%d" % number)
    assert (answers.too_old, 1 in answers, answers.payload(1)) == (0, True, b"1")
    answers.keep(70, b"70")
    assert (answers.too_old, 1 in answers, 2 in answers) == (1, False, True)
    answers.keep(69, b"69")
    assert (answers.too_old, 2 in answers, 3 in answers) == (2, False, True)
    assert answers.contents()[0] == (3, b"3")
    assert answers.contents()[-2:] == [(70, b"70"), (69, b"69")]
    answers.begin_session()
    assert (answers.too_old, 3 in answers) == (0, True)
    for number in range(1, 65):
        answers.keep(number, b"new")
    assert (answers.too_old, answers.payload(64)) == (0, b"new")
    again = Answers()
    again.restore([(4, b"4"), (9, b"9")])
    assert (again.contents(), again.too_old) == ([(4, b"4"), (9, b"9")], 0)


def test_refused_seals_are_told_once_a_minute_with_all_of_them_and_what_most_were() -> None:
    failures: dict[str, int] = {}
    seals: Any = type("Seals", (), {"failures": lambda self: dict(failures)})()
    endpoint: Any = type("Endpoint", (), {"seals": seals})()
    said: list[Any] = []
    watch = SealWatch(endpoint, lambda *words: said.append(words))
    watch.look(10.0)
    assert said == []
    for now, more, told in (
        (10.0, {"seal_forged": 3, "seal_old": 2}, (5, "forged")), (69.999, {"seal_old": 9}, None),
        (70.0, {"seal_old": 9}, (12, "old")), (200.0, {}, None), (200.5, {"seal_forged": 4}, (13, "forged")),
    ):  # fmt: skip
        failures |= more
        said.clear()
        for _ in range(2):  # what was told is no news
            watch.look(now)
        arguments = {} if told is None else {"refused": told[0], "mostly": told[1]}
        assert said == ([] if told is None else [(Severity.WARNING, "seal_refused", arguments)])
    assert refusal_of({"refused": 5, "mostly": "forged"}) == "5 refused, mostly forged"


# places


def hello(tube: int, hops: int) -> Hello:
    return Hello(tube, 3, hops, NodeMode.STILL, 1.0)


def test_a_tube_is_one_farther_than_the_one_above_and_what_hangs_between() -> None:
    counters: Counter[str] = Counter()
    place = StringPlace(4, 3, counters)
    assert (place.hops, place.told_hops) == (HOPS_UNKNOWN, HOPS_UNKNOWN)
    assert not place.meet(Side.LOWER, hello(3, 7), None, 1.0, 5.0)
    assert not place.meet(Side.UPPER, hello(5, HOPS_UNKNOWN), 5, 1.0, 5.0)
    assert place.told_hops == HOPS_UNKNOWN
    for above, hops, moves, expected in ((5, 1, True, 2), (5, 1, False, 2), (7, 1, True, 4), (6, 2, False, 4)):
        assert place.meet(Side.UPPER, hello(above, hops), above, 0.5, 6.0) == moves
        assert (place.hops, place.told_hops) == (expected, expected)
    upper = place.neighbours[Side.UPPER]
    assert upper is not None
    assert (upper.tube, upper.hops, upper.link_quality, upper.last_heard, upper.boot_count) == (6, 2, 0.5, 6.0, 3)
    assert place.meet(Side.UPPER, hello(5, MAX_TUBE - 1), 5, 1.0, 7.0)
    assert place.hops == MAX_TUBE
    assert not place.meet(Side.UPPER, hello(5, MAX_TUBE), 5, 1.0, 7.0)
    assert (place.hops, counters) == (MAX_TUBE, {"impossible_hops": 1})


def test_who_can_be_heard_lies_within_reach_on_the_right_side() -> None:
    place = StringPlace(4, 2, Counter())
    place.hops = 2
    upper = [place.distance(Side.UPPER, other) for other in (3, 4, 5, 6, 7, ENCODER)]
    assert upper == [math.inf, math.inf, 1.0, 2.0, math.inf, 2.5]
    assert [place.distance(Side.LOWER, other) for other in (5, 4, 3, 2, 1)] == [math.inf, math.inf, 1.0, 2.0, math.inf]
    place.hops = 3
    assert place.distance(Side.UPPER, ENCODER) == math.inf
    top = StringPlace(ENCODER, 2, Counter())
    assert (top.hops, top.told_hops) == (0, 0)
    assert [top.distance(Side.LOWER, other) for other in (0, 1, MAX_TUBE, MAX_TUBE + 1)] == [
        math.inf, MAX_TUBE, 1.0, math.inf
    ]  # fmt: skip
    near = {who: StringPlace(who, 2, Counter()) for who in (BASE, ENCODER, 4)}
    asked = [(BASE, Side.LOWER), (ENCODER, Side.UPPER), (ENCODER, Side.LOWER), (4, Side.UPPER)]
    assert [near[who].nearest(side) is None for who, side in asked] == [True, True, False, False]
    assert StringPlace(4, 1, Counter()).nearest(Side.UPPER) is None
    assert [place.skipped(upper) for upper in (None, 5, 6)] == [0, 0, 1]
    assert (top.skipped(3), StringPlace(4, 1, Counter()).skipped(5)) == (0, 0)


# joints and clocks


def test_a_fault_of_a_joint_is_told_when_it_has_grown_and_a_minute_has_passed() -> None:
    ports: Any = {side: type("Port", (), {"counters": Counter()})() for side in Side}
    watch = JointWatch()
    assert watch.find(ports, 5.0) == []
    ports[Side.UPPER].counters.update(bus_off=2, dropped=9)
    found = watch.find(ports, 5.0)
    assert found == [JointFault(Side.UPPER, "bus_off", 2)]
    assert found[0].arguments == {"side": "upper", "fault": "bus_off", "count": 2}
    assert found[0].line == "upper end: bus_off (2): the controller left the bus after too many errors and joins again"
    ports[Side.LOWER].counters["bus_off"] = 1
    assert watch.find(ports, 5.0) == [JointFault(Side.LOWER, "bus_off", 1)]
    ports[Side.UPPER].counters["bus_off"] = 3
    assert watch.find(ports, 64.999) == []
    assert watch.find(ports, 65.0) == [JointFault(Side.UPPER, "bus_off", 3)]
    assert watch.find(ports, 999.0) == []


def test_an_end_is_missed_after_its_limit_and_once_until_it_is_heard() -> None:
    watch = AbsenceWatch((Side.UPPER, Side.LOWER), 100.0)
    silent: dict[Side, object] = {Side.UPPER: None}
    assert watch.find(silent, 159.999) == []
    assert watch.find({Side.UPPER: "heard"}, 160.0) == [Side.LOWER]
    assert watch.find(silent, 219.999) == []
    assert watch.find(silent, 220.0) == [Side.UPPER]
    assert watch.find(silent, 300.0) == []
    assert watch.find({Side.LOWER: "heard", Side.UPPER: None}, 301.0) == []
    assert watch.find(silent, 361.0) == [Side.LOWER]


def test_deadlines_are_a_grid_and_those_that_passed_are_left_out() -> None:
    schedule = Schedule(10.0, 2.0)
    assert (schedule.due, schedule.halfway) == (12.0, 11.0)
    assert schedule.finish(12.5) == 0
    assert (schedule.due, schedule.halfway) == (14.0, 13.0)
    assert schedule.finish(13.0) == 0  # it ended before its deadline: the next one is the next
    assert schedule.due == 16.0
    assert schedule.finish(18.0) == 1  # at exactly a deadline that one has passed
    assert schedule.due == 20.0
    assert schedule.finish(25.9) == 2
    assert schedule.due == 26.0


# ports


def test_frames_without_a_delay_arrive_at_once_and_others_in_the_order_of_their_times() -> None:
    upper, lower = joined_ports(latency=0.0)
    came: list[bytes] = []
    upper.send(PortFrame(b"early", Priority.SURVEY))
    upper.send(PortFrame(b"time", Priority.TIME))
    assert not upper.is_up
    lower.listen(came.append)
    assert (upper.is_up, lower.is_up) == (True, False)
    assert came == []
    upper.flush()
    assert came == [b"early"]
    assert upper.counters == {"outdated": 1}
    upper.send(PortFrame(b"now", Priority.SURVEY))
    assert came == [b"early", b"now"]
    upper.latency = 0.25
    upper.advance(10.0)
    for payload in (b"a", b"b"):
        upper.send(PortFrame(payload, Priority.SURVEY))
    lower.advance(10.249)
    assert came == [b"early", b"now"]
    lower.advance(10.25)
    assert came == [b"early", b"now", b"a", b"b"]
    lower.is_open = True
    assert not upper.is_up
    lower.is_open, upper.is_open = False, True
    assert not upper.is_up
    upper.close()
    with pytest.raises(MediumError, match=r"^port in memory: it is closed$"):
        upper.send(PortFrame(b"late", Priority.SURVEY))


def test_ends_of_one_rig_that_face_each_other_are_joined_and_an_end_is_taken_once() -> None:
    medium = MemoryMedium()
    low, high = TubeEnd("r", 3, Side.UPPER, 4), TubeEnd("r", 4, Side.LOWER, 3)
    one, strange = medium.open_port(low), medium.open_port(TubeEnd("other", 4, Side.LOWER, 3))
    assert [one.other, strange.other] == [None, None]
    other = medium.open_port(high)
    assert other.other is one
    assert [port.other for port in (one, strange)] == [other, None]
    with pytest.raises(MediumError, match=r"the upper end of 3 is taken"):
        medium.open_port(low)
    one.close()
    again = medium.open_port(low)
    assert (again.other, other.other) == (other, again)


# orders and flags


@pytest.mark.parametrize(
    ("name", "action", "given", "found"),
    [
        ("static_record", "", {"seconds": 5.0}, {"seconds": 5.0}), ("static_record", "", {"seconds": 4.999}, None),
        ("static_record", "", {"seconds": 3600.0}, {"seconds": 3600.0}), ("static_record", "", {"seconds": True}, None),
        ("resend", "", {"first": 1, "last": 2}, {"first": 1, "last": 2}),
        ("resend", "", {"first": 1.5, "last": 2}, None),
        ("resend", "", {"first": 1}, None), ("take_survey", "", {"seconds": 5.0}, None), ("take_survey", "", {}, {}),
    ],
)  # fmt: skip
def test_arguments_of_an_order_are_those_of_the_table_in_their_ranges(
    name: str, action: str, given: dict[str, Any], found: dict[str, Any] | None
) -> None:
    spec = find_command(name, action)
    if found is None:
        with pytest.raises(CommandError):
            check_arguments(spec, given)
    else:
        assert check_arguments(spec, given) == found


def test_each_flag_of_a_node_is_a_bit_of_its_own() -> None:
    flags = {name: int(flag) for name, flag in NodeFlag.__members__.items() if name != "NONE"}
    assert [value.bit_length() - 1 for value in flags.values()] == list(range(len(flags)))
    assert all(value.bit_count() == 1 for value in flags.values())
    assert int(NodeFlag.NONE) == 0
