"""Instrument performance models: error terms with magnitude, weighting functions and propagation mode, as data files.

A tool is a TOML file in ``tools/`` (or the user's own); ``iscwsa_json`` reads and writes the industry's JSON schema.
A term acts on depth, inclination and azimuth through formulas; where the hole is vertical and an azimuth formula has
no value, ``singular`` states its effect on north, east and down per metre of leg; ``position`` terms act on the
position of a station directly. Terms of gyros that initialise and then run act in a range of inclinations and may keep
their value beyond it (``gyro_modes``). Source: ISCWSA error model definition; SPE 90408; thesis Appendix I.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from importlib import resources
from pathlib import Path
from typing import Any

from groundstation.errors import ToolError
from groundstation.survey.tools.formulas import (
    CONSTANTS,
    FUNCTIONS,
    VARIABLES,
    compile_formulas,
    is_zero,
    normalise_name,
)
from telemetry.bounded_bytes import bounded_text
from telemetry.toml_tables import parse_toml_tables

Triple = tuple[str, str, str]
LARGEST = 1e300
ZERO: Triple = ("0", "0", "0")
Window = tuple[float, float]
EVERYWHERE: Window = (-math.inf, math.inf)
COMPANION = "-ACROSS"  # ends the name of a companion in a vertical hole: ``across_vertical``
PREVIOUS = "previous"  # the azimuth weight of the station before, of drift and random walk


class PropagationMode(Enum):
    """Range over which an error stays the same."""

    RANDOM = "random"  # another one at every station
    SECTION = "section"  # the same from one initialisation of a gyro to the next, within a leg
    SYSTEMATIC = "systematic"  # the same within a leg
    WELL = "well"  # the same within a well
    GLOBAL = "global"  # the same in all wells


UNITS = {
    "-": 1.0, "m": 1.0, "1/m": 1.0, "nT": 1.0, "m/s2": 1.0, "rad": 1.0, "s": 1.0,
    "deg": math.radians(1.0), "deg.nT": math.radians(1.0), "deg/nT": math.radians(1.0),
    "deg/s": math.radians(1.0), "deg/rts": math.radians(1.0), "mm": 1e-3,
    # the industry's gyro formulas count in hours, and so does the variable EarthRate
    "deg/hr": math.radians(1.0), "deg/rthr": math.radians(1.0), "deg/sqr(hr)": math.radians(1.0),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Term:
    """One error source; ``value`` in ``unit`` is one standard deviation."""

    name: str
    value: float
    unit: str
    mode: PropagationMode
    weights: Triple = ZERO  # of depth (m), inclination and azimuth (rad)
    singular: Triple | None = None  # north, east, down per metre of leg where the hole is vertical
    position: Triple | None = None  # north, east, down of the station itself
    window: Window = EVERYWHERE  # acts at inclinations above the first and up to the second, rad
    kept: bool = False  # beyond the window it keeps the value that it had there

    @property
    def by_mode(self) -> bool:
        """Whether the term depends on the stations before: a gyro that initialises, drifts or walks."""
        return self.window != EVERYWHERE or self.kept or PREVIOUS in " ".join(self.weights).lower()

    @property
    def sigma(self) -> float:
        """One standard deviation in SI."""
        return self.value * UNITS[self.unit]

    @property
    def formulas(self) -> tuple[str, ...]:
        """Nine formulas: three weights, three for a vertical hole, three of the position."""
        return (*self.weights, *(self.singular or ZERO), *(self.position or ZERO))


@dataclass(frozen=True, slots=True)
class SurveyTool:
    """One instrument. ``parameters`` are names for its formulas, SI."""

    name: str
    title: str
    terms: tuple[Term, ...] = field(hash=False)  # long, and equality looks at them
    parameters: dict[str, float] = field(default_factory=dict, hash=False)
    source: str = ""
    revision: str = ""
    kind: str = "Unknown"  # Magnetic, Gyroscopic, Inertial or Unknown
    inclination_range: tuple[float, float] = (0.0, math.pi)
    slot_allowance: bool = False  # whether the direction at the surface errs like that of the first station

    def __post_init__(self) -> None:
        """Refuse what cannot be used, naming the term."""
        names = [term.name for term in self.terms]
        if not names:
            raise ToolError(f"{self.name}: expected at least one term")
        for term in self.terms:
            if names.count(term.name) > 1:
                raise ToolError(f"{self.name}: term {term.name} stands there twice")
            if term.unit not in UNITS:
                raise ToolError(
                    f"{self.name}: term {term.name}: unknown unit {term.unit!r}; expected one of {', '.join(UNITS)}"
                )
            if not math.isfinite(term.value):
                raise ToolError(f"{self.name}: term {term.name}: expected a finite value, got {term.value}")
            if term.by_mode and not (is_zero(term.weights[0]) and term.position is None):
                raise ToolError(f"{self.name}: term {term.name}: a gyro's ranges and recurrences are of angles alone")
            if not term.window[0] <= term.window[1]:
                raise ToolError(f"{self.name}: term {term.name}: expected above_deg at most up_to_deg")
            try:
                compile_formulas(term.formulas, tuple(self.parameters))
            except ToolError as error:
                raise ToolError(f"{self.name}: term {term.name}: {error}") from None

    def asks_for(self, variable: str) -> bool:
        """Whether a formula of the tool names a variable; case and underscores do not count."""
        text = " ".join(formula for term in self.terms for formula in term.formulas).replace("_", "").lower()
        return variable.lower() in text

    def without(self, *names: str) -> SurveyTool:
        """Return the tool less the terms of these names and their companions."""
        return self.with_terms(tuple(term for term in self.terms if term.name.removesuffix(COMPANION) not in names))

    def with_terms(self, terms: tuple[Term, ...]) -> SurveyTool:
        """Return the tool with ``terms`` in place of its own."""
        return replace(self, terms=terms)


def shipped_tool_names() -> list[str]:
    """Names of the tools that come with the program."""
    folder = resources.files("groundstation.survey.tools") / "models"
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))


def load_tool(name_or_file: str, parameters: Mapping[str, float] | None = None) -> SurveyTool:
    """Tool by its name, of the OWSG set by its name there, or of a TOML or ISCWSA JSON file.

    ``parameters`` are those that it leaves out, or in place of its own. Terms that lean a vertical hole one way have
    a companion across (``across_vertical``), but in the industry's own models.

    Raises
    ------
    ToolError
        One line: file, term, what was expected and what came.
    """
    from groundstation.survey.tools.across_vertical import with_across_terms

    tool = _read_tool(name_or_file, parameters)
    # the industry's own stay exact to its tables
    return tool if tool.slot_allowance else with_across_terms(tool)


def _read_tool(name_or_file: str, parameters: Mapping[str, float] | None) -> SurveyTool:
    """The tool as it is published; errors as ``load_tool``."""
    if name_or_file in shipped_tool_names():
        text = (resources.files("groundstation.survey.tools") / "models" / f"{name_or_file}.toml").read_text("utf-8")
        return parse_toml(text, name_or_file, parameters)
    path = Path(name_or_file)
    if path.suffix not in (".toml", ".json"):
        from groundstation.survey.tools.owsg import owsg_tool

        found = owsg_tool(name_or_file, parameters)
        if found is not None:
            return found
        raise ToolError(
            f"{name_or_file}: no such instrument; expected one of {', '.join(shipped_tool_names())}, "
            "one of the OWSG set such as MWD+IFR1+SAG+MS or GYRO-NS-CT (borechain survey --tools), "
            "or a .toml or .json file"
        )
    try:
        text = bounded_text(path)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise ToolError(
            f"{path}: {reason}; expected an instrument file or one of {', '.join(shipped_tool_names())}"
        ) from error
    if path.suffix == ".json":
        from groundstation.survey.tools.iscwsa_json import parse_json

        return parse_json(text, str(path), parameters)
    return parse_toml(text, str(path), parameters)


def parse_toml(text: str, where: str, replaced: Mapping[str, float] | None = None) -> SurveyTool:
    """Tool of TOML text; errors as ``load_tool``, beginning with ``where``."""
    try:
        data = parse_toml_tables(text)
    except ValueError as error:
        raise ToolError(f"{where}: not TOML: {error}") from error
    _keys(where, "", data, {"tool", "parameters", "term"}, {"tool", "term"})
    head = data["tool"]
    _keys(
        where,
        "tool: ",
        head,
        {"name", "title", "source", "revision", "kind", "inclination_max_deg", "slot_allowance"},
        {"name", "title"},
    )
    given = data.get("parameters", {})
    if not isinstance(given, dict) or not isinstance(data["term"], list):
        raise ToolError(f"{where}: term or parameters: expected a table [parameters] and terms [[term]]")
    own = {name: finite_number(where, f"parameters.{name}", value) for name, value in given.items()}
    parameters = with_parameters(own, replaced or {})
    check_parameters(where, parameters)
    limit = math.radians(finite_number(where, "tool.inclination_max_deg", head.get("inclination_max_deg", 180.0)))
    terms = tuple(_term(where, k, row) for k, row in enumerate(data["term"], 1))
    try:
        return SurveyTool(
            str(head["name"]),
            str(head["title"]),
            terms,
            parameters,
            str(head.get("source", "")),
            str(head.get("revision", "")),
            str(head.get("kind", "Unknown")),
            (0.0, limit),
            bool(head.get("slot_allowance", False)),
        )
    except ToolError as error:
        raise ToolError(f"{where}: {error}") from None


def with_parameters(own: dict[str, float], given: Mapping[str, float]) -> dict[str, float]:
    """Return the parameters of a file, replaced or completed by ``given``."""
    names = {normalise_name(name) for name in given}
    return {name: value for name, value in own.items() if normalise_name(name) not in names} | dict(given)


def check_parameters(where: str, parameters: dict[str, float]) -> None:
    """Refuse names that formulas would not find or would find twice; case and underscores do not count.

    Raises
    ------
    ToolError
        Names file and parameter.
    """
    taken = {normalise_name(name) for name in (*VARIABLES, *CONSTANTS, *FUNCTIONS)}
    for name in parameters:
        if normalise_name(name) in taken:
            whose = "a variable" if normalise_name(name) in {normalise_name(v) for v in VARIABLES} else "something else"
            raise ToolError(f"{where}: parameters.{name}: the name is that of {whose}; choose another")
        taken.add(normalise_name(name))


TERM_KEYS = {
    "name", "value", "unit", "mode", "depth", "inclination", "azimuth", "singular_north", "singular_east",
    "singular_down", "north", "east", "down", "above_deg", "up_to_deg", "kept",
}  # fmt: skip


def _term(where: str, k: int, row: Any) -> Term:
    name = row.get("name", f"number {k}") if isinstance(row, dict) else f"number {k}"
    _keys(where, f"term {name}: ", row, TERM_KEYS, {"name", "value", "unit", "mode"})
    return Term(
        str(name),
        finite_number(where, f"term {name}: value", row["value"]),
        str(row["unit"]),
        mode_of(where, str(name), str(row["mode"])),
        _triple(row, ("depth", "inclination", "azimuth")) or ZERO,
        _triple(row, ("singular_north", "singular_east", "singular_down")),
        _triple(row, ("north", "east", "down")),
        (_angle(where, str(name), row, "above_deg", -math.inf), _angle(where, str(name), row, "up_to_deg", math.inf)),
        row.get("kept", False) is True,
    )


def _angle(where: str, name: str, row: dict[str, Any], key: str, default: float) -> float:
    return math.radians(finite_number(where, f"term {name}: {key}", row[key])) if key in row else default


def _triple(row: dict[str, Any], names: tuple[str, str, str]) -> Triple | None:
    if not any(name in row for name in names):
        return None
    first, second, third = (str(row.get(name, "0")) for name in names)
    return first, second, third


def mode_of(where: str, term: str, text: str) -> PropagationMode:
    """Propagation mode by its name.

    Raises
    ------
    ToolError
        Names file, term and the valid modes.
    """
    try:
        return PropagationMode(text.lower())
    except ValueError:
        modes = ", ".join(mode.value for mode in PropagationMode)
        raise ToolError(f"{where}: term {term}: expected a mode of {modes}, got {text!r}") from None


def finite_number(where: str, what: str, value: Any) -> float:
    """A finite number of a file.

    Raises
    ------
    ToolError
        Names file and place.
    """
    if not isinstance(value, bool) and isinstance(value, int | float) and abs(value) < LARGEST:
        return float(value)
    try:
        got = f"{value!r:.60}"
    except ValueError:  # an integer of thousands of digits
        got = "a number beyond all"
    raise ToolError(f"{where}: {what}: expected a finite number, got {got}")


def _keys(where: str, place: str, table: Any, known: set[str], needed: set[str]) -> None:
    if not isinstance(table, dict):
        raise ToolError(f"{where}: {place}expected a table, got {table!r:.60}")
    for key in table:
        if key not in known:
            raise ToolError(f"{where}: {place}{key}: unknown key; expected one of {', '.join(sorted(known))}")
    for key in sorted(needed):
        if key not in table:
            raise ToolError(f"{where}: {place}{key} is missing")
