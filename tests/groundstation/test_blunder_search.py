"""The search for what is wrong on a thread of its own: it ends as a search at once does, and says so before."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from string_passes import Placed, knowing, passes
from test_adjusted_hole import ALIGNED, blamed, numbers_of

from groundstation.ground_host import run_on_thread
from groundstation.service.alarms.verdict_doubts import known_of
from groundstation.service.alarms.verdict_words import VerdictDoubt
from groundstation.service.answers.model import RigModel
from groundstation.service.hole.examined_hole import UNEXPLAINED

STOPS = 6


def moved_hole() -> list[Placed]:
    """Two stations move before the last stop."""
    return passes(STOPS, lambda stop, station: 2.0 if stop == STOPS and station in (1, 2) else 1.0)


def told(model: RigModel) -> list[str]:
    doubts = known_of(model.config, model.string, model.setup, model.hole, model.rig_alarms).doubts
    return [text for doubt, text in doubts if doubt is VerdictDoubt.CONTRADICTION]


def searched_through(model: RigModel) -> None:
    """Let every search end, also those that its end begins."""
    search = model.hole._adjustment._search
    assert search is not None
    assert model.hole.examined is not None
    for _ in range(4):
        search.wait()
        model.hole.adopt_found()
        assert model.hole.examined is not None


@pytest.fixture
def apart(tmp_path: Path) -> Iterator[RigModel]:
    model = knowing(tmp_path, [], STOPS, **ALIGNED)
    model.hole.search_apart(run_on_thread)
    yield model
    search = model.hole._adjustment._search
    if search is not None:
        search.wait()


def add_all(model: RigModel, placed: list[Placed], *, asked: bool) -> None:
    for measurement, md in placed:
        model.placement.place_one(measurement, md)
        if asked:
            assert model.hole.examined is not None
            model.hole.adopt_found()


@pytest.mark.parametrize("asked", [False, True])
def test_it_ends_with_what_a_search_at_once_comes_to_bit_for_bit(
    tmp_path: Path, apart: RigModel, *, asked: bool
) -> None:
    at_once = knowing(tmp_path, moved_hole(), STOPS, **ALIGNED)
    add_all(apart, moved_hole(), asked=asked)
    searched_through(apart)
    assert blamed(apart) == blamed(at_once)
    assert list(blamed(apart)) == ["hole"]
    assert numbers_of(apart) == numbers_of(at_once)
    assert apart.hole.deviations.offset.tolist() == at_once.hole.deviations.offset.tolist()
    assert apart.hole.examined is not None
    assert apart.hole.examined.surveys == len(moved_hole())
    assert told(apart) == told(at_once)


def test_until_it_ends_it_is_said_that_something_does_not_fit(apart: RigModel) -> None:
    add_all(apart, moved_hole(), asked=False)
    examined = apart.hole.examined
    assert examined is not None
    assert blamed(apart) == {}
    assert (examined.surveys, told(apart)) == (len(moved_hole()) - STOPS, [UNEXPLAINED])  # of the stops before
    before = apart.hole.version
    searched_through(apart)
    assert UNEXPLAINED not in told(apart)
    assert apart.hole.version > before


def test_what_was_found_stands_while_it_is_looked_for_again(apart: RigModel) -> None:
    placed = moved_hole()
    add_all(apart, placed[:-1], asked=False)
    searched_through(apart)
    found = list(blamed(apart))
    assert len(found) == 1
    apart.placement.place_one(*placed[-1])
    examined = apart.hole.examined
    assert examined is not None
    assert list(blamed(apart)) == found
    assert examined.surveys == len(placed) - 1


def test_an_honest_hole_is_not_searched(tmp_path: Path) -> None:
    placed = passes(5, lambda _stop, station: 1.0 + 0.1 * station)
    honest = ALIGNED | {"collar_std_deg": 2.0}
    apart, at_once = knowing(tmp_path, [], STOPS, **honest), knowing(tmp_path, placed, STOPS, **honest)
    apart.hole.search_apart(run_on_thread)
    add_all(apart, placed, asked=True)
    assert not apart.hole.adopt_found()
    assert numbers_of(apart) == numbers_of(at_once)


def test_a_station_that_comes_between_others_drops_what_was_found(apart: RigModel) -> None:
    """Places of stations are others then; what was found is looked for again and meanwhile not taken in."""
    placed = moved_hole()
    late = [one for one in placed if one[1] != min(md for _, md in placed)]
    add_all(apart, late, asked=False)
    searched_through(apart)
    add_all(apart, [one for one in placed if one not in late], asked=False)
    examined = apart.hole.examined
    assert examined is not None
    assert examined.surveys in (0, len(placed))
    searched_through(apart)
    assert list(blamed(apart)) == ["hole"]


def test_what_is_kept_of_a_stop_has_what_its_search_found(tmp_path: Path, apart: RigModel) -> None:
    """The next stop begins while the search of the one before still runs."""
    more = [one for one in passes(STOPS + 1, lambda _stop, _station: 1.0) if one[0].sequence > STOPS][:1]
    at_once = knowing(tmp_path, [], STOPS + 1, **ALIGNED)
    for model in (apart, at_once):
        model.hole.catch_up()
        add_all(model, [*moved_hole(), *more], asked=False)
    (*_, kept), (*_, expected) = apart.hole.history.moments, at_once.hole.history.moments
    assert (kept.number, kept.at) == (expected.number, expected.at)
    assert kept.found.tolist() == expected.found.tolist()
    assert list(blamed(apart)) == ["hole"]
