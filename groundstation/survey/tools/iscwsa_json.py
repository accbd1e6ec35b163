"""Import and export of the ISCWSA JSON schema for error models (framework "ISCWSA Rev5", draft schema).

The schema has no dimensionless unit and no term that acts on a position. On export a dimensionless magnitude is written
with the unit rad and deg.nT with deg: both leave number and formula as they are. The allowance for the direction at the
surface belongs to the framework of revision 5, whatever the instrument. The extended-course-length terms are
written with the angle formulas of the published sheets and, when read, take the definition's effect on the position
again: their formulas in angles do not say what happens across stations. Names of parameters become numbers on export.
"""

from __future__ import annotations

import datetime
import hashlib
import json
import math
import re
import uuid
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from groundstation.errors import ToolError
from groundstation.survey.tools.formulas import normalise_name
from groundstation.survey.tools.instruments import (
    COMPANION,
    EVERYWHERE,
    ZERO,
    PropagationMode,
    SurveyTool,
    Term,
    Triple,
    check_parameters,
    finite_number,
    mode_of,
    with_parameters,
)

COURSE = "(MD-MDPrev)"
TURN = "Abs(Sin(Inc) * Sin(AzT-AzTPrev)) * Step(IncPrev - 1.75e-6)"
ACROSS = f"{COURSE} * Max({TURN}, XCLTortuosity * {COURSE})"
ALONG = f"{COURSE} * Max(Abs(Inc-IncPrev), XCLTortuosity * {COURSE})"
XCL: dict[str, Triple] = {
    "XCLA": (f"-Sin(AzT) * {ACROSS}", f"Cos(AzT) * {ACROSS}", "0"),
    "XCLH": (f"Cos(Inc) * Cos(AzT) * {ALONG}", f"Cos(Inc) * Sin(AzT) * {ALONG}", f"-Sin(Inc) * {ALONG}"),
}
XCL_IN_ANGLES: dict[str, Triple] = {
    "XCLA": ("0", "0", f"Max(Sin(Abs(AzT-AzPrev)), XCLTortuosity * {COURSE} / Sin(Inc))"),
    "XCLH": ("0", f"Max(Abs(Inc-IncPrev), XCLTortuosity * {COURSE})", "0"),
}
TORTUOSITY = math.radians(1.0) / 30.48  # rad/m, 1 deg per 100 ft
# What continuous gyros call the weight of the station before, and what ends their stationary part
RECURRENCES = re.compile(r"\b(?:XYZ|XY|Z)_Gyro_(?:Drift|Random_Walk)\b", re.IGNORECASE)
STATIC_END = "xystaticgyroendinc"
STATIONARY = re.compile(r"G[XYZ]+-(?!GD|GRW)")
NOISE = "-RN"  # random at stationary stations; what is left of it in an initialisation stays the same until the next
REDUCTION = "noisereductionfactor"
EXPORTED_UNITS = {"-": "rad", "deg.nT": "deg", "deg/nT": "deg/nT", "deg/hr": "deg/hr"}
SCHEMA_UNITS = ("m", "1/m", "nT", "m/s2", "deg", "deg/nT", "deg/hr", "rad")
NO_UUID = "00000000-0000-0000-0000-000000000000"
KINDS = ("Magnetic", "Gyroscopic", "Inertial", "Unknown")
TERM_KEYS = ("name", "value", "units", "propagation_mode", "depth_formula", "inclination_formula", "azimuth_formula")


def parse_json(text: str, where: str, given: Mapping[str, float] | None = None) -> SurveyTool:
    """Tool of an ISCWSA JSON text; ``given`` are parameters that the file leaves out, or in place of its own.

    Raises
    ------
    ToolError
        One line that begins with ``where``: term, what was expected and what came.
    """
    try:
        data = json.loads(text)
    except (ValueError, RecursionError, MemoryError) as error:
        raise ToolError(f"{where}: not JSON: {error}") from error
    if not isinstance(data, dict) or not isinstance(data.get("terms"), list):
        raise ToolError(f"{where}: expected an ISCWSA error model with metadata, parameters and terms")
    return tool_of(data, where, given)


def tool_of(data: dict[str, Any], where: str, given: Mapping[str, float] | None = None) -> SurveyTool:
    """Tool of the content of an ISCWSA JSON text; errors as ``parse_json``."""
    meta, stated = data.get("metadata", {}), data.get("parameters", {})
    for name, table in (("metadata", meta), ("parameters", stated)):
        if not isinstance(table, dict):
            raise ToolError(f"{where}: {name}: expected an object, got {table!r:.60}")
    low, high = (
        math.radians(finite_number(where, key, stated.get(key, d))) for key, d in (("inc_min", 0), ("inc_max", 180))
    )
    parameters = _parameters(where, stated, given or {})
    end = next((parameters.pop(name) for name in list(parameters) if normalise_name(name) == STATIC_END), math.inf)
    rows = [_term(where, k, row) for k, row in enumerate(data["terms"], 1)]
    terms = tuple(term for row in rows for term in _in_modes(row, end))
    try:
        return SurveyTool(
            str(meta.get("short_name") or where),
            str(meta.get("long_name") or where),
            terms,
            parameters,
            str(meta.get("source", "")),
            str(meta.get("revision_number", "")),
            str(meta.get("tool_type", "Unknown")),
            (low, high),
            slot_allowance=str(meta.get("framework", "")) == "ISCWSA Rev5",
        )
    except ToolError as error:
        raise error if str(error).startswith(where) else ToolError(f"{where}: {error}") from None


def _parameters(where: str, stated: dict[str, Any], given: Mapping[str, float]) -> dict[str, float]:
    """Parameters of a file with what it leaves out."""
    own = {k: finite_number(where, f"parameters.{k}", v) for k, v in stated.items() if k not in ("inc_min", "inc_max")}
    parameters = with_parameters(own, given)
    names = {normalise_name(name) for name in parameters}
    if "xcltortuosity" not in names:
        parameters["XCLTortuosity"] = TORTUOSITY
    if REDUCTION not in names:
        parameters["NoiseReductionFactor"] = 1.0
    check_parameters(where, parameters)
    return parameters


def _in_modes(term: Term, end: float) -> list[Term]:
    """A term of a gyro in the ranges of its modes: stationary up to the inclination ``end``, then continuous.

    Source: SPE 90408, appendix C.
    """
    azimuth = term.weights[2]
    if RECURRENCES.search(azimuth):
        weights = (*term.weights[:2], RECURRENCES.sub("Previous", azimuth))
        walks = "random_walk" in azimuth.lower()
        # a free gyro, whose drift runs from the collar, states no end
        window = (end, math.inf) if end < math.inf else EVERYWHERE
        return [replace(term, weights=weights, window=window, mode=PropagationMode.SECTION if walks else term.mode)]
    if end >= math.pi or not STATIONARY.match(term.name):
        return [term]
    if term.mode is not PropagationMode.RANDOM:
        return [replace(term, window=(-math.inf, end), kept=True)]
    full = re.sub("NoiseReductionFactor *\\*", "", azimuth) if NOISE in term.name else azimuth
    start = replace(term, name=f"{term.name}-INIT", mode=PropagationMode.SECTION, window=(end, end), kept=True)
    return [replace(term, weights=(*term.weights[:2], full), window=(-math.inf, end)), start]


def _term(where: str, k: int, row: Any) -> Term:
    if not isinstance(row, dict):
        raise ToolError(f"{where}: term number {k}: expected an object, got {row!r:.60}")
    name = str(row.get("name", f"number {k}"))
    missing = [key for key in TERM_KEYS if key not in row]
    if missing:
        raise ToolError(f"{where}: term {name}: {missing[0]} is missing")
    mode = mode_of(where, name, str(row["propagation_mode"]))
    value = finite_number(where, f"term {name}: value", row["value"])
    if name in XCL:
        return Term(name, value, str(row["units"]), mode, position=XCL[name])
    weights = tuple(str(row[key]) for key in ("depth_formula", "inclination_formula", "azimuth_formula"))
    singular = [row.get(key) for key in ("north_singularity", "east_singularity", "vertical_singularity")]
    at_vertical = None if not any(singular) else tuple(str(text or "0") for text in singular)
    return Term(name, value, str(row["units"]), mode, weights, at_vertical)  # type: ignore[arg-type]


def to_json(tool: SurveyTool, date: datetime.date) -> str:
    """ISCWSA JSON text of a tool.

    Raises
    ------
    ToolError
        When a term has what the schema cannot say.
    """
    for term in tool.terms:
        if term.by_mode:
            raise ToolError(f"{tool.name}: term {term.name}: the schema has no ranges of a gyro's modes")
    terms = [_row(tool, term) for term in tool.terms if not term.name.endswith(COMPANION)]
    space = uuid.UUID(NO_UUID)
    metadata: dict[str, Any] = {
        "schema_uuid": NO_UUID,
        "model_uuid": str(uuid.uuid5(space, tool.name)),
        "model_id": tool.name,
        "short_name": tool.name,
        "long_name": tool.title or tool.name,
        "revision_number": float(tool.revision) if re.fullmatch(r"\d+(\.\d+)?", tool.revision) else 0,
        "revision_date": date.isoformat(),
        "revision_comment": "exported",
        "source": tool.source or "borechain",
        "application": tool.title or tool.name,
        "tool_type": tool.kind if tool.kind in KINDS else "Unknown",
        "author": "borechain",
        "framework": "ISCWSA Rev5" if tool.slot_allowance else "Other",
        "tags": [],
    }
    low, high = tool.inclination_range
    body = {"metadata": metadata, "terms": terms}
    model = {
        "$schema": "draft.json",
        **body,
        "parameters": {"inc_min": round(math.degrees(low)), "inc_max": round(math.degrees(high))},
        "hash_function": "SHA-256",
        "hash_value": _hash(body),
    }
    return json.dumps(model, indent=2) + "\n"


def _row(tool: SurveyTool, term: Term) -> dict[str, Any]:
    weights = term.weights
    if term.position is not None:
        if term.position != XCL.get(term.name) or term.weights != ZERO or term.singular is not None:
            raise ToolError(f"{tool.name}: term {term.name}: the schema has no term that acts on a position")
        weights = XCL_IN_ANGLES[term.name]
    unit = EXPORTED_UNITS.get(term.unit, term.unit)
    if unit not in SCHEMA_UNITS:
        raise ToolError(f"{tool.name}: term {term.name}: the schema has no unit {term.unit}")
    depth, inclination, azimuth = (_numbered(tool, term, text) for text in weights)
    singular = [None] * 3 if term.singular is None else [_numbered(tool, term, text) for text in term.singular]
    row = {
        "uuid": str(uuid.uuid5(uuid.UUID(NO_UUID), f"{tool.name}/{term.name}")),
        "name": term.name,
        "value": term.value,
        "units": unit,
        # correlation between stations of one leg, between legs of one well and between wells
        "depth_factor": float(term.mode is not PropagationMode.RANDOM),
        "inclination_factor": float(term.mode in (PropagationMode.WELL, PropagationMode.GLOBAL)),
        "azimuth_factor": float(term.mode is PropagationMode.GLOBAL),
        "propagation_mode": term.mode.value.capitalize(),
        "depth_formula": depth,
        "inclination_formula": inclination,
        "azimuth_formula": azimuth,
        "north_singularity": singular[0],
        "east_singularity": singular[1],
        "vertical_singularity": singular[2],
    }
    return row | {"hash_value": _hash(row)}


def _numbered(tool: SurveyTool, term: Term, text: str) -> str:
    """A formula with the tool's parameters as numbers."""
    known = {name.lower(): value for name, value in tool.parameters.items()}
    foreign = {"sigmayaw", "sigmasystematic", "sigmaforce", "readings", "time", "timeprev"} & {
        word.lower() for word in re.findall(r"[A-Za-z]\w*", text)
    }
    if foreign:
        raise ToolError(f"{tool.name}: term {term.name}: the schema has no variable {', '.join(sorted(foreign))}")
    return re.sub(
        r"(?<![\w.])[A-Za-z]\w*", lambda m: f"({known[m[0].lower()]!r})" if m[0].lower() in known else m[0], text
    )


def _hash(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
