"""A reading that points back up the hole: told by the depth of its station, and nothing is raised."""

import math
from array import array
from pathlib import Path

import numpy as np
import pytest
from hand_fed import Rig
from hypothesis import given
from hypothesis import strategies as st

from groundstation.service.hole.adjusted_stations import may_turn_back
from groundstation.service.hole.resolved_stops import ResolvedStops
from groundstation.service.hole.station import SurveyStation
from groundstation.survey.fusion.resolve import known_direction
from groundstation.survey.well.trajectory import Trajectory


def test_a_survey_that_points_back_up_is_named_and_the_verdict_is_that_it_is_not_known(tmp_path: Path) -> None:
    rig = Rig(tmp_path, target=8.0)
    rig.run(5.0)
    rig.drill(1, 1.0)
    rig.drill(2, 179.0)
    told = rig.ask("verdict")
    assert told["verdict"] == "dont_know"
    assert any("the survey at 4.0 m points back up the hole" in why for why in told["why"])
    rig.run(5.0)
    alarms = [row for row in rig.ask("alarms")["rig"] if row["code"] == "survey_refused"]
    assert [row["subject"] for row in alarms] == ["station at 4.00 m"]
    for path in ("trajectory", "stations", "uncertainty", "column"):
        assert rig.ask(path)
    rig.ground.close()


@pytest.mark.parametrize("azimuth", [0.0, 2.0])
def test_stations_exactly_opposite_are_drawn_and_told(azimuth: float) -> None:
    drawn = Trajectory()
    drawn.put([(2.0, known_direction(0.5, azimuth)), (4.0, known_direction(math.pi - 0.5, azimuth + math.pi))])
    assert drawn.turned_back == [4.0]
    assert np.all(np.isfinite(drawn.positions))
    assert np.all(np.isfinite(drawn.covs))
    drawn.put([(4.0, known_direction(0.5, azimuth))])
    assert drawn.turned_back == []


def test_a_hole_through_the_horizontal_and_beyond_turns_nowhere_back() -> None:
    drawn = Trajectory()
    drawn.put([(float(k), known_direction(math.radians(5.0 * k), 0.3)) for k in range(1, 35)])
    assert drawn.turned_back == []


@given(
    seed=st.integers(0, 2**32 - 1), counts=st.lists(st.integers(1, 4), min_size=1, max_size=6),
    apart_deg=st.floats(0.0, 90.0),
)  # fmt: skip
def test_no_station_is_passed_over_that_has_a_survey_far_from_one_above(
    seed: int, counts: list[int], apart_deg: float
) -> None:
    """Whatever two surveys of two stations are apart by 60 deg, they are looked at."""
    random, table = np.random.default_rng(seed), ResolvedStops(sum(counts))
    tangents = np.array([0.0, 0.0, 1.0]) + math.radians(apart_deg) * random.standard_normal((sum(counts), 3))
    table.rows["tangent"][:] = tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
    stations, rows = list[SurveyStation](), iter(random.permutation(sum(counts)).tolist())
    for place, count in enumerate(counts):
        stations.append(SurveyStation(2.0 * (place + 1), table))
        stations[-1].stops.rows = array("I", [next(rows) for _ in range(count)])
    above = np.array([[0.0, 0.0, 1.0]])
    suspected = may_turn_back(above[0], stations, table)
    for place, station in enumerate(stations):
        here = table.rows["tangent"][list(station.stops.rows)]
        if float((here @ above.T).min()) < math.cos(math.radians(60.0)):
            assert place in suspected
        above = here
    assert suspected == sorted(set(suspected))


def test_a_straight_hole_has_no_station_looked_at() -> None:
    table = ResolvedStops(6)
    table.rows["tangent"][:] = [*known_direction(0.1, 1.0).lean.tolist(), math.cos(0.1)]
    stations = [SurveyStation(float(k + 1), table) for k in range(3)]
    for k, station in enumerate(stations):
        station.stops.rows = array("I", [2 * k, 2 * k + 1])
    assert may_turn_back(np.array([0.0, 0.0, 1.0]), stations, table) == []
    assert may_turn_back(np.array([0.0, 0.0, -1.0]), stations, table) == [0]
