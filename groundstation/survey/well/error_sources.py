"""What error propagation starts from: the stations, the place, the legs of the two sides and the sources of a tool.

Arrays are (..., n): leading axes are wells. Frame: north, east, down; m and rad, nT for the magnetic field.
Source: thesis 2.3 and eqs. I.1-I.12; Definition of the ISCWSA error model, revision 5.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.survey.tools.formulas import VARIABLES, Compiled, compile_formulas, is_zero
from groundstation.survey.tools.instruments import ZERO, PropagationMode, SurveyTool, Term

Array = npt.NDArray[np.float64]
VERTICAL = 1.75e-6  # rad, nearer than this to the vertical an azimuth has no value
TINY = 1e-30  # rad, stands for an inclination of zero in formulas that divide by its sine
NO_WEIGHT = 1e12  # a weight beyond this is a division by the sine of a vertical inclination
EARTH_RATE = 7.292115e-5 * 3600.0  # rad/h
# What a record may hold beyond directions, and what stands for it where it does not: a stop of our own chain, ten hops
# down, with joints and mounts of 0.05 deg and 32 samples of 0.02 deg
RECORD = {
    "SigmaYaw": math.radians(0.02),
    "SigmaSystematic": math.radians(0.17),
    "SigmaForce": 6.1e-4,
    "Readings": 1.0,
}
SECONDS_A_METRE = 50.0  # of a survey whose record has no times: thesis, 100 s for a rod of 2 m


@dataclass(frozen=True, slots=True)
class Site:
    """Properties of the place that formulas use; SI and rad, nT."""

    gravity: float = 9.81
    b_field: float = 50_000.0
    dip: float = math.radians(70.0)
    declination: float = 0.0  # of magnetic north against the reference of the azimuths
    latitude: float = math.radians(52.0)


@dataclass(frozen=True, slots=True)
class WellSurvey:
    """Stations of one well or of many: (..., n); ``record`` holds further columns by the name of their variable."""

    md: Array
    inclination: Array
    azimuth: Array
    tvd: Array
    record: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Leg:
    """A part of the survey: the stations from ``first`` on, until the next leg begins, were taken with ``tool``."""

    tool: SurveyTool
    first: int = 1


@lru_cache(maxsize=64)
def compile_term_formulas(formulas: tuple[tuple[str, ...], ...], parameters: tuple[str, ...]) -> Compiled:
    """One function for the formulas of many terms."""
    return compile_formulas([text for row in formulas for text in row], parameters)


def inputs_of(tool: SurveyTool, site: Site, values: Mapping[str, Any]) -> list[Any]:
    """Values of the variables and parameters in the order in which compiled formulas take them."""
    known = {
        "GField": site.gravity,
        "BField": site.b_field,
        "Dip": site.dip,
        "Latitude": site.latitude,
        "EarthRate": EARTH_RATE,
        "Previous": 0.0,
        **values,
    }
    return [known[name] for name in VARIABLES] + list(tool.parameters.values())


def leaning_azimuth(survey: WellSurvey) -> Array:
    """Azimuths (..., n) that errors are weighted by, rad: true north where the hole is vertical and has none.

    The industry's own wells say 0 there. Whatever else a file says would turn the errors of one station against those
    of the next, and what has no meaning would make a hole look better known.
    """
    vertical = np.minimum(survey.inclination, math.pi - survey.inclination) < VERTICAL
    return np.where(vertical, 0.0, survey.azimuth) if np.any(vertical) else survey.azimuth


def station_values(survey: WellSurvey, site: Site) -> dict[str, Array]:
    """Variables of the stations from the second on, each with its predecessor: (..., n - 1)."""
    md, azimuth = survey.md, leaning_azimuth(survey)
    inclination = np.maximum(survey.inclination, TINY)
    time = survey.record.get("Time", SECONDS_A_METRE * md)
    magnetic = azimuth - site.declination
    values: dict[str, Array] = {"TVD": survey.tvd[..., 1:]}
    for name, array in (("MD", md), ("Inc", inclination), ("Az", azimuth), ("AzT", azimuth), ("AzM", magnetic)):
        values[name], values[f"{name}Prev"] = array[..., 1:], array[..., :-1]
    values["Time"], values["TimePrev"] = time[..., 1:], time[..., :-1]
    for name, default in RECORD.items():
        values[name] = survey.record[name][..., 1:] if name in survey.record else np.float64(default)  # type: ignore[assignment]
    return values


class SurveyGeometry:
    """Geometry of a survey for propagation, computed once for all sources: (..., n - 1), lengths in m.

    From revision 5 the industry's model allows the direction at the surface an error like that of the first station:
    ``slot_allowance`` gives the first station the whole first leg.
    """

    def __init__(self, survey: WellSurvey, *, slot_allowance: bool) -> None:
        sine, cosine = np.sin(survey.inclination), np.cos(survey.inclination)
        azimuth = leaning_azimuth(survey)
        cos_a, sin_a = np.cos(azimuth), np.sin(azimuth)
        self.upper = 0.5 * np.diff(survey.md, axis=-1)  # weight in the leg above
        self.both = self.upper.copy()  # weight in both legs
        self.both[..., :-1] += self.upper[..., 1:]
        if slot_allowance:
            self.both[..., 0] += self.upper[..., 0]
            self.upper[..., 0] *= 2.0
        tangent = (sine * cos_a, sine * sin_a, cosine)
        self.by_depth = np.stack([0.5 * (t[..., 1:] + t[..., :-1]) for t in tangent])  # d dr_k / d MD_k
        sine, cosine, cos_a, sin_a = (x[..., 1:] for x in (sine, cosine, cos_a, sin_a))
        self.by_inclination = np.stack([cosine * cos_a, cosine * sin_a, -sine])
        self.by_azimuth = np.stack([-sine * sin_a, sine * cos_a])
        self.vertical = np.minimum(survey.inclination, math.pi - survey.inclination)[..., 1:] < VERTICAL
        self.any_vertical = bool(np.any(self.vertical))


class ErrorSource:
    """One error source, wherever in the survey it acts: its rows are (leg, place in its tool, term)."""

    def __init__(self, rows: list[tuple[int, int, Term]]) -> None:
        self.rows = rows
        self.name = rows[0][2].name
        self.random = rows[0][2].mode is PropagationMode.RANDOM
        self.renewed = rows[0][2].mode is PropagationMode.SECTION and rows[0][2].by_mode
        # what turns the azimuth alone moves nothing down
        flat = all(is_zero(t.weights[0]) and is_zero(t.weights[1]) and t.position is None for _, _, t in rows)
        self.axes = 2 if flat and all(is_zero((t.singular or ZERO)[2]) for _, _, t in rows) else 3


@lru_cache(maxsize=64)
def sources_of(legs: tuple[Leg, ...]) -> list[ErrorSource]:
    """Sources of a survey: errors of a well or of all wells are one source in every leg that names them."""
    found: dict[tuple[str, int], list[tuple[int, int, Term]]] = {}
    for number, leg in enumerate(legs):
        for t, term in enumerate(leg.tool.terms):
            everywhere = term.mode in (PropagationMode.WELL, PropagationMode.GLOBAL)
            found.setdefault((term.name, -1 if everywhere else number), []).append((number, t, term))
    return [ErrorSource(rows) for rows in found.values()]


@lru_cache(maxsize=64)
def merged_sources(legs: tuple[Leg, ...]) -> list[ErrorSource]:
    """Return the sources merged for their sum alone: those with one formula are one, its variance the sum of theirs."""
    found: dict[Any, list[ErrorSource]] = {}
    for k, source in enumerate(sources_of(legs)):
        number, _, term = source.rows[0]
        formula = (term.formulas, term.singular is None, term.position is None, term.unit, term.window, term.kept)
        alike = (number, source.random, source.renewed, formula)
        found.setdefault(alike if len(source.rows) == 1 else k, []).append(source)
    out = []
    for group in found.values():
        number, t, term = group[0].rows[0]
        if len(group) == 1:
            out.append(group[0])
        else:
            out.append(
                ErrorSource([(number, t, replace(term, value=math.hypot(*(s.rows[0][2].value for s in group))))])
            )
    return out
