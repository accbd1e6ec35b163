"""Papers read back whole: reports of holes, certificates of calibrations in each language, instruments as files.

Their figures are those of `test_surveys_whole.py` and `test_calibrations_whole.py`, so that they are left out here.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from datetime import date
from pathlib import Path

import pytest
from read_back import check, leaves, write_anew

from groundstation.calibration.accuracy_records import answer_accuracy
from groundstation.report import hole_report as hole_report_module
from groundstation.report.calibrations.calibration_answer import answer_calibration
from groundstation.report.calibrations.calibration_request import AttitudesRequest, TurntableRequest
from groundstation.report.certificate import Identity, template_data
from groundstation.report.document import Origin, ReportPapers, document_content
from groundstation.report.hole_report import HolePapers, hole_report
from groundstation.survey.requests.survey_answer import answer_survey
from groundstation.survey.requests.survey_request import FrameRequest, SiteFigures, SurveyRequest
from groundstation.survey.tools.instruments import load_tool, shipped_tool_names
from groundstation.survey.tools.iscwsa_json import to_json

INSTRUMENTS = Path(__file__).parents[2] / "scenarios" / "instruments"
LANGUAGES = ("en", "de", "es", "fr", "it")
DAY = date(2026, 11, 20)
WELL = "md_m,inclination_deg,azimuth_deg,time_s\n0,0,0,60\n7,1.25,40,700\n15,3.5,55,1500\n26,8.75,71,2900\n"


def hole(folder: Path) -> SurveyRequest:
    """With a station that has no azimuth, on a grid, of an instrument with many sources."""
    (folder / "K 7.csv").write_text(WELL + "33,9.5,,3600\n41,11.0,80,4100\n")
    frame = FrameRequest("grid", "grid", convergence_deg=1.75, origin=(5e3, 300.25, 31.5), height_datum="DHHN2016")
    site = SiteFigures(9.8123, 49_230.0, 66.5, 3.25, 52.4)
    return SurveyRequest(folder / "K 7.csv", instrument="mwd-rev5.1", sigma=2.0, frame=frame, site=site)


def told_report(folder: Path, language: str) -> Iterator[str]:
    """Report of a hole but for its figure."""
    papers = ReportPapers(language=language)
    origin = Origin(DAY, "1.2.3", [("SHA-256 of K 7.csv", "ab" * 32)], papers)
    plain = SurveyRequest(folder / "plain.csv")
    (folder / "plain.csv").write_text(WELL)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hole_report_module, "survey_figure", lambda *_: None)
        patch.setattr(hole_report_module, "svg_in", lambda *_: "<svg/>")
        for request, told in ((hole(folder), HolePapers("Station square", "R-17", "K-31")), (plain, HolePapers())):
            yield from leaves(document_content(hole_report(answer_survey(request), told, origin)))


def told_certificate(folder: Path, language: str) -> Iterator[str]:
    """Everything that a certificate sets, but for its figures."""
    del folder
    for name, request in (
        ("accelerometer 3", AttitudesRequest(INSTRUMENTS / "attitudes.csv", temperature_c=23.0)),
        ("gyroscope 1", TurntableRequest(INSTRUMENTS / "turntable.csv", 720.0)),
    ):
        outcome = answer_calibration(request, DAY.isoformat())
        identity = Identity(
            name, DAY, request.file.name, outcome.record_sha256, outcome.block_sha256, "1.2.3",
            (("Serial number", "A1-0042"), ("Number", "K-17"), ("Next due", "2027-05-31")), language,
        )  # fmt: skip
        yield from leaves(json.loads(template_data(outcome.sheet, [], identity)))


def told_tools(folder: Path) -> Iterator[str]:
    """Each instrument that comes with the program, and as a file of the industry."""
    del folder
    for name in shipped_tool_names():
        tool = load_tool(name)
        yield from leaves(tool, name)
        try:
            yield from leaves(json.loads(to_json(tool, DAY)), f"{name} as JSON")
        except ValueError as error:
            yield f"{name} as JSON: refused: {error}"


def told_accuracy(folder: Path) -> Iterator[str]:
    """Two sensors against presets, one by its readings and one by means, and both together."""
    readings = [(15, 15.1), (15, 15.3), (15, 14.8), (30, 30.2), (30, 29.7), (60, 60.5), (60, 60.1), (60, 60.9)]
    rows = "".join(f"{preset},{reading}\n" for preset, reading in readings)
    (folder / "one.csv").write_text(f"preset_deg,reading_deg\n{rows}")
    (folder / "two.csv").write_text("preset_deg,mean_deg,std_deg\n10,10.05,0.02\n45,45.4,0.05\n90,89.5,0.11\n")
    found = answer_accuracy([folder / "one.csv", folder / "two.csv"])
    yield from (line.replace(str(folder), "FOLDER") for line in leaves(found))


MADE: dict[str, Callable[[Path], Iterable[str]]] = {
    **{f"report-hole-{name}": (lambda folder, name=name: told_report(folder, name)) for name in LANGUAGES},  # type: ignore[misc]
    **{f"certificate-{name}": (lambda folder, name=name: told_certificate(folder, name)) for name in LANGUAGES},  # type: ignore[misc]
    "tools": told_tools, "accuracy": told_accuracy,
}  # fmt: skip


@pytest.mark.parametrize("name", MADE)
def test_a_paper_is_told_as_approved(tmp_path: Path, name: str) -> None:
    check(name, MADE[name](tmp_path))


def test_a_region_is_told_at_one_sigma_in_millimetres_whatever_was_asked(tmp_path: Path) -> None:
    """The last row of the stations is the root of the last variance, though the survey was asked at two sigma."""
    answer = answer_survey(hole(tmp_path))
    document = hole_report(answer, HolePapers(), Origin(DAY, "1", []))
    rows = next(one for one in document.sections if one.title == "Stations").rows
    cov = answer.result["stations"][-1]["uncertainty"]["covariance_m2"]
    assert tuple(rows[-1][-3:]) == tuple(f"{1000.0 * cov[k][k] ** 0.5:.1f}" for k in range(3))


def test_sensors_together_weigh_by_the_inverse_of_their_variances(tmp_path: Path) -> None:
    list(told_accuracy(tmp_path))
    found = answer_accuracy([tmp_path / "one.csv", tmp_path / "two.csv"])
    weights = [1.0 / one["std"] ** 2 for one in found["sensors"]]
    mean = sum(w * one["error_percent"] for w, one in zip(weights, found["sensors"], strict=True)) / sum(weights)
    assert (found["error_percent"], found["std"]) == (pytest.approx(mean), pytest.approx(sum(weights) ** -0.5))


if __name__ == "__main__":
    write_anew(MADE)
