"""One frame an answer, tie-ons and programmes: against surveys that are turned, split and joined by hand."""

import math
from pathlib import Path

import numpy as np
import pytest
from wells import DEG, MWD

from groundstation.errors import SurveyError
from groundstation.survey.files.programme import read_programme, read_tie_on
from groundstation.survey.tools.instruments import load_tool
from groundstation.survey.well.analysis import Analysis, Stretch, analyse_survey, legs_of
from groundstation.survey.well.error_propagation import propagate_errors
from groundstation.survey.well.error_sources import Leg, Site, WellSurvey
from groundstation.survey.well.methods import Method, station_positions
from groundstation.survey.well.reference_frames import Norths, ReferenceFrame, TieOn
from groundstation.survey.well.well_record import SurveyRecord

SITE = Site(9.80665, 50_000.0, 72.0 * DEG, -4.0 * DEG, 60.0 * DEG)
NORTH_OF_SITE = 10.0 * DEG
CURVED = Method.MINIMUM_CURVATURE
GYRO = load_tool("gyro-continuous")


def record(count: int = 20, first: float = 0.0) -> SurveyRecord:
    md = first + 30.0 * np.arange(count)
    inclination = np.linspace(0.0 if first == 0.0 else 30.0, 60.0, count) * DEG
    return SurveyRecord(md, inclination, np.linspace(40.0, 80.0, count) * DEG, list(range(2, count + 2)), {})


def part(whole: SurveyRecord, keep: slice) -> SurveyRecord:
    return SurveyRecord(whole.md[keep], whole.inclination[keep], whole.azimuth[keep], whole.lines[keep], {})


def turned_by_hand(given: SurveyRecord, tool: object = MWD) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Azimuth, positions and covariances of a survey whose azimuths were turned before anything was computed."""
    azimuth = given.azimuth + NORTH_OF_SITE
    places = station_positions(CURVED, given.md, given.inclination, azimuth)
    survey = WellSurvey(given.md, given.inclination, azimuth, places[:, 2])
    return azimuth, places, propagate_errors(survey, [Leg(tool)], SITE, slot_allowance=tool.slot_allowance).cov  # type: ignore[arg-type,attr-defined]


@pytest.mark.parametrize("tool", [MWD, GYRO], ids=["magnetic", "gyro"])
def test_with_the_sites_north_at_ten_degrees_everything_is_in_one_frame(tool: object) -> None:
    given, section = record(), 55.0 * DEG
    frame = ReferenceFrame("site", "true", Norths(site=NORTH_OF_SITE))
    found = analyse_survey(given, CURVED, tool, SITE, section, frame)  # type: ignore[arg-type]
    azimuth, places, cov = turned_by_hand(given, tool)
    np.testing.assert_allclose(found.azimuth, azimuth, atol=1e-9)
    np.testing.assert_allclose(found.positions, places, atol=1e-9)
    np.testing.assert_allclose(found.uncertainty.cov, cov, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.closure_distance, np.hypot(places[:, 0], places[:, 1]), atol=1e-9)
    np.testing.assert_allclose(
        found.closure_azimuth[1:], np.arctan2(places[1:, 1], places[1:, 0]) % math.tau, atol=1e-9
    )
    along = places @ [math.cos(section), math.sin(section), 0.0]
    np.testing.assert_allclose(found.vertical_section, along, atol=1e-9)


def test_the_answer_in_the_sites_north_is_the_same_hole_turned_back() -> None:
    norths = Norths(site=NORTH_OF_SITE)
    site = analyse_survey(record(), CURVED, MWD, SITE, frame=ReferenceFrame("site", "site", norths))
    true = analyse_survey(record(), CURVED, MWD, SITE, frame=ReferenceFrame("site", "true", norths))
    c, s = math.cos(NORTH_OF_SITE), math.sin(NORTH_OF_SITE)
    back = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(site.positions, true.positions @ back.T, atol=1e-9)
    np.testing.assert_allclose(site.uncertainty.cov, back @ true.uncertainty.cov @ back.T, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(site.azimuth, record().azimuth, atol=1e-12)
    md = 100.0
    np.testing.assert_allclose(site.uncertainty.at(md), back @ true.uncertainty.at(md) @ back.T, rtol=1e-9, atol=1e-12)
    for name, cov in true.uncertainty.by_source().items():
        np.testing.assert_allclose(site.uncertainty.by_source()[name], back @ cov @ back.T, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("north", "angle_deg"), [("true", 0.0), ("grid", -1.5), ("magnetic", -4.0), ("site", 10.0)])
def test_a_record_of_any_north_is_the_same_hole(north: str, angle_deg: float) -> None:
    norths = Norths(NORTH_OF_SITE, -1.5 * DEG, -4.0 * DEG)
    given = record()
    shifted = SurveyRecord(given.md, given.inclination, given.azimuth - angle_deg * DEG, given.lines, {})
    found = analyse_survey(shifted, CURVED, MWD, SITE, frame=ReferenceFrame(north, "true", norths))
    expected = analyse_survey(given, CURVED, MWD, SITE, frame=ReferenceFrame("true", "true", norths))
    np.testing.assert_allclose(found.positions, expected.positions, atol=1e-9)
    np.testing.assert_allclose(found.uncertainty.cov, expected.uncertainty.cov, rtol=1e-9, atol=1e-12)


def test_a_record_that_begins_below_its_collar_is_refused() -> None:
    with pytest.raises(SurveyError, match="begins at 500 m, so nothing says where that is; expected the collar"):
        analyse_survey(record(first=500.0), CURVED, MWD, SITE)


def tied(whole: Analysis, k: int, frame: ReferenceFrame | None = None) -> TieOn:
    at = whole.record
    return TieOn(
        float(at.md[k]), float(at.inclination[k]), float(at.azimuth[k]), whole.positions[k], whole.uncertainty.cov[k]
    )


@pytest.mark.parametrize("shown", [True, False], ids=["station shown again", "station left out"])
def test_tied_on_at_a_station_the_hole_goes_on_where_it_was(shown: bool) -> None:
    whole = analyse_survey(record(30), CURVED, MWD, SITE)
    k = 17  # 510 m
    found = analyse_survey(
        part(record(30), slice(k if shown else k + 1, None)), CURVED, GYRO, SITE, tie_on=tied(whole, k)
    )
    np.testing.assert_allclose(found.positions, whole.positions[k:], atol=1e-9)
    lower = part(record(30), slice(k, None))
    survey = WellSurvey(lower.md, lower.inclination, lower.azimuth, whole.positions[k:, 2])
    expected = whole.uncertainty.cov[k] + propagate_errors(survey, [Leg(GYRO)], SITE).cov
    np.testing.assert_allclose(found.uncertainty.cov, expected, rtol=1e-9)
    parts = found.uncertainty.by_source()
    np.testing.assert_allclose(sum(parts.values())[1:], found.uncertainty.cov[1:], rtol=1e-9)
    np.testing.assert_array_equal(parts["tie-on"][3], whole.uncertainty.cov[k])


def test_a_tie_on_is_in_the_north_of_the_record() -> None:
    whole, norths = analyse_survey(record(30), CURVED, MWD, SITE), Norths(site=NORTH_OF_SITE)
    tie = tied(whole, 17)
    lower = part(record(30), slice(17, None))
    here = analyse_survey(lower, CURVED, GYRO, SITE, frame=ReferenceFrame("site", "site", norths), tie_on=tie)
    there = analyse_survey(lower, CURVED, GYRO, SITE, frame=ReferenceFrame("site", "true", norths), tie_on=tie)
    c, s = math.cos(NORTH_OF_SITE), math.sin(NORTH_OF_SITE)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(here.positions[0], tie.position, atol=1e-9)
    np.testing.assert_allclose(there.positions, here.positions @ turn.T, atol=1e-9)
    np.testing.assert_allclose(there.uncertainty.cov, turn @ here.uncertainty.cov @ turn.T, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("tie", "named"),
    [
        (TieOn(520.0, 0.5, 0.7, np.zeros(3)), "below the first station at 500 m"),
        (TieOn(500.0, 31.0 * DEG, 40.0 * DEG, np.zeros(3)), "contradict the first station, 30 and 40 deg"),
        (TieOn(500.0, 30.0 * DEG, 41.0 * DEG, np.zeros(3)), "30 and 41 deg at 500 m contradict"),
    ],
)
def test_a_tie_on_that_contradicts_the_first_station_is_refused(tie: TieOn, named: str) -> None:
    with pytest.raises(SurveyError, match=named):
        analyse_survey(record(first=500.0), CURVED, MWD, SITE, tie_on=tie)


def test_a_sidetrack_with_two_tools_is_two_legs_below_its_tie_on() -> None:
    mother = analyse_survey(record(20), CURVED, MWD, SITE)
    tie = tied(mother, 10)
    md = tie.md + 20.0 * np.arange(1, 15)
    side = SurveyRecord(md, np.linspace(32.0, 80.0, 14) * DEG, np.linspace(62.0, 20.0, 14) * DEG, list(range(14)), {})
    change = float(md[6])
    found = analyse_survey(side, CURVED, [Stretch(MWD, 0.0), Stretch(GYRO, change)], SITE, tie_on=tie)
    inclination = np.concatenate([[tie.inclination], side.inclination])
    azimuth = np.concatenate([[tie.azimuth], side.azimuth])
    mds = np.concatenate([[tie.md], md])
    places = tie.position + station_positions(CURVED, mds, inclination, azimuth)
    legs = [Leg(MWD), Leg(GYRO, 7)]
    expected = tie.cov + propagate_errors(WellSurvey(mds, inclination, azimuth, places[:, 2]), legs, SITE).cov
    np.testing.assert_allclose(found.positions, places, atol=1e-9)
    np.testing.assert_allclose(found.uncertainty.cov, expected, rtol=1e-9)


def test_where_legs_overlap_the_later_one_counts() -> None:
    md = np.arange(0.0, 100.0, 10.0)
    legs = legs_of([Stretch(GYRO, 45.0, 200.0), Stretch(MWD, 0.0, 60.0)], md)
    assert [(leg.tool.name, leg.first) for leg in legs] == [(MWD.name, 1), (GYRO.name, 5)]


@pytest.mark.parametrize(
    ("parts", "named"),
    [
        ([Stretch(MWD, 0.0, 30.0), Stretch(GYRO, 55.0)], "the station at 40 m lies in no leg"),
        ([Stretch(MWD, 30.0)], "the station at 10 m lies in no leg"),
        ([Stretch(MWD, 0.0), Stretch(GYRO, 95.0)], "the leg of gyro-continuous from 95 m has no station"),
    ],
)
def test_legs_that_leave_a_gap_are_refused(parts: list[Stretch], named: str) -> None:
    with pytest.raises(SurveyError, match=named):
        legs_of(parts, np.arange(0.0, 100.0, 10.0))


def test_programmes_and_tie_ons_are_read_from_files(tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text(
        '[[leg]]\nfrom_m = 0\nto_m = 500\ninstrument = "mwd-rev5.1"\n[[leg]]\nfrom_m = 500\ninstrument = "relay"\n'
    )
    parts = read_programme(tmp_path / "p.toml")
    assert [(p.tool.name, p.top, p.bottom) for p in parts] == [("mwd-rev5.1", 0.0, 500.0), ("relay", 500.0, None)]
    (tmp_path / "t.toml").write_text(
        "md_m = 500\ninclination_deg = 30\nazimuth_deg = 40\n"
        "north_m = 1\neast_m = 2\ntvd_m = 490\nsigma_m = [1, 2, 3]\n"
    )
    tie = read_tie_on(tmp_path / "t.toml")
    assert (tie.md, tie.position.tolist(), np.diag(tie.cov).tolist()) == (500.0, [1.0, 2.0, 490.0], [1.0, 4.0, 9.0])


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("md_m = 5", "inclination_deg is missing"),
        ("depth = 5", "depth: unknown key"),
        (
            "md_m = 0\ninclination_deg = 200\nazimuth_deg = 0\nnorth_m = 0\neast_m = 0\ntvd_m = 0",
            "inclination_deg: expected an inclination of 0..180 deg, got 200",
        ),
        (
            "md_m = 0\ninclination_deg = 2\nazimuth_deg = 0\nnorth_m = 0\neast_m = 0\ntvd_m = 0\n"
            "covariance_m2 = [[1, 2, 0], [2, 1, 0], [0, 0, 1]]",
            "no negative variance",
        ),
    ],
)
def test_a_tie_on_that_cannot_be_is_refused(tmp_path: Path, text: str, named: str) -> None:
    (tmp_path / "t.toml").write_text(text)
    with pytest.raises(SurveyError, match=named):
        read_tie_on(tmp_path / "t.toml")
