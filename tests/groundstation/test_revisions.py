"""A survey that is said again takes the place of the one before: it is as if the last word were the only one."""

import math
from pathlib import Path
from typing import Any

import orjson
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from schemas import shown_on
from string_passes import Placed, passes

from groundstation.config import GroundConfig
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.paths import answer_header, find_path
from telemetry.frozen import replace
from telemetry.messages import NodeFlag

STOPS = 5
LATER = 1000  # numbers of revisions; those of surveys are the stop's
SELECTIONS: list[dict[str, str]] = [
    {}, {"tube": "2"}, {"station": "2..3"}, {"station": "1", "tube": "2.."}, {"since": "1", "limit": "3"},
    {"tube": "9"},
]  # fmt: skip


def heard(tmp_path: Path, measurements: list[Placed]) -> RigModel:
    model = RigModel.begin(GroundConfig(folder=tmp_path))
    model.string.tally.restore(list(range(STOPS, 0, -1)))
    for measurement, md in measurements:
        model.placement.place_one(measurement, md)
    return model


def shown(model: RigModel) -> dict[str, Any]:
    """What operators see, but for the numbers that say in which order it came."""
    rows = shown_on(model, "measurements")["measurements"]
    for row in rows:
        del row["seq"], row["replaces"]
    return {
        "measurements": rows,
        "stations": shown_on(model, "stations")["stations"],
        "trajectory": shown_on(model, "trajectory")["points"],
        "moved": [(one.md, one.at, one.dropped) for one in model.hole.moved],
    }


def same(one: Any, other: Any) -> bool:
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == pytest.approx(other, rel=1e-7, abs=1e-12)) if isinstance(one, float) else one == other


def revised(placed: Placed, number: int, moved: float) -> Placed:
    measurement, md = placed
    again = replace(measurement, sequence=number, yaw=measurement.yaw + moved, yaw_var=0.25 * measurement.yaw_var)
    return again, md


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=40, deadline=None)
@given(st.data())
def test_the_last_word_of_every_survey_counts_in_whatever_order_they_come(tmp_path: Path, data: st.DataObject) -> None:
    tilt = data.draw(st.sampled_from([0.0, 0.8]))
    first = passes(STOPS, lambda stop, station: 1.0 + tilt * (stop >= 4 and station >= 2))
    chosen = data.draw(st.lists(st.integers(0, len(first) - 1), max_size=8))
    said = [revised(first[place], LATER + n, 1e-3 * (n + 1)) for n, place in enumerate(chosen)]
    last = dict(zip(chosen, said, strict=True))
    course = [*first]
    for place, one in zip(chosen, said, strict=True):
        course.insert(data.draw(st.integers(course.index(first[place]) + 1, len(course))), one)
    final = [last.get(place, one) for place, one in enumerate(first)]
    assert same(shown(heard(tmp_path, course)), shown(heard(tmp_path, final)))


def test_a_revision_says_what_it_replaces_and_is_new_in_the_stream(tmp_path: Path) -> None:
    first = passes(2, lambda _stop, _station: 1.0)
    model = heard(tmp_path, first)
    newest = shown_on(model, "measurements")["newest"]
    model.placement.place_one(*revised(first[0], 7, 1e-3))
    model.placement.place_one(*revised(first[0], 9, 2e-3))
    answer = shown_on(model, "measurements", since=str(newest), limit="10")
    assert [(row["sequence"], row["replaces"], row["seq"]) for row in answer["measurements"]] == [(9, 7, newest + 2)]
    assert len(shown_on(model, "measurements")["measurements"]) == len(first)


def test_an_older_word_that_comes_late_changes_nothing(tmp_path: Path) -> None:
    first = passes(2, lambda _stop, _station: 1.0)
    model = heard(tmp_path, [*first, revised(first[1], 9, 2e-3)])
    before, version = shown(model), model.hole.version
    model.placement.place_one(*revised(first[1], 7, 1e-3))
    model.placement.place_one(*first[1])
    assert shown(model) == before
    assert model.hole.version == version


def test_a_survey_whose_yaw_becomes_known_is_trusted_from_then_on(tmp_path: Path) -> None:
    first = passes(1, lambda _stop, _station: 1.0)
    measurement, md = first[0]
    unknown = replace(measurement, flags=NodeFlag.RESTORED | NodeFlag.AIDING_OLD), md
    model = heard(tmp_path, [unknown])
    assert [station.untrusted for station in model.hole.stations] == [1]
    model.placement.place_one(*revised((measurement, md), 5, 0.0))
    assert [station.untrusted for station in model.hole.stations] == [0]
    assert model.hole.stations[0].is_trusted


def test_a_better_yaw_shows_in_the_station(tmp_path: Path) -> None:
    first = passes(1, lambda _stop, _station: 30.0)
    model = heard(tmp_path, first)
    (before,) = shown_on(model, "stations")["stations"]
    model.placement.place_one(*revised(first[0], 5, math.radians(1.0)))
    (after,) = shown_on(model, "stations")["stations"]
    assert after["azimuth_deg"] - before["azimuth_deg"] == pytest.approx(1.0)
    assert after["sigma_yaw_deg"] == pytest.approx(0.5 * before["sigma_yaw_deg"])


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=40, deadline=None)
@given(st.data())
def test_the_text_of_all_measurements_is_that_of_now_however_often_it_was_asked_for(
    tmp_path: Path, data: st.DataObject
) -> None:
    first = data.draw(st.permutations(passes(3, lambda _stop, _station: 1.0)))  # a station may come above others
    course = first + [revised(one, LATER + n, 1e-3) for n, one in enumerate(data.draw(st.permutations(first))[:3])]
    model = heard(tmp_path, [])
    path = find_path(model, "measurements")
    for placed in course:
        model.placement.place_one(*placed)
        for parameters in data.draw(st.lists(st.sampled_from(SELECTIONS), max_size=3)):
            shown_now = shown_on(model, "measurements", **parameters)
            answer = orjson.loads(path.json(model, parameters))
            assert {name: answer[name] for name in shown_now} == orjson.loads(orjson.dumps(shown_now))
            assert list(answer) == [*vars(answer_header(model)), *shown_now]
