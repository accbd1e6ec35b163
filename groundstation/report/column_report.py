"""Report of one column: set out, as built against its design, tolerance, instrument and calibration, what to do.

Lengths in m; positions against the site's zero: north, east, down.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.report.document import AS_BUILT, Document, Origin, ReportSection
from groundstation.report.figure_words import svg_in
from groundstation.report.plots import survey_figure
from groundstation.report.word_tables import NOT_STATED
from groundstation.survey.tools.instruments import SurveyTool
from groundstation.survey.wall.column_deviation import ColumnDesign, Deviation, Tolerance, point_deviation
from groundstation.survey.well.reference_frames import SiteGrid
from groundstation.survey.well.trajectory_rows import TrajectoryPoint

Array = npt.NDArray[np.float64]
CONFIDENCE = 0.95
CHECKED = "nothing is missing, and nothing is beyond what steel does"
CONTAINED = "errors of the instrument and of setting out; no mistakes"
NO_INSTRUMENT = "none, the column was not surveyed"
CLAUSES = {
    "en-12716": "EN 12716, execution of jet grouting: 50 mm at the head and 2 % of the length drilled",
    "5-cm": "50 mm at every depth",
    "0.27-deg": "0.27 deg from the design axis",
}


@dataclass(frozen=True, slots=True)
class ReportSite:
    """Site of a report: project, client, north, and the site's coordinates, if any."""

    project: str = ""
    client: str = ""
    north: str = "site"
    depth_reference: str = "collar"
    height_datum: str = ""
    grid: SiteGrid | None = None

    def facts(self) -> list[tuple[str, str]]:
        """Lines at the top of every report."""
        zero = "local, none were given"
        if self.grid is not None:
            northing, easting, height = self.grid.origin
            zero = f"N {northing:.3f} m, E {easting:.3f} m, height {height:.3f} m at the zero of this report"
            zero += f"; {self.grid.north} north" + ("" if self.grid.scale == 1.0 else f", scale {self.grid.scale:g}")
        return [
            ("Project", self.project or "not stated"),
            ("Client", self.client or "not stated"),
            ("Azimuths and coordinates", f"{self.north} north"),
            ("Depths count from", self.depth_reference.replace("-", " ")),
            ("Height datum", self.height_datum or "not stated"),
            ("Site coordinates", zero),
        ]


@dataclass(frozen=True, slots=True)
class ColumnRecord:
    """One column as a report needs it: stations (n,), positions (n, 3) against the zero and covariances (n, 3, 3)."""

    design: ColumnDesign
    state: str
    tool: SurveyTool
    serial: str
    calibration: str
    head_std: float
    md: Array
    inclination: Array
    azimuth: Array
    positions: Array
    covs: Array
    surveyed_md: float  # nan where it was not surveyed
    drilled_md: float  # nan where it was not drilled
    actions: Sequence[str] = ()  # what is to be done about it
    times: tuple[str, str] | None = None  # of its first and last survey, as its table tells them
    warnings: Sequence[str] = ()  # of its data

    def deviations(self) -> list[Deviation]:
        """Deviations from the design at every surveyed station."""
        found = []
        for md, place, cov in zip(self.md, self.positions, self.covs, strict=True):
            if md <= self.surveyed_md + 1e-6:
                point = TrajectoryPoint(float(md), self.design.axis, place, cov, np.zeros((3, 0)))
                found.append(point_deviation(point, self.design))
        return found


def column_report(record: ColumnRecord, site: ReportSite, origin: Origin) -> Document:
    """Report of one column."""
    found = record.deviations() if math.isfinite(record.surveyed_md) else []
    verdict, good = _verdict(record, found)
    good = good and not record.warnings
    sections = [
        ReportSection("Setting out and design", facts=_design_facts(record, site)),
        ReportSection("As built against design", (_tolerance_words(record.design),), **_table(record, found, site)),  # type: ignore[arg-type]
        ReportSection("What is to be done", record.actions or ("Nothing.",)),
        ReportSection("Instrument", facts=instrument_facts(record)),
    ]
    if len(found) > 1:
        count, zero = len(found), np.array(record.design.head)
        figure = survey_figure(
            record.md[:count], record.positions[:count] - zero, record.covs[:count], CONFIDENCE,
            f"Column {record.design.name} from its head, {100.0 * CONFIDENCE:g} % regions",
            _from_its_head(record.design),
        )  # fmt: skip
        sections.append(
            ReportSection("Plan and sections", figure=svg_in(figure, origin.papers.language), new_page=True)
        )
    title = f"Column {record.design.name}"
    facts = [*site.facts(), *paper_facts(record)]
    return Document("Column report", title, site.project or AS_BUILT, verdict, good, facts, sections, origin)


def _from_its_head(design: ColumnDesign) -> ColumnDesign:
    return ColumnDesign(
        design.name, (0.0, 0.0, 0.0), design.inclination, design.azimuth, design.length, design.radius, design.tolerance
    )


def _verdict(record: ColumnRecord, found: Sequence[Deviation]) -> tuple[str, bool]:
    name, length = record.design.name, record.design.length
    if not math.isfinite(record.drilled_md):
        return f"Column {name}: {record.state or 'not drilled'}", False
    if not found:
        return f"Column {name}: {record.state}; nothing is known of where it is", False
    worst = max(found, key=lambda d: d.ratio)
    if worst.ratio >= 1.0:
        return f"Column {name} is out of tolerance: {worst.ratio:.0%} of it at {worst.md:g} m", False
    short = min(record.drilled_md, record.surveyed_md)
    if short < length - 0.05:
        return f"Column {name} is within tolerance to {short:g} m; design length {length:g} m ({record.state})", False
    return f"Column {name} is within tolerance: {worst.ratio:.0%} of it at the most, at {worst.md:g} m", True


def tolerance_text(rule: Tolerance) -> str:
    """A tolerance in words."""
    parts = [f"{1e3 * rule.start:g} mm at the head"] if rule.start else []
    parts += [f"{100.0 * rule.growth:.3g} % of the length"] if rule.growth else []
    return CLAUSES.get(rule.name, f"{rule.name}: {' and '.join(parts)}")


def _tolerance_words(design: ColumnDesign) -> str:
    tolerance = tolerance_text(design.tolerance)
    return f"Tolerance: {tolerance}. Deviation is across the design axis; sigma is one standard deviation."


def _design_facts(record: ColumnRecord, site: ReportSite) -> list[tuple[str, str]]:
    design = record.design
    north, east, down = design.head
    facts = [("Head as set out", f"north {north:.3f} m, east {east:.3f} m, down {down:.3f} m")]
    if site.grid is not None:
        northing, easting, height = site.grid.of_places(np.array(design.head)).tolist()
        facts.append(("", f"N {northing:.3f} m, E {easting:.3f} m, {height:.3f} m"))
    facts.append(("Sigma of setting out", f"{1e3 * record.head_std:.1f} mm north and east"))
    lean = "vertical"
    if design.inclination > 0.0:
        inclination, azimuth = math.degrees(design.inclination), math.degrees(design.azimuth)
        lean = f"{inclination:.3f} deg from the vertical, azimuth {azimuth:.2f} deg"
    return [
        *facts,
        ("Design axis", lean),
        ("Design length and radius", f"{design.length:g} m, {design.radius:g} m"),
        ("State", record.state),
    ]


def instrument_facts(record: ColumnRecord) -> list[tuple[str, str]]:
    """Facts on the instrument that surveyed a column, and on its calibration."""
    if not math.isfinite(record.surveyed_md):
        return [("Error model", NO_INSTRUMENT)]
    tool = record.tool
    return [
        ("Error model", f"{tool.name}: {tool.title}"),
        ("Its source", tool.source or "not stated"),
        ("Serial number", record.serial or NOT_STATED),
        ("Calibration", record.calibration or NOT_STATED),
    ]


def paper_facts(record: ColumnRecord) -> list[tuple[str, str]]:
    """What the first page says of the instrument and of the ±."""
    told = " / ".join(text or NOT_STATED for text in (record.serial, record.calibration))
    told = told if math.isfinite(record.surveyed_md) else NO_INSTRUMENT
    return [
        ("Times of the surveys", times_words(record)),
        ("Serial and calibration of the instruments", told),
        ("Check of the data", f"warnings: {len(record.warnings)}" if record.warnings else CHECKED),
        ("What the ± contains", CONTAINED),
    ]


def times_words(record: ColumnRecord) -> str:
    """When a column was surveyed: seconds of its record, or days and hours as they are told."""
    if record.times is None:
        return NOT_STATED
    first, last = record.times
    are_seconds = all(re.fullmatch(r"[0-9.e+]+", text) for text in record.times)
    return f"{first} to {last} s of its record" if are_seconds else f"{first}, {last}"


def _table(record: ColumnRecord, found: Sequence[Deviation], site: ReportSite) -> dict[str, object]:
    """Columns, rows and marked rows of the stations."""
    site_columns = ("N m", "E m", "height m") if site.grid is not None else ("north m", "east m", "down m")
    columns = ("MD m", "incl. deg", "azi. deg", *site_columns, "dev. mm", "sigma mm", "allowed mm", "used")
    rows = []
    for k, d in enumerate(found):
        place = record.positions[k]
        if site.grid is not None:
            place = site.grid.of_places(place)
        rows.append(
            (
                f"{d.md:.2f}",
                f"{math.degrees(record.inclination[k]):.3f}",
                f"{math.degrees(record.azimuth[k]) % 360.0:.2f}",
                *(f"{value:.3f}" for value in place),
                f"{1e3 * d.size:.1f}",
                f"{1e3 * d.std:.1f}",
                f"{1e3 * d.limit:.1f}",
                f"{d.ratio:.0%}" if math.isfinite(d.ratio) else "all",
            )
        )
    marked = [k for k, d in enumerate(found) if d.ratio >= 1.0]
    return {"columns": columns, "rows": rows, "marked": marked}
