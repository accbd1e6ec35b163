"""The site: the magnetic model against its own test values, gravity, national grids; and who is refused without one."""

import datetime
import json
from pathlib import Path

import numpy as np
import pytest

from groundstation.errors import SurveyError
from groundstation.survey.requests.clearance_answer import answer_clearance
from groundstation.survey.requests.clearance_request import ClearanceRequest
from groundstation.survey.requests.site_place import (
    SitePlace,
    decimal_year,
    field_of_model,
    grid_factors,
    magnetic_field,
    normal_gravity,
    parse_place,
    site_words,
)
from groundstation.survey.requests.survey_answer import answer_survey
from groundstation.survey.requests.survey_request import FrameRequest, SiteFigures, SurveyRequest
from groundstation.survey.requests.survey_tables import station_table_text

# Test values that NOAA published with WMM2020: year, height km, latitude, longitude;
# north, east, down, level, total nT, dip and declination deg
WMM2020 = """
2020.0   0  80   0   6570.4   -146.3  54606.0   6572.0 55000.1  83.14 -1.28
2020.0   0   0 120  39624.3    109.9 -10932.5  39624.4 41104.9 -15.42  0.16
2020.0   0 -80 240   5940.6  15772.1 -52480.8  16853.8 55120.6 -72.20 69.36
2020.0 100  80   0   6261.8   -185.5  52429.1   6264.5 52802.0  83.19 -1.70
2020.0 100   0 120  37636.7    104.9 -10474.8  37636.9 39067.3 -15.55  0.16
2020.0 100 -80 240   5744.9  14799.5 -49969.4  15875.4 52430.6 -72.37 68.78
2022.5   0  80   0   6529.9      1.1  54713.4   6529.9 55101.7  83.19  0.01
2022.5   0   0 120  39684.7    -42.2 -10809.5  39684.7 41130.5 -15.24 -0.06
2022.5   0 -80 240   6016.5  15776.7 -52251.6  16885.0 54912.1 -72.09 69.13
2022.5 100  80   0   6224.0    -44.5  52527.0   6224.2 52894.5  83.24 -0.41
2022.5 100   0 120  37694.0    -35.3 -10362.0  37694.1 39092.4 -15.37 -0.05
2022.5 100 -80 240   5815.0  14803.0 -49755.3  15904.1 52235.4 -72.27 68.55
"""
# Declinations of the test values of WMM2025
WMM2025 = """
2025.0   0  80    0  1.28
2025.0   0   0  120 -0.16
2025.0   0 -80  240 68.78
2025.0 100  80    0  0.85
2025.0 100   0  120 -0.15
2025.0 100 -80  240 68.21
2027.5   0  80    0  2.59
2027.5   0   0  120 -0.24
2027.5   0 -80  240 68.49
2027.5 100  80    0  2.16
2027.5 100   0  120 -0.23
2027.5 100 -80  240 67.93
2025.0  48  80  -96 -29.91
2025.0  18   0   21  1.29
2025.5   6 -36 -137 20.28
"""


def rows(text: str) -> list[list[float]]:
    return [[float(word) for word in line.split()] for line in text.strip().splitlines()]


@pytest.mark.parametrize("row", rows(WMM2020))
def test_the_model_gives_its_own_test_values(row: list[float]) -> None:
    year, km, latitude, longitude, *_, total, dip, declination = row
    found = field_of_model("WMM_2020", SitePlace(latitude, longitude, 1000.0 * km, None), year)
    assert found.field_nt == pytest.approx(total, abs=0.06)  # printed to 0.1
    assert found.dip_deg == pytest.approx(dip, abs=0.006)
    assert found.declination_deg == pytest.approx(declination, abs=0.006)


@pytest.mark.parametrize("row", rows(WMM2025))
def test_the_model_of_now_gives_its_declinations(row: list[float]) -> None:
    year, km, latitude, longitude, declination = row
    found = field_of_model("WMM_2025", SitePlace(latitude, longitude, 1000.0 * km, None), year)
    assert found.declination_deg == pytest.approx(declination, abs=0.006)


def test_a_day_takes_its_model_and_its_year() -> None:
    assert decimal_year(datetime.date(2026, 7, 4)) == pytest.approx(2026.50411, abs=1e-5)
    assert magnetic_field(parse_place("52.4,13.1", "2024-12-31")).model == "WMM-2020"
    # the model's calculator on that day at London
    found = magnetic_field(parse_place("51.5074,-0.1278", "2026-07-04"))
    assert (found.model, found.declination_deg) == ("WMM-2025", pytest.approx(1.16280, abs=0.002))


@pytest.mark.parametrize(("latitude", "gravity"), [(0.0, 9.7803253359), (45.0, 9.806197769), (90.0, 9.8321849379)])
def test_gravity_is_that_of_the_ellipsoid(latitude: float, gravity: float) -> None:
    assert normal_gravity(latitude, 0.0) == pytest.approx(gravity, abs=1e-8)
    assert normal_gravity(latitude, 1000.0) == pytest.approx(gravity - 3.086e-3, abs=1e-8)


def test_a_national_grid_turns_west_of_its_meridian_to_the_west() -> None:
    convergence, scale = grid_factors("EPSG:25833", SitePlace(52.4, 13.06, 0.0, None))
    # transverse Mercator: tan gamma = tan(lambda) sin(phi), to the third order of a longitude of -1.94 deg
    assert convergence == pytest.approx(
        np.degrees(np.arctan(np.tan(np.radians(-1.94)) * np.sin(np.radians(52.4)))), abs=2e-3
    )
    assert scale == pytest.approx(0.9996 * (1.0 + 0.5 * (np.radians(1.94) * np.cos(np.radians(52.4))) ** 2), abs=2e-6)
    assert grid_factors("EPSG:25833", SitePlace(52.4, 15.0, 637.1, None)) == (
        pytest.approx(0.0, abs=1e-9),
        pytest.approx(0.9996 * 0.9999, abs=1e-7),
    )


HOLE = "MD (m),Inc (deg),Azi (deg)\n0,0,0\n30,2,40\n60,4,42\n"


def hole(folder: Path) -> Path:
    path = folder / "s.csv"
    path.write_text(HOLE)
    return path


@pytest.mark.parametrize("tool", ["mwd-rev5.1", "MWD+IFR1+SAG+MS", "EMS+HRGM"])
def test_a_magnetic_tool_without_a_site_is_refused(tmp_path: Path, tool: str) -> None:
    with pytest.raises(
        SurveyError, match=r"a magnetic instrument needs its site: expected --at .* --dip-deg and --field-nt"
    ):
        answer_survey(SurveyRequest(hole(tmp_path), instrument=tool))
    other = tmp_path / "o.csv"
    other.write_text(HOLE)
    with pytest.raises(SurveyError, match="a magnetic instrument needs its site"):
        answer_clearance(ClearanceRequest(hole(tmp_path), other, tool, offset_head=(20.0, 0.0, 0.0)))


@pytest.mark.parametrize("tool", ["relay", "gyro-continuous", "INC-ONLY", "ipst-rqh"])
def test_one_that_feels_no_field_needs_none_and_says_so(tmp_path: Path, tool: str) -> None:
    found = answer_survey(SurveyRequest(hole(tmp_path), instrument=tool)).result["site"]
    assert (found["field_nt"], found["gravity_mps2"], found["sources"]["gravity"]) == (None, 9.81, "default")
    assert "no magnetic field stated" in site_words(found)


def test_the_site_stands_in_json_table_and_line(tmp_path: Path) -> None:
    site = SiteFigures(at="52.4,13.06,35", date="2026-11-27", grid_crs="EPSG:25833")
    frame = FrameRequest(north="magnetic", answer_north="grid", origin=(5_806_123.4567, 3_500_000.1234, 35.0))
    asked = SurveyRequest(hole(tmp_path), instrument="mwd-rev5.1", site=site, frame=frame)
    answer = answer_survey(asked)
    found = json.loads(json.dumps(answer.result["site"]))
    assert found["sources"]["field_nt"] == "WMM-2025 on 2026-11-27"
    assert found["sources"]["convergence_deg"] == "EPSG:25833"
    assert (found["date"], found["latitude_deg"], found["height_m"]) == ("2026-11-27", 52.4, 35.0)
    assert 49_000.0 < found["field_nt"] < 50_500.0
    assert 67.0 < found["dip_deg"] < 69.0
    assert 4.0 < found["declination_deg"] < 6.0
    table = station_table_text(answer.result["stations"], answer.found.frame, answer.result["site"]).splitlines()
    assert table[0].endswith("coordinates_north,site")
    assert all("WMM-2025 on 2026-11-27" in line and "EPSG:25833" in line for line in table[1:])
    # a record from magnetic north, answered from grid north: declination less convergence
    turned = found["declination_deg"] - found["convergence_deg"]
    assert answer.result["stations"][1]["azimuth_deg"] == pytest.approx(40.0 + turned)
    # millimetres of a national grid survive
    last, origin = answer.result["stations"][-1], frame.origin
    scale = found["grid_scale_factor"]
    assert last["easting_m"] - origin[1] == pytest.approx(scale * last["east_m"], abs=1e-8)
    assert last["northing_m"] - origin[0] == pytest.approx(scale * last["north_m"], abs=1e-8)


def test_what_is_stated_counts_before_what_is_worked_out(tmp_path: Path) -> None:
    site = SiteFigures(at="52.4,13.06", date="2026-11-27", declination_deg=3.0, gravity=9.8)
    found = answer_survey(SurveyRequest(hole(tmp_path), instrument="mwd-rev5.1", site=site)).result["site"]
    assert (found["declination_deg"], found["gravity_mps2"]) == (3.0, 9.8)
    assert found["sources"]["declination_deg"] == found["sources"]["gravity"] == "stated"


@pytest.mark.parametrize(
    ("site", "named"),
    [
        (
            SiteFigures(at="52.4", date="2026-11-27"),
            "--at: expected LAT,LON or LAT,LON,HEIGHT in deg and m, got '52.4'",
        ),
        (SiteFigures(at="520,13", date="2026-11-27"), "--at: expected a latitude of -90..90 deg, got 520"),
        (SiteFigures(at="90,0", date="2026-11-27"), "--at: a site at the pole has no true north"),
        (SiteFigures(at="-89.995,0", date="2026-11-27"), "--at: a site at the pole has no true north"),
        (SiteFigures(at="85.8,139.3", date="2026-11-27"), "--at: the level field is "),  # the magnetic pole
        (SiteFigures(at="52.4,13", date="2031-01-01"), "--date: expected a day of 2010 to 2029, of the magnetic model"),
        (SiteFigures(at="52.4,13", date="1999-01-01"), "--date: expected a day of 2010 to 2029"),
        (SiteFigures(at="52.4,13", date="yesterday"), "--date: expected a day as 2026-11-27, got 'yesterday'"),
        (SiteFigures(at="52.4,13"), "--at: expected --date beside it; the magnetic field changes with time"),
        (SiteFigures(date="2026-11-27"), "--date: expected --at beside it"),
        (SiteFigures(at="52.4,13", date="2026-11-27", grid_crs="EPSG:1"), "--grid-crs: expected a projected grid"),
    ],
)
def test_a_site_that_cannot_be_is_refused_by_name(tmp_path: Path, site: SiteFigures, named: str) -> None:
    with pytest.raises(SurveyError) as error:
        answer_survey(SurveyRequest(hole(tmp_path), instrument="mwd-rev5.1", site=site))
    assert named in str(error.value)


def test_a_wall_of_a_magnetic_tool_states_its_site(tmp_path: Path) -> None:
    from groundstation.survey.requests.wall_result import wall_site
    from groundstation.survey.wall.wall_file import read_wall

    (tmp_path / "heads.csv").write_text("column,north_m,east_m\nA,0,0\nB,0,0.7\n")
    stations = "".join(f"{name},{md},0.1,40\n" for name in "AB" for md in (0, 5, 10))
    (tmp_path / "stations.csv").write_text("column,md_m,inclination_deg,azimuth_deg\n" + stations)
    path = tmp_path / "wall.toml"
    text = (
        'radius_m = 0.6\nthickness_m = 0.8\nheads = "heads.csv"\nstations = "stations.csv"\ninstrument = "mwd-rev5.1"\n'
    )
    path.write_text(text)
    with pytest.raises(
        SurveyError, match=r"field_nt, dip_deg, declination_deg: missing; the instrument .* is magnetic"
    ):
        read_wall(path)
    path.write_text(text + "field_nt = 49500\ndip_deg = 68\ndeclination_deg = 4.5\n")
    found = wall_site(read_wall(path))
    assert (found["field_nt"], found["sources"]["dip_deg"], found["sources"]["gravity_mps2"]) == (
        49500.0,
        "stated",
        "default",
    )
    path.write_text(text + "field_nt = 495\ndip_deg = 68\ndeclination_deg = 4.5\n")
    with pytest.raises(SurveyError, match=r"field_nt: expected a magnetic field of 15000..75000 nT, got 495"):
        read_wall(path)
