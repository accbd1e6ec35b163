"""Site coordinates: the same place whichever north a record counts from, against complex numbers and sums by hand."""

import cmath
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.errors import SurveyError
from groundstation.survey.requests.survey_answer import answer_survey
from groundstation.survey.requests.survey_request import FrameRequest, SurveyRequest
from groundstation.survey.requests.survey_tables import station_table_text
from groundstation.survey.requests.wall_result import wall_result
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.judged_wall import judge_wall
from groundstation.survey.wall.wall_file import read_wall

DEG = math.pi / 180.0
ANGLES = {"site": 23.0, "true": 0.0, "grid": -1.5, "magnetic": 4.25}  # deg, of each north from true north
ORIGIN, SCALE = (5_807_120.5, 372_045.25, 31.4), 0.9996
MD = [0.0, 30.0, 75.0, 100.0, 160.0]
INCLINATION = [1.0, 14.0, 35.0, 62.0, 95.0]
TRUE_AZIMUTH = [310.0, 325.0, 2.0, 40.0, 71.0]


def offsets_by_hand() -> np.ndarray:
    """Northing, easting and height from the origin's by arcs in complex numbers, azimuths from grid north."""
    place, down = 0j, 0.0
    out = [(0.0, 0.0, 0.0)]
    for k in range(len(MD) - 1):
        i0, i1 = INCLINATION[k] * DEG, INCLINATION[k + 1] * DEG
        a0, a1 = ((TRUE_AZIMUTH[n] - ANGLES["grid"]) * DEG for n in (k, k + 1))
        cosine = math.cos(i0) * math.cos(i1) + math.sin(i0) * math.sin(i1) * math.cos(a1 - a0)
        bend = math.acos(cosine)
        half = (MD[k + 1] - MD[k]) / bend * math.tan(bend / 2.0)
        place += half * (math.sin(i0) * cmath.exp(1j * a0) + math.sin(i1) * cmath.exp(1j * a1))
        down += half * (math.cos(i0) + math.cos(i1))
        out.append((SCALE * place.real, SCALE * place.imag, -down))
    return np.array(out)


def record(folder: Path, north: str) -> Path:
    path = folder / "s.csv"
    rows = [f"{m},{i},{a - ANGLES[north]!r}" for m, i, a in zip(MD, INCLINATION, TRUE_AZIMUTH, strict=True)]
    path.write_text("md_m,inclination_deg,azimuth_deg\n" + "\n".join(rows) + "\n")
    return path


def frame(north: str, answer: str | None, **more: Any) -> FrameRequest:
    told: dict[str, Any] = {"north_of_site_deg": ANGLES["site"], "convergence_deg": ANGLES["grid"]}
    told |= {"declination_deg": ANGLES["magnetic"], "origin": ORIGIN, "grid_scale_factor": SCALE}
    return FrameRequest(north, answer, **(told | more))


@pytest.mark.parametrize("north", list(ANGLES))
@pytest.mark.parametrize("answer", [None, "true", "grid", "magnetic"])
@pytest.mark.parametrize(
    ("origin", "within"), [((0.0, 0.0, 0.0), 1e-9), (ORIGIN, 2e-9)], ids=["zero", "millions have nine digits left"]
)
def test_a_record_of_any_north_has_one_place_in_the_grid(
    tmp_path: Path, north: str, answer: str | None, origin: tuple[float, float, float], within: float
) -> None:
    found = answer_survey(SurveyRequest(record(tmp_path, north), frame=frame(north, answer, origin=origin)))
    assert (found.result["north"], found.result["coordinates_north"]) == (answer or "grid", "grid")
    rows = found.result["stations"]
    places = [[row[key] for key in ("northing_m", "easting_m", "height_m")] for row in rows]
    np.testing.assert_allclose(np.array(places) - origin, offsets_by_hand(), rtol=0.0, atol=within)
    if answer is None:  # all coordinates of the answer are in one frame then
        offsets = np.array([[row[key] for key in ("north_m", "east_m", "tvd_m")] for row in rows])
        np.testing.assert_allclose(offsets[:, 0] * SCALE, np.array(places)[:, 0] - origin[0], rtol=0.0, atol=within)
        azimuth = [row["azimuth_deg"] for row in rows]
        np.testing.assert_allclose(azimuth, np.mod(np.array(TRUE_AZIMUTH) - ANGLES["grid"], 360.0), atol=1e-9)
    assert station_table_text(rows, found.found.frame).splitlines()[1].endswith(",grid")


def test_coordinates_of_the_sites_own_axes_are_not_turned(tmp_path: Path) -> None:
    asked = FrameRequest("site", origin=(100.0, 200.0, 35.0))
    found = answer_survey(SurveyRequest(record(tmp_path, "site"), frame=asked)).result
    assert (found["north"], found["coordinates_north"]) == ("site", "site")
    for row in found["stations"]:
        assert (row["northing_m"], row["easting_m"]) == (100.0 + row["north_m"], 200.0 + row["east_m"])


@pytest.mark.parametrize(
    ("asked", "named"),
    [
        (FrameRequest("magnetic", origin=ORIGIN), "count from grid north; expected --convergence-deg beside it"),
        (frame("grid", None, grid_scale_factor=0.0), "grid scale factor: expected metres of the grid a metre on the"),
        (frame("grid", None, grid_scale_factor=math.nan), "--grid-scale-factor: expected a finite number, got nan"),
        (frame("grid", None, origin=None), "--grid-scale-factor: expected --origin beside it"),
    ],
)
def test_coordinates_that_cannot_be_are_refused(tmp_path: Path, asked: FrameRequest, named: str) -> None:
    with pytest.raises(SurveyError) as error:
        answer_survey(SurveyRequest(record(tmp_path, "grid"), frame=asked))
    assert named in str(error.value)
    assert "\n" not in str(error.value)


WALL = """radius_m = 0.6
thickness_m = 0.8
heads = "heads.csv"
stations = "stations.csv"
inclination_deg = 12
azimuth_deg = 77
length_m = 12
instrument = "mwd-rev5.1"
field_nt = 50000
dip_deg = 70
"""


def wall(folder: Path, north: str, stations_north: str, more: str = "") -> Path:
    """Three columns whose heads and designs count from ``north`` and whose stations from ``stations_north``."""
    folder.mkdir(exist_ok=True)
    (folder / "heads.csv").write_text("column,north_m,east_m\nA,0,0\nB,0,0.7\nC,0.02,1.4\n")
    turn = ANGLES[north] - ANGLES[stations_north]  # of an azimuth from the one, in the other
    rows = [
        f"{name},{md},{12 + 0.1 * md!r},{77 + 0.3 * k + turn!r}" for k, name in enumerate("ABC") for md in (0, 4, 8, 12)
    ]
    (folder / "stations.csv").write_text("column,md_m,inclination_deg,azimuth_deg\n" + "\n".join(rows) + "\n")
    path = folder / "wall.toml"
    if "declination_deg" not in more and "magnetic" not in (north, stations_north):
        more += "declination_deg = 0\n"  # what a magnetic instrument is not without
    path.write_text(f'{WALL}north = "{north}"\nstations_north = "{stations_north}"\n{more}')
    return path


TOLD = "".join(
    f"{key} = {ANGLES[name]}\n"
    for name, key in (("site", "north_of_site_deg"), ("grid", "convergence_deg"), ("magnetic", "declination_deg"))
)


@pytest.mark.parametrize("stations_north", ["site", "true", "magnetic"])
def test_stations_of_any_north_are_the_same_wall(tmp_path: Path, stations_north: str) -> None:
    expected = read_wall(wall(tmp_path / "one", "grid", "grid", TOLD))
    found = read_wall(wall(tmp_path / "other", "grid", stations_north, TOLD))
    np.testing.assert_allclose(found.columns.centres, expected.columns.centres, atol=1e-9, equal_nan=True)
    np.testing.assert_allclose(found.columns.covs, expected.columns.covs, rtol=1e-6)
    assert wall_result(found, judge_wall(found))["stations_north"] == stations_north


def test_a_magnetic_survey_errs_alike_in_whichever_north_its_wall_is_told(tmp_path: Path) -> None:
    grid = read_wall(wall(tmp_path / "grid", "grid", "grid", TOLD))
    true = wall(tmp_path / "true", "true", "true", TOLD)  # the same columns, turned by hand into true north
    angle = ANGLES["grid"]
    heads = [complex(*place) * cmath.exp(1j * angle * DEG) for place in ((0.0, 0.0), (0.0, 0.7), (0.02, 1.4))]
    true.with_name("heads.csv").write_text(
        "column,north_m,east_m\n" + "".join(f"{n},{z.real!r},{z.imag!r}\n" for n, z in zip("ABC", heads, strict=True))
    )
    rows = [f"{n},{md},{12 + 0.1 * md!r},{77 + 0.3 * k + angle!r}" for k, n in enumerate("ABC") for md in (0, 4, 8, 12)]
    true.with_name("stations.csv").write_text("column,md_m,inclination_deg,azimuth_deg\n" + "\n".join(rows) + "\n")
    true.write_text(true.read_text().replace("azimuth_deg = 77", f"azimuth_deg = {77 + angle}"))
    found = read_wall(true)
    within = (grid.columns.states != ColumnState.OUTSIDE) & (found.columns.states != ColumnState.OUTSIDE)
    regions = [np.linalg.eigvalsh(each.columns.covs[within]) for each in (grid, found)]
    np.testing.assert_allclose(regions[1], regions[0], rtol=1e-6, atol=1e-12)
    untold = read_wall(wall(tmp_path / "untold", "grid", "grid", ""))  # taken as if grid were magnetic north
    toes = [each.columns.covs[:, -2] for each in (untold, grid)]
    assert float(np.max(np.abs(toes[0] - toes[1]))) > 1e-3 * float(np.max(toes[1]))


def test_what_a_wall_proposes_stands_in_grid_coordinates(tmp_path: Path) -> None:
    origin = f"northing_m = {ORIGIN[0]}\neasting_m = {ORIGIN[1]}\nheight_m = {ORIGIN[2]}\ngrid_scale_factor = {SCALE}\n"
    path = wall(tmp_path, "magnetic", "magnetic", TOLD + origin)
    stations = path.with_name("stations.csv")
    stations.write_text(
        "\n".join(line for line in stations.read_text().splitlines() if not line.startswith("B")) + "\n"
    )
    found = read_wall(path)
    result = wall_result(found, judge_wall(found))
    assert result["coordinates_north"] == "grid"
    column = result["extra_columns"][0]["extra_column"]
    place = complex(column["north_m"], column["east_m"]) * cmath.exp(1j * (ANGLES["magnetic"] - ANGLES["grid"]) * DEG)
    assert column["northing_m"] - ORIGIN[0] == pytest.approx(SCALE * place.real, abs=2e-9)
    assert column["easting_m"] - ORIGIN[1] == pytest.approx(SCALE * place.imag, abs=2e-9)
    assert column["height_m"] == pytest.approx(ORIGIN[2] - column["down_m"], abs=1e-9)


@pytest.mark.parametrize(
    ("north", "stations", "more", "named"),
    [
        ("grid", "magnetic", "convergence_deg = 1\n", "declination_deg is missing: stations count from magnetic north"),
        ("polar", "grid", "", "north: expected one of site, true, grid, magnetic, got 'polar'"),
        ("grid", "grid", "declination_deg = 200\n", "declination_deg: expected at most 180, got 200"),
        (
            "grid",
            "grid",
            "grid_scale_factor = 1\n",
            "grid_scale_factor: expected northing_m, easting_m, height_m beside",
        ),
        ("grid", "grid", "grid_scale_factor = 0\n", "grid_scale_factor: expected a positive number, got 0"),
        (
            "true",
            "true",
            "northing_m = 1\neasting_m = 1\nheight_m = 1\n",
            "convergence_deg is missing: site coordinates",
        ),
    ],
)
def test_norths_of_a_wall_that_cannot_be_are_refused(
    tmp_path: Path, north: str, stations: str, more: str, named: str
) -> None:
    ANGLES.setdefault("polar", 0.0)
    with pytest.raises(SurveyError) as error:
        read_wall(wall(tmp_path, north, stations, more))
    assert named in str(error.value)
    assert "\n" not in str(error.value)
