"""Which surveys a stop owes, however its stands were heard of."""

import math

import pytest

from groundstation.service.string.depth import DepthLog
from groundstation.service.string.stands import take_stand, take_survey
from groundstation.service.string.stops import Stops
from groundstation.service.string.tally import Tally
from telemetry.messages import Stand

DUE = 60.0
FIRST, LATER = Stand(2, 1000.0, 1025.0, 4.0), Stand(3, 5.0, 40.0, 4.0)


@pytest.fixture
def tally() -> Tally:
    known = Tally(2.0)
    known.on_hops(2, 1)
    known.on_hops(1, 2)
    return known


def missing(stops: Stops) -> set[int]:
    return {tube for stop in stops if stop.judged for tube in stop.missing}


def test_a_stop_goes_on_over_a_start_of_the_encoder(tally: Tally) -> None:
    stops = Stops(tally, DUE)
    stops.on_stand(FIRST)
    stops.on_survey(2, 1020.0, 1)
    stops.on_later_stand(FIRST, LATER)
    stops.judge(3, 30.0)
    assert missing(stops) == set()  # 25 s before and 25 s after the start are less than what is due
    stops.judge(3, 41.0)
    assert missing(stops) == {2}
    stops.on_survey(3, 39.0, 2)
    assert missing(stops) == set()


def test_a_survey_of_an_epoch_that_ended_at_the_stop_belongs_to_it_whenever_a_depth_was_heard_last(
    tally: Tally,
) -> None:
    """A ground station without power hears no depth; its tubes survey by the time of the encoder's last start."""
    stops = Stops(tally, DUE)
    stops.on_stand(FIRST)
    for tube in (1, 2):
        stops.on_survey(2, 1200.0, tube)
    stops.on_survey(3, 100.0, 1)
    stops.on_later_stand(FIRST, LATER)
    stops.judge(3, 41.0)
    assert missing(stops) == set()
    alone = Stops(tally, DUE)
    alone.on_stand(Stand(2, 1000.0, 1040.0, 4.0))
    alone.on_survey(2, 1200.0, 1)
    alone.judge(2, 1300.0)
    assert missing(alone) == {1, 2}


def test_a_stop_whose_last_stand_is_a_part_of_it_goes_on_too(tally: Tally) -> None:
    """Where readings were refused for a while, a stop is made of stands that touch."""
    stops = Stops(tally, DUE)
    stops.on_stand(FIRST)
    stops.on_later_stand(Stand(2, 1020.0, 1025.0, 4.0), LATER)
    stops.judge(3, 41.0)
    assert missing(stops) == {1, 2}


def test_parts_of_a_stop_that_are_told_again_with_every_reading_are_no_other_stops(tally: Tally) -> None:
    """Readings were refused for a while: what the string stood before is a stand of its own, and is told for long."""
    depths, stops = DepthLog(1.0, 5.0), Stops(tally, DUE)
    before, after = Stand(2, 1000.0, 1025.0, 4.0), 1040.0
    take_stand(depths, stops, Stand(2, 900.0, 950.0, 3.0))
    first = len(list(stops))
    for seconds in range(1, 30):
        take_stand(depths, stops, before)
        take_stand(depths, stops, Stand(2, after, after + seconds, 4.0))
    assert [stop.stand for stop in list(stops)[first:]] == [Stand(2, 1000.0, 1069.0, 4.0)]


def test_a_stop_that_was_too_short_before_and_after_owes_nothing(tally: Tally) -> None:
    stops = Stops(tally, DUE)
    stops.on_stand(Stand(2, 1000.0, 1010.0, 4.0))
    stops.on_later_stand(Stand(2, 1000.0, 1010.0, 4.0), Stand(3, 5.0, 20.0, 4.0))
    stops.judge(4, 1000.0)
    assert missing(stops) == set()


def test_tubes_that_are_met_during_a_stop_owe_its_survey() -> None:
    """A ground station that lost its database hears of the stand first, and of the tubes a second later."""
    tally = Tally(2.0)
    stops = Stops(tally, DUE)
    stops.on_stand(Stand(2, 1000.0, 1010.0, 4.0))
    tally.on_hops(2, 1)
    tally.on_hops(1, 2)
    stops.on_stand(Stand(2, 1000.0, 1065.0, 4.0))
    stops.judge(2, 1065.0)
    assert missing(stops) == {1, 2}


def test_a_tube_that_is_heard_first_after_a_start_of_the_encoder_owes_the_survey_of_the_stop_that_goes_on() -> None:
    known = Tally(2.0)
    known.on_hops(1, 1)
    stops = Stops(known, DUE)
    stops.on_stand(FIRST)
    known.on_hops(2, 1)
    known.on_hops(1, 2)
    stops.on_later_stand(FIRST, LATER)
    stops.on_survey(3, 39.0, 1)
    stops.judge(3, 41.0)
    assert missing(stops) == {2}


def test_a_stop_is_judged_when_somebody_is_known_who_could_owe_its_survey() -> None:
    """A ground station that lost its database, and hears no tube till the encoder starts again."""
    known = Tally(2.0)
    stops = Stops(known, DUE)
    stops.on_stand(Stand(2, 1000.0, 1040.0, 4.0))
    stops.judge(2, 1040.0)
    for at in (7.0, 20.0):
        stops.judge(3, at)
    assert not any(stop.judged for stop in stops)
    known.on_hops(2, 1)
    known.on_hops(1, 2)
    stops.judge(3, 21.0)
    assert missing(stops) == {1, 2}


def test_the_tubes_of_a_stop_of_before_are_heard_first(tally: Tally) -> None:
    stops = Stops(tally, DUE)
    stops.on_stand(Stand(2, 1000.0, 1040.0, 4.0))
    stops.judge(2, 1040.0)
    stops.judge(3, math.nan)
    stops.judge(3, 7.0)
    assert missing(stops) == set()
    stops.judge(3, 12.0)
    assert missing(stops) == {1, 2}


def test_the_first_stand_is_a_stop_as_soon_as_it_has_lasted_till_a_survey_in_it(tally: Tally) -> None:
    """It was stored when it began, and the survey before the ground station's start."""
    depths, stops = DepthLog(0.5, 5.0), Stops(tally, DUE)
    take_stand(depths, stops, Stand(1, 10.0, 10.5, 4.0))
    stops.on_survey(1, 30.0, 1)
    take_survey(depths, stops, 1, 30.0)
    assert list(stops) == []
    take_stand(depths, stops, Stand(1, 10.0, 71.0, 4.0))
    stops.judge(1, 71.0)
    assert missing(stops) == {2}


@pytest.mark.parametrize(("epoch", "lacking"), [(1, set()), (2, {1, 2})])
def test_a_string_that_is_met_at_rest_lacks_its_surveys_where_the_encoder_has_started_before(
    tally: Tally, epoch: int, lacking: set[int]
) -> None:
    depths, stops = DepthLog(0.5, 5.0), Stops(tally, DUE)
    take_stand(depths, stops, Stand(epoch, 10.0, 71.0, 4.0))
    stops.judge(epoch, 71.0)
    assert missing(stops) == lacking


def test_surveys_are_kept_until_their_stop_is_judged(tally: Tally, monkeypatch: pytest.MonkeyPatch) -> None:
    """The oldest go by halves; a stop of which the surveys are there owes nothing."""
    monkeypatch.setattr("groundstation.service.string.stops.SURVEYS_KEPT", 8)
    stops = Stops(tally, DUE)
    for stop in range(6):
        for tube in (1, 2):
            stops.on_survey(2, 1010.0 + 100.0 * stop, tube)
    for stop in range(6):
        stops.on_stand(Stand(2, 1000.0 + 100.0 * stop, 1040.0 + 100.0 * stop, 4.0 + stop))
    stops.judge(2, 1700.0)
    owing = [stop.stand.begun_at for stop in stops if stop.missing]
    assert owing == [1000.0, 1100.0, 1200.0][: len(owing)]
    assert 2 <= len(owing) <= 4


@pytest.mark.parametrize(("stood", "owed"), [(4.0, {1, 2}), (40.0, set())])
def test_a_stop_that_was_too_short_goes_on_where_the_string_was_lifted_to(
    tally: Tally, stood: float, owed: set[int]
) -> None:
    """One that was long enough owes its surveys itself; then the bit that is pulled up owes none."""
    depths, stops = DepthLog(0.5, 5.0), Stops(tally, DUE)
    end = 1020.0 + stood
    for stand in (Stand(1, 1000.0, 1010.0, 4.0), Stand(1, 1020.0, end, 5.6), Stand(1, end + 4.0, end + 80.0, 4.8)):
        take_stand(depths, stops, stand)
    for tube in (1, 2):
        stops.on_survey(1, 1030.0 if stood > 30.0 else 0.0, tube)
    stops.judge(1, end + 80.0)
    assert missing(stops) == owed
