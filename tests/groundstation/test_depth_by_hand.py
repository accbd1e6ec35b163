"""The depth of the bit by hand: each bound of what is believed met exactly and passed by a hair, each way twice."""

from __future__ import annotations

import math

import pytest

from groundstation.service.string import depth as room
from groundstation.service.string.depth import CONTRADICTION, DOUBTFUL, DepthDoubt, DepthLog, Track
from telemetry.messages import EPOCH_UNKNOWN, DepthReading, Stand

RATE, GAP, DEEPEST = 0.5, 5.0, 50.0


class Heard:
    """A log, and readings numbered on that are heard the moment they are made."""

    def __init__(self) -> None:
        self.log, self.sequence = DepthLog(RATE, GAP), 0

    def hear(self, at: float, md: float, epoch: int = 1, *, own: float | None = None) -> str:
        self.sequence += 1
        reading = DepthReading(self.sequence, at, md, (), epoch)
        return self.log.on_reading(reading, epoch, at, at if own is None else own, DEEPEST)


def track_of(*readings: tuple[float, float], gap: float = 1.0) -> tuple[Track, list[bool]]:
    track = Track(gap)
    return track, [track.append_reading(at, md) for at, md in readings]


# readings of an epoch


def test_a_depth_between_two_readings_lies_on_the_line_between_them_where_they_are_close() -> None:
    track, _ = track_of((10.0, 2.0), (11.0, 2.4), (12.001, 3.0), (12.501, 2.0))
    assert [track.depth_at(t) for t in (9.999, 10.0, 10.25)] == [None, 2.0, pytest.approx(2.1)]
    assert [track.depth_at(t) for t in (11.5, 12.002)] == [None, pytest.approx(2.998)]
    assert [track.depth_at(t) for t in (12.376, 12.501, 12.502)] == [pytest.approx(2.25), 2.0, None]
    assert Track(1.0).depth_at(0.0) is None


def test_readings_at_rest_count_as_two_while_they_come_within_the_gap() -> None:
    track, rested = track_of((0.0, 2.0), (1.0, 2.0), (2.0, 2.0), (3.0, 2.0), (4.001, 2.0))
    assert (list(track.at), list(track.run)) == ([0.0, 3.0, 4.001], [False, True, False])
    assert rested == [False] * 5  # it has not been elsewhere
    assert [track.depth_at(t) for t in (0.5, 2.5, 3.5, 4.001)] == [2.0, 2.0, None, 2.0]
    apart, _ = track_of((0.0, 2.0), (1.5, 2.0), (2.0, 2.0))
    assert list(apart.at) == [0.0, 1.5, 2.0]
    assert [apart.depth_at(t) for t in (1.0, 1.75)] == [None, 2.0]
    apart.append_reading(3.001, 2.0)  # close before and not after
    assert [apart.depth_at(t) for t in (1.75, 2.5)] == [2.0, None]


def test_a_bit_comes_to_rest_where_two_readings_are_equal_and_the_one_before_is_not() -> None:
    _, rested = track_of((0.0, 1.0), (0.5, 2.0), (1.0, 2.0), (1.5, 2.0), (2.0, 1.0), (2.5, 2.0), (3.0, 2.0))
    assert rested == [False, False, True, False, False, False, True]


def test_of_too_many_readings_the_older_half_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(room, "LIMIT", 4)
    track, _ = track_of((0.0, 0.0), (1.0, 0.1), (2.0, 0.2), (3.0, 0.3))
    assert len(track.at) == 4
    track.append_reading(4.0, 0.4)
    assert (list(track.at), list(track.md), list(track.run)) == ([2.0, 3.0, 4.0], [0.2, 0.3, 0.4], [False] * 3)


def test_the_readings_of_the_newest_eight_epochs_are_kept() -> None:
    heard = Heard()
    for epoch in range(1, 10):
        for at in (10.0, 11.0):
            assert heard.hear(at, 2.0, epoch, own=100.0 * epoch + at) == ""
    assert [heard.log.at(epoch, 10.5) for epoch in range(1, 11)] == [None, *[2.0] * 8, None]


# what the stream may not say


@pytest.mark.parametrize(
    ("at", "md", "epoch", "reason"),
    [
        (102.0, 7.0, 1, ""), (102.001, 7.0, 1, "ahead of rig time"), (70.0, 7.0, 1, ""),
        (69.999, 7.0, 1, "behind rig time"), (100.0, 50.0, 1, ""), (100.0, 50.001, 1, "deeper than the string reaches"),
        (100.0, 7.0, 2, "of another epoch of rig time"), (100.0, 7.0, EPOCH_UNKNOWN, ""),
    ],
)  # fmt: skip
def test_a_reading_is_of_now_of_this_epoch_and_within_the_string(at: float, md: float, epoch: int, reason: str) -> None:
    log = DepthLog(RATE, GAP)
    assert log.on_reading(DepthReading(1, at, md, (), epoch), 1, 100.0, 900.0, DEEPEST) == reason
    assert log.latest == (None if reason else md)
    assert dict(log.refusals) == ({reason: 1} if reason else {})
    assert log.jumped == ""


def test_a_refused_reading_is_no_measure_of_the_next_and_yet_is_counted_as_come() -> None:
    heard = Heard()
    for at, md, reason in (
        (100.0, 10.0, ""), (101.0, 60.0, "deeper than the string reaches"), (102.0, 10.5, ""),
        (102.0, 10.5, "repeated"), (101.5, 10.5, "repeated"), (103.0, 11.0, ""),
    ):  # fmt: skip
        assert heard.hear(at, md) == reason
    assert heard.log.latest == 11.0
    assert heard.log.refusals == {"deeper than the string reaches": 1, "repeated": 2}
    assert heard.log.lost == 2  # a repeated one keeps no number from the next


def test_numbers_that_are_left_out_are_lost_and_a_source_that_counts_anew_has_lost_none() -> None:
    log = DepthLog(RATE, GAP)
    for at, (number, lost) in enumerate(((4, 0), (5, 0), (8, 2), (1, 2), (2, 2), (4, 3)), 100):
        log.on_reading(DepthReading(number, float(at), 5.0, (), 1), 1, float(at), float(at), DEEPEST)
        assert log.lost == lost


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(("by", "reason"), [(1.0199, ""), (1.0201, "after a jump")])
def test_a_bit_moves_no_faster_than_its_rate_and_the_slack(way: float, by: float, reason: str) -> None:
    """In 2 s at 0.5 m/s one metre, and 2 cm of two readings."""
    heard = Heard()
    assert heard.hear(100.0, 20.0) == ""
    assert heard.hear(102.0, 20.0 + way * by) == reason
    told = f"from 20.00 m to {20.0 + way * by:.2f} m in 2.0 s" if reason else ""
    assert heard.log.jumped == told
    assert heard.log.doubt.times == ((Stand(1, 100.0, math.inf, 20.0),) if reason else ())


def test_the_speed_is_that_of_the_newest_reading_however_the_one_before_was_heard() -> None:
    heard = Heard()
    for at, md in ((100.0, 20.0), (110.0, 24.0), (111.0, 24.5)):
        assert heard.hear(at, md) == ""
    assert heard.hear(112.0, 20.0) == "after a jump"


@pytest.mark.parametrize(("back", "returned"), [(0.0999, True), (-0.0999, True), (0.1001, False), (-0.1001, False)])
def test_a_depth_has_returned_within_a_decimetre_of_the_last_one_before_the_jump(back: float, returned: bool) -> None:
    heard = Heard()
    for _ in range(2):  # a second jump is as the first
        begun = 100.0 + 20.0 * heard.sequence
        heard.log.accept()
        assert heard.hear(begun, 20.0) == ""
        assert heard.hear(begun + 1.0, 25.0) == "after a jump"
        assert heard.hear(begun + 2.0, 25.1) == "after a jump"
        assert heard.log.latest == 20.0
        assert heard.hear(begun + 9.0, 20.0 + back) == ("" if returned else "after a jump")
        assert (heard.log.jumped == "") == returned
        end = begun + 2.0 if returned else math.inf  # the last reading that was off
        assert heard.log.doubt.times[-1] == Stand(1, begun, end, 20.0)
        assert heard.log.at(1, begun + 1.5) is None


def test_a_jump_that_lasts_into_the_next_epoch_is_doubted_in_both() -> None:
    heard = Heard()
    assert heard.hear(100.0, 20.0) == ""
    assert heard.hear(101.0, 25.0) == "after a jump"
    for at in (7.0, 8.0, 9.0):
        assert heard.hear(at, 25.0, 2, own=195.0 + at) == "after a jump"
    assert heard.log.doubt.times == (Stand(1, 100.0, 101.0, 20.0), Stand(2, 7.0, math.inf, 25.0))
    assert heard.log.jumped == "from 20.00 m to 25.00 m in 1.0 s"
    assert heard.log.add_stand(Stand(2, 7.5, 8.5, 25.0)) is None


@pytest.mark.parametrize(("by", "jumps"), [(1.5199, False), (-1.5199, False), (1.5201, True), (-1.5201, True)])
def test_between_epochs_the_own_clock_says_how_far_a_bit_can_have_moved(by: float, jumps: bool) -> None:
    """Made at 498 s and at 501 s of the own clock, as each lay 2 s and 1 s on its way: 3 s at 0.5 m/s, and 2 cm."""
    log = DepthLog(RATE, GAP)
    assert log.on_reading(DepthReading(1, 1000.0, 20.0, (), 1), 1, 1002.0, 500.0, DEEPEST) == ""
    reason = log.on_reading(DepthReading(2, 7.0, 20.0 + by, (), 2), 2, 8.0, 502.0, DEEPEST)
    assert reason == ("after a jump" if jumps else "")
    doubted = (Stand(1, 1000.0, math.inf, 20.0), Stand(2, -math.inf, math.inf, 20.0))
    assert log.doubt.times == (doubted if jumps else ())


# where the bit stood


def test_a_stand_grows_by_what_touches_it_at_its_depth_and_only_there() -> None:
    log = DepthLog(RATE, GAP)
    assert log.add_stand(Stand(1, 100.0, 110.0, 5.0)) == Stand(1, 100.0, 110.0, 5.0)
    assert log.add_stand(Stand(1, 110.0, 120.0, 5.0)) == Stand(1, 100.0, 120.0, 5.0)
    assert log.add_stand(Stand(1, 90.0, 100.0, 5.0)) == Stand(1, 90.0, 120.0, 5.0)
    assert log.add_stand(Stand(1, 95.0, 99.0, 5.0)) == Stand(1, 90.0, 120.0, 5.0)
    assert log.add_stand(Stand(2, 90.0, 120.0, 5.0)) == Stand(2, 90.0, 120.0, 5.0)
    assert log.add_stand(Stand(1, 130.0, 140.0, 5.0)) == Stand(1, 130.0, 140.0, 5.0)
    assert log.stands == [Stand(1, 90.0, 120.0, 5.0), Stand(1, 130.0, 140.0, 5.0), Stand(2, 90.0, 120.0, 5.0)]
    assert log.jumped == ""


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize(("by", "agree"), [(2.0199, True), (2.0201, False)])
def test_from_one_stand_to_the_next_a_bit_has_the_time_between_them(
    way: float, first: bool, by: float, agree: bool
) -> None:
    """Four seconds at 0.5 m/s, and 2 cm; whichever of the two is heard of first."""
    one, other = Stand(1, 100.0, 110.0, 20.0), Stand(1, 114.0, 130.0, 20.0 + way * by)
    log = DepthLog(RATE, GAP)
    pair = (one, other) if first else (other, one)
    assert log.add_stand(pair[0]) == pair[0]
    assert log.add_stand(pair[1]) == (pair[1] if agree else None)
    assert log.stands == ([one, other] if agree else [])
    assert dict(log.refusals) == ({} if agree else {CONTRADICTION: 1})
    told = f"from 20.00 m to {20.0 + way * by:.2f} m between two stands"
    assert log.jumped == ("" if agree else told)
    assert log.latest == (None if agree else 20.0)
    if not agree:
        assert set(log.doubt.times[:-1]) == {pair[0]}
        assert log.add_stand(one) is None
        assert log.refusals == {CONTRADICTION: 1, DOUBTFUL: 1}


def test_two_stands_of_one_time_at_two_depths_contradict_each_other_however_near() -> None:
    log = DepthLog(RATE, GAP)
    log.add_stand(Stand(1, 100.0, 110.0, 20.0))
    assert log.add_stand(Stand(1, 109.0, 120.0, 20.01)) is None
    assert log.refusals == {CONTRADICTION: 1}
    touching = DepthLog(RATE, GAP)
    touching.add_stand(Stand(1, 100.0, 110.0, 20.0))
    assert touching.add_stand(Stand(1, 110.0, 120.0, 20.01)) is not None


def test_of_several_that_a_stand_contradicts_the_last_is_where_the_jump_began_and_all_are_doubted() -> None:
    log = DepthLog(RATE, GAP)
    for stand in (Stand(1, 100.0, 110.0, 20.0), Stand(1, 112.0, 120.0, 21.0), Stand(2, 1.0, 90.0, 3.0)):
        assert log.add_stand(stand)
    assert log.add_stand(Stand(1, 121.0, 130.0, 40.0)) is None
    assert log.jumped == "from 21.00 m to 40.00 m between two stands"
    assert log.latest == 21.0
    assert log.stands == [Stand(2, 1.0, 90.0, 3.0)]
    assert [time.md for time in log.doubt.times] == [20.0, 21.0, 40.0]


def test_a_contradiction_within_a_jump_leaves_the_jump_as_it_was() -> None:
    heard = Heard()
    heard.log.add_stand(Stand(1, 80.0, 90.0, 10.0))
    heard.hear(100.0, 20.0)
    heard.hear(101.0, 30.0)
    assert heard.log.add_stand(Stand(1, 91.0, 92.0, 13.0)) is None
    assert heard.log.jumped == "from 20.00 m to 30.00 m in 1.0 s"
    assert heard.log.latest == 20.0
    assert heard.log.stands == []


def test_while_a_jump_lasts_a_stand_is_believed_that_ended_before_it() -> None:
    heard = Heard()
    heard.hear(100.0, 20.0)
    heard.hear(101.0, 30.0)
    for end, believed in ((100.0, True), (100.001, False)):
        stand = Stand(1, 90.0, end, 20.0 if believed else 20.5)
        assert (heard.log.add_stand(stand) is not None) == believed
    assert heard.log.add_stand(Stand(2, 1.0, 9.0, 20.0)) is None
    assert heard.log.refusals[DOUBTFUL] == 2


def test_of_too_many_stands_and_doubtful_times_the_oldest_go(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(room, "STANDS_KEPT", 3)
    log = DepthLog(RATE, GAP)
    times = [Stand(1, 100.0 * k, 100.0 * k + 20.0, float(k)) for k in (3, 1, 2)]
    for stand in times:
        log.add_stand(stand)
    assert [stand.md for stand in log.stands] == [1.0, 2.0, 3.0]
    log.add_stand(Stand(1, 400.0, 420.0, 4.0))
    assert [stand.md for stand in log.stands] == [2.0, 3.0, 4.0]
    doubtful = tuple(Stand(1, float(k), k + 0.5, 2.0) for k in range(101))
    log.recall(DepthDoubt(None, (-1, 0.0), doubtful))
    assert log.doubt.times == doubtful[1:]


def test_the_stand_before_another_began_before_it_in_its_epoch_or_an_earlier_one() -> None:
    log = DepthLog(RATE, GAP)
    one, two, three = Stand(1, 100.0, 110.0, 2.0), Stand(1, 120.0, 130.0, 3.0), Stand(2, 5.0, 9.0, 3.0)
    for stand in (three, one, two):
        log.add_stand(stand)
    assert [log.stand_before(stand) for stand in (one, two, three)] == [None, one, two]
    assert log.stand_before(Stand(1, 120.001, 125.0, 9.0)) == two


def test_a_stand_without_an_epoch_may_be_one_of_before() -> None:
    log = DepthLog(RATE, GAP)
    log.add_stand(Stand(1, 100.0, 110.0, 2.0))
    for stand, now, is_old in (
        (Stand(EPOCH_UNKNOWN, 100.0, 110.0, 2.0), 2, True), (Stand(EPOCH_UNKNOWN, 90.0, 100.0, 2.0), 2, True),
        (Stand(EPOCH_UNKNOWN, 100.0, 110.001, 2.0), 2, False), (Stand(EPOCH_UNKNOWN, 100.0, 110.0, 2.0), 1, False),
        (Stand(EPOCH_UNKNOWN, 100.0, 110.0, 2.1), 2, False), (Stand(EPOCH_UNKNOWN, 80.0, 99.0, 2.0), 2, False),
        (Stand(1, 100.0, 110.0, 2.0), 2, False),
    ):  # fmt: skip
        assert log.is_of_before(stand, now) == is_old


def test_a_depth_is_that_of_the_readings_and_else_of_the_stand_from_its_begin_to_its_end() -> None:
    heard = Heard()
    heard.log.add_stand(Stand(1, 100.0, 110.0, 2.0))
    heard.log.add_stand(Stand(2, 50.0, 60.0, 3.0))
    at = [(1, 99.999), (1, 100.0), (1, 110.0), (1, 110.001), (2, 50.0), (2, 60.0), (2, 49.0), (3, 100.0)]
    assert [heard.log.at(*instant) for instant in at] == [None, 2.0, 2.0, None, 3.0, 3.0, None, None]
    heard.hear(104.0, 2.02)
    heard.hear(105.0, 2.04)
    assert heard.log.at(1, 104.5) == pytest.approx(2.03)
    assert heard.log.at(1, 106.0) == 2.0


# what the crew has looked at


def test_what_the_crew_accepts_is_up_to_the_newest_reading_also_of_a_jump() -> None:
    heard = Heard()
    heard.log.accept()  # of nothing
    assert heard.log.accepted_at(1) == -math.inf
    assert heard.hear(100.0, 20.0) == ""
    assert heard.hear(101.0, 30.0) == "after a jump"
    heard.log.accept()
    assert (heard.log.jumped, heard.log.latest) == ("", 20.0)
    assert [heard.log.accepted_at(epoch) for epoch in (1, 2)] == [101.0, -math.inf]
    heard.log.accept()  # twice is as once
    assert heard.log.accepted_at(1) == 101.0
    assert heard.hear(102.0, 45.0) == ""
    assert heard.log.doubt == DepthDoubt(None, (1, 101.0), (Stand(1, 100.0, 101.0, 20.0),))


@pytest.mark.parametrize(
    ("begun_at", "ended_at", "believed"),
    [(100.5, 120.0, True), (101.0, 120.0, True), (100.5, 101.0, False), (100.5, 101.001, True)],
)
def test_a_stand_in_which_the_crew_looked_is_believed_whole(begun_at: float, ended_at: float, believed: bool) -> None:
    """The crew looked at 101 s, where the doubtful time ends too."""
    heard = Heard()
    for at, md in ((99.0, 20.0), (101.0, 30.0)):
        heard.hear(at, md)
    heard.log.accept()
    stand = Stand(1, begun_at, ended_at, 30.0)
    assert heard.log.add_stand(stand) == (stand if believed else None)


def test_between_two_stands_or_while_the_bit_was_at_the_second_the_crew_may_have_looked() -> None:
    for looked, agree in ((110.0, True), (114.0, True), (130.0, True), (109.999, False), (130.001, False)):
        log = DepthLog(RATE, GAP)
        log.recall(DepthDoubt(None, (1, looked), ()))
        assert log.add_stand(Stand(1, 100.0, 110.0, 20.0))
        assert (log.add_stand(Stand(1, 114.0, 130.0, 40.0)) is not None) == agree


def test_a_stand_that_goes_on_from_a_doubtful_time_is_believed_from_its_end() -> None:
    heard = Heard()
    for at, md in ((100.0, 20.0), (101.0, 30.0), (108.0, 30.0), (110.0, 20.0), (112.0, 20.0)):
        heard.hear(at, md)
    assert heard.log.add_stand(Stand(1, 105.0, 111.0, 20.0)) is None  # it had ended before the newest reading
    assert heard.log.add_stand(Stand(1, 105.0, 112.0, 20.5)) is None
    assert heard.log.add_stand(Stand(1, 105.0, 112.0, 20.0)) == Stand(1, 108.0, 112.0, 20.0)
    assert heard.log.add_stand(Stand(1, 105.0, 112.0, 20.0)) == Stand(1, 108.0, 112.0, 20.0)


def test_kept_stands_are_gone_on_with_but_not_where_a_jump_was_kept() -> None:
    stands = [Stand(1, 100.0, 110.0, 5.0), Stand(1, 120.0, 130.0, 6.0)]
    log = DepthLog(RATE, GAP)
    log.recall(DepthDoubt((1, 130.0, 6.5), (-1, 0.0), ()))
    log.restore(stands)
    assert (log.latest, log.stands) == (6.5, stands)
    fresh = DepthLog(RATE, GAP)
    fresh.restore([])
    assert (fresh.latest, fresh.stands, fresh.doubt) == (None, [], DepthDoubt())
    fresh.restore(stands)
    assert fresh.latest == 6.0
    assert fresh.on_reading(DepthReading(1, 131.0, 9.0, (), 1), 1, 131.0, 131.0, DEEPEST) == "after a jump"
    assert fresh.jumped == "from 6.00 m to 9.00 m in 1.0 s"
