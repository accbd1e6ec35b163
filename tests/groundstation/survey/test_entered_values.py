"""Every number that enters: values that stand for none, ranges, what hardly can be, in surveys and walls."""

import dataclasses
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from borechain import api
from groundstation.calibration.calibration_records import read_turn_table
from groundstation.config import checked_config
from groundstation.entry.null_values import is_null, null_or_number
from groundstation.entry.station_plausibility import station_warnings
from groundstation.errors import ConfigurationError, SurveyError
from groundstation.survey.requests.clearance_answer import answer_clearance
from groundstation.survey.requests.clearance_request import ClearanceRequest
from groundstation.survey.requests.survey_answer import answer_survey
from groundstation.survey.requests.survey_request import FrameRequest, SiteFigures, SurveyRequest
from groundstation.survey.requests.wall_result import wall_result
from groundstation.survey.wall.judged_wall import judge_wall, part_around
from groundstation.survey.wall.wall_file import read_wall
from groundstation.survey.wall.wall_verdict import FindingKind, WallVerdict
from groundstation.survey.well.error_sources import Site
from telemetry.errors import CalibrationError

HEAD = "MD (m),Inc (deg),Azi (deg)\n"
NULLS = ("-999.25", "-9999", "-99999", "-999.2500", "1e30", "1E+30", "-1e30", "-1E+31", "", "-", "N/A", "null")
SITE = SiteFigures()


def file_of(folder: Path, text: str, name: str = "s.csv") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def answer(folder: Path, text: str, **asked: object) -> dict:
    return answer_survey(SurveyRequest(file_of(folder, text), **asked)).result


@pytest.mark.parametrize("cell", [*NULLS, "9999", "9999.25", "99999"])
@pytest.mark.parametrize("place", [1, 2])
def test_a_value_that_stands_for_none_is_missing_and_named(tmp_path: Path, cell: str, place: int) -> None:
    row = ["20", "3", "40"]
    row[place] = cell
    found = answer(tmp_path, f"{HEAD}0,0,0\n10,2,40\n{','.join(row)}\n30,2,40\n")
    assert [station["md_m"] for station in found["stations"]] == [0.0, 10.0, 30.0]
    (warning,) = found["warnings"]
    column = ("MD (m)", "Inc (deg)", "Azi (deg)")[place]
    assert (warning["kind"], warning["what"], warning["from_m"]) == ("missing", column, 20.0)
    assert warning["text"] == (f"line 4: {column} = {cell!r} stands for no value, at 20: the station is left out")


@pytest.mark.parametrize("cell", NULLS)
def test_a_depth_that_stands_for_none_is_missing_too(tmp_path: Path, cell: str) -> None:
    found = answer(tmp_path, f"{HEAD}0,0,0\n{cell},2,40\n30,2,40\n")
    assert [station["md_m"] for station in found["stations"]] == [0.0, 30.0]
    assert found["warnings"][0]["what"] == "MD (m)"


def test_a_depth_of_9999_m_is_a_depth_and_an_angle_is_not() -> None:
    assert not is_null(9999.0)
    assert is_null(9999.0, angle=True)
    assert null_or_number(" 12.5 ") == 12.5
    assert null_or_number("") is None


def test_a_vertical_station_does_not_miss_its_azimuth(tmp_path: Path) -> None:
    found = answer(tmp_path, f"{HEAD}0,0,-999.25\n10,0,\n20,2,40\n")
    assert len(found["stations"]) == 3
    assert found["warnings"] == []


@pytest.mark.parametrize(
    ("row", "named"),
    [
        ("20,2,1005", "line 4: azimuth_deg: expected an azimuth of -720..720 deg, got 1005"),
        ("20,2,-721", "line 4: azimuth_deg: expected an azimuth of -720..720 deg, got -721"),
        ("20,181,40", "line 4: expected an inclination of 0..180 deg, got 181"),
        ("20,-1,40", "line 4: expected an inclination of 0..180 deg, got -1"),
    ],
)
def test_an_angle_beyond_its_range_is_refused_with_line_column_and_unit(tmp_path: Path, row: str, named: str) -> None:
    with pytest.raises(SurveyError) as error:
        answer(tmp_path, f"{HEAD}0,0,0\n10,2,40\n{row}\n30,2,40\n")
    assert named in str(error.value)


@pytest.mark.parametrize(
    ("asked", "named"),
    [
        ({"site": SiteFigures(declination_deg=900)}, "--declination-deg: expected a declination of -180..180 deg"),
        ({"frame": FrameRequest(declination_deg=900)}, "--declination-deg: expected a declination of -180..180 deg"),
        ({"site": SiteFigures(dip_deg=91)}, "--dip-deg: expected a dip of -90..90 deg, got 91"),
        ({"site": SiteFigures(gravity=981)}, "--gravity: expected a gravity of 9..10.5 m/s^2, got 981"),
        ({"site": SiteFigures(field_nt=50)}, "--field-nt: expected a magnetic field of 15000..75000 nT, got 50"),
        ({"site": SiteFigures(latitude_deg=520)}, "--latitude-deg: expected a latitude of -90..90 deg, got 520"),
        ({"site": SiteFigures(latitude_deg=math.nan)}, "--latitude-deg: expected a finite number, got nan"),
        ({"frame": FrameRequest(convergence_deg=400)}, "--convergence-deg: expected a convergence of -180..180 deg"),
        ({"frame": FrameRequest(north_of_site_deg=1e4)}, "--north-of-site-deg: expected an azimuth of the site's"),
        ({"section_azimuth_deg": 9999.0}, "--section-azimuth-deg: expected an azimuth of -720..720 deg, got 9999"),
    ],
)
def test_a_figure_of_the_site_beyond_its_range_is_refused(tmp_path: Path, asked: dict, named: str) -> None:
    with pytest.raises(SurveyError) as error:
        answer(tmp_path, f"{HEAD}0,0,0\n10,2,40\n", **asked)
    assert named in str(error.value)


@pytest.mark.parametrize(
    ("rows", "kind"),
    [
        ("30,12,90\n60,123,90\n90,12.4,90\n", "spike"),  # a decimal point
        ("30,12,90\n60,12.1,901\n90,12.4,90\n", None),  # beyond its range
        ("30,12,90\n60,12.1,270\n90,12.4,90\n", "spike"),  # north and south
        ("30,12,90\n60,12.2,90\n90,124,90\n", "dogleg"),  # at the toe
        ("0.5,1,90\n1,12,90\n1.5,12,90\n", "dogleg"),
        ("30,12,90\n60,30,90\n90,50,90\n", None),  # steered
    ],
)
def test_what_steel_hardly_does_is_a_warning(tmp_path: Path, rows: str, kind: str | None) -> None:
    text = f"{HEAD}0,0,0\n{rows}"
    if "901" in rows:
        with pytest.raises(SurveyError):
            answer(tmp_path, text)
        return
    found = answer(tmp_path, text)["warnings"]
    assert [warning["kind"] for warning in found] == ([] if kind is None else [kind])
    assert all("deg" in warning["text"] for warning in found)


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize(("between", "kinds"), [(20.0, []), (22.0, ["spike"])])
def test_a_station_is_alone_where_it_departs_from_both_its_neighbours(
    way: int, between: float, kinds: list[str]
) -> None:
    """11.6 and 10 deg: 8.4 and 10 deg from 20, where 9.8 are allowed on both sides; a hole is the same upside down."""
    md, inclination = np.array([0.0, 30.0, 60.0]), np.radians([10.0, between, 11.6])[::way]
    assert [warning.kind for warning in station_warnings(md, inclination, np.zeros(3), "h")] == kinds


@given(st.lists(st.tuples(st.floats(0.2, 30.0), st.floats(-1.0, 1.0), st.floats(0.0, 360.0)), min_size=2, max_size=30))
def test_a_hole_that_bends_as_steel_does_has_no_warning(steps: list[tuple[float, float, float]]) -> None:
    md = np.cumsum([0.0, *(length for length, _, _ in steps)])
    inc = np.abs(np.cumsum([0.0, *(0.9 * length * bend for length, bend, _ in steps)]))
    inc = np.radians(np.minimum(inc, 360.0 - inc) % 180.0 if inc.max() > 180.0 else inc)
    if inc.max() <= math.pi and np.all(np.abs(np.diff(inc)) <= np.radians(np.diff(md))):
        assert not [w for w in station_warnings(md, inc, np.full(len(md), 1.0), "h") if w.kind == "dogleg"]


@pytest.mark.parametrize("words", [(), ("hole",)])
def test_two_holes_in_one_table_are_a_choice(tmp_path: Path, words: tuple[str, ...]) -> None:
    name = "hole" if words else "what"
    text = f"{name},MD,Inc,Azi\nA,0,0,0\nA,10,2,40\nB,20,2,40\nB,30,3,50\n"
    with pytest.raises(SurveyError, match=rf"{name} tells 2 holes apart: A, B; expected --hole with one of them"):
        answer(tmp_path, text)
    assert [s["md_m"] for s in answer(tmp_path, text, hole="A")["stations"]] == [0.0, 10.0]
    assert len(answer(tmp_path, text, hole="*")["stations"]) == 4
    with pytest.raises(SurveyError, match="--hole C: expected one of its holes, A, B"):
        answer(tmp_path, text, hole="C")


def test_holes_that_have_numbers_are_a_choice_too_and_remarks_are_none(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="hole tells 2 holes apart: 1, 2"):
        answer(tmp_path, "hole,MD,Inc,Azi\n1,0,0,0\n1,10,2,40\n2,20,2,40\n")
    found = answer(tmp_path, "MD,Inc,Azi,Remarks\n0,0,0,begun\n10,2,40,\n20,2,40,wet\n")
    assert (len(found["stations"]), found["warnings"]) == (3, [])


def test_a_text_that_differs_beside_the_chosen_hole_is_named(tmp_path: Path) -> None:
    text = "hole,tool,MD,Inc,Azi\nA,gyro,0,0,0\nA,probe,10,2,40\nB,probe,20,2,40\n"
    (warning,) = answer(tmp_path, text, hole="A")["warnings"]
    assert (warning["kind"], "tool differs" in warning["text"]) == ("unread", True)


GOOD = "".join(f"{name},{md},0.1,40\n" for name in "ABC" for md in (0, 5, 10))
HEADS = "column,north_m,east_m\nA,0,0\nB,0,0.7\nC,0,1.4\n"


def wall_of(folder: Path, stations: str = GOOD, heads: str = HEADS, more: str = "") -> Path:
    file_of(folder, heads, "heads.csv")
    file_of(folder, "column,md_m,inclination_deg,azimuth_deg\n" + stations, "stations.csv")
    return file_of(
        folder,
        f'radius_m = 0.6\nthickness_m = 0.8\nlength_m = 10\nheads = "heads.csv"\nstations = "stations.csv"\n{more}',
        "wall.toml",
    )


def test_a_wall_without_a_warning_is_tight(tmp_path: Path) -> None:
    wall = read_wall(wall_of(tmp_path))
    judgement = judge_wall(wall)
    assert (judgement.verdict, wall.warnings) == (WallVerdict.TIGHT, ())
    assert wall_result(wall, judgement)["warnings"] == []


@pytest.mark.parametrize("cell", ["-999.25", "9999", "1e30", ""])
def test_a_null_in_a_column_is_not_surveyed_and_the_wall_not_tight(tmp_path: Path, cell: str) -> None:
    wall = read_wall(wall_of(tmp_path, GOOD.replace("B,5,0.1,40", f"B,5,0.1,{cell}")))
    judgement = judge_wall(wall)
    assert judgement.verdict is WallVerdict.NOT_PROVEN
    assert [f.kind for f in judgement.findings] == [FindingKind.IMPLAUSIBLE]
    assert "column B, line 6: azimuth_deg stands for no value: the station at 5 m" in judgement.findings[0].text
    (row,) = wall_result(wall, judgement)["warnings"]
    assert (row["kind"], row["what"], row["from_m"]) == ("missing", "B", 5.0)


def test_a_column_of_nulls_is_not_surveyed_at_all(tmp_path: Path) -> None:
    text = "".join(line if line[0] != "B" else line.replace(",40", ",-999.25") for line in GOOD.splitlines(True))
    judgement = judge_wall(read_wall(wall_of(tmp_path, text)))
    assert judgement.verdict is WallVerdict.NOT_TIGHT
    assert {f.kind for f in judgement.findings} >= {FindingKind.MISSING, FindingKind.IMPLAUSIBLE}


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        ({"stations": GOOD.replace("B,10,0.1,40", "B,10,45,40")}, "lean"),
        ({"stations": GOOD.replace("B,10,0.1,40", "B,10,0.1,40\nB,10000,0.1,40")}, "depth"),
        ({"heads": "column,north_m,east_m,radius_m\nA,0,0,\nB,0,0.7,60\nC,0,1.4,\n"}, "radius"),
        ({"heads": "column,north_m,east_m,radius_m\nA,0,0,\nB,0,0.7,2\nC,0,1.4,\n"}, "radius"),
        ({"stations": GOOD.replace("B,10,0.1,40", "B,10,8.9,40")}, "dogleg"),
        ({"stations": GOOD.replace("B,5,0.1,40", "B,5,8.9,40")}, "spike"),
    ],
)
def test_a_wall_with_a_warning_that_touches_its_verdict_is_not_tight(tmp_path: Path, change: dict, kind: str) -> None:
    wall = read_wall(wall_of(tmp_path, **change))
    judgement = judge_wall(wall)
    assert judgement.verdict is not WallVerdict.TIGHT
    assert kind in {warning.kind for warning in wall.warnings}
    texts = {finding.text for finding in judgement.findings if finding.kind is FindingKind.IMPLAUSIBLE}
    assert texts == {warning.text for warning in wall.warnings}
    part, place = part_around(wall, 0)
    assert judge_wall(part, place).verdict is not WallVerdict.TIGHT


def test_a_warning_below_what_is_to_be_tight_is_named_and_touches_nothing(tmp_path: Path) -> None:
    stations = GOOD.replace("B,10,0.1,40", "B,10,0.1,40\nB,11,0.1,40\nB,12,9,40")
    wall = read_wall(wall_of(tmp_path, stations, more="tight_from_m = 0\ntight_to_m = 8\n"))
    assert [warning.kind for warning in wall.warnings] == ["dogleg"]
    assert judge_wall(wall).verdict is WallVerdict.TIGHT


@pytest.mark.parametrize("cell", ["-999.25", "9999", "1e30", "nan", "-0.1", "", "x"])
@pytest.mark.parametrize("name", ["sigma_yaw_deg", "sigma_systematic_deg", "sigma_force_mps2", "measurements"])
def test_a_sigma_of_a_station_that_is_none_is_refused(tmp_path: Path, name: str, cell: str) -> None:
    """It would be a covariance of nothing, or of thousands of degrees, without a word."""
    rows = f"0,0,0,\n10,1,40,2\n20,1,40,{cell}\n"
    if (name, cell) == ("measurements", "9999"):
        assert answer(tmp_path, f"md_m,inclination_deg,azimuth_deg,{name}\n{rows}")["warnings"] == []
        return
    with pytest.raises(SurveyError) as error:
        answer(tmp_path, f"md_m,inclination_deg,azimuth_deg,{name}\n{rows}")
    assert f"line 4: {name}" in str(error.value) or f"line 4: expected numbers, got {name}" in str(error.value)


def test_the_collar_has_no_sigma_of_its_own_and_a_column_may_be_empty(tmp_path: Path) -> None:
    head = "md_m,inclination_deg,azimuth_deg,sigma_yaw_deg\n"
    told, own, none = (
        answer(tmp_path, f"{head}0,0,0,{a}\n10,1,40,{b}\n20,1,40,{b}\n") for a, b in (("", 2), (2, 2), ("", ""))
    )
    assert told["stations"] == own["stations"]
    assert none["stations"][-1]["uncertainty"] != own["stations"][-1]["uncertainty"]


@pytest.mark.parametrize(
    ("key", "cell", "named"),
    [
        ("azimuth_deg", "-999.25", "azimuth_deg: expected a number, or nothing, got '-999.25', which stands for no"),
        ("azimuth_deg", "9999", "azimuth_deg: expected a number, or nothing, got '9999', which stands for no value"),
        ("azimuth_deg", "900", "azimuth_deg: expected an azimuth of -720..720 deg, got 900"),
        ("inclination_deg", "450", "inclination_deg: expected an inclination of 0..180 deg, got 450"),
        ("length_m", "1e30", "length_m: expected a number, or nothing, got '1e30', which stands for no value"),
        ("length_m", "1e6", "length_m: expected a depth or a length of -100000..100000 m, got 1e+06"),
        ("down_m", "1e30", "down_m: expected a number, or nothing"),
        ("radius_m", "1e30", "radius_m: expected a number, or nothing"),
    ],
)  # fmt: skip
def test_a_head_whose_value_is_none_is_refused(tmp_path: Path, key: str, cell: str, named: str) -> None:
    with pytest.raises(SurveyError) as error:
        read_wall(wall_of(tmp_path, heads=f"column,north_m,east_m,{key}\nA,0,0,\nB,0,0.7,{cell}\nC,0,1.4,\n"))
    assert f"line 3: column B: {named}" in str(error.value)


@pytest.mark.parametrize(
    ("line", "most"),
    [
        ("tight_to_m = 1e30", 100_000), ("tight_from_m = 1e30", 100_000), ("depth_step_m = 9999", 2),
        ("head_sigma_m = 1e30", 100_000), ("northing_m = 1e30\neasting_m = 0\nheight_m = 0", 1e8),
    ],
)  # fmt: skip
def test_a_figure_of_a_wall_beyond_its_range_is_refused(tmp_path: Path, line: str, most: float) -> None:
    key = line.partition(" ")[0]
    with pytest.raises(SurveyError, match=rf"wall\.toml: {key}: expected at most {re.escape(format(most, 'g'))}, got"):
        read_wall(wall_of(tmp_path, more=line))


def test_a_wall_whose_plan_no_string_follows_is_not_tight(tmp_path: Path) -> None:
    file_of(tmp_path, "md_m,inclination_deg,azimuth_deg\n0,0,0\n5,0.1,40\n5.5,3,40\n6,0.1,40\n10,0.1,40\n", "plan.csv")
    path = wall_of(tmp_path, more='plan = "plan.csv"\n')
    path.write_text(path.read_text().replace("length_m = 10\n", ""))
    judgement = judge_wall(read_wall(path))
    assert judgement.verdict is not WallVerdict.TIGHT
    texts = [finding.text for finding in judgement.findings if finding.kind is FindingKind.IMPLAUSIBLE]
    assert [text for text in texts if "A: its design bends by 5.8 deg a metre at 5 m" in text]


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("azimuth_deg = -999.25", "azimuth_deg: expected a number, got -999.25, which stands for no value"),
        ("north_m = 1e30", "north_m: expected a number, got 1e+30, which stands for no value"),
        ("md_m = -9999", "md_m: expected a number, got -9999, which stands for no value"),
    ],
)
def test_a_tie_on_of_no_values_is_refused(tmp_path: Path, text: str, named: str) -> None:
    lines = {key: f"{key} = 0" for key in ("md_m", "inclination_deg", "azimuth_deg", "north_m", "east_m", "tvd_m")}
    tie = file_of(tmp_path, "\n".join((lines | {text.partition(" ")[0]: text}).values()), "tie.toml")
    with pytest.raises(SurveyError) as error:
        answer(tmp_path, f"{HEAD}0,0,0\n10,2,40\n", tie_on=tie)
    assert named in str(error.value)


@pytest.mark.parametrize("value", [-999.25, 9999.0, 1e30, math.nan, math.inf])
@pytest.mark.parametrize(
    "key",
    [
        "tube_length", "tube_length_std", "gravity", "north_deg", "north_std_deg", "collar_azimuth_deg",
        "collar_inclination_deg", "collar_std_deg", "mount_tilt_std_deg", "mount_std_deg", "play_std_deg",
        "design_azimuth_deg", "design_inclination_deg", "column_radius", "steering_deg_per_m", "stick_up_m",
        "accelerometer_bias_std_deg", "north_check_deg", "station_tolerance", "stale_after", "depth_rate", "depth_gap",
        "survey_after",
    ],
)  # fmt: skip
def test_a_setting_of_a_ground_station_beyond_its_range_is_refused(tmp_path: Path, key: str, value: float) -> None:
    with pytest.raises(ConfigurationError, match=key):
        checked_config(folder=tmp_path, **{key: value})
    with pytest.raises(ConfigurationError, match="column_radius"):
        checked_config(folder=tmp_path, column_radius=60.0)


@pytest.mark.parametrize(
    ("key", "what", "low", "high", "unit"),
    [
        ("station_tolerance", "a distance of two surveys at one station", 0.001, 1.0, "m"),
        ("stale_after", "a time of silence", 1.0, 600.0, "s"),
        ("depth_rate", "a speed of the bit", 0.001, 5.0, "m/s"),
        ("depth_gap", "a time between two depths", 0.1, 600.0, "s"),
        ("survey_after", "a time of a stop", 5.0, 3600.0, "s"),
    ],
)
def test_a_setting_of_times_and_speeds_is_refused_by_name_and_unit(
    tmp_path: Path, key: str, what: str, low: float, high: float, unit: str
) -> None:
    for value in (low, high):
        assert getattr(checked_config(folder=tmp_path, **{key: value}), key) == value
    for value in (0.999 * low, 1.001 * high, -low):
        with pytest.raises(ConfigurationError) as refused:
            checked_config(folder=tmp_path, **{key: value})
        assert str(refused.value) == f"{key}: expected {what} of {low:g}..{high:g} {unit}, got {value!r}"


def test_a_place_is_in_radians() -> None:
    place = SiteFigures(9.8, 49_000.0, 60.0, 3.0, 45.0).to_site()
    expected = Site(9.8, 49_000.0, math.pi / 3.0, math.pi / 60.0, math.pi / 4.0)
    assert dataclasses.astuple(place) == pytest.approx(dataclasses.astuple(expected), rel=1e-12)


def test_places_beyond_the_earth_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"--origin: expected a coordinate of -1e\+08\.\.1e\+08 m, got 1e\+30"):
        answer(tmp_path, f"{HEAD}0,0,0\n10,2,40\n", frame=FrameRequest(origin=(1e30, 0.0, 0.0)))
    one = file_of(tmp_path, f"{HEAD}0,0,0\n10,2,40\n", "one.csv")
    with pytest.raises(SurveyError, match=r"--offset-head: expected a distance of -1e\+06\.\.1e\+06 m, got 1e\+30"):
        answer_clearance(ClearanceRequest(one, one, offset_head=(0.0, 1e30, 0.0)))


def test_the_library_reads_by_the_same_reader(tmp_path: Path) -> None:
    """``api.survey``: formats, ranges, values for none, plausibility, and no magnetic tool without its site."""
    book = file_of(tmp_path, "site 7\nMD;Incl (deg);Azim (deg)\n0;0;0\n10;2;40\n20;-999.25;40\n30;2;40\n")
    with pytest.warns(UserWarning, match=r"s\.csv: line 5: Incl \(deg\) = '-999.25' stands for no value") as told:
        found = api.survey(book)
    assert len(told) == 1
    np.testing.assert_array_equal(found.md, [0.0, 10.0, 30.0])
    typed = file_of(tmp_path, f"{HEAD}0,0,0\n30,12,90\n60,123,90\n90,12.4,90\n")
    with pytest.warns(UserWarning, match="departs by 111"):
        api.survey(typed)
    for rows, named in (("10,2,9e2", "expected an azimuth"), ("10,181,4", "expected an inclination of 0..180 deg")):
        with pytest.raises(SurveyError, match=named):
            api.survey(file_of(tmp_path, f"{HEAD}0,0,0\n{rows}\n20,2,4\n"))
    two = file_of(tmp_path, "hole,MD,Inc,Azi\nA,0,0,0\nA,10,2,40\nB,20,2,40\nB,30,3,50\n")
    with pytest.raises(SurveyError, match="hole tells 2 holes apart"):
        api.survey(two)
    assert len(api.survey(two, hole="A").md) == 2
    with pytest.raises(SurveyError, match="a magnetic instrument needs its site"):
        api.survey(two, hole="A", instrument="mwd-rev5.1")


def test_a_clearance_names_what_hardly_can_be(tmp_path: Path) -> None:
    one = file_of(tmp_path, f"{HEAD}0,0,0\n30,12,90\n60,123,90\n90,12.4,90\n", "one.csv")
    two = file_of(tmp_path, f"{HEAD}0,0,0\n30,12,90\n60,-999.25,90\n90,12.4,90\n", "two.csv")
    found = answer_clearance(ClearanceRequest(one, two, offset_head=(50.0, 0.0, 0.0), radius_m=60.0))
    assert [row["kind"] for row in found["warnings"]] == ["spike", "radius", "missing"]
    json.dumps(found)


def test_a_calibration_refuses_what_stands_for_no_reading(tmp_path: Path) -> None:
    text = "axis,x_pos,x_neg,y_pos,y_neg,z_pos,z_neg\nx,200,-200,0,0,0,0\ny,0,0,200,-999.25,0,0\nz,0,0,0,0,200,-200\n"
    with pytest.raises(CalibrationError, match=r"s\.csv, line 3: expected a reading in column y_neg, got -999\.25"):
        read_turn_table(file_of(tmp_path, text), 200.0)


FIGURES = ("md_m", "inclination_deg", "north_m", "east_m", "tvd_m", "closure_m", "uncertainty")


def figures(found: dict) -> list:
    return [[station[key] for key in FIGURES] for station in found["stations"]]


SITE = SiteFigures(field_nt=49_000.0, dip_deg=66.0, declination_deg=2.5)


@settings(max_examples=15, deadline=None)
@given(st.floats(-360.0, 360.0), st.sampled_from(["relay", "mwd-rev5.1", "ipst-rqh"]), st.integers(-1, 1))
def test_an_answer_does_not_depend_on_what_means_nothing(
    tmp_path_factory: pytest.TempPathFactory, azimuth: float, tool: str, turns: int
) -> None:
    """The azimuth of a vertical station, whole turns, the order of the columns and the unit of the file."""
    folder = tmp_path_factory.mktemp("same")
    rows = [(0.0, 0.0, azimuth), (30.48, 0.0, azimuth), (60.96, 3.0, 40.0), (91.44, 5.0, 350.0)]
    asked = {"instrument": tool, "site": SITE}
    plain = answer(folder, HEAD + "".join(f"{m},{i},{a if i else 0.0}\n" for m, i, a in rows), **asked)
    turned = answer(folder, HEAD + "".join(f"{m},{i},{a + 360 * turns if i else a}\n" for m, i, a in rows), **asked)
    other = "Azi (deg),Inc (deg),MD (ft)\n" + "".join(f"{a},{i},{m / 0.3048}\n" for m, i, a in rows)
    for found in (turned, answer(folder, other, **asked)):
        np.testing.assert_allclose(flat(figures(found)), flat(figures(plain)), rtol=1e-9, atol=1e-9)


@settings(max_examples=15, deadline=None)
@given(st.floats(-30.0, 30.0), st.sampled_from(["relay", "mwd-rev5.1", "ipst-rqh"]))
def test_the_frame_of_the_file_changes_nothing_of_a_hole(
    tmp_path_factory: pytest.TempPathFactory, convergence: float, tool: str
) -> None:
    folder = tmp_path_factory.mktemp("frame")
    rows = [(0.0, 0.0, 0.0), (30.0, 0.0, 0.0), (60.0, 3.0, 40.0), (90.0, 5.0, 350.0)]
    true, grid = (HEAD + "".join(f"{m},{i},{a - turn}\n" for m, i, a in rows) for turn in (0.0, convergence))
    frames = (
        FrameRequest(north="true", answer_north="true", convergence_deg=convergence),
        FrameRequest(north="grid", answer_north="true", convergence_deg=convergence),
    )
    one, other = (
        answer(folder, text, instrument=tool, frame=frame, site=SITE)
        for text, frame in zip((true, grid), frames, strict=True)
    )
    np.testing.assert_allclose(flat(figures(one)), flat(figures(other)), rtol=1e-8, atol=1e-9)


def flat(value: object) -> list[float]:
    """All numbers, but the direction of an ellipse that is a circle."""
    if isinstance(value, dict):
        return [x for key, part in value.items() if key != "azimuth_deg" for x in flat(part)]
    if isinstance(value, list):
        return [x for part in value for x in flat(part)]
    return [float(value)]  # type: ignore[arg-type]
