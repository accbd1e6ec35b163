"""A wall as files: what is required of it (TOML), where its columns stand and how they were surveyed (CSV).

Every file a wall file names lies beside it. What a column does not say of itself is that of the wall.
"""

from __future__ import annotations

import hashlib
import math
import tomllib
from dataclasses import dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from groundstation.entry.entry_warning import EntryWarning
from groundstation.entry.quantity_ranges import RANGES
from groundstation.errors import SurveyError
from groundstation.survey.tools.instruments import SurveyTool, load_tool
from groundstation.survey.wall.as_built import Columns
from groundstation.survey.wall.closing import ClosingDay, closing_by_day
from groundstation.survey.wall.column_deviation import Tolerance, parse_tolerance
from groundstation.survey.wall.column_joint import largest_distance
from groundstation.survey.wall.column_plans import Assumptions, ColumnPlan, ColumnSurvey
from groundstation.survey.wall.tight_depths import TightRange, asked_depths, tight_depths
from groundstation.survey.wall.wall_columns import BuiltWall, build_wall
from groundstation.survey.wall.wall_design import check_design, find_detours, find_pairs
from groundstation.survey.wall.wall_frames import (
    FRAMES,
    NORTH_ANGLES,
    ORIGIN,
    PLACE,
    check_magnetic_site,
    grid_of,
    norths_of,
    place_of,
)
from groundstation.survey.wall.wall_joints import Detour
from groundstation.survey.wall.wall_layers import MOST_RADIUS_CV, layers_of
from groundstation.survey.wall.wall_plausibility import wall_warnings
from groundstation.survey.wall.wall_stations import read_holes
from groundstation.survey.wall.wall_tables import STRAIGHT, Defaults, read_course, read_heads
from groundstation.survey.well.depth_reference import DEPTHS_FROM
from groundstation.survey.well.methods import Method
from groundstation.survey.well.reference_frames import SiteGrid
from telemetry.bounded_bytes import bounded_text
from telemetry.toml_tables import parse_toml_tables

if TYPE_CHECKING:
    from groundstation.plan_settings import PlanSettings

Array = npt.NDArray[np.float64]
LAYOUTS = ("line", "shaft", "grid")
NEEDED = ("radius_m", "thickness_m", "heads", "stations")
NAMED = ("project", "client", "calibration", "height_datum")  # of the report alone
DEPTHS = ("depth_reference", "answer_depth_reference")
OWN = ("name", "heads", "stations", "layout", "tolerance", "instrument", "serial", "method", "plan")
TEXTS = (*OWN, *NAMED, *FRAMES, *DEPTHS)
REFERENCE_HEIGHT = "depth_reference_height_m"
TIGHT = ("tight_from_m", "tight_to_m")
SIGNED = (*ORIGIN, *NORTH_ANGLES.values(), *TIGHT, REFERENCE_HEIGHT, *PLACE)  # may be negative
POSITIVE = (
    "radius_m",
    "thickness_m",
    "spacing_m",
    "length_m",
    "depth_step_m",
    "gravity_mps2",
    "allowed_probability",
    "grid_scale_factor",
    "field_nt",
)
NOT_NEGATIVE = (
    "radius_cv", "radius_correlation", "head_sigma_m", "unsurveyed_percent", "inclination_deg", "azimuth_deg",
)  # fmt: skip
MOST_DEPTH = RANGES["depth"].high
MOST = {
    "allowed_probability": 0.5, "radius_cv": MOST_RADIUS_CV, "radius_correlation": 1.0, "unsurveyed_percent": 100.0,
    "inclination_deg": 180.0, "azimuth_deg": 360.0, "dip_deg": 90.0, "latitude_deg": 90.0, "declination_deg": 180.0,
    "convergence_deg": 180.0, "north_of_site_deg": 360.0, "depth_step_m": 2.0, "spacing_m": MOST_DEPTH,
    "length_m": MOST_DEPTH, "tight_from_m": MOST_DEPTH, "tight_to_m": MOST_DEPTH, "head_sigma_m": MOST_DEPTH,
    REFERENCE_HEIGHT: MOST_DEPTH, **dict.fromkeys(ORIGIN, RANGES["coordinate"].high),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class WallFile:
    """Requirements of a wall; m and rad."""

    path: Path
    name: str
    radius: float
    thickness: float
    layout: str
    spacing: float | None
    length: float | None
    allowed: float  # probability
    tolerance: Tolerance
    tool: SurveyTool
    serial: str
    head_std: float
    inclination: float
    azimuth: float
    assumed: Assumptions
    heads: Path
    stations: Path
    project: str = ""
    client: str = ""
    calibration: str = ""  # certificate of the instrument
    north: str = "site"  # that designs, positions and every answer count from
    stations_north: str = "site"
    stations_turn: float = 0.0  # rad, azimuth of the north that stations count from, from ``north``
    depths_read_from: str = DEPTHS_FROM[0]  # of stations and drilled depths
    depth_reference: str = DEPTHS_FROM[0]  # of all answers: the heads' own
    reference_height: float | None = None  # m, of the former above the latter
    height_datum: str = ""
    grid: SiteGrid | None = None  # site coordinates of positions from the wall's zero
    course: PlanSettings | None = None  # of columns that state no axis of their own
    courses: tuple[Path, ...] = ()  # files of plans
    stated: dict[str, Any] = field(default_factory=dict)  # figures of the site

    def digests(self) -> list[tuple[str, str]]:
        """Name and SHA-256 of each file as it is now."""
        inputs = (self.path, self.heads, self.stations, *self.courses)
        return [(path.name, hashlib.sha256(path.read_bytes()).hexdigest()) for path in inputs]

    @property
    def defaults(self) -> Defaults:
        """Values for columns that state none of their own."""
        return Defaults(
            self.radius, self.length, self.inclination, self.azimuth, self.tolerance, self.tool, self.serial,
            self.head_std, self.path.parent, self.calibration,
            (self.depths_read_from, self.depth_reference, self.reference_height), self.course,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Wall:
    """A wall as surveyed: its columns in planes, pairs of neighbours and the ways by remedial columns."""

    file: WallFile
    plans: list[ColumnPlan]
    built: BuiltWall
    pairs: npt.NDArray[np.intp]
    detours: list[Detour]
    holes: list[ColumnSurvey]
    drilled_on: list[date | None]  # of every column
    warnings: tuple[EntryWarning, ...] = ()

    @property
    def columns(self) -> Columns:
        """The columns in planes across them."""
        return self.built.columns

    @property
    def stages(self) -> list[ClosingDay]:
        """Closing of the wall day by day; empty where no day of drilling is stated."""
        return closing_by_day(self.columns, self.pairs, self.file.thickness, self.drilled_on, self.detours, self.asked)

    @property
    def tight_depths(self) -> Array:
        """First and last depth (joints, 2) at which each joint is to be tight, m."""
        return tight_depths([plan.design for plan in self.plans], self.built.frame, self.pairs, self.file.assumed.tight)

    @property
    def asked(self) -> npt.NDArray[np.bool_]:
        """Whether each joint is to be tight at each depth (joints, depths)."""
        return asked_depths(self.columns.depths, self.tight_depths)

    @property
    def grid_spacing(self) -> float | None:
        """Spacing (m) of a grid, whose plane must be covered; None for a wall or a shaft."""
        return self.file.spacing if self.file.layout == "grid" else None


def read_wall_file(path: Path) -> WallFile:
    """Requirements of a TOML file.

    Raises
    ------
    SurveyError, ToolError
        One line: file, key, what was expected and what came.
    """
    try:
        data = parse_toml_tables(bounded_text(path))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise SurveyError(f"{path}: {reason}; expected a wall file") from error
    except tomllib.TOMLDecodeError as error:
        raise SurveyError(f"{path}: not TOML: {error}") from error
    layers = data.pop("layer", [])
    known = (*TEXTS, *POSITIVE, *NOT_NEGATIVE, *SIGNED)
    for key in data:
        if key not in known:
            raise SurveyError(f"{path}: {key}: unknown key; expected one of {', '.join(known)} or tables [[layer]]")
    for key in NEEDED:
        if key not in data:
            raise SurveyError(f"{path}: {key} is missing")
    values: dict[str, Any] = {key: _value(path, key, value) for key, value in data.items()}
    layout = _one_of(path, values, "layout", LAYOUTS, "line")
    if layout == "grid" and "spacing_m" not in values:
        raise SurveyError(f"{path}: spacing_m is missing; a grid needs it to know who is whose neighbour")
    method = Method(_one_of(path, values, "method", tuple(m.value for m in Method), Method.MINIMUM_CURVATURE.value))
    try:
        largest_distance(values["radius_m"], values["thickness_m"])
        allowed = parse_tolerance(values.get("tolerance", "en-12716"))
        tight = TightRange(values.get("tight_from_m"), values.get("tight_to_m"))
    except SurveyError as error:
        raise SurveyError(f"{path}: {error}") from None
    north, stations_north = norths_of(path, values)
    assumed = Assumptions(
        method,
        place_of(path, values),
        north,
        values.get("unsurveyed_percent", 1.0) / 100.0,
        values.get("depth_step_m", 0.5),
        layers_of(path, layers, values.get("radius_cv", 0.0)),
        values.get("radius_correlation", 1.0),
        tight,
    )
    read_from = _one_of(path, values, "depth_reference", DEPTHS_FROM, DEPTHS_FROM[0])
    return WallFile(
        path,
        values.get("name", path.stem),
        values["radius_m"],
        values["thickness_m"],
        layout,
        values.get("spacing_m"),
        values.get("length_m"),
        values.get("allowed_probability", 0.01),
        allowed,
        load_tool(instrument_path(path, values.get("instrument", "relay"))),
        values.get("serial", ""),
        values.get("head_sigma_m", 0.0),
        math.radians(values.get("inclination_deg", 0.0)),
        math.radians(values.get("azimuth_deg", 0.0)),
        assumed,
        path.parent / values["heads"],
        path.parent / values["stations"],
        values.get("project", ""),
        values.get("client", ""),
        values.get("calibration", ""),
        str(values.get("north", "site")),
        str(values.get("stations_north", values.get("north", "site"))),
        stations_north - north,
        read_from,
        _one_of(path, values, "answer_depth_reference", DEPTHS_FROM, read_from),
        values.get(REFERENCE_HEIGHT),
        values.get("height_datum", ""),
        grid_of(path, values, north),
        _course(path, values),
        (path.parent / values["plan"],) if "plan" in values else (),
        {key: values[key] for key in ("gravity_mps2", "field_nt", "declination_deg", *PLACE) if key in values},
    )


def _course(path: Path, values: dict[str, Any]) -> PlanSettings | None:
    """Plan of the columns, beside which nothing else says where their axes lead."""
    if "plan" not in values:
        return None
    straight = [key for key in STRAIGHT if key in values]
    if straight:
        raise SurveyError(
            f"{path}: {straight[0]}: expected none beside a plan, which says it, got {values[straight[0]]:g}"
        )
    return read_course(path.parent / values["plan"])


def instrument_path(path: Path, instrument: str) -> str:
    """An instrument by its name, or the file of that name beside ``path``."""
    return str(path.parent / instrument) if instrument.endswith((".toml", ".json")) else instrument


def _one_of(path: Path, values: dict[str, Any], key: str, names: tuple[str, ...], default: str) -> str:
    name = str(values.get(key, default))
    if name not in names:
        raise SurveyError(f"{path}: {key}: expected one of {', '.join(names)}, got {name!r}")
    return name


def _value(path: Path, key: str, value: Any) -> Any:
    if key in TEXTS:
        if not isinstance(value, str):
            raise SurveyError(f"{path}: {key}: expected a text, got {value!r:.60}")
        return value
    usable = not isinstance(value, bool) and isinstance(value, int | float) and math.isfinite(value)
    signed = key in SIGNED
    if not usable or (value < 0.0 and not signed) or (key in POSITIVE and value == 0.0):
        sign = "positive" if key in POSITIVE else "finite" if signed else "non-negative"
        raise SurveyError(f"{path}: {key}: expected a {sign} number, got {value!r:.60}")
    if abs(value) > MOST.get(key, math.inf):
        raise SurveyError(f"{path}: {key}: expected at most {MOST[key]:g}, got {value!r:.60}")
    return float(value)


def read_wall(path: Path) -> Wall:
    """The whole wall; errors as ``read_wall_file``, of its CSV files with their line."""
    file = read_wall_file(path)
    rows = read_heads(file.heads, file.defaults, file.north)
    if not rows:
        raise SurveyError(f"{file.heads}: expected at least two columns next to each other, got none")
    courses = dict.fromkeys([*file.courses, *(row.course for row in rows if row.course is not None)])
    file = replace(file, courses=tuple(courses))
    names = [row.name for row in rows]
    designed, heights = [row.plan_without_length for row in rows], [row.depths.height for row in rows]
    surveys = read_holes(file.stations, designed, heights, file.stations_north)
    holes = [hole.turned(file.stations_turn) for hole in surveys]
    length = file.length or max((float(hole.md[-1]) for hole in holes if len(hole.md)), default=0.0)
    if not length and any(row.length is None for row in rows):  # of a plan it is known
        raise SurveyError(
            f"{path}: length_m is missing; no column was surveyed, so nothing says how deep they are to go"
        )
    plans = [row.plan(length) for row in rows]
    check_magnetic_site(path, file.stated, {id(plan.tool): plan.tool for plan in plans}.values())
    try:
        built = build_wall(plans, holes, file.assumed)
    except SurveyError as error:
        raise SurveyError(f"{path}: {error}") from None
    remedies = [row.remedy for row in rows]
    pairs = find_pairs(file.heads, file.layout, file.spacing, built.columns, remedies)
    detours = find_detours(file.heads, names, remedies, pairs)
    designs = [plan.design for plan in plans]
    try:
        check_design(designs, built, pairs, {detour.joint for detour in detours}, file.thickness, file.assumed.tight)
    except SurveyError as error:
        raise SurveyError(f"{path}: {error}") from None
    days = [row.drilled_on for row in rows]
    return Wall(file, plans, built, pairs, detours, holes, days, wall_warnings(plans, holes, pairs))
