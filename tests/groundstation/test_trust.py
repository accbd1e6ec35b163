"""Every flag of a survey has its stated effect on the fusion, whatever the rest of the survey is."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from schemas import shown_on

from groundstation.config import GroundConfig
from groundstation.service.answers.model import RigModel
from groundstation.survey.bearings import wrap_angle
from groundstation.survey.fusion.fusion import Weighting
from groundstation.survey.fusion.resolve import direction_angles, resolve_direction
from groundstation.survey.fusion.sphere_direction import UNKNOWN_YAW_VAR, stds_of_directions
from groundstation.survey.fusion.survey_trust import EFFECTS, trust_of, with_yaws_of
from groundstation.survey.fusion.trust_level import Trust
from telemetry.frozen import replace
from telemetry.messages import ImuMean, NodeFlag, SurveyMeasurement

G, DEG, VAR = 9.81, math.pi / 180.0, (0.0034**2) / 32
COV = ((VAR, 0.0, 0.0), (0.0, VAR, 0.0), (0.0, 0.0, VAR))
MD = 4.0


def force_at(inclination_deg: float) -> np.ndarray:
    """Specific force (m/s^2) of a tube that leans to the north at a yaw of 0."""
    return np.array([G * math.sin(inclination_deg * DEG), 0.0, -G * math.cos(inclination_deg * DEG)])


def survey(tube: int, yaw_error_deg: float = 0.0, flags: NodeFlag = NodeFlag.NONE) -> SurveyMeasurement:
    """A tube in a hole that leans by 5 deg to the north; its yaw is off by an error that its variance does not show."""
    lean = math.sin(5.0 * DEG)
    imus = (ImuMean((G * lean, 0.0, -G * math.cos(5.0 * DEG)), COV),)
    return SurveyMeasurement(
        tube, 1, 100.0 * tube, 1, imus, yaw_error_deg * DEG % math.tau, (0.002 * DEG) ** 2, (0.01 * DEG) ** 2, 32, 20.0,
        flags,
    )  # fmt: skip


def station_of(folder: Path, *surveys: SurveyMeasurement, **config: Any) -> dict[str, Any] | None:
    """What an operator sees of the one station."""
    model = RigModel.begin(GroundConfig(folder=folder, **config))
    for measurement in surveys:
        model.placement.place_one(measurement, MD)
    return shown_on(model, "stations")["stations"][0] if model.hole.stations else None


def test_every_flag_has_its_effect() -> None:
    assert set(EFFECTS) == {flag for flag in NodeFlag if flag}


@pytest.mark.parametrize("flag", [flag for flag, effect in EFFECTS.items() if effect is Trust.UNKNOWN_YAW])
@pytest.mark.parametrize("scheme", [one for one in Weighting if one is not Weighting.ADJUSTED])
def test_a_survey_with_an_unknown_yaw_moves_no_trusted_one(tmp_path: Path, flag: NodeFlag, scheme: Weighting) -> None:
    good, bad = survey(1), survey(2, 90.0, flag)
    alone, both = (station_of(tmp_path, *each, weighting=scheme) for each in ([good], [good, bad]))
    assert alone is not None
    assert both is not None
    assert both["untrusted_measurements"] == 1
    assert both["azimuth_deg"] % 360.0 == pytest.approx(alone["azimuth_deg"] % 360.0, abs=1e-9)
    assert both["sigma_azimuth_deg"] == pytest.approx(alone["sigma_azimuth_deg"])


@pytest.mark.parametrize("flag", [flag for flag, effect in EFFECTS.items() if effect is Trust.UNKNOWN_YAW])
def test_an_unknown_yaw_tells_an_adjustment_the_inclination_alone(tmp_path: Path, flag: NodeFlag) -> None:
    """Another look says how far the hole leans, and not to which side."""
    good, bad = survey(1), survey(2, 90.0, flag)
    adjusted = {"weighting": Weighting.ADJUSTED}
    alone, both = (station_of(tmp_path, *each, **adjusted) for each in ([good], [good, bad]))
    assert alone is not None
    assert both is not None
    assert both["sigma_azimuth_deg"] > 0.9 * alone["sigma_azimuth_deg"]
    moved = (both["azimuth_deg"] - alone["azimuth_deg"] + 180.0) % 360.0 - 180.0
    assert abs(moved) < 0.2 * alone["sigma_azimuth_deg"]


@pytest.mark.parametrize("flag", [flag for flag, effect in EFFECTS.items() if effect is Trust.UNKNOWN_YAW])
def test_alone_it_has_the_uncertainty_of_an_unknown_yaw(tmp_path: Path, flag: NodeFlag) -> None:
    seen = station_of(tmp_path, survey(1, 90.0, flag))
    assert seen is not None
    assert seen["sigma_azimuth_deg"] >= math.degrees(math.sqrt(UNKNOWN_YAW_VAR)) - 1e-6
    assert seen["sigma_yaw_deg"] >= math.degrees(math.sqrt(UNKNOWN_YAW_VAR)) - 1e-6
    assert seen["untrusted_measurements"] == seen["measurements"] == 1


def test_a_trusted_survey_that_comes_later_takes_the_station_over(tmp_path: Path) -> None:
    late = station_of(tmp_path, survey(2, 90.0, NodeFlag.YAW_UNTRUSTED), survey(1))
    alone = station_of(tmp_path, survey(1))
    assert late is not None
    assert alone is not None
    assert late["sigma_azimuth_deg"] < 1.1 * alone["sigma_azimuth_deg"]
    apart = (late["azimuth_deg"] - alone["azimuth_deg"] + 180.0) % 360.0 - 180.0
    assert abs(apart) < 0.2 * alone["sigma_azimuth_deg"]


def test_a_survey_of_a_faulty_sensor_is_set_aside(tmp_path: Path) -> None:
    model = RigModel.begin(GroundConfig(folder=tmp_path))
    assert model.placement.place_one(survey(1, flags=NodeFlag.SENSOR_FAULT), MD) == "survey_set_aside"
    assert model.hole.stations == []
    assert shown_on(model, "status")["set_aside_measurements"] == 1


def test_a_survey_without_rig_time_has_no_depth(tmp_path: Path) -> None:
    model = RigModel.begin(GroundConfig(folder=tmp_path))
    assert model.placement.place_one(survey(1, flags=NodeFlag.CLOCK_UNSYNCHRONISED), MD) == "survey_unplaced"
    assert shown_on(model, "status")["unplaced_measurements"] == 1


@pytest.mark.parametrize("flag", [flag for flag, effect in EFFECTS.items() if effect is Trust.FULL])
def test_a_flag_that_the_variance_answers_for_changes_nothing(tmp_path: Path, flag: NodeFlag) -> None:
    assert station_of(tmp_path, survey(1, flags=flag)) == station_of(tmp_path, survey(1))


def test_a_restored_yaw_counts_once_an_aiding_has_confirmed_it() -> None:
    assert trust_of(NodeFlag.RESTORED) is Trust.FULL
    assert trust_of(NodeFlag.RESTORED | NodeFlag.AIDING_OLD) is Trust.UNKNOWN_YAW


@given(st.integers(0, 0xFFFF), st.integers(0, 0xFFFF))
def test_a_further_flag_never_gains_trust(one: int, other: int) -> None:
    assert trust_of(NodeFlag(one | other)) >= max(trust_of(NodeFlag(one)), trust_of(NodeFlag(other)))


@given(st.floats(-180.0, 180.0), st.floats(0.01, 179.0))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_the_yaw_is_the_truth_is_within_the_uncertainty(yaw_error_deg: float, inclination_deg: float) -> None:
    known = resolve_direction(force_at(inclination_deg), np.array(COV), yaw_error_deg * DEG, 1e-8)
    seen = with_yaws_of(known, UNKNOWN_YAW_VAR)
    inclination, azimuth = direction_angles(seen.direction.lean, seen.direction.down)
    ((inclination_std, azimuth_std),) = stds_of_directions([seen.direction])
    assert abs(inclination - inclination_deg * DEG) < inclination_std
    assert abs(wrap_angle(azimuth)) < 1.74 * azimuth_std


@given(st.floats(-2.0, 2.0), st.floats(0.01, 60.0), st.floats(0.01, 179.0))
@example(2.0, 0.5, 85.0)
@example(2.0, 20.0, 90.0)
def test_a_yaw_that_is_off_by_two_sigmas_leaves_the_truth_within_two(
    sigmas: float, sigma_deg: float, inclination_deg: float
) -> None:
    """Its direction is on a circle: in a plane a sigma of 20 deg would put the truth a hundred sigmas away."""
    force, yaw_var = force_at(inclination_deg), (sigma_deg * DEG) ** 2
    seen = resolve_direction(force, np.array(COV), sigmas * sigma_deg * DEG, yaw_var).direction
    inclination, azimuth = direction_angles(seen.lean, seen.down)
    ((inclination_std, azimuth_std),) = stds_of_directions([seen])
    assert abs(inclination - inclination_deg * DEG) < 1e-6 * inclination_std + 1e-9
    assert abs(wrap_angle(azimuth)) <= 2.0 * max(azimuth_std, math.pi / 2.0 if azimuth_std >= math.pi else 0.0) + 1e-9


def test_of_two_surveys_the_one_whose_yaw_is_in_doubt_moves_nothing(tmp_path: Path) -> None:
    """One tube at one stop, before and after the encoder slipped by what its systematic variance says."""
    good, doubted = survey(1), replace(survey(1, 26.6), sequence=2, station_at=130.0, systematic_var=(23.5 * DEG) ** 2)
    station = station_of(tmp_path, good, doubted, collar_inclination_deg=5.0, collar_std_deg=0.5)
    assert station is not None
    assert station["inclination_deg"] == pytest.approx(5.0, abs=0.01)
    assert (station["azimuth_deg"] + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=0.05)


def test_an_unknown_flag_of_a_later_version_sets_aside(tmp_path: Path) -> None:
    assert station_of(tmp_path, replace(survey(1), flags=NodeFlag(1 << 15))) is None
