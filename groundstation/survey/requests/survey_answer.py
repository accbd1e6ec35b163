"""A survey as it was asked for: the record read, its trajectory and region of uncertainty, the object for JSON."""

from __future__ import annotations

import datetime
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from groundstation.entry.entry_warning import EntryWarning, warning_rows
from groundstation.entry.quantity_ranges import RANGES
from groundstation.entry.station_plausibility import station_warnings
from groundstation.errors import SurveyError
from groundstation.survey.files.field_files import read_any
from groundstation.survey.files.field_table import TableWish
from groundstation.survey.files.programme import read_programme, read_tie_on
from groundstation.survey.files.station_tables import Understood
from groundstation.survey.files.survey_records import DisplacementRule, with_collar
from groundstation.survey.requests.finite_figures import check_figures
from groundstation.survey.requests.site_place import MAGNETIC, known_site
from groundstation.survey.requests.survey_request import PROGRAMME_ALONE, FrameRequest, SurveyRequest
from groundstation.survey.requests.survey_rows import source_rows, station_at_depth, station_rows
from groundstation.survey.tools.instruments import SurveyTool, load_tool
from groundstation.survey.tools.iscwsa_json import to_json
from groundstation.survey.well.analysis import (
    Analysis,
    Stretch,
    analyse_survey,
    default_method,
    with_azimuth_error,
)
from groundstation.survey.well.depth_reference import DEPTHS_FROM, DepthReference, depth_reference
from groundstation.survey.well.gyro_export import as_gyro, needs_record
from groundstation.survey.well.methods import Method
from groundstation.survey.well.reference_frames import (
    Norths,
    ReferenceFrame,
    SiteGrid,
    check_grid_scale,
    north_of_coordinates,
)
from groundstation.survey.well.well_record import SurveyRecord


@dataclass(frozen=True, slots=True)
class SurveyAnswer:
    """A survey: ``result`` is the object that ``borechain survey --json`` prints."""

    request: SurveyRequest
    record: SurveyRecord
    tool: SurveyTool
    instrument: str  # in words
    found: Analysis
    result: dict[str, Any]

    def tool_text(self) -> str:
        """Instrument as ISCWSA JSON; one that asks for columns of a record, as a gyro with those of this one."""
        written = as_gyro(self.tool, self.record) if needs_record(self.tool) else self.tool
        return to_json(written, datetime.datetime.now(datetime.UTC).date())


def answer_survey(request: SurveyRequest) -> SurveyAnswer:
    """Read, survey and answer.

    Raises
    ------
    SurveyError, ToolError
        When the record, the instrument or a file cannot be used, or what is asked contradicts itself.
    """
    check_request(request)
    wish = TableWish(
        request.md_unit, request.hole, request.frame.north, request.decimal, 1 if request.from_collar else 2
    )
    understood = read_any(request.file, DisplacementRule(request.displacement_rule), wish)
    request = _as_said(request, understood)
    record = with_collar(understood.record) if request.from_collar else understood.record
    tool = load_tool(request.instrument, request.parameter)
    if request.azimuth_error_deg is not None:
        tool = with_azimuth_error(tool, math.radians(request.azimuth_error_deg))
    legs = [] if request.programme is None else read_programme(request.programme)
    tools = [leg.tool for leg in legs] or [tool]
    known = known_site(request.site, request.frame, magnetic_needs(tools))
    request = replace(request, site=known.figures, frame=known.frame)
    found = analyse_record(record, legs or tool, request)
    instrument = ", ".join(f"{leg.tool.name} from {leg.top:g} m" for leg in legs) or tool.name
    result = survey_result(request, understood, instrument, found) | {"site": known.row()}
    return SurveyAnswer(request, record, tool, instrument, found, result)


def magnetic_needs(tools: Sequence[SurveyTool]) -> set[str]:
    """Figures of the magnetic field that instruments ask for."""
    return {name for name, variable in MAGNETIC.items() if any(tool.asks_for(variable) for tool in tools)}


def _as_said(request: SurveyRequest, understood: Understood) -> SurveyRequest:
    """The request in the frame that the file says, where the user says none."""
    frame = request.frame
    if understood.north and frame.north == "site":
        frame = replace(frame, north=understood.north)
    if understood.depth_reference in DEPTHS_FROM and frame.depth_reference == DEPTHS_FROM[0]:
        frame = replace(frame, depth_reference=understood.depth_reference)
    return replace(request, frame=frame)


def check_request(request: SurveyRequest) -> None:
    """Refuse what contradicts itself.

    Raises
    ------
    SurveyError
        Naming the options of the command.
    """
    check_figures(request)
    if request.from_collar and request.tie_on is not None:
        raise SurveyError("expected --from-collar or --tie-on, got both")
    if request.programme is not None and request.azimuth_error_deg is not None:
        raise SurveyError(PROGRAMME_ALONE)


def analyse_record(record: SurveyRecord, tool: SurveyTool | list[Stretch], request: SurveyRequest) -> Analysis:
    """Trajectory and region of uncertainty in the frame that is asked for; errors as ``answer_survey``."""
    frame = reference_frame(request.frame)
    tied = None if request.tie_on is None else read_tie_on(request.tie_on)
    RANGES["section_azimuth_deg"].check("--section-azimuth-deg", request.section_azimuth_deg)
    section = math.radians(request.section_azimuth_deg)
    method = default_method(record) if request.method is None else Method(request.method)
    found = analyse_survey(record, method, tool, request.site.to_site(), section, frame, tied)
    first, last = found.md[0], found.md[-1]
    for depth in request.md:
        if not first <= depth <= last:
            raise SurveyError(f"--md {depth:g}: expected a depth of {first:g}..{last:g} m")
    return found


def reference_frame(asked: FrameRequest) -> ReferenceFrame:
    """Norths and depth references of the record and of the answer."""
    angles = (asked.north_of_site_deg or 0.0, asked.convergence_deg or 0.0, asked.declination_deg or 0.0)
    for name, angle in zip(("north_of_site_deg", "convergence_deg", "declination_deg"), angles, strict=True):
        RANGES[name].check(f"--{name.replace('_', '-')}", angle)
    norths = Norths(*map(math.radians, angles))
    answer = asked.answer_north
    if answer is None:
        answer = asked.north if asked.north_of_site_deg is None else "true"
        answer = answer if asked.origin is None else north_of_coordinates(answer)
    grid = site_grid(asked, answer, norths)
    depths = depth_references(asked)
    return ReferenceFrame(asked.north, answer, norths, depths, asked.height_datum or "", grid)


def site_grid(asked: FrameRequest, answer: str, norths: Norths) -> SiteGrid | None:
    """Site coordinates of the answer; None where no origin is stated.

    Raises
    ------
    SurveyError
        When the azimuth of grid north is not told and they need it, or there is a scale factor alone.
    """
    check_grid_scale(asked.grid_scale_factor)
    if asked.origin is None:
        if asked.grid_scale_factor != 1.0:
            raise SurveyError("--grid-scale-factor: expected --origin beside it")
        return None
    for value in asked.origin:
        RANGES["coordinate"].check("--origin", value)
    north = north_of_coordinates(answer)
    if north == "grid" and asked.north != "grid" and asked.convergence_deg is None:
        raise SurveyError("--origin: its coordinates count from grid north; expected --convergence-deg beside it")
    return SiteGrid(asked.origin, north, norths.of(north) - norths.of(answer), asked.grid_scale_factor)


def depth_references(asked: FrameRequest) -> DepthReference:
    """Depth references of the record and of the answer, which fit the datum of heights and the origin."""
    found = depth_reference(asked.depth_reference, asked.answer_depth_reference, asked.depth_reference_height_m)
    from_datum = "height-datum" in (found.record, found.answer)
    datum, origin = asked.height_datum, asked.origin
    if from_datum and datum is None:
        raise SurveyError("--depth-reference height-datum: expected --height-datum NAME beside it")
    if datum is not None and origin is None and not from_datum:
        raise SurveyError("--height-datum: expected --origin beside it")
    if found.answer == "height-datum" and origin is not None and origin[2] != 0.0:
        raise SurveyError(f"--origin: depths count from {datum}, so its height is 0; got {origin[2]:g} m")
    return found


def survey_warnings(record: SurveyRecord) -> tuple[EntryWarning, ...]:
    """What was missing of a record as read, and what of it hardly can be."""
    return (*record.warnings, *station_warnings(record.md, record.inclination, record.azimuth, "the hole"))


def survey_result(request: SurveyRequest, understood: Understood, instrument: str, found: Analysis) -> dict[str, Any]:
    """The object for JSON."""
    frame, grid, sigma = found.frame, found.frame.grid, request.sigma
    return {
        "file": str(request.file),
        "read_as": understood.line,
        "method": found.method.value,
        "instrument": instrument,
        "north": frame.answer,
        "depth_reference": frame.depths.answer,
        "read_from": {"depth_reference": frame.depths.record, "height_m": frame.depths.height},
        "height_datum": frame.height_datum or None,
        "origin_m": None if grid is None else list(grid.origin),
        "coordinates_north": None if grid is None else grid.north,
        "grid_scale_factor": None if grid is None else grid.scale,
        "sigma": sigma,
        "warnings": warning_rows(survey_warnings(understood.record)),
        "stations": station_rows(found, sigma),
        "at": [station_at_depth(found, depth, sigma) for depth in request.md],
        "closure_m": float(found.closure_distance[-1]),
        "closure_azimuth_deg": math.degrees(found.closure_azimuth[-1]),
        "sources": source_rows(found, sigma),
    }
