"""The depth of the bit: what is believed of the stream, and when a depth is known."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.service.string.depth import DepthLog, Track
from telemetry.application.depth_source import DepthSource
from telemetry.errors import EncodeError
from telemetry.messages import DepthReading, Stand
from telemetry.presentation.msgpack_codec import decode_message, encode_message
from telemetry.quantities import MAX_STANDS

EPOCH, CYCLE = 3, 0.5


class Bit:
    """A bit that is drilled, its source and the ground station's log."""

    def __init__(self) -> None:
        self.source, self.log = DepthSource(), DepthLog(0.5, 5.0)
        self.now, self.md = 1000.0, 0.0

    def read(self, md: float, ahead: float = 0.0, *, heard: bool = True) -> str:
        self.md = md
        reading = self.source.measure(self.now + ahead, md)
        return self.log.on_reading(reading, EPOCH, self.now, self.now, 1e3) if heard else "off"

    def move_to(self, md: float, *, heard: bool = True) -> None:
        while self.md != md:
            self.now += CYCLE
            self.read(min(self.md + 0.1, md) if md > self.md else max(self.md - 0.1, md), heard=heard)

    def stand(self, duration: float, *, heard: bool = True) -> float:
        begin = self.now
        while self.now < begin + duration:
            self.now += CYCLE
            self.read(self.md, heard=heard)
        return 0.5 * (begin + self.now)

    def hear_stands(self) -> None:
        self.now += CYCLE
        reading = self.source.measure(self.now, self.md)
        assert self.log.on_reading(reading, EPOCH, self.now, self.now, 1e3) == ""
        for stand in reading.stands:
            self.log.add_stand(Stand(EPOCH, stand.begun_at, stand.ended_at, stand.md))


def test_depth_is_that_of_the_time_asked_for() -> None:
    track = Track(gap=1.0)
    readings = [(1.0, 0.0), (2.0, 0.5), (3.0, 1.0), (4.0, 1.0), (5.0, 1.0), (6.0, 1.5)]
    assert [track.append_reading(at, md) for at, md in readings] == [False, False, False, True, False, False]
    assert [track.depth_at(t) for t in (0.5, 2.5, 4.5, 6.0, 6.1)] == [None, 0.75, 1.0, 1.5, None]


def test_a_depth_is_known_only_where_readings_bracket_its_time() -> None:
    bit = Bit()
    bit.move_to(2.0)
    at = bit.stand(30.0)
    assert bit.log.at(EPOCH, at) == 2.0
    assert bit.log.at(EPOCH, bit.now + 0.1) is None
    assert bit.log.at(EPOCH + 1, at) is None
    bit.now += 100.0  # nothing comes
    bit.read(2.0)
    assert bit.log.at(EPOCH, bit.now - 50.0) is None


def test_a_ground_station_that_was_off_across_a_stop_learns_where_the_bit_stood() -> None:
    bit = Bit()
    bit.move_to(2.0)
    bit.stand(30.0)
    bit.move_to(4.0, heard=False)
    at = bit.stand(30.0, heard=False)
    bit.move_to(5.0, heard=False)
    bit.hear_stands()
    assert bit.log.at(EPOCH, at) == 4.0


def test_a_reading_from_the_future_is_refused_and_changes_nothing() -> None:
    bit = Bit()
    bit.move_to(2.0)
    bit.stand(10.0)
    assert bit.read(2.0, ahead=300.0) == "ahead of rig time"
    at = bit.stand(10.0)
    assert bit.log.at(EPOCH, at) == 2.0


@pytest.mark.parametrize(
    ("md", "ahead", "reason"), [(2000.0, 0.0, "deeper than the string reaches"), (2.0, -60.0, "behind rig time")]
)
def test_what_the_stream_may_not_say_is_refused(md: float, ahead: float, reason: str) -> None:
    bit = Bit()
    bit.move_to(2.0)
    bit.now += CYCLE
    assert bit.read(md, ahead) == reason
    assert bit.log.latest == 2.0
    assert bit.log.refusals[reason] == 1


def test_a_reading_of_another_epoch_is_refused() -> None:
    log = DepthLog(0.5, 5.0)
    assert log.on_reading(DepthReading(1, 10.0, 1.0, (), EPOCH + 1), EPOCH, 10.0, 10.0, math.inf) != ""
    assert log.on_reading(DepthReading(2, 10.0, 1.0, (), EPOCH), EPOCH, 10.0, 10.0, math.inf) == ""


@pytest.mark.parametrize(("by", "reason"), [(-0.3, ""), (1.5, "after a jump"), (-1.5, "after a jump")])
def test_a_bit_that_moves_too_fast_from_one_epoch_to_the_next_has_jumped(by: float, reason: str) -> None:
    """The own clock tells the time between the two readings, however late they came."""
    log = DepthLog(0.5, 5.0)
    late, own = 2.0, 500.0
    assert log.on_reading(DepthReading(1, 1000.0, 3.0, (), EPOCH), EPOCH, 1000.0 + late, own + late, 1e3) == ""
    first = DepthReading(2, 7.0, 3.0 + by, (), EPOCH + 1)
    assert log.on_reading(first, EPOCH + 1, 7.0, own + 1.0, 1e3) == reason
    stand = Stand(EPOCH + 1, 6.0, 8.0, 3.0 + by)
    assert log.add_stand(stand) == (None if reason else stand)
    if reason:
        assert log.jumped == f"from 3.00 m to {3.0 + by:.2f} m in 1.0 s"
        log.accept()
        assert log.on_reading(DepthReading(3, 9.0, 3.0 + by, (), EPOCH + 1), EPOCH + 1, 9.0, own + 3.0, 1e3) == ""


def test_nothing_is_known_of_the_time_between_epochs_across_a_start() -> None:
    log = DepthLog(0.5, 5.0)
    log.restore([Stand(EPOCH, 900.0, 1000.0, 3.0)])
    assert log.on_reading(DepthReading(2, 7.0, 30.0, (), EPOCH + 1), EPOCH + 1, 7.0, 500.0, 1e3) == ""


@pytest.mark.parametrize("by", [3.0, -1.5])
def test_after_a_jump_nothing_is_believed_until_it_returns(by: float) -> None:
    bit = Bit()
    bit.move_to(2.0)
    bit.stand(20.0)
    bit.now += CYCLE
    assert bit.read(2.0 + by) == "after a jump"
    at = bit.stand(60.0)
    assert bit.log.at(EPOCH, at) is None
    assert bit.log.latest == 2.0
    bit.now += CYCLE
    bit.read(2.0)
    assert bit.log.jumped == ""
    bit.stand(5.0)
    bit.hear_stands()
    assert bit.log.at(EPOCH, at) is None  # the stand at the wrong depth, which the source repeats, is not believed


def test_a_stand_of_the_time_of_a_jump_is_not_believed_when_the_depth_has_returned() -> None:
    """The bit goes on to its stop while the depth is off, and the source repeats the wrong stand for ever."""
    bit = Bit()
    bit.move_to(2.0)
    bit.now += CYCLE
    assert bit.read(3.0) == "after a jump"
    at = bit.stand(30.0)
    bit.now += CYCLE
    assert bit.read(2.0) == ""
    assert bit.stand(10.0) > at
    bit.hear_stands()
    assert [stand.md for stand in bit.log.stands] == [2.0]
    assert bit.log.at(EPOCH, at) is None


@pytest.mark.parametrize("ends", ["before the start", "after the start", "by the crew"])
def test_a_doubtful_time_stays_doubtful_over_a_start(ends: str) -> None:
    bit = Bit()
    bit.move_to(2.0)
    bit.now += CYCLE
    assert bit.read(3.0) == "after a jump"
    at = bit.stand(30.0)
    wrong = Stand(EPOCH, at - 10.0, at + 10.0, 3.0)
    if ends == "before the start":
        bit.now += CYCLE
        assert bit.read(2.0) == ""
    doubt, bit.log = bit.log.doubt, DepthLog(0.5, 5.0)
    bit.log.recall(doubt)
    if ends == "by the crew":
        bit.log.accept()
    bit.now += CYCLE
    assert bit.read(2.0) == ""
    assert not bit.log.add_stand(wrong)
    later = bit.stand(10.0)
    assert bit.log.doubt.times[-1].ended_at < later
    assert bit.log.add_stand(Stand(EPOCH, later - 1.0, later + 1.0, 2.0))


def test_a_stand_that_began_in_a_doubtful_time_and_goes_on_is_believed_from_its_end_on() -> None:
    """A process that was off when the depth returned hears of it later, in the midst of a stand."""
    bit = Bit()
    bit.move_to(2.0)
    bit.now += CYCLE
    assert bit.read(3.0) == "after a jump"
    bit.stand(10.0)
    doubt, bit.log = bit.log.doubt, DepthLog(0.5, 5.0)
    bit.log.recall(doubt)
    bit.now += CYCLE
    bit.read(2.0, heard=False)
    before = bit.stand(20.0, heard=False)
    bit.hear_stands()
    heard_again = bit.now
    assert bit.log.stands == []
    after = bit.stand(10.0)
    bit.hear_stands()
    assert bit.log.stands == [Stand(EPOCH, heard_again, bit.now, 2.0)]
    assert bit.log.at(EPOCH, before) is None
    assert bit.log.at(EPOCH, after) == 2.0


def test_a_wrong_stand_is_not_believed_of_the_time_in_which_nobody_heard_its_readings() -> None:
    """It ended unheard, so nothing says that it was in doubt to its end; the depth has returned when it is heard of."""
    bit = Bit()
    bit.move_to(2.0)
    bit.now += CYCLE
    assert bit.read(3.0) == "after a jump"
    bit.stand(10.0)
    unheard = bit.stand(20.0, heard=False)
    bit.now += CYCLE
    bit.read(2.0, heard=False)
    bit.stand(1.0, heard=False)
    bit.hear_stands()
    assert bit.log.jumped == ""
    assert bit.log.at(EPOCH, unheard) is None
    assert [stand.md for stand in bit.log.stands] == [2.0]


def contradicted() -> tuple[Bit, float, float]:
    """A bit at 0.5 m whose stand at 2 m and the one after it no bit can both have had, and a time of each."""
    bit = Bit()
    bit.move_to(2.0, heard=False)
    right = bit.stand(20.0, heard=False)
    bit.now += CYCLE
    bit.read(0.5, heard=False)
    wrong = bit.stand(20.0, heard=False)
    bit.hear_stands()
    return bit, right, wrong


def test_two_stands_that_contradict_each_other_are_both_doubtful_and_the_present_is_a_jump() -> None:
    """A ground station that was off while the depth went wrong sees only stands between which no bit can move."""
    bit, right, wrong = contradicted()
    assert bit.log.jumped != ""
    assert bit.stand(10.0)
    assert bit.log.at(EPOCH, right) is bit.log.at(EPOCH, wrong) is None
    bit.now += CYCLE
    bit.read(2.0)
    assert bit.log.jumped == ""
    assert bit.log.at(EPOCH, bit.stand(10.0)) == 2.0


@pytest.mark.parametrize("is_restarted", [False, True])
def test_a_stand_is_believed_again_where_the_depth_returns_to_it_and_the_one_that_contradicted_it_is_not(
    is_restarted: bool,
) -> None:
    """As after a jump that was heard: without that, a stop that was surveyed would be another one after it."""
    bit, right, wrong = contradicted()
    bit.stand(10.0)
    if is_restarted:
        doubt, bit.log = bit.log.doubt, DepthLog(0.5, 5.0)
        bit.log.recall(doubt)
    bit.now += CYCLE
    bit.read(2.0)
    bit.stand(10.0)
    bit.hear_stands()
    assert bit.log.at(EPOCH, right) == 2.0
    assert bit.log.at(EPOCH, wrong) is None


def test_of_a_jump_that_the_crew_looked_at_the_stands_that_go_on_are_believed_and_no_others() -> None:
    log = DepthLog(0.5, 5.0)
    before = Stand(EPOCH, 1000.0, 1010.0, 6.0)
    assert log.add_stand(before)
    for at, md in ((1009.5, 6.0), (1010.0, 6.0), (1010.5, 2.5), (1011.0, 2.5)):
        log.on_reading(DepthReading(int(2 * at), at, md, ()), EPOCH, at, at, 1e3)
    log.accept()
    assert not log.add_stand(Stand(EPOCH, 1010.5, 1011.0, 2.5))
    assert log.stands == [before]
    assert log.refusals["a stand contradicts another"] == 0
    assert log.add_stand(Stand(EPOCH, 1010.5, 1020.0, 2.5))
    assert log.refusals["a stand contradicts another"] == 0


def test_the_crew_may_accept_the_depth_after_a_jump() -> None:
    bit = Bit()
    bit.move_to(2.0)
    bit.stand(20.0)
    bit.now += CYCLE
    bit.read(5.0)
    bit.stand(20.0)
    bit.log.accept()
    at = bit.stand(20.0)
    assert bit.log.at(EPOCH, at) == 5.0


def test_numbers_that_never_came_are_counted() -> None:
    bit = Bit()
    bit.move_to(1.0)
    bit.move_to(1.5, heard=False)
    bit.move_to(2.0)
    assert bit.log.lost == 5


def test_a_repeated_reading_changes_nothing() -> None:
    log = DepthLog(0.5, 5.0)
    first = DepthReading(1, 10.0, 1.0, ())
    assert log.on_reading(first, EPOCH, 10.0, 10.0, math.inf) == ""
    assert log.on_reading(first, EPOCH, 10.0, 10.0, math.inf) == "repeated"


@pytest.mark.parametrize("md", [-1e-9, -1.0, math.nan, math.inf, 1e6])
def test_there_is_no_negative_depth_and_none_that_is_no_number(md: float) -> None:
    with pytest.raises(EncodeError):
        encode_message(DepthReading(1, 0.0, md, ()))


@given(st.lists(st.tuples(st.sampled_from([0.0, 0.1, 0.2, -0.1]), st.integers(1, 3)), min_size=1, max_size=120))
def test_whatever_the_bit_does_a_depth_that_is_known_is_the_right_one(moves: list[tuple[float, int]]) -> None:
    bit = Bit()
    truth = [(bit.now, 0.0)]
    bit.read(0.0)
    for step, cycles in moves:
        for _ in range(cycles):
            bit.now += CYCLE
            bit.read(max(bit.md + step, 0.0))
            truth.append((bit.now, bit.md))
    bit.hear_stands()
    for (t0, d0), (t1, d1) in pairwise(truth):
        known = bit.log.at(EPOCH, 0.5 * (t0 + t1))
        assert known is not None
        assert min(d0, d1) - 1e-9 <= known <= max(d0, d1) + 1e-9


def test_a_reading_with_all_its_stands_travels() -> None:
    bit = Bit()
    for n in range(1, MAX_STANDS + 5):
        bit.move_to(0.2 * n)
        bit.stand(2.0)
    reading = bit.source.measure(bit.now + 1.0, bit.md)
    assert len(reading.stands) == MAX_STANDS
    assert decode_message(encode_message(reading)) == reading
