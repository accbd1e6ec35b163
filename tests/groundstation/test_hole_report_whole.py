"""The whole report of a hole from an answer that is given by hand: every fact, cell and word."""

import math
from dataclasses import replace
from datetime import date
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from groundstation.report import hole_report as hole_report_module
from groundstation.report.document import Document, Origin, ReportPapers, ReportSection
from groundstation.report.hole_report import HolePapers, hole_report
from groundstation.survey.well.depth_reference import DepthReference
from groundstation.survey.well.reference_frames import ReferenceFrame, SiteGrid

POSITIONS = np.array([[0.0, 0.0, 0.0], [0.1234, -0.2346, 9.9871], [-0.5674, 1.2345, 19.8765]])
STDS = np.array([[0.0, 0.0, 0.0], [0.0012, 0.0034, 0.0056], [0.0123, 0.0345, 0.0067]])
SITE = {"gravity_mps2": 9.81}


def source(number: int) -> dict[str, Any]:
    return {"source": f"s{number}", "north_m": 0.01 * number, "east_m": 0.002 * number, "tvd_m": 0.0004 * number}


def answer(count: int = 13, *, warnings: tuple[str, ...] = (), grid: SiteGrid | None = None, times: bool = True) -> Any:
    """A survey of three stations; its sources are told at two sigma."""
    covs = np.stack([np.diag(row**2) for row in STDS])
    covs[:, 0, 1] = covs[:, 1, 0] = 1e-7
    frame = ReferenceFrame("magnetic", "true", depths=DepthReference("rotary-table", "drill-floor", 0.0), grid=grid)
    columns = {"time_s": np.array([12.5, 100.0, 987.0])} if times else {}
    found = SimpleNamespace(
        md=np.array([0.0, 10.0, 20.25]), positions=POSITIONS, uncertainty=SimpleNamespace(cov=covs),
        frame=replace(frame, height_datum="NN"), azimuth=np.radians([0.0, 297.754, 114.678]),
        record=SimpleNamespace(inclination=np.radians([0.0, 1.5236, 3.0004])),
    )  # fmt: skip
    result = {
        "warnings": [{"text": text} for text in warnings], "sources": [source(k) for k in range(1, count + 1)],
        "sigma": 2.0, "method": "minimum-curvature", "site": SITE,
    }  # fmt: skip
    return SimpleNamespace(
        found=found, result=result, instrument="relay: a chain", tool=SimpleNamespace(source="calibration"),
        record=SimpleNamespace(columns=columns), request=SimpleNamespace(file=SimpleNamespace(stem="K7")),
    )  # fmt: skip


@pytest.fixture(autouse=True)
def asked_figure(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What the figure was asked for; `test_survey_drawing.py` reads figures."""
    asked: list[Any] = []
    monkeypatch.setattr(hole_report_module, "survey_figure", lambda *given: asked.append(given))
    monkeypatch.setattr(hole_report_module, "svg_in", lambda _, language: f"svg {language}")
    monkeypatch.setattr(hole_report_module, "site_words", lambda site: f"site: gravity {site['gravity_mps2']}")
    return asked


ORIGIN = Origin(date(2026, 11, 20), "1.2.3", [], ReportPapers("D-1", "B", "Bohr", "Rail", "fr"))


def section(document: Document, title: str) -> ReportSection:
    (found,) = [one for one in document.sections if one.title == title]
    return found


def test_every_fact_cell_and_word(asked_figure: list[Any]) -> None:
    given = answer()
    document = hole_report(given, HolePapers("Lot 3", "R-17", "K-31"), ORIGIN)
    assert (document.kind, document.title, document.subject, document.good) == ("Hole report", "Hole K7", "Lot 3", True)
    half = 1.959963984540054 * STDS[-1]
    assert document.verdict == (
        f"The hole ends at 20.25 m: north -0.567 ± {half[0]:.3f} m, east 1.234 ± {half[1]:.3f} m, "
        f"down 19.877 ± {half[2]:.3f} m, 95 % each"
    )
    assert document.verdict.count("± 0.024 m") == document.verdict.count("± 0.068 m") == 1
    assert list(document.facts) == [
        ("Project", "Lot 3"), ("Client", "Rail"), ("Azimuths and coordinates", "true north"),
        ("Depths count from", "drill floor"), ("Height datum", "NN"), ("Site coordinates", "local, none were given"),
        ("Site", "gravity 9.81"), ("Times of the surveys", "12.5 to 987 s of its record"),
    ]  # fmt: skip
    assert [(one.title, one.new_page) for one in document.sections] == [
        ("Check of the data", False), ("Instrument", False), ("What the ± contains", False), ("Stations", False),
        ("Plan and sections", True),
    ]  # fmt: skip
    assert list(section(document, "Check of the data").words) == [
        "Nothing is missing, and nothing is beyond what steel does."
    ]
    assert list(section(document, "Instrument").facts) == [
        ("Error model", "relay: a chain"), ("Its source", "calibration"), ("Serial number", "R-17"),
        ("Calibration", "K-31"), ("Joined by", "minimum-curvature"),
    ]  # fmt: skip
    contained = section(document, "What the ± contains")
    assert list(contained.words) == [
        "The errors of this instrument, 13 sources, at the last station.",
        "It leaves out mistakes, such as a wrong depth or north, and how the hole runs between its stations.",
    ]
    assert list(contained.columns) == ["source", "north mm", "east mm", "down mm"]
    # the first twelve, from two sigma in m to one in mm
    assert list(contained.rows) == [(f"s{k}", f"{5.0 * k:.1f}", f"{k:.1f}", f"{0.2 * k:.1f}") for k in range(1, 13)]
    stations = section(document, "Stations")
    assert list(stations.words) == ["Sigma is one standard deviation."]
    assert list(stations.columns) == [
        "MD m", "incl. deg", "azi. deg", "north m", "east m", "down m", "sigma N mm", "sigma E mm", "sigma D mm",
    ]  # fmt: skip
    assert list(stations.rows) == [
        ("0.00", "0.000", "0.00", "0.000", "0.000", "0.000", "0.0", "0.0", "0.0"),
        ("10.00", "1.524", "297.75", "0.123", "-0.235", "9.987", "1.2", "3.4", "5.6"),
        ("20.25", "3.000", "114.68", "-0.567", "1.234", "19.877", "12.3", "34.5", "6.7"),
    ]
    assert section(document, "Plan and sections").figure == "svg fr"
    ((md, positions, covs, confidence, title),) = asked_figure
    assert (confidence, title) == (0.95, "Hole K7, 95 % regions")
    found = given.found
    assert (md is found.md, positions is found.positions, covs is found.uncertainty.cov) == (True, True, True)


def test_what_is_not_stated_and_a_warning() -> None:
    document = hole_report(
        answer(1, warnings=("a spike at 5 m", "line 3 has none"), times=False),
        HolePapers(),
        replace(ORIGIN, papers=ReportPapers()),
    )
    assert (document.subject, document.good) == ("as built", False)
    assert document.verdict.endswith(" m, 95 % each; warnings: 2")
    facts = dict(document.facts)
    assert (facts["Project"], facts["Client"], facts["Times of the surveys"]) == ("not stated",) * 3
    assert list(section(document, "Check of the data").words) == ["A spike at 5 m.", "Line 3 has none."]
    instrument = dict(section(document, "Instrument").facts)
    assert (instrument["Serial number"], instrument["Calibration"]) == ("not stated", "not stated")
    plain = answer(1)
    plain.tool.source = ""
    assert dict(section(hole_report(plain, HolePapers(), ORIGIN), "Instrument").facts)["Its source"] == "not stated"
    contained = section(document, "What the ± contains")
    assert list(contained.rows) == [("s1", "5.0", "1.0", "0.2")]


def test_site_coordinates_stand_in_place_of_positions() -> None:
    """Turned by a quarter, north of the grid points where west was; the scale is that of the grid, heights go up."""
    grid = SiteGrid((5000.0, 300.0, 40.0), "grid", math.radians(90.0), 0.9996)
    document = hole_report(answer(grid=grid), HolePapers(), ORIGIN)
    stations = section(document, "Stations")
    assert list(stations.columns)[3:6] == ["N m", "E m", "height m"]
    north, east, down = POSITIONS[-1]
    # azimuth of grid north is east: what lies east lies north of the grid, what lies north lies west of it
    assert stations.rows[-1][3:6] == (
        f"{5000.0 + 0.9996 * east:.3f}", f"{300.0 - 0.9996 * north:.3f}", f"{40.0 - down:.3f}",
    )  # fmt: skip
    assert dict(document.facts)["Site coordinates"] == (
        "N 5000.000 m, E 300.000 m, height 40.000 m at the zero of this report; grid north, scale 0.9996"
    )
