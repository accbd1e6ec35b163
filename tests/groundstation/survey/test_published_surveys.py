"""Surveys with published answers: the workbook of ISCWSA MWD Rev 5.1 and the gyro models of SPE 90408, appendix E."""

import csv
import math
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from groundstation.survey.requests.survey_answer import answer_survey
from groundstation.survey.requests.survey_request import SurveyRequest
from groundstation.survey.tools.instruments import load_tool
from groundstation.survey.well.compiled_model import CompiledModel
from groundstation.survey.well.error_propagation import Uncertainty, propagate_errors
from groundstation.survey.well.error_sources import Leg, Site, WellSurvey
from groundstation.survey.well.methods import Method, station_positions

DATA = Path(__file__).parents[2] / "data" / "survey"
DEG = math.pi / 180.0
ENTRIES = {"NN": (0, 0), "NE": (0, 1), "NV": (0, 2), "EE": (1, 1), "EV": (1, 2), "VV": (2, 2)}
LATITUDES = {"1": 60.0, "2": 28.0, "3": -40.0}
FEET = 0.3048
GRID_NORTH = {"1": 0.0, "2": 1.25 * DEG, "3": 0.0}  # of the tables' axes; the weights count from true north
# Model 4 on well 3 initialises a second time, at 3 deg on the way from the vertical to 110 deg: its table wants the
# first seed at two depths and another at the third. welleng gives our figures. Model 1 there is printed 4 % low in NN.
MISSED = {
    ("3", "1", "3000"): {"NN"},
    ("3", "4", "3000"): {"NE", "EE"},
    ("3", "4", "3720"): {"NN", "NE"},
    ("3", "4", "4030"): {"NN", "NE", "EE"},
}


def rows_of(name: str) -> Iterator[dict[str, str]]:
    with (DATA / name).open() as file:
        yield from csv.DictReader(line for line in file if not line.startswith("#"))


def well(name: str) -> WellSurvey:
    table = [[float(row[key]) for key in ("md", "inclination_deg", "azimuth_deg")] for row in rows_of(name)]
    md, inclination, azimuth = np.array(table).T
    i, a = inclination * DEG, azimuth * DEG
    return WellSurvey(md, i, a, station_positions(Method.MINIMUM_CURVATURE, md, i, a)[:, 2])


@pytest.fixture(scope="module")
def workbook() -> Uncertainty:
    site = Site(9.80665, 50_000.0, 72.0 * DEG, -4.0 * DEG, 60.0 * DEG)
    return propagate_errors(
        well("iscwsa_mwd_rev5.1_well_1.csv"), [Leg(load_tool("mwd-rev5.1"))], site, slot_allowance=True
    )


def test_totals_at_all_stations_are_those_of_the_workbook(workbook: Uncertainty) -> None:
    for k, row in enumerate(rows_of("iscwsa_mwd_rev5.1_well_1.csv")):
        trace = sum(float(row[name]) for name in ("NN", "EE", "VV"))
        for name, place in ENTRIES.items():
            if k > 0:  # the workbook's first row is zero, ours reads its own depth
                assert abs(workbook.cov[(k, *place)] - float(row[name])) <= 1e-6 * trace, (row["md"], name)
    assert len(workbook.cov) > 250


@pytest.mark.slow
def test_the_compiled_model_gives_the_workbook_too(workbook: Uncertainty) -> None:
    survey = workbook.survey
    _, cov = CompiledModel(load_tool("mwd-rev5.1")).run(
        Method.MINIMUM_CURVATURE, survey.md, survey.inclination, survey.azimuth, workbook.site
    )
    np.testing.assert_allclose(cov[1:], workbook.cov[1:], rtol=1e-11, atol=1e-11)


def test_every_source_at_the_checkpoints_is_that_of_the_workbook(workbook: Uncertainty) -> None:
    by_source = workbook.by_source()
    totals = {row["md"]: row for row in rows_of("iscwsa_mwd_rev5.1_well_1_sources.csv") if row["source"] == "TOTAL"}
    compared = 0
    for row in rows_of("iscwsa_mwd_rev5.1_well_1_sources.csv"):
        if row["source"] == "TOTAL":
            continue
        k = int(np.flatnonzero(workbook.survey.md == float(row["md"]))[0])
        trace = sum(float(totals[row["md"]][name]) for name in ("NN", "EE", "VV"))
        for name, place in ENTRIES.items():
            error = abs(by_source[row["source"]][(k, *place)] - float(row[name]))
            assert error <= 1e-4 * max(abs(float(row[name])), 1e-3 * trace), (row["md"], row["source"], name)
            compared += 1
    assert compared > 6 * 35


@cache
def covariance(number: str, model: str, deepest: float) -> tuple[WellSurvey, np.ndarray]:
    """Of a gyro model down to a depth, in the axes of the tables."""
    name = "iscwsa_mwd_rev5.1_well_1.csv" if number == "1" else f"iscwsa_well_{number}.csv"
    whole = well(name)
    count = int(np.searchsorted(whole.md, deepest)) + 1
    turn = GRID_NORTH[number]
    azimuth = whole.azimuth[:count] + turn
    survey = WellSurvey(whole.md[:count], whole.inclination[:count], azimuth, whole.tvd[:count])
    tool = load_tool(str(DATA / f"spe90408-model-{model}.toml"))
    site = Site(9.80665, 50_000.0, 72.0 * DEG, 0.0, LATITUDES[number] * DEG)
    cov = propagate_errors(survey, [Leg(tool)], site, slot_allowance=tool.slot_allowance).cov
    c, s = math.cos(turn), math.sin(turn)
    axes = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return survey, axes @ cov @ axes.T


CELLS = list(rows_of("spe90408_appendix_e.csv"))


def deepest_of(cell: dict[str, str]) -> float:
    mine = [float(c["md"]) for c in CELLS if (c["well"], c["model"]) == (cell["well"], cell["model"])]
    return max(mine) * (FEET if cell["well"] == "2" else 1.0)


@pytest.mark.parametrize("cell", CELLS, ids=lambda c: f"well{c['well']}-model{c['model']}-{c['md']}")
def test_gyro_models_have_the_covariances_of_the_paper(cell: dict[str, str]) -> None:
    survey, cov = covariance(cell["well"], cell["model"], deepest_of(cell))
    unit = FEET if cell["well"] == "2" else 1.0
    missed = MISSED.get((cell["well"], cell["model"], cell["md"]), set())
    for name, (a, b) in ENTRIES.items():
        found = np.interp(float(cell["md"]) * unit, survey.md, cov[:, a, b]) / unit**2
        printed = float(cell[name])
        agrees = abs(found - printed) <= max(2.0, 0.01 * abs(printed))
        assert agrees == (name not in missed), (name, found, printed)


PATHS = sorted({row["well"] for row in rows_of("iscwsa_clearance_wells.csv")})


@pytest.mark.parametrize("name", PATHS)
def test_a_survey_lies_where_the_wells_of_the_standard_set_are_printed(tmp_path: Path, name: str) -> None:
    """Positions there are printed to the centimetre. Balanced tangential is off by 0.1 m and more where holes bend."""
    rows = [row for row in rows_of("iscwsa_clearance_wells.csv") if row["well"] == name and row["md"]]
    printed = np.array([[float(row[key]) for key in ("north", "east", "tvd")] for row in rows])
    first = float(rows[0]["md"])  # of the sidetrack 900 m, where it is vertical
    path = tmp_path / "well.csv"
    stations = [f"{float(r['md']) - first},{r['inclination_deg']},{r['azimuth_deg']}" for r in rows]
    path.write_text("md_m,inclination_deg,azimuth_deg\n" + "\n".join(stations) + "\n")
    off = {}
    for method in (None, "balanced-tangential"):
        found = answer_survey(SurveyRequest(path, method=method)).result
        places = np.array([[row[key] for key in ("north_m", "east_m", "tvd_m")] for row in found["stations"]])
        off[found["method"]] = float(np.max(np.linalg.norm(places + printed[0] - printed, axis=-1)))
    assert off["minimum-curvature"] < 0.009
    assert (off["balanced-tangential"] > 0.1) == (name != "09")  # well 09 is straight


def test_lateral_displacements_keep_the_method_of_their_form(tmp_path: Path) -> None:
    path = tmp_path / "field.csv"
    path.write_text("md_m,a_cm,b_cm\n0,0,0\n2,1,-3\n4,2,-7\n")
    assert answer_survey(SurveyRequest(path)).result["method"] == "balanced-tangential"
    assert answer_survey(SurveyRequest(path, method="minimum-curvature")).result["method"] == "minimum-curvature"
