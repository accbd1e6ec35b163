"""The heads of a wall as a table: one column a row, with what sets it apart.

Every refusal names file, line, column, what was expected and what came.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from groundstation.entry.null_values import is_null
from groundstation.entry.quantity_ranges import RANGES
from groundstation.errors import SurveyError
from groundstation.survey.files.column_tables import read_table_columns
from groundstation.survey.files.survey_columns import UNITS
from groundstation.survey.tools.instruments import SurveyTool, load_tool
from groundstation.survey.wall.column_deviation import ColumnDesign, Tolerance, parse_tolerance
from groundstation.survey.wall.column_plans import ColumnPlan, ColumnStatus
from groundstation.survey.well.depth_reference import DEPTHS_FROM, DepthReference, depth_reference

if TYPE_CHECKING:
    from groundstation.plan_settings import PlanSettings

Array = npt.NDArray[np.float64]
NUMBERS = (
    "down_m", "inclination_deg", "azimuth_deg", "length_m", "radius_m", "drilled_to_m", "head_sigma_m",
    "depth_reference_height_m",
)  # fmt: skip
NEEDED = ("column", "north_m", "east_m")
SIGNED = ("down_m", "azimuth_deg", "depth_reference_height_m")  # may be negative
WORDS = ("state", "instrument", "serial", "calibration", "tolerance", "between", "replaces", "drilled_on", "plan")
STRAIGHT = ("inclination_deg", "azimuth_deg", "length_m")  # of an axis without a plan


@dataclass(frozen=True, slots=True)
class Defaults:
    """Values of a column that states none of its own; m and rad."""

    radius: float
    length: float | None
    inclination: float
    azimuth: float
    tolerance: Tolerance
    tool: SurveyTool
    serial: str
    head_std: float
    folder: Path  # of instrument files
    calibration: str = ""
    # what stations and drilled depths count from, what the heads do, and the height of the one above the other, if any
    depths: tuple[str, str, float | None] = (DEPTHS_FROM[0], DEPTHS_FROM[0], None)
    course: PlanSettings | None = None  # of the axes


@dataclass(frozen=True, slots=True)
class Remedy:
    """Purpose of a remedial column."""

    between: tuple[str, ...] = ()
    replaces: str = ""

    @property
    def asked(self) -> bool:
        """Whether the column is a remedial one."""
        return bool(self.between or self.replaces)

    @property
    def named(self) -> tuple[str, ...]:
        """Columns it names."""
        return (*self.between, *((self.replaces,) if self.replaces else ()))


@dataclass(frozen=True, slots=True)
class HeadRow:
    """One row of the heads."""

    name: str
    plan_without_length: ColumnPlan
    length: float | None
    remedy: Remedy
    drilled_on: date | None = None
    depths: DepthReference = field(default_factory=DepthReference)
    course: Path | None = None  # file of its own plan

    def plan(self, length: float) -> ColumnPlan:
        """The plan, ``length`` (m) where the row has none."""
        known = self.plan_without_length
        if known.design.plan is not None:
            return known
        return replace(known, design=replace(known.design, length=self.length or length))


def read_heads(path: Path, defaults: Defaults, north: str) -> list[HeadRow]:
    """Columns of a wall in the order of the file; azimuths count from ``north``.

    Raises
    ------
    SurveyError, ToolError
        Names file, line and column.
    """
    table, lines = read_table_columns(path, NEEDED, texts=("column", *NUMBERS, *WORDS), north=north)
    _check_units(path, [name for name in table if name not in (*NEEDED, *NUMBERS, *WORDS)])
    names = [str(name) for name in table["column"]]
    seen: dict[str, int] = {}
    for line, name in zip(lines, names, strict=True):
        if not name:
            raise SurveyError(f"{path}: line {line}: expected the name of a column")
        first = seen.setdefault(name.casefold(), line)
        if first != line:
            other = names[lines.index(first)]
            differs = "" if other == name else f" as {other}; expected names that differ by more than case"
            raise SurveyError(f"{path}: line {line}: column {name} stands in line {first} already{differs}")
    heads = np.stack([table["north_m"], table["east_m"]], axis=1)
    wrong = np.flatnonzero(~np.isfinite(heads).all(axis=1))
    if len(wrong):
        raise SurveyError(f"{path}: line {lines[wrong[0]]}: expected finite north_m and east_m")
    for line, head in zip(lines, heads.tolist(), strict=True):
        for key, value in zip(NEEDED[1:], head, strict=True):
            RANGES["coordinate"].check(f"{path}: line {line}: {key}", value)
    tools: dict[str, SurveyTool] = {}
    courses: dict[str, PlanSettings] = {}
    rows = []
    for k, (line, name) in enumerate(zip(lines, names, strict=True)):
        cells = {key: str(table[key][k]) for key in (*NUMBERS, *WORDS) if key in table}
        rows.append(_head(f"{path}: line {line}: column {name}", name, heads[k], cells, defaults, tools, courses))
    return rows


def _check_units(path: Path, others: list[str]) -> None:
    """Refuse a column that would be ours in another unit, or without one: what it says would not be heard."""
    for other in others:
        for name in NUMBERS:
            stem = name.rpartition("_")[0]
            rest = other.lower().removeprefix(stem).strip(" _()[]")
            if other.lower().startswith(stem) and (not rest or rest in UNITS):
                raise SurveyError(f"{path}: {other}: expected {name}")


def _head(
    where: str,
    name: str,
    head: Array,
    cells: dict[str, str],
    defaults: Defaults,
    tools: dict[str, SurveyTool],
    courses: dict[str, PlanSettings],
) -> HeadRow:
    values = {key: _number(where, key, cells[key]) for key in NUMBERS if cells.get(key)}
    status = _status(where, cells.get("state", ""))
    try:
        allowed = parse_tolerance(cells["tolerance"]) if cells.get("tolerance") else defaults.tolerance
        read_from, answer, height = defaults.depths
        depths = depth_reference(read_from, answer, values.get("depth_reference_height_m", height))
    except SurveyError as error:
        raise SurveyError(f"{where}: {error}") from None
    place = (float(head[0]), float(head[1]), values.get("down_m", 0.0))
    radius, course = values.get("radius_m", defaults.radius), _course(where, cells, defaults, courses)
    if course is None:
        inclination = math.radians(values["inclination_deg"]) if "inclination_deg" in values else defaults.inclination
        azimuth = math.radians(values["azimuth_deg"]) if "azimuth_deg" in values else defaults.azimuth
        design = ColumnDesign(name, place, inclination, azimuth, 1.0, radius, allowed)
    else:
        allowed = allowed if cells.get("tolerance") else course.to_tolerance(allowed)
        design = ColumnDesign.of_plan(name, course.to_plan(), place, radius, allowed)
    tool = _tool(cells.get("instrument", ""), defaults, tools)
    drilled = depths.to_answer(values["drilled_to_m"]) if "drilled_to_m" in values else None
    if drilled is not None and drilled < 0.0:
        raise SurveyError(f"{where}: drilled_to_m: {values['drilled_to_m']:g} m lies above the head")
    plan = ColumnPlan(
        design, tool, cells.get("serial") or defaults.serial, status, drilled,
        values.get("head_sigma_m", defaults.head_std), cells.get("calibration") or defaults.calibration,
    )  # fmt: skip
    day = _day(where, cells.get("drilled_on", ""))
    if day is not None and status in (ColumnStatus.PLANNED, ColumnStatus.NOT_DRILLED):
        raise SurveyError(f"{where}: drilled_on: stated as {status.value}, yet drilled on {day}")
    length = values.get("length_m", defaults.length) if course is None else design.length
    own = defaults.folder / cells["plan"] if cells.get("plan") else None
    return HeadRow(name, plan, length, _remedy(where, cells), day, depths, own)


def _day(where: str, text: str) -> date | None:
    try:
        return date.fromisoformat(text) if text else None
    except ValueError:
        raise SurveyError(f"{where}: drilled_on: expected a day as 2026-11-20, got {text!r}") from None


def _number(where: str, key: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    low = -math.inf if key in SIGNED else 0.0
    if not math.isfinite(value) or value < low or (key in ("length_m", "radius_m") and value == 0.0):
        raise SurveyError(
            f"{where}: {key}: expected a number{'' if low < 0.0 else ' that is not negative'}, got {text!r}"
        )
    if is_null(value, angle=key.endswith("_deg")):
        raise SurveyError(f"{where}: {key}: expected a number, or nothing, got {text!r}, which stands for no value")
    return RANGES[key if key.endswith("_deg") else "depth"].check(f"{where}: {key}", value)


def _status(where: str, text: str) -> ColumnStatus:
    try:
        return ColumnStatus(text)
    except ValueError:
        names = ", ".join(status.value for status in ColumnStatus if status.value)
        raise SurveyError(f"{where}: state: expected one of {names}, or nothing, got {text!r}") from None


def _tool(name: str, defaults: Defaults, tools: dict[str, SurveyTool]) -> SurveyTool:
    """Instrument of a row; the same object for the same name."""
    if not name:
        return defaults.tool
    if name not in tools:
        tools[name] = load_tool(str(defaults.folder / name) if name.endswith((".toml", ".json")) else name)
    return tools[name]


def _course(
    where: str, cells: dict[str, str], defaults: Defaults, courses: dict[str, PlanSettings]
) -> PlanSettings | None:
    """Plan of a row, made once for all that name it; that of the wall where the row says nothing of its axis."""
    name, straight = cells.get("plan", ""), [key for key in STRAIGHT if cells.get(key)]
    if not name:
        return None if straight else defaults.course
    if straight:
        raise SurveyError(
            f"{where}: {straight[0]}: expected none beside a plan, which says it, got {cells[straight[0]]!r}"
        )
    if name not in courses:
        try:
            courses[name] = read_course(defaults.folder / name)
        except SurveyError as error:
            raise SurveyError(f"{where}: plan: {error}") from None
    return courses[name]


def read_course(path: Path) -> PlanSettings:
    """Plan of columns, which begins at their heads.

    Raises
    ------
    SurveyError
        Names the file, what was expected and what came.
    """
    from groundstation.plan_settings import read_plan  # a wall of straight columns needs none of it

    found = read_plan(path)
    if any(found.head):
        north, east, down = found.head
        raise SurveyError(
            f"{path}: expected a plan that begins at the head of a column, 0 m, got {north:g}, {east:g}, {down:g} m"
        )
    return found


def _remedy(where: str, cells: dict[str, str]) -> Remedy:
    between = tuple(part.strip() for part in cells.get("between", "").split("/")) if cells.get("between") else ()
    if between and (len(between) != 2 or between[0] == between[1]):
        raise SurveyError(f"{where}: between: expected two columns as NAME/NAME, got {cells['between']!r}")
    return Remedy(between, cells.get("replaces", ""))
