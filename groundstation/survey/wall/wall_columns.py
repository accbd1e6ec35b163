"""From designs and surveys of columns to where they stand in planes across them, with what is not known of them.

Above its first survey a column hangs on its head as set out; below its last survey it is taken to go on as it leans
there, and to wander from that by ``Assumptions.wander`` of the length; below its end it is missing.
Frame: north, east, down of the site; m and rad.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.tools.instruments import PropagationMode, SurveyTool
from groundstation.survey.wall.as_built import TOE, Columns, covariance_roots, intersect_planes, plane_frame
from groundstation.survey.wall.column_deviation import ColumnDesign
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.plane_errors import PlaneErrors
from groundstation.survey.wall.tight_depths import TightRange
from groundstation.survey.well.ellipsoid import check_covariance
from groundstation.survey.well.error_columns import ErrorColumns, error_columns
from groundstation.survey.well.error_sources import Leg, Site, WellSurvey
from groundstation.survey.well.methods import Method, station_positions, station_tangents
from groundstation.survey.well.reference_frames import turn_north

Array = npt.NDArray[np.float64]
FLATTEST = 0.17  # cosine (80 deg) between a hole and the planes' normal, below which it is not cut by them
SAME_END = 1e-6  # m
AT_ONCE = 256  # columns that are computed together: thousands would need hundreds of megabytes


class ColumnStatus(Enum):
    """Status of a column on the site."""

    UNSTATED = ""  # as far as it was surveyed
    PLANNED = "planned"  # to be drilled
    DRILLED = "drilled"  # to its design length, or to the depth stated
    NOT_DRILLED = "not-drilled"  # given up


@dataclass(frozen=True, slots=True)
class ColumnPlan:
    """Plan of one column: its design, the tool that surveyed it, the depth drilled."""

    design: ColumnDesign
    tool: SurveyTool
    serial: str = ""  # of the instrument; columns of one instrument share its systematic errors
    status: ColumnStatus = ColumnStatus.UNSTATED
    drilled: float | None = None  # m, measured depth of its end
    head_std: float = 0.0  # m, north and east, of setting out
    calibration: str = ""  # certificate of the instrument


@dataclass(frozen=True, slots=True)
class ColumnSurvey:
    """Stations (n,) of one column from its head on; none where it was not surveyed.

    Azimuths count from the wall's north. ``record`` holds what else an instrument knows of every station, by the name
    of its variable: the sigma of its yaw, of its forces. ``covs`` (n, 3, 3), m^2, is how well each station is known
    against the head, where that was told with the survey: then no model of an instrument is asked.
    """

    md: Array
    inclination: Array
    azimuth: Array
    record: dict[str, Array] = field(default_factory=dict)
    covs: Array | None = None

    def turned(self, angle: float) -> ColumnSurvey:
        """Return the survey counted from another north, from which its own has the azimuth ``angle`` (rad)."""
        turn = turn_north(-angle)
        covs = None if self.covs is None else turn @ self.covs @ turn.T
        return replace(self, azimuth=self.azimuth + angle, covs=covs)


@dataclass(frozen=True, slots=True)
class Layer:
    """Radius of finished columns from a depth on."""

    top: float
    radius: float | None  # m; None: that of the design
    radius_cv: float  # standard deviation over radius


@dataclass(frozen=True, slots=True)
class Assumptions:
    """Assumptions for the whole wall."""

    method: Method = Method.MINIMUM_CURVATURE
    site: Site = field(default_factory=Site)
    north: float = 0.0  # rad, azimuth from true north of the north that designs and stations count from
    wander: float = 0.01  # m/m, one standard deviation of where an unsurveyed length goes
    step: float = 0.5  # m between planes
    layers: tuple[Layer, ...] = (Layer(-math.inf, None, 0.0),)
    radius_correlation: float = 1.0  # of two columns in one layer
    tight: TightRange = field(default_factory=TightRange)  # the planes lie in it


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
    book = _Book(count, len(depths))
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
                book.add(k, _key(source, plans[k]), plane[w])
        book.close()
    centres, states = _states(plans, frame, depths, centres, surveyed, ends)
    planned = np.stack([_design_centres(plan.design, frame, depths) for plan in plans])
    heads_in_plane = np.array([frame[:2] @ plan.design.head for plan in plans])
    radii, stds, layer = _radii(plans, depths, assumed.layers)
    own, shared = book.errors(_site_errors(plans, depths, surveyed, assumed.wander))
    columns = Columns(
        [plan.design.name for plan in plans], depths, centres, _covariances(own, shared), heads_in_plane, planned,
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
        hole = ColumnSurvey(np.zeros(1), np.array([plan.design.inclination]), np.array([plan.design.azimuth]))
    last = float(hole.md[-1])
    end = last if end is None else end
    if end < last - SAME_END:
        raise SurveyError(f"column {name}: stated as drilled to {end:g} m, yet surveyed at {last:g} m")
    if end <= last + SAME_END:
        return Way(hole.md, hole.inclination, hole.azimuth, last, last, hole.record, hole.covs)
    longer = [np.append(values, values[-1]) for values in (hole.md, hole.inclination, hole.azimuth)]
    longer[0][-1] = end
    record = {name: np.append(values, values[-1]) for name, values in hole.record.items()}
    covs = None if hole.covs is None else np.concatenate([hole.covs, hole.covs[-1:]])
    return Way(longer[0], longer[1], longer[2], last, end, record, covs)


def _last_survey(way: Way) -> int:
    return int(np.flatnonzero(way.md <= way.surveyed_md + SAME_END)[-1])


def _depths(plans: Sequence[ColumnPlan], frame: Array, assumed: Assumptions) -> Array:
    """Planes at most a step apart, from the first head to the last toe or over what is stated to be tight."""
    heads = np.array([plan.design.head for plan in plans])
    toes = heads + np.array([plan.design.length * plan.design.axis for plan in plans])
    top, bottom = float(np.min(heads @ frame[2])), float(np.max(toes @ frame[2]))
    stated = assumed.tight
    top, bottom = top if stated.top is None else stated.top, bottom if stated.bottom is None else stated.bottom
    return np.append(np.arange(top, bottom - 1e-3, assumed.step), bottom)


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


def told_errors(covs: Array) -> ErrorColumns:
    """Errors of stations whose covariances (w, n, 3, 3) are told: what a column is off, it is off all along."""
    return ErrorColumns("stations", PropagationMode.RANDOM, covariance_roots(covs))


def survey_errors(survey: WellSurvey, tool: SurveyTool, assumed: Assumptions) -> list[ErrorColumns]:
    """Errors of stations whose azimuths count from the wall's north, in its axes: models are evaluated from true north.

    Raises
    ------
    ToolError
        When a weight has no value at a station.
    """
    if assumed.north == 0.0:
        return error_columns(survey, (Leg(tool),), assumed.site)
    true = replace(survey, azimuth=survey.azimuth + assumed.north)
    turn = turn_north(assumed.north)
    return [
        replace(found, effects=np.einsum("ij,...jm->...im", turn, found.effects))
        for found in error_columns(true, (Leg(tool),), assumed.site)
    ]


def _key(source: ErrorColumns, plan: ColumnPlan) -> str | None:
    """Name under which columns share a source; None where it is a column's own."""
    if source.mode is PropagationMode.GLOBAL:
        return source.name
    if source.mode in (PropagationMode.RANDOM, PropagationMode.SECTION) or not plan.serial:
        return None
    return f"{plan.serial}/{source.name}"


class _Book:
    """Errors of all columns at their stations as they come: shared ones by name, own ones by column."""

    def __init__(self, count: int, depths: int) -> None:
        self._upper, self._share = np.zeros((count, depths), np.intp), np.zeros((count, depths))
        self._names: dict[str, int] = {}  # number of every shared error
        self._open: dict[int, tuple[list[Array], dict[int, Array]]] = {}  # own and shared ones, by column
        self._own = [np.zeros((1, 2, 0))] * count
        self._shared: list[tuple[list[int], Array]] = [([], np.zeros((1, 2, 0)))] * count  # and their numbers

    def cut(self, columns: list[int], upper: npt.NDArray[np.intp], share: Array) -> None:
        """Store the stations between which planes cut some columns."""
        self._upper[columns], self._share[columns] = upper, share

    def add(self, column: int, key: str | None, errors: Array) -> None:
        """Add errors (stations, 2, m) of one column, shared under ``key`` or its own (None)."""
        own, shared = self._open.setdefault(column, ([], {}))
        if key is None:
            own.append(errors)
            return
        number = self._names.setdefault(key, len(self._names))
        shared[number] = shared[number] + errors[..., 0] if number in shared else errors[..., 0]

    def close(self) -> None:
        """Finish the columns added so far: their own errors become as few numbers as have the same covariance."""
        for k, (own, shared) in self._open.items():
            stations = len(own[0] if own else next(iter(shared.values())))
            self._own[k] = reduce_error_columns(np.concatenate([np.zeros((stations, 2, 0)), *own], axis=-1))
            self._shared[k] = list(shared), np.moveaxis(np.array([*shared.values()]).reshape(-1, stations, 2), 0, -1)
        self._open = {}

    def errors(self, alike: Array) -> tuple[PlaneErrors, PlaneErrors]:
        """Own and shared errors; ``alike`` (columns, depths, e) are those of no station, which are a column's own."""
        shared = []
        while self._shared:  # each is let go of as it is written anew: together they are many
            numbers, effects = self._shared.pop()
            wide = np.zeros((len(effects), 2, len(self._names)))
            wide[..., numbers] = effects
            shared.append(wide)
        shared.reverse()
        return (
            PlaneErrors.of_stations(self._own, self._upper, self._share, alike),
            PlaneErrors.of_stations(shared, self._upper, self._share, alike[..., :0]),
        )


def reduce_error_columns(errors: Array) -> Array:
    """Errors (stations, 2, m) of one column by not more numbers than it has places that err.

    They are Gaussian and come to a plane by blending, so that all that counts is their covariance E E^T. With E^T = Q R
    that is R^T R, and R has a row a place at the most.
    """
    stations, directions, _ = errors.shape
    if errors.shape[-1] == 0:
        return errors
    triangle = np.asarray(np.linalg.qr(errors[1:].reshape((stations - 1) * directions, -1).T, mode="r"))
    first = np.zeros((1, directions, len(triangle)))  # the first station errs in nothing
    return np.concatenate([first, triangle.T.reshape(stations - 1, directions, -1)])


def _site_errors(plans: Sequence[ColumnPlan], depths: Array, surveyed: Array, wander: float) -> Array:
    """Setting out of the head, and the way an unsurveyed length may go (columns, depths, 2): m, either way alike."""
    below = np.maximum(depths - np.where(np.isfinite(surveyed), surveyed, np.inf)[:, None], 0.0)
    heads = np.array([plan.head_std for plan in plans])[:, None]
    return np.stack([np.broadcast_to(heads, below.shape), wander * below], axis=-1)


def _covariances(own: PlaneErrors, shared: PlaneErrors) -> Array:
    """Covariances (columns, depths, 2, 2) of own and shared errors together."""
    out = np.empty((*own.upper.shape, 2, 2))
    for k in range(0, len(out), AT_ONCE):
        some = range(k, min(k + AT_ONCE, len(out)))
        out[some] = sum(e @ np.swapaxes(e, -1, -2) for e in (own.at(some), shared.at(some)))
    return out


def _states(
    plans: Sequence[ColumnPlan], frame: Array, depths: Array, centres: Array, surveyed: Array, ends: Array
) -> tuple[Array, npt.NDArray[np.int8]]:
    """Centres without those that are missing, and the state of every column at every depth."""
    heads = np.array([plan.design.head for plan in plans])
    toes = heads + np.array([plan.design.length * plan.design.axis for plan in plans])
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
    if axis[2] < FLATTEST:
        raise SurveyError(
            f"column {design.name}: its design is more than 80 deg from the mean of all; "
            "give such columns a wall of their own"
        )
    return np.asarray(head[:2] + (depths - head[2])[:, None] / axis[2] * axis[:2])


def _radii(
    plans: Sequence[ColumnPlan], depths: Array, layers: tuple[Layer, ...]
) -> tuple[Array, Array, npt.NDArray[np.intp]]:
    """Radii and their standard deviations (columns, depths), and the layer of every depth."""
    tops = np.array([layer.top for layer in layers])
    index = np.maximum(np.searchsorted(tops, depths, side="right") - 1, 0)
    designed = np.array([plan.design.radius for plan in plans])
    radii = np.stack([[layers[i].radius or r for i in index] for r in designed])
    return radii, radii * np.array([layers[i].radius_cv for i in index]), np.asarray(index, np.intp)


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
