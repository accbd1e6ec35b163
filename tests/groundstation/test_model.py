"""What the ground station makes of surveys, without any bus: stations, holes that moved, columns, alarms, views."""

import math
import pickle
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hand_fed import FOLLOWED
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from schemas import shown_on
from string_passes import BETWEEN_STOPS, COV, DEG, differing, knowing, passes, result, survey
from test_movement import moving

from groundstation.config import GroundConfig
from groundstation.errors import SelectorError
from groundstation.service.answers.model import RigModel
from groundstation.service.string.stored import Stored
from groundstation.survey.well.ellipsoid import plan_ellipse
from telemetry.messages import ImuMean, NodeFlag, SurveyMeasurement


@pytest.mark.slow
@settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(shuffler=st.randoms(use_true_random=False))
@pytest.mark.parametrize("apart", [0.5, 4.0, 7.0, 16.0])
@pytest.mark.parametrize("moves", [False, True], ids=["stays", "moves"])
def test_surveys_may_come_in_any_order(tmp_path: Path, moves: bool, apart: float, shuffler: random.Random) -> None:
    measurements = passes(4, lambda stop, station: 1.0 + 0.1 * station + (1.0 if moves and stop == 4 else 0.0), apart)
    expected = result(knowing(tmp_path, measurements, 4))
    shuffled = measurements[:]
    shuffler.shuffle(shuffled)
    assert differing(result(knowing(tmp_path, shuffled, 4)), expected) == []


def test_a_late_survey_clears_no_alarm_before_it_was_raised(tmp_path: Path) -> None:
    model = knowing(tmp_path, [(survey(1, 2, 1, 2.0), 4.0)], 1, tolerance="5-cm")
    assert model.hole.alarms.active
    assert model.placement.place_one(survey(1, 1, 1, 2.0, azimuth_deg=180.0), 2.0) == ""
    assert any(alarm.cleared_at is not None for alarm in model.hole.alarms.alarms)
    for alarm in model.hole.alarms.alarms:
        assert alarm.cleared_at is None or alarm.cleared_at >= alarm.raised_at


def test_it_does_not_matter_whether_somebody_looks_between_two_surveys(tmp_path: Path) -> None:
    """What follows from the surveys of a stop is worked out once; looked at after each it is the same, bit for bit."""
    measurements = moving(5, 5)
    looked_at = knowing(tmp_path, [], 5)
    for measurement, md in measurements:
        looked_at.placement.place_one(measurement, md)
        assert looked_at.hole.trajectory[-1].md == looked_at.hole.stations[-1].md
    together = knowing(tmp_path, measurements, 5)
    assert pickle.dumps(result(looked_at)) == pickle.dumps(result(together))
    assert [moment.rows[-1].md for moment in together.hole.history.moments] == [2.0, 4.0, 6.0, 8.0]


def test_surveys_of_one_stop_that_come_late_change_nothing(tmp_path: Path) -> None:
    measurements = moving(5, 5)
    late = [placed for placed in measurements if placed[0].sequence == 2]
    others = [placed for placed in measurements if placed[0].sequence != 2]
    in_order, out_of_order = (result(knowing(tmp_path, m, 5)) for m in (measurements, others + late))
    assert differing(out_of_order, in_order) == []


def test_a_measurement_that_is_none_is_counted_and_changes_nothing(tmp_path: Path) -> None:
    model = knowing(tmp_path, passes(2, lambda _stop, _station: 1.0), 2)
    before = result(model)
    bad = SurveyMeasurement(1, 9, 2000.0, 1, (ImuMean((0.0, 0.0, 0.0), COV),), 0.0, 1e-8, 1e-8, 32, 20.0, NodeFlag.NONE)
    assert model.placement.place_one(bad, 2.0) == "survey_refused"
    assert model.placement.wait_for_depth(Stored(survey(1, 10, 1, 1.0), None)) == ""
    assert (model.placement.refused, model.placement.unplaced) == (1, 1)
    assert differing(result(model), before) == []


def test_the_random_part_of_a_station_shrinks_and_its_joints_stay(tmp_path: Path) -> None:
    def stds(count: int) -> dict[str, Any]:
        measurements = [(survey(1, stop, 1, 5.0), 2.0) for stop in range(1, count + 1)]
        view = shown_on(knowing(tmp_path, measurements, 1, weighting="bayes"), "uncertainty")
        return view["stations"][-1]["sources"]

    one, nine = stds(1), stds(9)
    assert nine["random"]["sigma_north_m"] == pytest.approx(one["random"]["sigma_north_m"] / 3.0, rel=1e-6)
    for kind in ("joints", "mounts", "accelerometer_bias"):
        assert nine[kind]["sigma_east_m"] == pytest.approx(one[kind]["sigma_east_m"], rel=1e-6)


def test_uncertainty_is_told_at_a_confidence_with_its_sources(tmp_path: Path) -> None:
    model = knowing(tmp_path, passes(4, lambda _stop, station: 1.0 + station), 4)
    view = shown_on(model, "uncertainty")
    assert view["confidence"] == 0.95
    assert view["sigma_plane"] == pytest.approx(2.4477, abs=1e-4)
    assert view["sigma_space"] == pytest.approx(2.7955, abs=1e-4)
    assert [row["md_m"] for row in view["stations"]] == [0.0, 2.0, 4.0, 6.0, 8.0]
    for row, point in zip(view["stations"], model.hole.trajectory, strict=True):
        ellipse, sources = plan_ellipse(point.cov, view["sigma_plane"]), row["sources"]
        assert row["plan_ellipse"]["major_m"] == pytest.approx(ellipse.major)
        assert row["plan_ellipse"]["minor_m"] == pytest.approx(ellipse.minor)
        assert row["plan_ellipse"]["azimuth_deg"] == pytest.approx(math.degrees(ellipse.azimuth))
        sizes = [axis["semi_axis_m"] for axis in row["ellipsoid"]]
        variances = np.maximum(np.linalg.eigvalsh(point.cov)[::-1], 0.0)
        assert sizes == pytest.approx(list(2.7955 * np.sqrt(variances)), rel=1e-4, abs=1e-9)
        for axis, name in enumerate(("sigma_north_m", "sigma_east_m", "sigma_tvd_m")):
            squares = sum(source[name] ** 2 for source in sources.values())
            assert squares == pytest.approx(point.cov[axis, axis], rel=1e-6, abs=1e-15)
    told = {"random", "mounts", "joints", "accelerometer_bias", "depth", "path", "collar", "north"}
    assert set(view["stations"][-1]["sources"]) == told


def test_another_confidence_scales_the_regions(tmp_path: Path) -> None:
    model = knowing(tmp_path, passes(2, lambda _stop, _station: 1.0), 2)
    half = shown_on(model, "uncertainty", confidence="0.5")
    assert half["confidence"] == 0.5
    assert half["sigma_plane"] == pytest.approx(math.sqrt(2.0 * math.log(2.0)))
    major, wanted = half["stations"][-1]["plan_ellipse"]["major_m"], model.hole.trajectory[-1].cov
    assert major == pytest.approx(half["sigma_plane"] * math.sqrt(np.linalg.eigvalsh(wanted[:2, :2])[-1]))


@pytest.mark.parametrize("text", ["", "abc", "0", "1", "-0.5", "95", "nan", "inf", "1e-999"])
def test_a_confidence_that_is_none_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(SelectorError, match="confidence"):
        shown_on(RigModel.begin(GroundConfig(folder=tmp_path)), "uncertainty", confidence=text)


def test_views_of_nothing_have_the_collar_alone(tmp_path: Path) -> None:
    model = RigModel.begin(GroundConfig(folder=tmp_path))
    assert [row["md_m"] for row in shown_on(model, "uncertainty")["stations"]] == [0.0]
    column = shown_on(model, "column")
    assert [row["deviation_cm"] for row in column["stations"]] == [0.0]
    assert column["projection"] is None
    assert column["dominant"] is None
    alarms = shown_on(model, "alarms")
    assert (alarms["active"], alarms["cleared"], alarms["moved"]) == ([], [], [])


FIRST_LEG = 2.0 / DEG * (1.0 - math.cos(DEG))  # m aside, of an arc of 2 m from the vertical to 1 deg


def column_of(tmp_path: Path, inclination: float, azimuth: float, **settings: Any) -> tuple[RigModel, dict[str, Any]]:
    """Five stations of a hole that leans alike all along, each read by the tube at the bit."""
    measurements = [(survey(1, stop, 1, inclination, azimuth), 2.0 * stop) for stop in range(1, 6)]
    model = knowing(tmp_path, measurements, 1, **FOLLOWED | settings)
    return model, shown_on(model, "column")


def test_a_column_is_told_in_centimetres_percent_and_degrees(tmp_path: Path) -> None:
    model, view = column_of(tmp_path, 1.0, 120.0)
    assert view["design"] == {
        "inclination_deg": 0.0, "azimuth_deg": 0.0, "target_m": 30.0, "radius_m": 0.6, "tolerance": "en-12716",
        "course_m": [[0.0, 0.0, 0.0, 0.0], [30.0, 0.0, 0.0, 30.0]],
    }  # fmt: skip
    toe, point = view["stations"][-1], model.hole.trajectory[-1]
    lateral = 8.0 * math.sin(DEG) + FIRST_LEG
    assert toe["md_m"] == 10.0
    assert toe["deviation_cm"] == pytest.approx(100.0 * lateral, rel=1e-6)
    assert toe["north_cm"] == pytest.approx(-50.0 * lateral, rel=1e-6)
    assert toe["east_cm"] == pytest.approx(100.0 * lateral * math.sqrt(0.75), rel=1e-6)
    assert toe["direction_deg"] == pytest.approx(120.0)
    assert toe["along_m"] == pytest.approx(point.position[2])
    assert toe["deviation_percent"] == pytest.approx(100.0 * lateral / point.position[2], rel=1e-6)
    assert toe["limit_cm"] == pytest.approx(5.0 + 2.0 * point.position[2])
    assert toe["used_percent"] == pytest.approx(100.0 * 100.0 * lateral / toe["limit_cm"], rel=1e-6)
    assert toe["level_percent"] == 50
    unit = np.array([math.cos(120.0 * DEG), math.sin(120.0 * DEG)])
    assert toe["sigma_cm"] == pytest.approx(100.0 * math.sqrt(unit @ point.cov[:2, :2] @ unit), rel=1e-6)
    assert view["worst"] == max(view["stations"], key=lambda row: row["used_percent"])


def test_a_column_is_projected_to_its_target(tmp_path: Path) -> None:
    _, view = column_of(tmp_path, 1.0, 120.0, curvature_std_deg_per_m=0.3)
    toe, projection = view["stations"][-1], view["projection"]
    expected = toe["deviation_cm"] + 100.0 * (30.0 - toe["along_m"]) * math.tan(DEG)
    assert projection["deviation_cm"] == pytest.approx(expected, rel=1e-3)  # it has gone straight so far
    assert projection["along_m"] == 30.0
    assert projection["limit_cm"] == pytest.approx(65.0)
    assert projection["sigma_cm"] > toe["sigma_cm"]
    ahead = view["ahead"]
    assert ahead["cone"][-1]["deviation_cm"] == projection["deviation_cm"]
    assert ahead["cone"][-1]["half_width_cm"] == pytest.approx(ahead["half_width_cm"])
    assert [row["md_m"] for row in ahead["cone"]] == pytest.approx(
        np.linspace(10.0, projection["md_m"], 9)[1:].tolist()
    )
    assert 5.0 < ahead["half_width_cm"] < 60.0  # of 20 m of a hole that is 10 m deep
    assert toe["sigma_cm"] < ahead["surveyed_sigma_cm"] < projection["sigma_cm"]


def test_the_view_says_which_angle_dominates(tmp_path: Path) -> None:
    _, steep = column_of(tmp_path, 0.3, 10.0)
    assert steep["dominant"]["angle"] == "inclination"
    assert steep["dominant"]["by_inclination_m"] > 0.0
    _, flat = column_of(tmp_path, 60.0, 10.0, design_inclination_deg=60.0, design_azimuth_deg=10.0)
    assert flat["dominant"]["angle"] == "azimuth"


def test_a_column_along_its_inclined_design_does_not_deviate(tmp_path: Path) -> None:
    design = {"design_inclination_deg": 10.0, "design_azimuth_deg": 70.0}
    collar = {"collar_inclination_deg": 10.0, "collar_azimuth_deg": 70.0}
    _, view = column_of(tmp_path, 10.0, 70.0, **design, **collar)
    for row in (*view["stations"], view["projection"]):
        assert row["deviation_cm"] == pytest.approx(0.0, abs=1e-9)


def test_a_column_along_its_inclined_design_deviates_by_its_vertical_start_alone(tmp_path: Path) -> None:
    design = {"design_inclination_deg": 10.0, "design_azimuth_deg": 70.0}
    _, view = column_of(tmp_path, 10.0, 70.0, **design, collar_inclination_deg=0.0)
    bend = 10.0 * DEG  # an arc from the vertical falls behind the chord of the design
    along, aside = 2.0 / bend * math.sin(bend), 2.0 / bend * (1.0 - math.cos(bend))
    start = 100.0 * (along * math.sin(bend) - aside * math.cos(bend))
    assert [row["deviation_cm"] for row in view["stations"][1:]] == pytest.approx([start] * 5, rel=1e-6)
    assert view["projection"]["deviation_cm"] == pytest.approx(start, abs=view["ahead"]["half_width_cm"])


def test_a_column_that_leaves_its_tolerance_raises_alarms_with_their_threshold(tmp_path: Path) -> None:
    model, _ = column_of(tmp_path, 1.0, 120.0, tolerance="5-cm")
    view = shown_on(model, "alarms")
    assert view["levels_percent"] == [50, 80, 100]
    deviations = {row["level_percent"]: row for row in view["active"] if row["kind"] == "deviation"}
    assert set(deviations) == {50, 80, 100}
    assert deviations[50]["threshold_cm"] == pytest.approx(2.5)
    assert deviations[80]["threshold_cm"] == pytest.approx(4.0)
    # an arc of 2 m and 2 m straight: 1.75 cm at 2 m, 5.24 cm at 4 m
    assert deviations[50]["md_m"] == deviations[100]["md_m"] == 4.0
    assert deviations[100]["deviation_cm"] == pytest.approx(100.0 * (2.0 * math.sin(DEG) + FIRST_LEG), rel=1e-6)
    assert deviations[50]["raised_at_s"] == pytest.approx(2 * BETWEEN_STOPS, abs=5.0)
    assert deviations[50]["cleared_at_s"] is None
    projected = [row for row in view["active"] if row["kind"] == "projection"]
    assert {row["raised_at_s"] for row in projected} == {BETWEEN_STOPS + 0.5}
    assert view["cleared"] == []


def test_an_alarm_of_a_projection_is_cleared_when_the_hole_is_steered_back(tmp_path: Path) -> None:
    measurements = [(survey(1, stop, 1, 2.0), 2.0 * stop) for stop in range(1, 3)]
    measurements += [(survey(1, stop, 1, 0.0), 2.0 * stop) for stop in range(3, 13)]
    view = shown_on(knowing(tmp_path, measurements, 1), "alarms")
    cleared = {row["level_percent"]: row["cleared_at_s"] for row in view["cleared"] if row["kind"] == "projection"}
    assert set(cleared) == {50, 80, 100}
    # not by the first survey that is straight again, which says little of the 24 m ahead: once 80 % lie within
    assert 3 * BETWEEN_STOPS + 0.5 < cleared[100] <= cleared[80] <= cleared[50]
    assert [row for row in view["active"] if row["kind"] == "projection"] == []
