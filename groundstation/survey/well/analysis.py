"""A whole record at once: trajectory and region of uncertainty. What the command line and the exports show."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.tools.formulas import is_zero
from groundstation.survey.tools.instruments import COMPANION, PropagationMode, SurveyTool, Term
from groundstation.survey.well.compiled_model import locate_stations
from groundstation.survey.well.error_propagation import Uncertainty
from groundstation.survey.well.error_sources import Leg, Site, WellSurvey
from groundstation.survey.well.leg_errors import covariance_at
from groundstation.survey.well.methods import Method, dogleg_severity, horizontal_closure, vertical_section
from groundstation.survey.well.reference_frames import SAME_DEPTH, ReferenceFrame, TieOn, turn_north
from groundstation.survey.well.well_record import SurveyRecord

Array = npt.NDArray[np.float64]
# Columns of a record that instrument models may ask for: variable, factor to SI
RECORD_COLUMNS = {
    "sigma_yaw_deg": ("SigmaYaw", math.radians(1.0)),
    "sigma_systematic_deg": ("SigmaSystematic", math.radians(1.0)),
    "sigma_force_mps2": ("SigmaForce", 1.0),
    "measurements": ("Readings", 1.0),
    "time_s": ("Time", 1.0),
}


def record_variables(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Further columns of a record as variables of formulas, SI and rad; without those that are none."""
    return {name: columns[c] * factor for c, (name, factor) in RECORD_COLUMNS.items() if c in columns}


def default_method(record: SurveyRecord) -> Method:
    """Minimum curvature; of lateral displacements balanced tangential, with which their form was published."""
    return Method.BALANCED_TANGENTIAL if record.of_displacements else Method.MINIMUM_CURVATURE


@dataclass(frozen=True, slots=True)
class Region:
    """Uncertainty of a survey in the answer's frame, that of its tie-on included."""

    model: Uncertainty  # from true north, of what was surveyed
    turn: Array  # (3, 3) from true north, east, down
    tie_cov: Array  # (3, 3) m^2, in the answer's frame

    @property
    def cov(self) -> Array:
        """Covariance (n, 3, 3) of every position, m^2."""
        turned = self._turned(self.model.cov)
        return turned + self.tie_cov if self.tie_cov.any() else turned

    def at(self, md: float) -> Array:
        """Covariance (3, 3) at any depth of the survey; errors as ``covariance_at``."""
        return self._turned(covariance_at(self.model, md)) + self.tie_cov

    def by_source(self) -> dict[str, Array]:
        """Covariance (n, 3, 3) by the name of its source; ``tie-on`` is what was there before."""
        parts = self.model.by_source()
        found = dict(zip(parts, self._turned(np.stack(list(parts.values()))), strict=True)) if self._turns else parts
        if np.any(self.tie_cov):
            found = found | {"tie-on": np.broadcast_to(self.tie_cov, self.model.cov.shape)}
        return found

    @property
    def _turns(self) -> bool:
        return bool(self.turn[0, 0] != 1.0 or self.turn[0, 1] != 0.0)  # about the vertical

    def _turned(self, cov: Array) -> Array:
        return np.asarray(self.turn @ cov @ self.turn.T) if self._turns else cov


@dataclass(frozen=True, slots=True)
class Analysis:
    """Positions (n, 3) with what follows from them, all in one frame; m and rad, north east down."""

    record: SurveyRecord
    method: Method
    frame: ReferenceFrame
    azimuth: Array  # (n,) from the answer's north
    positions: Array
    uncertainty: Region
    dogleg_severity: Array  # (n - 1,) rad/m
    closure_distance: Array
    closure_azimuth: Array
    vertical_section: Array

    @property
    def md(self) -> Array:
        """Measured depths (n,) as the answer counts them."""
        return self.frame.depths.to_answer(self.record.md)

    def covariance_at(self, md: float) -> Array:
        """Covariance (3, 3, m^2) at any depth of the answer; errors as ``Region.at``."""
        return self.uncertainty.at(self.frame.depths.to_record(md))


@dataclass(frozen=True, slots=True)
class Stretch:
    """Part of a survey that one tool took: measured depths from ``top`` on, to ``bottom`` where that is stated."""

    tool: SurveyTool
    top: float
    bottom: float | None = None


def analyse_survey(
    record: SurveyRecord,
    method: Method,
    tool: SurveyTool | Sequence[Stretch],
    site: Site,
    section_azimuth: float = 0.0,
    frame: ReferenceFrame | None = None,
    tie_on: TieOn | None = None,
) -> Analysis:
    """Trajectory and uncertainty of a record.

    Tools of the industry's model come with its allowance for the direction at the surface; a survey that is tied on
    below has none.

    Parameters
    ----------
    tool : one for all, or what surveyed which part
    site : its declination is that of magnetic north from true north
    section_azimuth : in the answer's north, rad
    frame : norths and depth references of the record and of the answer; the site's and the collar by default
    tie_on : where the record begins, if not at its collar

    Raises
    ------
    SurveyError, ToolError
        When the record is not a survey or begins nowhere, the tie-on contradicts it, parts leave a gap, or a tool
        cannot be used on it.
    """
    frame = frame or ReferenceFrame()
    height = frame.depths.height
    at_zero = abs(float(record.md[0]) - height) <= SAME_DEPTH  # of the answer's depths
    if tie_on is not None:
        tie_on.check(float(record.md[0]), float(record.inclination[0]), float(record.azimuth[0]))
        record = _tied(record, tie_on)
    elif record.md[0] != 0.0 and not at_zero:
        raise SurveyError(
            f"the record begins at {record.md[0]:g} m, so nothing says where that is; "
            "expected the collar at 0 m first, --from-collar for a vertical one, or --tie-on"
        )
    azimuth = frame.to_true(record.azimuth)
    start = np.array([0.0, 0.0, height if at_zero else 0.0])
    if tie_on is not None:
        start = turn_north(-frame.norths.of(frame.record)) @ tie_on.position
    survey = WellSurvey(record.md, record.inclination, azimuth, record.md, record_variables(record.columns))
    legs = [Leg(tool)] if isinstance(tool, SurveyTool) else legs_of(tool, record.md)
    allowance = tie_on is None and legs[0].tool.slot_allowance
    places, found = locate_stations(method, survey, legs, site, start, slot_allowance=allowance)
    turned = frame.turned(places)
    distance, direction = horizontal_closure(turned)
    tie_cov = np.zeros((3, 3))
    if tie_on is not None:
        from_record = frame.turn @ turn_north(-frame.norths.of(frame.record))
        tie_cov = from_record @ tie_on.cov @ from_record.T
    return Analysis(
        record,
        method,
        frame,
        frame.azimuth(azimuth),
        turned,
        Region(found, frame.turn, tie_cov),
        dogleg_severity(record.md, record.inclination, azimuth),
        distance,
        direction,
        vertical_section(turned, section_azimuth),
    )


def _tied(record: SurveyRecord, tie_on: TieOn) -> SurveyRecord:
    """The record from its tie-on down; what else it holds there is that of its first station."""
    keep = slice(1, None) if record.md[0] <= tie_on.md + SAME_DEPTH else slice(None)
    parts = ((tie_on.md, record.md), (tie_on.inclination, record.inclination), (tie_on.azimuth, record.azimuth))
    md, inclination, azimuth = (np.concatenate([[first], values[keep]]) for first, values in parts)
    columns = {name: np.concatenate([values[:1], values[keep]]) for name, values in record.columns.items()}
    if len(md) < 2:
        raise SurveyError(f"tie-on: expected a station below {tie_on.md:g} m, got none")
    return SurveyRecord(
        md, inclination, azimuth, [0, *record.lines[keep]], columns, record.of_displacements, record.warnings
    )


def legs_of(parts: Sequence[Stretch], md: Array) -> list[Leg]:
    """Legs of a survey that several tools took; where two overlap, the later one counts.

    Raises
    ------
    SurveyError
        When parts leave stations without a tool, or one surveyed no station.
    """
    ordered = sorted(parts, key=lambda part: part.top)
    owner = np.full(len(md), -1)
    for k, part in enumerate(ordered):
        owner[(md >= part.top) & (md <= (np.inf if part.bottom is None else part.bottom))] = k
    owner[0] = owner[1]  # the first station is where the survey begins, not what it measured
    lost = np.flatnonzero(owner[1:] < 0)
    if len(lost):
        raise SurveyError(
            f"programme: the station at {md[lost[0] + 1]:g} m lies in no leg; expected legs without a gap"
        )
    firsts = [1, *(int(k) + 1 for k in np.flatnonzero(np.diff(owner[1:])) + 1)]
    unused = sorted(set(range(len(ordered))) - set(owner.tolist()))
    if unused:
        part = ordered[unused[0]]
        raise SurveyError(f"programme: the leg of {part.tool.name} from {part.top:g} m has no station of its own")
    return [Leg(ordered[owner[first]].tool, first) for first in firsts]


def with_azimuth_error(tool: SurveyTool, azimuth_error: float) -> SurveyTool:
    """The tool with one constant azimuth error (rad) in place of every term that turns the azimuth alone.

    This is the filtered against the unfiltered survey of thesis figures 4.24-4.27.
    """
    constant = Term("AZIMUTH", azimuth_error, "rad", PropagationMode.SYSTEMATIC, ("0", "0", "1"))
    gyro = [term.name for term in tool.terms if _turns_azimuth_alone(term)]
    return tool.with_terms((*tool.terms, constant)).without(*gyro)


def _turns_azimuth_alone(term: Term) -> bool:
    depth, inclination, azimuth = term.weights
    companion = term.name.endswith(COMPANION)  # that of an inclination
    return not companion and term.position is None and is_zero(depth) and is_zero(inclination) and not is_zero(azimuth)


def magnetic_error(inclination: Array, azimuth: Array) -> Array:
    """Azimuth error (rad) of a magnetic survey: 0.25 deg + 0.6 deg sin I |sin A|, larger to the east and to the west.

    Source: thesis Fig. 4.23, whose formula has sin A with its sign, against its own text.
    """
    return np.radians(0.25 + 0.6 * np.sin(inclination) * np.abs(np.sin(azimuth)))
