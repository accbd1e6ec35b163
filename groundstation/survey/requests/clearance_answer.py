"""A clearance as it was asked for: how far two holes keep from each other, as the object for JSON."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.entry.entry_warning import EntryWarning, warning_rows
from groundstation.entry.quantity_ranges import RANGES
from groundstation.entry.station_plausibility import radius_warnings, station_warnings
from groundstation.errors import SurveyError
from groundstation.survey.files.field_files import read_any
from groundstation.survey.files.field_table import TableWish
from groundstation.survey.path.leg_wander import LegWander
from groundstation.survey.path.stated_curvature import STATED_CURVATURE_DEG
from groundstation.survey.requests.clearance_request import ClearanceRequest
from groundstation.survey.requests.finite_figures import check_figures
from groundstation.survey.requests.site_place import known_site
from groundstation.survey.requests.survey_answer import magnetic_needs
from groundstation.survey.requests.survey_request import FrameRequest
from groundstation.survey.tools.instruments import load_tool
from groundstation.survey.well.analysis import record_variables
from groundstation.survey.well.clearance import Clearance, ClearanceHole, Rule, Separations, clearance_between
from groundstation.survey.well.error_sources import Leg, WellSurvey
from groundstation.survey.well.methods import Method, station_positions
from groundstation.survey.well.reference_frames import SAME_DEPTH
from groundstation.survey.well.well_record import SurveyRecord

Array = npt.NDArray[np.float64]
SAME_PLACE = 0.1  # m, of two records of one hole


@dataclass(frozen=True, slots=True)
class _Described:
    """How one hole is described: the words for it, its record, instrument, head and radius."""

    name: str
    record: SurveyRecord
    instrument: str
    head: Array
    radius: float


def answer_clearance(request: ClearanceRequest) -> dict[str, Any]:
    """The object that ``borechain clearance --json`` prints; ``clear`` says whether every factor is above 1.

    How a path may leave its arcs is in the models of the industry or not meant to be; of ``relay`` it is counted as the
    ground station does while it drills, unless the request says otherwise.

    Raises
    ------
    SurveyError, ToolError
        When a record or an instrument cannot be used.
    """
    check_figures(request)
    for value in request.offset_head:
        RANGES["distance"].check("--offset-head", value)
    serial = "one" if request.same_instrument else ""
    mine = _Described(
        str(request.reference), _record(request.reference, request.hole), request.instrument, np.zeros(3),
        request.radius_m,
    )  # fmt: skip
    theirs = _Described(
        str(request.offset), _record(request.offset, request.offset_hole),
        request.offset_instrument or request.instrument, np.array(request.offset_head), request.offset_radius_m,
    )  # fmt: skip
    rule = Rule(request.k, request.sigma_ahead_m, request.margin_m)
    if request.from_m is None:
        holes = [_hole(hole, serial) for hole in (mine, theirs)]
    else:
        holes = _sidetrack(mine, theirs, request.from_m, serial)
    holes = [
        replace(hole, wander=_wander(request, described.instrument))
        for hole, described in zip(holes, (mine, theirs), strict=True)
    ]
    needs = magnetic_needs([leg.tool for hole in holes for leg in hole.legs])
    known = known_site(request.site, FrameRequest(), needs)
    found = clearance_between(holes[0], holes[1], known.figures.to_site(), rule)
    warnings = [*_warnings(mine), *_warnings(theirs)]
    more = {"site": known.row(), "warnings": warning_rows(tuple(warnings))}
    return clearance_result(found, request.from_m) | more


def _record(path: Path, hole: str | None) -> SurveyRecord:
    """Record of one hole, azimuths from true north."""
    found = read_any(path, wish=TableWish(hole=hole, north="true"))
    if found.north not in ("", "true"):
        raise SurveyError(f"{path}: its azimuths count from {found.north} north; expected true north")
    return found.record


def _warnings(described: _Described) -> tuple[EntryWarning, ...]:
    """What of a hole is missing or hardly can be."""
    record, name = described.record, described.name
    stations = station_warnings(record.md, record.inclination, record.azimuth, name)
    return (*record.warnings, *stations, *radius_warnings(described.radius, name))


def _wander(request: ClearanceRequest, instrument: str) -> LegWander:
    """Curvature of a path that an instrument surveyed."""
    std = request.curvature_sigma_deg_per_m
    if std is None:
        std = STATED_CURVATURE_DEG if instrument == "relay" else 0.0
    return LegWander(math.radians(std), request.curvature_length_m)


def _hole(described: _Described, serial: str, first: int = 0) -> ClearanceHole:
    """A hole from its head on, surveyed by one instrument; its errors count from its station ``first``."""
    record = described.record
    if abs(float(record.md[0])) > SAME_DEPTH:
        raise SurveyError(
            f"{described.name}: the record begins at {record.md[0]:g} m, so nothing says where that is; expected the "
            "collar at 0 m first, or --from-m of a sidetrack that begins there"
        )
    places = station_positions(Method.MINIMUM_CURVATURE, record.md, record.inclination, record.azimuth)
    return _surveyed(described, places, serial, first)


def _surveyed(described: _Described, places: Array, serial: str, first: int) -> ClearanceHole:
    """A hole whose stations lie at places (n, 3) from its head, from its station ``first`` on."""
    record = described.record
    columns = {name: values[first:] for name, values in record_variables(record.columns).items()}
    md, inclination, azimuth, tvd = (
        values[first:] for values in (record.md, record.inclination, record.azimuth, places[:, 2])
    )
    survey = WellSurvey(md, inclination, azimuth, tvd, columns)
    tool = load_tool(described.instrument)
    return ClearanceHole(survey, described.head + places[first:], (Leg(tool),), described.radius, serial)


def _sidetrack(mine: _Described, theirs: _Described, from_m: float, serial: str) -> list[ClearanceHole]:
    """Two holes that are one down to a station of both: what erred above it, both have alike.

    Raises
    ------
    SurveyError
        When a record has no station there, or they lie elsewhere there.
    """
    reference = _hole(mine, serial, _station_at(mine, from_m))
    if theirs.record.md[0] > SAME_DEPTH:
        _station_at(theirs, from_m, begins=True)
        places = station_positions(
            Method.MINIMUM_CURVATURE, theirs.record.md, theirs.record.inclination, theirs.record.azimuth
        )
        offset = _surveyed(theirs, reference.positions[0] - theirs.head + places, serial, 0)
    else:
        offset = _hole(theirs, serial, _station_at(theirs, from_m))
    apart = float(np.linalg.norm(offset.positions[0] - reference.positions[0]))
    if apart > SAME_PLACE:
        raise SurveyError(
            f"--from-m {from_m:g}: the two lie {apart:.2f} m apart there; expected one hole down to that depth"
        )
    return [reference, offset]


def _station_at(described: _Described, from_m: float, *, begins: bool = False) -> int:
    """Number of the station at a depth; of one that begins there, 0."""
    md = described.record.md
    found = np.flatnonzero(np.abs(md - from_m) <= SAME_DEPTH)
    if not len(found) or found[0] >= len(md) - 1 or (begins and found[0] != 0):
        words = f"one that begins there, it begins at {md[0]:g} m" if begins else "a station there and one below it"
        raise SurveyError(f"{described.name}: --from-m {from_m:g}: expected {words}")
    return int(found[0])


def separation_rows(found: Separations) -> list[dict[str, float]]:
    """One object a place of the reference hole."""
    columns = {
        "md_m": found.md,
        "offset_md_m": found.offset_md,
        "distance_m": found.distance,
        "sigma_m": found.sigma,
        "factor": found.factor,
        "independent_factor": found.independent_factor,
    }
    return [dict(zip(columns, row, strict=True)) for row in zip(*(c.tolist() for c in columns.values()), strict=True)]


def clearance_result(found: Clearance, from_m: float | None = None) -> dict[str, Any]:
    """Stations, the places of the least factor and of the least distance, and the frame as one object."""
    return {
        "north": "true",
        "depth_reference": "head of the reference hole",
        "from_m": from_m,
        "clear": found.clear,
        "least": separation_rows(found.least)[0],
        "nearest": separation_rows(found.nearest)[0],
        "stations": separation_rows(found.stations),
    }
