"""Resolved stops as rows of a table: what goes in comes out, in the order of time, and each takes little memory."""

import gc
import math
import tracemalloc
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.config import GroundConfig
from groundstation.service.answers.answer_texts import plain_answer
from groundstation.service.answers.measurement_views import measurement_rows
from groundstation.service.answers.model import RigModel
from groundstation.service.hole.resolved_stops import ResolvedStop, ResolvedStops
from groundstation.service.hole.resolving import Resolver
from groundstation.service.hole.station import StationStops
from groundstation.survey.fusion.fusion import Weighting
from groundstation.survey.fusion.resolve import Quality, direction_angles
from groundstation.survey.fusion.shared import SharedErrors
from groundstation.survey.fusion.sphere_direction import stds_of_directions
from groundstation.survey.fusion.trust_level import Trust
from telemetry.messages import ImuMean, NodeFlag, SurveyMeasurement

VAR = 1e-7
COV = ((VAR, 0.0, 0.0), (0.0, VAR, 0.0), (0.0, 0.0, VAR))
MOST_BYTES = {"bayes": 700, "adjusted": 1300}  # of a survey: an adjustment keeps what stations have of each tube
EVERY = (Trust.FULL, Trust.UNKNOWN_YAW)


def survey(tube: int, number: int, at: float, imus: int = 1) -> SurveyMeasurement:
    lean = 0.001 * tube
    force = (9.81 * math.sin(lean), 0.0, -9.81 * math.cos(lean))
    means = tuple(ImuMean((force[0] + 1e-4 * imu, *force[1:]), COV) for imu in range(imus))
    flags = NodeFlag.RESTORED if number % 2 else NodeFlag.NONE
    return SurveyMeasurement(tube, number, at, tube, means, 0.1 * tube, 1e-8, 1e-7, 32, 20.0, flags)


def stops_of(tube: int, number: int, at: float, imus: int = 1) -> ResolvedStops:
    """A table of one stop."""
    resolver = Resolver(9.81, SharedErrors(), 1e-8, 1e-3)
    measured = survey(tube, number, at, imus)
    (found,) = resolver.resolve_measurements([measured], [2.0 * tube], [list(range(tube + 1, tube + 3))], [[]])
    assert found is not None
    rows = found[0].rows
    rows["quality"] = Quality.MOTION | Quality.SPREAD if number % 3 == 0 else Quality.GOOD
    rows["trust"], rows["number"] = EVERY[number % 2], number
    return found[0]


def same(one: ResolvedStop, other: ResolvedStop) -> bool:
    arrays = ("causes", "places")
    plain = [field.name for field in fields(ResolvedStop) if field.name not in (*arrays, "direction")]
    of_direction = ("tangent", "own", "shared", "tangent_cov")
    return (
        all(getattr(one, name) == getattr(other, name) for name in plain)
        and all(np.array_equal(getattr(one, name), getattr(other, name)) for name in arrays)
        and all(np.array_equal(getattr(one.direction, name), getattr(other.direction, name)) for name in of_direction)
    )


@given(st.lists(st.tuples(st.integers(1, 50), st.integers(0, 20), st.integers(1, 4)), max_size=30))
def test_whatever_is_inserted_is_given_back_in_the_order_of_time(course: list[tuple[int, int, int]]) -> None:
    stops, expected = StationStops(ResolvedStops()), list[ResolvedStop]()
    for number, (tube, at, imus) in enumerate(course):
        table = stops_of(tube, number, float(at), imus)
        expected.append(table.stop(0))
        expected.sort(key=lambda known: known.order)
        place = stops.insert_stop(table, 0)
        assert expected[place].number == number
    assert len(stops) == len(expected)
    assert all(same(one, other) for one, other in zip(stops, expected, strict=True))
    assert [one.number for one in stops[:2]] == [one.number for one in expected[:2]]


def test_a_place_that_there_is_not_is_named() -> None:
    stops = StationStops(ResolvedStops())
    stops.insert_stop(stops_of(1, 1, 5.0), 0)
    assert stops[-1].number == 1
    with pytest.raises(IndexError, match="stop 1: expected one of 1"):
        _ = stops[1]


def test_what_cannot_be_weighed_is_told_before_it_is_inserted() -> None:
    stops = stops_of(1, 1, 5.0)
    stops.rows["cov"] = stops.rows["causes"] = 0.0
    with pytest.raises(np.linalg.LinAlgError):
        stops.check_weights()


def test_a_departure_is_kept_until_an_earlier_stop_comes() -> None:
    stops = StationStops(ResolvedStops())
    for number, at in enumerate((5.0, 7.0, 9.0)):
        stops.insert_stop(stops_of(1, number, at), 0)
    stops.keep_departure(1, (np.array([1e-3, 2e-3]), 2.5))
    stops.keep_departure(2, (np.array([3e-3, 0.0]), 1.5))
    known = stops.departure(1)
    assert known is not None
    np.testing.assert_array_equal(known[0], [1e-3, 2e-3])
    assert known[1] == 2.5
    stops.insert_stop(stops_of(1, 3, 8.0), 0)
    assert stops.departure(1) is not None
    assert [stops.departure(place) for place in (0, 2, 3)] == [None, None, None]


def test_what_is_shown_of_many_surveys_is_what_each_of_them_says() -> None:
    """Measurements are shown column by column, those with equally many shared errors together."""
    table = ResolvedStops()
    found = [
        stops_of(tube, number, 10.0 * number, imus=1 + number % 3) for number, tube in enumerate((1, 4, 2, 4, 1), 1)
    ]
    known = [one.stop(0) for one in found]
    rows = [table.append_stop(one, 0) for one in found]
    shown = plain_answer(measurement_rows(table, rows[::-1], [3, 1, 1, 2, 9]))
    for view, one, station in zip(shown, known[::-1], (3, 1, 1, 2, 9), strict=True):
        inclination, azimuth = direction_angles(one.direction.lean, one.direction.down)
        (stds,) = stds_of_directions([one.direction])
        assert (view["seq"], view["tube"], view["station"], view["md_m"]) == (one.number, one.tube, station, one.md)
        assert (view["inclination_deg"], view["azimuth_deg"]) == (math.degrees(inclination), math.degrees(azimuth))
        shown_stds = (view["sigma_inclination_deg"], view["sigma_azimuth_deg"])
        assert shown_stds == pytest.approx(tuple(map(math.degrees, stds)), rel=1e-12)
        assert view["forces_mps2"] == [list(force) for force in one.forces]
        assert view["flags"] == (["restored"] if one.flags else [])
        assert view["trust"] == one.trust.name.lower()
        assert view["quality"] == (["motion", "spread"] if one.quality else [])
    assert measurement_rows(table, [], []) == []


@pytest.mark.slow
@pytest.mark.parametrize(("weighting", "stops"), [("bayes", 25), ("adjusted", 15)])
def test_a_survey_takes_little_memory(tmp_path: Path, weighting: str, stops: int) -> None:
    """Ten tubes that survey the same stations again and again.

    What a process keeps for every hole, such as what a path does over a length, the first hole has had worked out.
    """

    def drilled(name: str) -> tuple[int, int]:
        config = GroundConfig(folder=tmp_path / name, target=40.0, weighting=Weighting(weighting))
        model, taken = RigModel.begin(config), []
        model.string.tally.restore(list(range(10, 0, -1)))
        for stop in range(1, 4 * stops):
            for tube in range(1, 11):
                assert model.placement.place_one(survey(tube, stop, 100.0 * stop + 0.5 * tube), 2.0 * tube) == ""
            if stop + 1 in (2 * stops, 4 * stops):
                model.hole.settle()
                gc.collect()
                taken.append(tracemalloc.get_traced_memory()[0])
        assert sum(station.count for station in model.hole.stations) == 10 * (4 * stops - 1)
        return taken[0], taken[1]

    drilled("first")
    tracemalloc.start()
    try:
        before, after = drilled("second")
    finally:
        tracemalloc.stop()
    assert 200.0 < (after - before) / (20 * stops) < MOST_BYTES[weighting]
