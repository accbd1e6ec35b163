"""A clearance as it was asked for: how far two holes keep from each other, as the object for JSON."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from groundstation.survey.files.field_files import read_any
from groundstation.survey.requests.clearance_request import ClearanceRequest
from groundstation.survey.tools.instruments import load_tool
from groundstation.survey.well.clearance import Clearance, ClearanceHole, Rule, clearance_between
from groundstation.survey.well.error_sources import Leg, WellSurvey
from groundstation.survey.well.methods import Method, station_positions


def answer_clearance(request: ClearanceRequest) -> dict[str, Any]:
    """The object that ``borechain clearance --json`` prints; ``clear`` says whether every factor is above 1.

    Raises
    ------
    SurveyError, ToolError
        When a record or an instrument cannot be used.
    """
    serial = "one" if request.same_instrument else ""
    offset_tool = request.offset_instrument or request.instrument
    first = read_hole(request.reference, request.instrument, (0.0, 0.0, 0.0), request.radius_m, serial)
    second = read_hole(request.offset, offset_tool, request.offset_head, request.offset_radius_m, serial)
    rule = Rule(request.k, request.sigma_ahead_m, request.margin_m)
    return clearance_result(first, clearance_between(first, second, request.site.to_site(), rule))


def read_hole(
    path: Path, instrument: str, head: tuple[float, float, float], radius: float, serial: str
) -> ClearanceHole:
    """A hole of a record from its head (m, north, east, down), surveyed by one instrument."""
    record = read_any(path).record
    places = np.array(head) + station_positions(Method.MINIMUM_CURVATURE, record.md, record.inclination, record.azimuth)
    survey = WellSurvey(record.md, record.inclination, record.azimuth, places[:, 2] - head[2])
    return ClearanceHole(survey, places, (Leg(load_tool(instrument)),), radius, serial)


def clearance_result(hole: ClearanceHole, found: Clearance) -> dict[str, Any]:
    """Stations, the least factor and the frame as one object."""
    columns = {
        "md_m": hole.survey.md,
        "offset_md_m": found.offset_md,
        "distance_m": found.distance,
        "sigma_m": found.sigma,
        "factor": found.factor,
        "independent_factor": found.independent_factor,
    }
    values = [column.tolist() for column in columns.values()]
    stations = [dict(zip(columns, row, strict=True)) for row in zip(*values, strict=True)]
    least = min(stations, key=lambda row: min(row["factor"], row["independent_factor"]))
    frame = {"north": "true", "depth_reference": "head of the reference hole"}
    return frame | {
        "clear": min(least["factor"], least["independent_factor"]) > 1.0,
        "least": least,
        "stations": stations,
    }
