"""Our own chain as a gyro tool that other programs know: what its record says station by station, as a model of depth.

The variance of the yaw is taken as a reference and a random walk with depth, a^2 + b^2 MD, fitted to the record; the
other columns stand as their root mean squares. Lengths in m, angles in rad.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from groundstation.survey.tools.instruments import SurveyTool, Term
from groundstation.survey.well.analysis import RECORD_COLUMNS
from groundstation.survey.well.error_sources import RECORD
from groundstation.survey.well.well_record import SurveyRecord

Array = npt.NDArray[np.float64]
YAW = re.compile(r"\bSigmaYaw\b", re.IGNORECASE)


def needs_record(tool: SurveyTool) -> bool:
    """Whether a tool asks for columns of a record."""
    return any(tool.asks_for(name) for name in RECORD)


def as_gyro(tool: SurveyTool, record: SurveyRecord) -> SurveyTool:
    """The tool with the columns of one record as constants and a walk with depth."""
    sizes = {name: _size(record, name) for name in RECORD if name != "SigmaYaw"}
    reference, walk = _yaw(record)
    terms: list[Term] = []
    for term in tool.terms:
        fixed = _replaced(term, sizes)
        if not YAW.search(" ".join(fixed.formulas)):
            terms.append(fixed)
            continue
        terms.append(_with_yaw(fixed, f"{term.name}-REF", f"({reference!r})"))
        terms.append(_with_yaw(fixed, f"{term.name}-WALK", f"({walk!r} * Sqrt(MD))"))
    title = f"{tool.title}, as a gyro, for one survey to {record.md[-1]:g} m"
    return replace(tool, name=f"{tool.name}-gyro", title=title, terms=tuple(terms), kind="Gyroscopic")


def _size(record: SurveyRecord, name: str) -> float:
    """Root mean square of a column from the second station on, or its default; of a count its harmonic mean."""
    values = _column(record, name)
    if values is None:
        return RECORD[name]
    if name == "Readings":  # errors go with one over its root
        return float(1.0 / np.mean(1.0 / np.maximum(values[1:], 1.0)))
    return math.sqrt(float(np.mean(values[1:] ** 2)))


def _yaw(record: SurveyRecord) -> tuple[float, float]:
    """A reference (rad) and a walk (rad / m^0.5) of the yaw."""
    values = _column(record, "SigmaYaw")
    if values is None:
        return RECORD["SigmaYaw"], 0.0
    md, variance = record.md[1:], values[1:] ** 2
    slope = float(np.polyfit(md, variance, 1)[0]) if len(md) > 1 else 0.0
    slope = min(max(slope, 0.0), float(np.sum(md * variance) / np.sum(md**2)))  # neither part is negative
    rest = max(float(np.mean(variance - slope * md)), 0.0)
    return math.sqrt(rest), math.sqrt(slope)


def _column(record: SurveyRecord, name: str) -> Array | None:
    for column, (variable, factor) in RECORD_COLUMNS.items():
        if variable == name and column in record.columns:
            return np.asarray(record.columns[column] * factor)
    return None


def _replaced(term: Term, sizes: dict[str, float]) -> Term:
    found = term
    for name, size in sizes.items():
        found = _with(found, re.compile(rf"\b{name}\b", re.IGNORECASE), f"({size!r})")
    return found


def _with_yaw(term: Term, name: str, text: str) -> Term:
    return replace(_with(term, YAW, text), name=name)


def _with(term: Term, what: re.Pattern[str], text: str) -> Term:
    weights = tuple(what.sub(text, weight) for weight in term.weights)
    singular = None if term.singular is None else tuple(what.sub(text, weight) for weight in term.singular)
    return replace(term, weights=weights, singular=singular)  # type: ignore[arg-type]
