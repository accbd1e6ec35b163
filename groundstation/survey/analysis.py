"""A whole record at once: trajectory and region of uncertainty. What the command line and the exports show."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.error_model import Uncertainty, propagate
from groundstation.survey.error_sources import Leg, Site, Survey
from groundstation.survey.formulas import is_zero
from groundstation.survey.instruments import Mode, Term, Tool
from groundstation.survey.methods import Method, closure, dogleg_severity, positions, vertical_section
from groundstation.survey.records import Record

Array = npt.NDArray[np.float64]
# Columns of a record that instrument models may ask for: variable, factor to SI
RECORD_COLUMNS = {
    "sigma_yaw_deg": ("SigmaYaw", math.radians(1.0)),
    "sigma_systematic_deg": ("SigmaSystematic", math.radians(1.0)),
    "sigma_force_mps2": ("SigmaForce", 1.0),
    "measurements": ("Readings", 1.0),
    "time_s": ("Time", 1.0),
}


@dataclass(frozen=True, slots=True)
class Analysis:
    """Positions (n, 3) with what follows from them; m and rad, north east down."""

    record: Record
    positions: Array
    uncertainty: Uncertainty
    dogleg_severity: Array  # (n - 1,) rad/m
    closure_distance: Array
    closure_azimuth: Array
    vertical_section: Array


def analyse(record: Record, method: Method, tool: Tool, site: Site, section_azimuth: float = 0.0) -> Analysis:
    """Trajectory and uncertainty of a record.

    Tools of the industry's magnetic model come with its allowance for the direction at the surface.

    Raises
    ------
    SurveyError, ToolError
        When the record is not a survey, or the tool cannot be used on it.
    """
    places = positions(method, record.md, record.inclination, record.azimuth)
    extra = {name: record.columns[c] * f for c, (name, f) in RECORD_COLUMNS.items() if c in record.columns}
    survey = Survey(record.md, record.inclination, record.azimuth, places[:, 2], extra)
    found = propagate(survey, [Leg(tool)], site, slot_allowance=tool.slot_allowance)
    distance, direction = closure(places)
    return Analysis(
        record,
        places,
        found,
        dogleg_severity(record.md, record.inclination, record.azimuth),
        distance,
        direction,
        vertical_section(places, section_azimuth),
    )


def with_azimuth_error(tool: Tool, azimuth_error: float) -> Tool:
    """The tool with one constant azimuth error (rad) in place of every term that turns the azimuth alone.

    This is the filtered against the unfiltered survey of thesis figures 4.24-4.27.
    """
    constant = Term("AZIMUTH", azimuth_error, "rad", Mode.SYSTEMATIC, ("0", "0", "1"))
    gyro = [term.name for term in tool.terms if _turns_azimuth_alone(term)]
    return tool.with_terms((*tool.terms, constant)).without(*gyro)


def _turns_azimuth_alone(term: Term) -> bool:
    depth, inclination, azimuth = term.weights
    return term.position is None and is_zero(depth) and is_zero(inclination) and not is_zero(azimuth)


def magnetic_error(inclination: Array, azimuth: Array) -> Array:
    """Azimuth error (rad) of a magnetic survey: 0.25 deg + 0.6 deg sin I sin A. Source: thesis Fig. 4.23."""
    return np.radians(0.25 + 0.6 * np.sin(inclination) * np.sin(azimuth))
