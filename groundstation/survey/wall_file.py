"""A wall as files: what is required of it (TOML), where its columns stand and how they were surveyed (CSV)."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.columns import Design, Tolerance, tolerance
from groundstation.survey.ellipsoid import check_covariance
from groundstation.survey.error_model import propagate
from groundstation.survey.error_sources import Leg, Site, Survey
from groundstation.survey.instruments import Tool, load_tool
from groundstation.survey.methods import Method, positions, tangents
from groundstation.survey.records import read_columns
from groundstation.survey.wall import Columns, at_depths, largest_distance, neighbours_in_grid, neighbours_in_line

Array = npt.NDArray[np.float64]
LAYOUTS = ("line", "shaft", "grid")
NEEDED = ("radius_m", "thickness_m", "heads", "stations")
KNOWN = {
    "name": str, "radius_m": float, "thickness_m": float, "heads": str, "stations": str, "layout": str,
    "spacing_m": float, "length_m": float, "tolerance": str, "instrument": str, "method": str, "depth_step_m": float,
    "gravity_mps2": float,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class WallFile:
    """Requirements of a wall; m."""

    path: Path
    name: str
    radius: float
    thickness: float
    layout: str
    spacing: float | None
    length: float | None
    tolerance: Tolerance
    tool: Tool
    method: Method
    depth_step: float
    gravity: float
    heads: Path
    stations: Path

    def design(self, name: str, head: tuple[float, float], depth: float) -> Design:
        """Design axis of one column: vertical from its head."""
        return Design(name, (*head, 0.0), length=self.length or depth, radius=self.radius, tolerance=self.tolerance)


@dataclass(frozen=True, slots=True)
class Wall:
    """A wall as surveyed: columns at common depths, pairs of neighbours, and the toes."""

    file: WallFile
    columns: Columns
    pairs: npt.NDArray[np.intp]
    toes: Array  # (columns, 3) against the head, m
    toe_covs: Array  # (columns, 3, 3)
    toe_mds: Array  # (columns,)


def read_wall_file(path: Path) -> WallFile:
    """Requirements of a TOML file.

    Raises
    ------
    SurveyError, ToolError
        One line: file, key, what was expected and what came.
    """
    try:
        data = tomllib.loads(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise SurveyError(f"{path}: {reason}; expected a wall file") from error
    except tomllib.TOMLDecodeError as error:
        raise SurveyError(f"{path}: not TOML: {error}") from error
    for key in data:
        if key not in KNOWN:
            raise SurveyError(f"{path}: {key}: unknown key; expected one of {', '.join(KNOWN)}")
    for key in NEEDED:
        if key not in data:
            raise SurveyError(f"{path}: {key} is missing")
    values: dict[str, Any] = {key: _value(path, key, value) for key, value in data.items()}
    layout = values.get("layout", "line")
    if layout not in LAYOUTS:
        raise SurveyError(f"{path}: layout: expected one of {', '.join(LAYOUTS)}, got {layout!r}")
    if layout == "grid" and "spacing_m" not in values:
        raise SurveyError(f"{path}: spacing_m is missing; a grid needs it to know who is whose neighbour")
    method = values.get("method", Method.BALANCED_TANGENTIAL.value)
    if method not in [m.value for m in Method]:
        raise SurveyError(f"{path}: method: expected one of {', '.join(m.value for m in Method)}, got {method!r}")
    try:
        largest_distance(values["radius_m"], values["thickness_m"])
        allowed = tolerance(values.get("tolerance", "en-12716"))
    except SurveyError as error:
        raise SurveyError(f"{path}: {error}") from None
    return WallFile(
        path,
        values.get("name", path.stem),
        values["radius_m"],
        values["thickness_m"],
        layout,
        values.get("spacing_m"),
        values.get("length_m"),
        allowed,
        load_tool(values.get("instrument", "relay")),
        Method(method),
        values.get("depth_step_m", 0.5),
        values.get("gravity_mps2", 9.81),
        path.parent / values["heads"],
        path.parent / values["stations"],
    )


def _value(path: Path, key: str, value: Any) -> Any:
    if KNOWN[key] is str:
        if not isinstance(value, str):
            raise SurveyError(f"{path}: {key}: expected a text, got {value!r:.60}")
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value <= 0.0:
        raise SurveyError(f"{path}: {key}: expected a positive number, got {value!r:.60}")
    return float(value)


def read_wall(path: Path) -> Wall:
    """The whole wall; errors as ``read_wall_file``, of its CSV files with their line."""
    file = read_wall_file(path)
    names, heads = _heads(file.heads)
    groups = _stations(file.stations, names)
    shape = (len(names), 3)
    toes, toe_covs, toe_mds = np.zeros(shape), np.zeros((*shape, 3)), np.zeros(len(names))
    placed = [(m, md, inc, azi, positions(file.method, md, inc, azi)) for m, md, inc, azi in groups]
    deepest = max(float(np.max(places[:, -1, 2])) for *_, places in placed)
    depths = np.append(np.arange(0.0, deepest - 1e-3, file.depth_step), deepest)
    centres = np.full((len(names), len(depths), 2), np.nan)
    covs = np.full((len(names), len(depths), 2, 2), np.nan)
    site = Site(gravity=file.gravity)
    for members, md, inclination, azimuth, places in placed:
        survey = Survey(md, inclination, azimuth, places[..., 2])
        cov = propagate(survey, [Leg(file.tool)], site, slot_allowance=file.tool.slot_allowance).cov
        _check_covariances(file.stations, names, members, cov)
        centre, plane = at_depths(places, tangents(inclination, azimuth), cov, depths)
        centres[members], covs[members] = centre + heads[members, None, :], plane
        toes[members], toe_covs[members], toe_mds[members] = places[:, -1], cov[:, -1], md[:, -1]
    pairs = (
        neighbours_in_grid(heads, file.spacing or 0.0)
        if file.layout == "grid"
        else neighbours_in_line(len(names), closed=file.layout == "shaft")
    )
    if not len(pairs):
        raise SurveyError(f"{file.heads}: expected at least two columns next to each other, got {len(names)}")
    return Wall(file, Columns(names, depths, centres, covs, heads), pairs, toes, toe_covs, toe_mds)


def _heads(path: Path) -> tuple[list[str], Array]:
    table, lines = read_columns(path, ("column", "north_m", "east_m"), texts=("column",))
    names = [str(name) for name in table["column"]]
    seen: dict[str, int] = {}
    for line, name in zip(lines, names, strict=True):
        if not name:
            raise SurveyError(f"{path}: line {line}: expected the name of a column")
        if name in seen:
            raise SurveyError(f"{path}: line {line}: column {name} stands in line {seen[name]} already")
        seen[name] = line
    heads = np.stack([table["north_m"], table["east_m"]], axis=1)
    wrong = np.flatnonzero(~np.isfinite(heads).all(axis=1))
    if len(wrong):
        raise SurveyError(f"{path}: line {lines[wrong[0]]}: expected finite north_m and east_m")
    return names, heads


Group = tuple[npt.NDArray[np.intp], Array, Array, Array]


def _stations(path: Path, names: list[str]) -> list[Group]:
    """Columns with as many stations each as one group: their indices, md, inclination and azimuth (w, n)."""
    needed = ("column", "md_m", "inclination_deg", "azimuth_deg")
    table, lines = read_columns(path, needed, texts=("column",))
    if not lines:
        raise SurveyError(f"{path}: expected stations, the file has none")
    index = {name: k for k, name in enumerate(names)}
    owner = np.array([index.get(str(name), -1) for name in table["column"]])
    unknown = np.flatnonzero(owner < 0)
    if len(unknown):
        k = int(unknown[0])
        raise SurveyError(f"{path}: line {lines[k]}: column {table['column'][k]} is not among the heads")
    order = np.argsort(owner, kind="stable")
    owner, md, inc, azi = owner[order], *(table[name][order] for name in needed[1:])
    line = np.array(lines)[order]
    _check_values(path, line, md, inc, azi)
    counts = np.bincount(owner, minlength=len(names))
    short = np.flatnonzero(counts < 2)
    if len(short):
        raise SurveyError(f"{path}: column {names[short[0]]}: expected at least two stations, got {counts[short[0]]}")
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    same = np.ones(len(md), bool)
    same[starts] = False
    back = np.flatnonzero(same[1:] & ~(np.diff(md) > 0.0)) + 1
    if len(back):
        k = int(back[0])
        raise SurveyError(
            f"{path}: line {line[k]}: column {names[owner[k]]}: "
            f"expected a depth beyond {md[k - 1]:g} m, got {md[k]:g} m"
        )
    off = np.flatnonzero(md[starts] != 0.0)
    if len(off):
        k = int(starts[off[0]])
        raise SurveyError(
            f"{path}: line {line[k]}: column {names[off[0]]}: expected the head at 0 m first, got {md[k]:g}"
        )
    groups = []
    for count in np.unique(counts):
        members = np.flatnonzero(counts == count)
        rows = starts[members][:, None] + np.arange(count)
        groups.append((members, md[rows], np.radians(inc[rows]), np.radians(azi[rows])))
    return groups


def _check_values(path: Path, line: Array, md: Array, inclination_deg: Array, azimuth_deg: Array) -> None:
    for name, values, good in (
        ("a finite md_m", md, np.isfinite(md)),
        ("an inclination below 90 deg", inclination_deg, (inclination_deg >= 0.0) & (inclination_deg < 90.0)),
        ("a finite azimuth_deg", azimuth_deg, np.isfinite(azimuth_deg)),
    ):
        wrong = np.flatnonzero(~good)
        if len(wrong):
            raise SurveyError(f"{path}: line {line[wrong[0]]}: expected {name}, got {values[wrong[0]]:g}")


def _check_covariances(path: Path, names: list[str], members: npt.NDArray[np.intp], cov: Array) -> None:
    smallest = np.linalg.eigvalsh(cov[:, 1:, :2, :2])[..., 0]
    for well, station in np.argwhere(~(smallest > 0.0))[:1]:
        where = f"{path}: column {names[members[well]]}, station {station + 1}, north and east"
        check_covariance(cov[well, station + 1, :2, :2], where)
