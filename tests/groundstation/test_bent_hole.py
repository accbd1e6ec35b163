"""The ground station of a string that its bent hole turns: what follows from surveys, in whatever order they come."""

from __future__ import annotations

import math
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hand_fed import FOLLOWED, TOLD
from schemas import check_answers, shown_on
from string_passes import survey

from borechain.drilling.inline import InlineRig
from groundstation.config import GroundConfig
from groundstation.service.answers.model import RigModel
from sim.rig.ground_settings import ground_settings
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import SurveyMeasurement

INCLINATION_DEG, STEP_DEG = 30.0, 4.0
LACKED_DEG = STEP_DEG * (1.0 - math.cos(math.radians(INCLINATION_DEG)))  # a station
BENT: dict[str, Any] = {"string_transport": "parallel", "collar_inclination_deg": INCLINATION_DEG}
Placed = tuple[SurveyMeasurement, float]


def passes(stops: int) -> list[Placed]:
    """Tubes that pass a helix; each lacks in its azimuth what the string turns by above its station."""
    return [
        (survey(tube, stop, station, INCLINATION_DEG, station * (STEP_DEG - LACKED_DEG)), 2.0 * station)
        for stop in range(1, stops + 1)
        for tube in range(1, stop + 1)
        for station in [stop - tube + 1]
    ]


def model_of(folder: Path, placed: list[Placed], **settings: Any) -> RigModel:
    model = RigModel.begin(GroundConfig(folder=folder, **TOLD | FOLLOWED | settings))
    model.string.tally.restore([5, 4, 3, 2, 1])
    for measurement, md in placed:
        assert model.placement.place_one(measurement, md) == ""
        _ = model.hole.trajectory  # what follows from each is worked out as it comes
    return model


def rows(model: RigModel) -> list[dict[str, Any]]:
    check_answers(model)
    found: list[dict[str, Any]] = shown_on(model, "stations")["stations"]
    return found


def test_stations_have_the_transport_and_measurements_have_not(tmp_path: Path) -> None:
    model = model_of(tmp_path, passes(5), **BENT)
    for n, row in enumerate(rows(model), 1):
        # a leg of 4 degrees of azimuth is no arc: 4e-4 degrees each
        assert row["azimuth_deg"] == pytest.approx(n * STEP_DEG, abs=3e-3)
        assert row["transport_deg"] == pytest.approx(n * LACKED_DEG, abs=3e-3)
        assert 0.0 < row["sigma_transport_deg"] < 0.05
        for measured in shown_on(model, f"stations/{n}/measurements")["measurements"]:
            assert measured["azimuth_deg"] == pytest.approx(row["azimuth_deg"] - row["transport_deg"], abs=1e-6)


def test_without_transport_nothing_is_added(tmp_path: Path) -> None:
    model = model_of(tmp_path, passes(5), collar_inclination_deg=INCLINATION_DEG)
    for n, row in enumerate(rows(model), 1):
        assert (row["transport_deg"], row["sigma_transport_deg"]) == (0.0, 0.0)
        assert row["azimuth_deg"] == pytest.approx(n * (STEP_DEG - LACKED_DEG), abs=1e-8)  # a hole is calm among others


@pytest.mark.parametrize("seed", range(4))
def test_surveys_may_come_in_any_order_and_late(tmp_path: Path, seed: int) -> None:
    placed = passes(5)
    shuffled = random.Random(seed).sample(placed, len(placed))
    one, other = (model_of(tmp_path, order, **BENT) for order in (placed, shuffled))
    for row, same in zip(rows(one), rows(other), strict=True):
        assert row == {key: pytest.approx(value, rel=1e-9, abs=1e-12) for key, value in same.items()}
    for point, same_point in zip(one.hole.trajectory, other.hole.trajectory, strict=True):
        assert np.allclose(point.cov, same_point.cov, rtol=1e-9, atol=1e-18)


def test_a_station_between_two_others_changes_what_is_below_it(tmp_path: Path) -> None:
    """Before it came the hole was one arc there; what that is off by is in the uncertainty."""
    late = [one for one in passes(5) if one[1] == 4.0]
    model = model_of(tmp_path, [one for one in passes(5) if one[1] != 4.0], **BENT)
    before = rows(model)[-1]
    assert before["transport_deg"] != pytest.approx(5.0 * LACKED_DEG, abs=1e-4)
    assert abs(before["transport_deg"] - 5.0 * LACKED_DEG) < 3.0 * before["sigma_transport_deg"]
    for measurement, md in late:
        model.placement.place_one(measurement, md)
    after = rows(model)[-1]
    assert abs(after["transport_deg"] - 5.0 * LACKED_DEG) < abs(before["transport_deg"] - 5.0 * LACKED_DEG)


@pytest.mark.slow
def test_a_rig_in_a_bent_hole_knows_where_it_is(tmp_path: Path) -> None:
    tables: dict[str, Any] = {
        "rig": {"tubes": 3, "tube_length_m": 2.0},
        "path": {"spiral": {"inclination_deg": 30.0, "turn_deg": 20.0}},
        "schedule": {"add_s": 60.0, "joint_s": 20.0, "stop_s": 32.0, "finish_s": 20.0},
        "rotation": {"turns": 5.3},
        "rough": {"samples_hz": 50.0, "string": {"transport": "parallel"}},
    }
    world = World(scenario_of(tables), 3)
    rig = InlineRig(world, ground_settings(world), "rig-1", tmp_path)
    rig.run()
    found = rig.ask("stations")["stations"]
    rig.close()
    assert [row["md_m"] for row in found if row["md_m"] > 0.0] == [2.0, 4.0, 6.0]
    assert found[-1]["transport_deg"] > 2.0
    for row in found:
        off = row["azimuth_deg"] - world.truth_station(row["md_m"])["azimuth_deg"]
        assert abs(off) < 3.0 * row["sigma_azimuth_deg"] < 0.6, row["md_m"]
