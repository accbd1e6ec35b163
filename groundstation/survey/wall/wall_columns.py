"""From designs and surveys of columns to where they stand in planes across them, with what is not known of them.

Above its first survey a column hangs on its head as set out; below its last survey it is taken to go on as it leans
there, to bend as its plan does, and to wander from that by ``Assumptions.wander`` of the length; below its end it is
missing.
Frame: north, east, down of the site; m and rad.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.wall.as_built import TOE, Columns, intersect_planes, plane_frame
from groundstation.survey.wall.column_deviation import ColumnDesign
from groundstation.survey.wall.column_errors import (
    AT_ONCE,
    ErrorBook,
    plane_covariances,
    shared_name,
    site_errors,
    survey_errors,
    told_errors,
)
from groundstation.survey.wall.column_plans import Assumptions, ColumnPlan, ColumnStatus, ColumnSurvey, Layer
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.well.ellipsoid import check_covariance
from groundstation.survey.well.error_columns import ErrorColumns
from groundstation.survey.well.error_sources import WellSurvey
from groundstation.survey.well.methods import station_positions, station_tangents

Array = npt.NDArray[np.float64]
FLATTEST = 0.17  # cosine (80 deg) between a hole and the planes' normal, below which it is not cut by them
SAME_END = 1e-6  # m
MOST_PLANES = 100_000


@dataclass(frozen=True, slots=True)
class Way:
    """One column in the frame of the planes: stations (n, 3), with the end appended where it is not surveyed."""

    md: Array
    inclination: Array
    azimuth: Array
    surveyed_md: float
    end_md: float
    record: dict[str, Array]
    covs: Array | None


@dataclass(frozen=True, slots=True)
class BuiltWall:
    """Columns in planes, and of each where it ends: site frame, nan where there is none."""

    columns: Columns
    frame: Array  # (3, 3) rows: axes of the planes and their normal
    surveyed: Array  # (columns,) m, measured depth of the last survey; nan without one
    ends: Array  # (columns,) m, measured depth of the end; nan where not drilled
    toes: Array  # (columns, 3) of the last survey against the head
    toe_covs: Array  # (columns, 3, 3)


def build_wall(
    plans: Sequence[ColumnPlan], holes: Sequence[ColumnSurvey], assumed: Assumptions, whole: BuiltWall | None = None
) -> BuiltWall:
    """Cut all columns by common planes.

    Parameters
    ----------
    whole : of which they are a part, whose planes are used; their own if not given

    Raises
    ------
    SurveyError, ToolError
        Names the column whose survey contradicts what is said of it, or that the planes do not cut.
    """
    frame = plane_frame([plan.design for plan in plans]) if whole is None else whole.frame
    ways = [_way(plan, hole) for plan, hole in zip(plans, holes, strict=True)]
    depths = _depths(plans, frame, assumed) if whole is None else whole.columns.depths
    count = len(plans)
    centres = np.full((count, len(depths), 2), np.nan)
    ends, surveyed = np.full((2, count), -np.inf)
    book = ErrorBook(count, len(depths))
    toes, toe_covs = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan)
    for members in _alike(plans, ways):
        some = [(plans[k], way) for k in members if (way := ways[k]) is not None]
        places, along, errors = _survey(some, assumed)
        _check_covariances(some, errors)
        heads = np.array([plan.design.head for plan, _ in some])
        turned, tangent = (heads[:, None] + places) @ frame.T, along @ frame.T
        _check_cut(some, tangent)
        for w, (k, (_, way)) in enumerate(zip(members, some, strict=True)):
            last = _last_survey(way)
            surveyed[k], ends[k] = turned[w, last, 2], turned[w, -1, 2]
            toes[k] = places[w, last]
            toe_covs[k] = sum(c.effects[w, last] @ c.effects[w, last].T for c in errors)
        found = intersect_planes(turned, tangent, depths)
        centres[members] = found.centres
        book.cut(members, found.upper, found.share)
        for source in errors:
            plane = found.in_plane(np.einsum("ij,wnjm->wnim", frame, source.effects))
            for w, k in enumerate(members):
                book.add(k, shared_name(source, plans[k]), plane[w])
        book.close()
    centres, states = _states(plans, frame, depths, centres, surveyed, ends)
    planned = np.stack([_design_centres(plan.design, frame, depths) for plan in plans])
    heads_in_plane = np.array([frame[:2] @ plan.design.head for plan in plans])
    radii, stds, layer = _radii(plans, depths, assumed.layers)
    own, shared = book.errors(site_errors(plans, depths, surveyed, assumed.wander))
    columns = Columns(
        [plan.design.name for plan in plans], depths, centres, plane_covariances(own, shared), heads_in_plane, planned,
        states, own, shared, radii, stds, assumed.radius_correlation, layer,
    )  # fmt: skip
    surveyed_md = np.array([way.surveyed_md if way else np.nan for way in ways])
    end_md = np.array([way.end_md if way else np.nan for way in ways])
    return BuiltWall(columns, frame, surveyed_md, end_md, toes, toe_covs)


def state_words(plan: ColumnPlan, built: BuiltWall, k: int) -> str:
    """State of column ``k``: planned, not drilled, no record, drilled, surveyed; and to which depth."""
    end, surveyed = float(built.ends[k]), float(built.surveyed[k])
    if not math.isfinite(end):
        return plan.status.value.replace("-", " ") or "no record"
    if not surveyed > 0.0:
        return f"drilled to {end:g} m, not surveyed"
    drilled = "" if end <= surveyed + 1e-6 else f", drilled to {end:g} m"
    return f"surveyed to {surveyed:g} m{drilled}"


def _way(plan: ColumnPlan, hole: ColumnSurvey) -> Way | None:
    """Stations to the end of the column; None for one that is not there."""
    name, n = plan.design.name, len(hole.md)
    if plan.status in (ColumnStatus.PLANNED, ColumnStatus.NOT_DRILLED):
        if n or plan.drilled is not None:
            raise SurveyError(f"column {name}: stated as {plan.status.value}, yet it has a survey or a drilled depth")
        return None
    end = plan.drilled
    if end is None and plan.status is ColumnStatus.DRILLED:
        end = max(plan.design.length, float(hole.md[-1]) if n else 0.0)
    if end is None and not n:
        return None
    if not n:  # drilled and not surveyed: the design is all there is to go by
        design = plan.design
        hole = ColumnSurvey(np.zeros(1), np.array([design.inclination]), np.array([design.azimuth]))
    last = float(hole.md[-1])
    end = last if end is None else end
    if end < last - SAME_END:
        raise SurveyError(f"column {name}: stated as drilled to {end:g} m, yet surveyed at {last:g} m")
    if end <= last + SAME_END:
        return Way(hole.md, hole.inclination, hole.azimuth, last, last, hole.record, hole.covs)
    added = _unsurveyed(plan.design, hole, end)
    more = len(added[0])
    surveyed = (hole.md, hole.inclination, hole.azimuth)
    md, inclination, azimuth = (np.append(known, further) for known, further in zip(surveyed, added, strict=True))
    record = {name: np.append(values, values[-1:].repeat(more)) for name, values in hole.record.items()}
    covs = None if hole.covs is None else np.concatenate([hole.covs, hole.covs[-1:].repeat(more, axis=0)])
    return Way(md, inclination, azimuth, last, end, record, covs)


def _unsurveyed(design: ColumnDesign, hole: ColumnSurvey, end: float) -> tuple[Array, Array, Array]:
    """Depths, inclinations and azimuths to the end (m) of a hole that goes on as it leans, bending as its plan does."""
    last = float(hole.md[-1])
    if design.plan is None:
        return np.array([end]), hole.inclination[-1:], hole.azimuth[-1:]
    between = design.plan.md[(design.plan.md > last + SAME_END) & (design.plan.md < end - SAME_END)]
    md = np.append(between, end)
    planned = design.plan.points_at(np.concatenate([[last], md])).tangents
    tangents = station_tangents(hole.inclination[-1:], hole.azimuth[-1:]) + planned[1:] - planned[0]
    level = np.hypot(tangents[:, 0], tangents[:, 1])
    return md, np.arctan2(level, tangents[:, 2]), np.arctan2(tangents[:, 1], tangents[:, 0])


def _last_survey(way: Way) -> int:
    return int(np.flatnonzero(way.md <= way.surveyed_md + SAME_END)[-1])


def _depths(plans: Sequence[ColumnPlan], frame: Array, assumed: Assumptions) -> Array:
    """Planes from the first head to the last toe or over what is stated to be tight.

    They lie a step apart at the most, and where a layer begins: one that is thinner than a step has a plane too.
    """
    heads = np.array([plan.design.head for plan in plans])
    toes = np.array([plan.design.end.point for plan in plans])
    top, bottom = float(np.min(heads @ frame[2])), float(np.max(toes @ frame[2]))
    stated = assumed.tight
    top, bottom = top if stated.top is None else stated.top, bottom if stated.bottom is None else stated.bottom
    if bottom - top > MOST_PLANES * assumed.step:
        raise SurveyError(
            f"depth_step_m: expected at most {MOST_PLANES} planes across the columns, got them {assumed.step:g} m "
            f"apart from {top:g} to {bottom:g} m"
        )
    planes = np.append(np.arange(top, bottom - 1e-3, assumed.step), bottom)
    layers = np.array([layer.top for layer in assumed.layers if top < layer.top < bottom])
    beside = np.abs(planes[:, None] - layers).min(axis=1, initial=np.inf) < SAME_END
    return np.sort(np.concatenate([planes[~beside], layers]))


def _alike(plans: Sequence[ColumnPlan], ways: Sequence[Way | None]) -> list[list[int]]:
    """Columns with as many stations of one tool and one record, for one computation each; not too many at once."""
    groups: dict[tuple[int, int, tuple[str, ...], bool], list[int]] = {}
    for k, (plan, way) in enumerate(zip(plans, ways, strict=True)):
        if way is not None:
            key = (len(way.md), id(plan.tool), tuple(sorted(way.record)), way.covs is None)
            groups.setdefault(key, []).append(k)
    return [some[k : k + AT_ONCE] for some in groups.values() for k in range(0, len(some), AT_ONCE)]


def _survey(some: list[tuple[ColumnPlan, Way]], assumed: Assumptions) -> tuple[Array, Array, list[ErrorColumns]]:
    """Positions against the head (w, n, 3), tangents and errors of columns with as many stations."""
    ways = [way for _, way in some]
    md, inclination, azimuth = (
        np.stack([getattr(way, name) for way in ways]) for name in ("md", "inclination", "azimuth")
    )
    places = station_positions(assumed.method, md, inclination, azimuth)
    told = [way.covs for way in ways if way.covs is not None]
    if told:
        return places, station_tangents(inclination, azimuth), [told_errors(np.stack(told))]
    record = {name: np.stack([way.record[name] for way in ways]) for name in ways[0].record}
    tool = some[0][0].tool
    errors = survey_errors(WellSurvey(md, inclination, azimuth, places[..., 2], record), tool, assumed)
    return places, station_tangents(inclination, azimuth), errors


def _states(
    plans: Sequence[ColumnPlan], frame: Array, depths: Array, centres: Array, surveyed: Array, ends: Array
) -> tuple[Array, npt.NDArray[np.int8]]:
    """Centres without those that are missing, and the state of every column at every depth."""
    heads = np.array([plan.design.head for plan in plans])
    toes = np.array([plan.design.end.point for plan in plans])
    top, bottom = (heads @ frame[2])[:, None], (toes @ frame[2])[:, None]
    states = np.full(centres.shape[:2], ColumnState.MISSING, np.int8)
    states[depths <= ends[:, None] + TOE] = ColumnState.UNSURVEYED
    states[depths <= surveyed[:, None] + TOE] = ColumnState.SURVEYED
    states[np.isnan(centres[..., 0])] = ColumnState.MISSING
    outside = (depths < top - 1e-6) | (depths > bottom + 1e-6)
    states[outside] = ColumnState.OUTSIDE
    return np.where((states == ColumnState.MISSING)[..., None], np.nan, centres), states


def _design_centres(design: ColumnDesign, frame: Array, depths: Array) -> Array:
    """Points (depths, 2) at which a design axis crosses the planes."""
    head, axis = frame @ np.array(design.head), frame @ design.axis
    flattest = float(axis[2]) if design.plan is None else float(np.min(design.plan.tangents @ frame[2]))
    if flattest < FLATTEST:
        raise SurveyError(
            f"column {design.name}: its design is more than 80 deg from the mean of all; "
            "give such columns a wall of their own"
        )
    if design.plan is None:
        return np.asarray(head[:2] + (depths - head[2])[:, None] / axis[2] * axis[:2])
    crossed = design.plan.cross_planes(frame[2], depths - head[2])
    return np.asarray(head[:2] + crossed.points @ frame[:2].T)


def _radii(
    plans: Sequence[ColumnPlan], depths: Array, layers: tuple[Layer, ...]
) -> tuple[Array, Array, npt.NDArray[np.intp]]:
    """Radii and their standard deviations (columns, depths), and the layer of every depth; each layer has depths."""
    tops = np.array([layer.top for layer in layers])
    index = np.maximum(np.searchsorted(tops, depths, side="right") - 1, 0)
    designed = np.array([plan.design.radius for plan in plans])
    radii = np.stack([[layers[i].radius or r for i in index] for r in designed])
    _, layer = np.unique(index, return_inverse=True)  # one above the first plane is none
    return radii, radii * np.array([layers[i].radius_cv for i in index]), np.asarray(layer, np.intp)


def _check_covariances(some: list[tuple[ColumnPlan, Way]], errors: list[ErrorColumns]) -> None:
    cov = sum(c.effects[..., :2, :] @ np.swapaxes(c.effects[..., :2, :], -1, -2) for c in errors)
    assert isinstance(cov, np.ndarray)
    smallest = np.linalg.eigvalsh(cov[:, 1:])[..., 0]
    for well, station in np.argwhere(~(smallest > 0.0))[:1]:
        where = f"column {some[well][0].design.name}, station {station + 1}, north and east"
        check_covariance(cov[well, station + 1], where)


def _check_cut(some: list[tuple[ColumnPlan, Way]], tangent: Array) -> None:
    flat = np.argwhere(tangent[..., 2] < FLATTEST)
    if len(flat):
        well, station = flat[0]
        plan, way = some[well]
        raise SurveyError(
            f"column {plan.design.name}: at {way.md[station]:g} m the hole runs more than 80 deg off the mean design "
            f"axis, inclination {math.degrees(way.inclination[station]):g} deg, azimuth "
            f"{math.degrees(way.azimuth[station]):g} deg; expected a hole along its design"
        )
