"""Numbers that two tubes share, by hand: what makes two of one, which times count, and whose a message is."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from groundstation.service.string.doubled_numbers import OTHER, DoubledNumbers, DoubledPlaces, NumberWatch
from telemetry.messages import EPOCH_UNKNOWN, NodeFlag


def heard(*states: tuple[float, int], tube: int = 3, epoch: int = 4) -> list[DoubledPlaces | None]:
    watch = NumberWatch()
    return [watch.find_places(state(at, hops, tube, epoch)) for at, hops in states]


def state(at: float, hops: int, tube: int = 3, epoch: int = 4) -> Any:
    return SimpleNamespace(at=at, hops=hops, tube=tube, epoch=epoch, flags=NodeFlag.NONE)


def test_five_changes_between_two_places_are_two_tubes_since_the_first_of_them() -> None:
    found = heard((1.0, 5), (2.5, 2), (3.0, 5), (4.0, 5), (5.0, 2), (6.0, 5), (7.0, 2))
    assert found == [None] * 5 + [None, DoubledPlaces(4, 0.0, 2, 5)]
    later = heard((1.0, 5), (2.5, 2), (3.0, 5), (4.0, 2), (5.0, 5), (6.0, 2), (7.0, 5), (8.0, 2))
    assert [one and one.at for one in later[5:]] == [0.0, 1.5, 2.0]  # the five changes that were last


def test_changes_are_looked_for_in_the_order_of_time_and_over_less_than_twenty_seconds() -> None:
    places = [(0.0, 5), (4.0, 2), (8.0, 5), (12.0, 2), (16.0, 5)]
    assert heard(*places, (19.9, 2))[-1] == DoubledPlaces(4, -1.0, 2, 5)
    assert heard(*places, (20.0, 2))[-1] is None
    assert heard(*places[::-1], (19.9, 2))[-1] == DoubledPlaces(4, -1.0, 2, 5)
    at_once = heard(*places[:4], (12.0, 5), (16.0, 2), (12.0, 5), (16.0, 2))  # what comes again is no news
    assert at_once[-3:] == [DoubledPlaces(4, -1.0, 2, 5), None, None]


def test_three_places_and_what_names_none_are_no_two_tubes() -> None:
    assert heard((1.0, 5), (2.0, 2), (3.0, 5), (4.0, 2), (5.0, 7), (6.0, 2)) == [None] * 6
    assert heard((1.0, 0), (2.0, 2), (3.0, 0), (4.0, 2), (5.0, 0), (6.0, 2)) == [None] * 6
    assert heard(*[(float(k), 2 + k % 2) for k in range(8)], epoch=EPOCH_UNKNOWN) == [None] * 8
    watch = NumberWatch()
    for k in range(12):  # of two numbers, or epochs, each is one tube
        assert watch.find_places(state(float(k), 2 + k % 2, tube=3 + k % 2)) is None
        assert watch.find_places(state(float(k), 2 + k % 2, tube=9, epoch=4 + k % 2)) is None


PLACES = [DoubledPlaces(4, 10.0, 2, 5), DoubledPlaces(4, 50.0, 3, 6), DoubledPlaces(6, 5.0, 1, 4)]


def numbers(**is_upper: bool) -> DoubledNumbers:
    found = DoubledNumbers()
    found.begin_anew([(3, one) for one in PLACES], {3: is_upper["told"]} if is_upper else {})
    return found


@pytest.mark.parametrize(
    ("epoch", "at", "places"),
    [
        (4, 9.9, None), (4, 10.0, 0), (4, 49.9, 0), (4, 50.0, 1), (4, 900.0, 1), (6, 4.9, None), (6, 5.0, 2),
        (3, 99.0, None), (4.5, 1.0, 2), (7, 0.0, 2), (EPOCH_UNKNOWN, 0.0, 2),
    ],
)  # fmt: skip
def test_places_are_those_known_at_the_time_or_the_last_of_before_its_epoch(
    epoch: int, at: float, places: int | None
) -> None:
    assert numbers()._in_force(3, epoch, at) == (None if places is None else PLACES[places])
    assert numbers()._in_force(8, epoch, at) is None


@pytest.mark.parametrize("told", [True, False])
def test_a_message_is_of_the_one_that_was_told_where_it_comes_from_its_place(told: bool) -> None:
    found = numbers(told=told)
    own, other = (2, 5) if told else (5, 2)
    assert (found.key_of(3, 4, 20.0, own), found.key_of(3, 4, 20.0, other)) == (3, OTHER + 3)
    assert (found.key_of(3, 4, 1.0, other), found.key_of(8, 4, 20.0, other)) == (3, 8)
    assert (found.upper_of(3), found.upper_of(8)) == (3 if told else OTHER + 3, OTHER + 8)
    assert (found.untold, numbers().untold) == ([], [3])
    assert (3 in found, OTHER + 3 in found, 8 in found, bool(found), bool(DoubledNumbers())) == (
        True, True, False, True, False,
    )  # fmt: skip
    assert found.newest(3) is PLACES[2]


def survey(hops: int, at: float = 20.0) -> Any:
    from telemetry.messages import ImuMean, SurveyMeasurement

    cov = ((1e-6, 0.0, 0.0), (0.0, 1e-6, 0.0), (0.0, 0.0, 1e-6))
    return SurveyMeasurement(
        3, 7, at, hops, (ImuMean((0.0, 0.0, -9.81), cov),), 0.0, 1e-8, 1e-8, 32, 20.0, NodeFlag.NONE, epoch=4
    )


def test_a_survey_is_held_until_it_is_told_whose_it_is_and_that_of_the_other_for_ever() -> None:
    untold, told = numbers(), numbers(told=False)
    assert [untold.is_held(survey(hops)) for hops in (2, 5)] == [True, True]
    assert [told.is_held(survey(hops)) for hops in (2, 5)] == [True, False]
    early = survey(2, at=0.0)
    assert not untold.is_held(early)
    assert not told.is_held(early)
    assert told.survey_apart(survey(2)).tube == OTHER + 3
    assert told.survey_apart(early) is early
