"""Report of one hole by itself: its survey, what the ± contains, the site, the instrument, the check of its data.

Lengths in m against the hole's zero: north, east, down.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from groundstation.report.column_report import CONFIDENCE, ReportSite
from groundstation.report.document import AS_BUILT, Document, Origin, ReportSection
from groundstation.report.figure_words import svg_in
from groundstation.report.plots import survey_figure
from groundstation.report.word_tables import NOT_STATED
from groundstation.survey.requests.site_place import site_words
from groundstation.survey.wall.column_deviation import NORMAL_95

if TYPE_CHECKING:
    from groundstation.survey.requests.survey_answer import SurveyAnswer

SOURCES_SHOWN = 12
NOT_IN_IT = "It leaves out mistakes, such as a wrong depth or north, and how the hole runs between its stations."


@dataclass(frozen=True, slots=True)
class HolePapers:
    """What a report says of a hole and no record does: project, serial number and calibration of what surveyed it."""

    project: str = ""
    serial: str = ""
    calibration: str = ""


def hole_report(answer: SurveyAnswer, papers: HolePapers, origin: Origin) -> Document:
    """Report of a hole as it was surveyed; it has no design, so nothing is called good that has a warning."""
    found, result = answer.found, answer.result
    warnings = [row["text"][0].upper() + row["text"][1:] + "." for row in result["warnings"]]
    frame = found.frame
    site = ReportSite(
        papers.project, origin.papers.client, frame.answer, frame.depths.answer, frame.height_datum, frame.grid
    )
    title = f"Hole {answer.request.file.stem}"
    figure = survey_figure(found.md, found.positions, found.uncertainty.cov, CONFIDENCE, f"{title}, 95 % regions")
    sections = [
        ReportSection("Check of the data", warnings or ("Nothing is missing, and nothing is beyond what steel does.",)),
        ReportSection("Instrument", facts=_instrument(answer, papers)),
        ReportSection("What the ± contains", _contained(result), **_sources(result)),
        ReportSection("Stations", **_stations(answer)),
        ReportSection("Plan and sections", figure=svg_in(figure, origin.papers.language), new_page=True),
    ]
    facts = [*site.facts(), ("Site", site_words(result["site"]).removeprefix("site: ")), *_times(answer)]
    return Document(
        "Hole report", title, papers.project or AS_BUILT, _verdict(answer), not warnings, facts, sections, origin
    )


def _verdict(answer: SurveyAnswer) -> str:
    """Where the hole ends, at 95 %."""
    found, warnings = answer.found, answer.result["warnings"]
    half = NORMAL_95 * np.sqrt(np.maximum(np.diagonal(found.uncertainty.cov[-1]), 0.0))
    parts = zip(("north", "east", "down"), found.positions[-1].tolist(), half.tolist(), strict=True)
    place = " m, ".join(f"{name} {value:.3f} ± {std:.3f}" for name, value, std in parts)
    end = f"The hole ends at {found.md[-1]:g} m: {place} m, 95 % each"
    return end if not warnings else f"{end}; warnings: {len(warnings)}"


def _times(answer: SurveyAnswer) -> list[tuple[str, str]]:
    times = answer.record.columns.get("time_s")
    words = NOT_STATED if times is None else f"{times[0]:g} to {times[-1]:g} s of its record"
    return [("Times of the surveys", words)]


def _instrument(answer: SurveyAnswer, papers: HolePapers) -> list[tuple[str, str]]:
    return [
        ("Error model", answer.instrument),
        ("Its source", answer.tool.source or NOT_STATED),
        ("Serial number", papers.serial or NOT_STATED),
        ("Calibration", papers.calibration or NOT_STATED),
        ("Joined by", answer.result["method"]),
    ]


def _contained(result: dict[str, Any]) -> list[str]:
    return [f"The errors of this instrument, {len(result['sources'])} sources, at the last station.", NOT_IN_IT]


def _sources(result: dict[str, Any]) -> dict[str, Any]:
    shown = result["sources"][:SOURCES_SHOWN]
    multiple = 1000.0 / result["sigma"]
    rows = [(row["source"], *(f"{multiple * row[key]:.1f}" for key in ("north_m", "east_m", "tvd_m"))) for row in shown]
    return {"columns": ("source", "north mm", "east mm", "down mm"), "rows": rows}


def _stations(answer: SurveyAnswer) -> dict[str, Any]:
    found, grid = answer.found, answer.found.frame.grid
    places = found.positions if grid is None else grid.of_places(found.positions)
    names = ("north m", "east m", "down m") if grid is None else ("N m", "E m", "height m")
    stds = 1000.0 * np.sqrt(np.maximum(np.diagonal(found.uncertainty.cov, axis1=1, axis2=2), 0.0))
    rows = [
        (
            f"{md:.2f}", f"{inclination:.3f}", f"{azimuth:.2f}", *(f"{value:.3f}" for value in place),
            *(f"{value:.1f}" for value in std),
        )
        for md, inclination, azimuth, place, std in zip(
            found.md.tolist(), np.degrees(found.record.inclination).tolist(), np.degrees(found.azimuth).tolist(),
            places.tolist(), stds.tolist(), strict=True,
        )
    ]  # fmt: skip
    columns = ("MD m", "incl. deg", "azi. deg", *names, "sigma N mm", "sigma E mm", "sigma D mm")
    return {"words": ("Sigma is one standard deviation.",), "columns": columns, "rows": rows}
