"""Errors of the columns of a wall: of their stations, by what they share; of their heads; of lengths not surveyed.

Frame: north, east, down of the site, and two axes in the planes across the columns; m and rad.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from groundstation.survey.tools.instruments import PropagationMode, SurveyTool
from groundstation.survey.wall.as_built import covariance_roots
from groundstation.survey.wall.column_plans import Assumptions, ColumnPlan
from groundstation.survey.wall.plane_errors import PlaneErrors
from groundstation.survey.well.error_columns import ErrorColumns, error_columns
from groundstation.survey.well.error_sources import Leg, WellSurvey
from groundstation.survey.well.reference_frames import turn_north

Array = npt.NDArray[np.float64]
AT_ONCE = 256  # columns that are computed together: thousands would need hundreds of megabytes


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


def shared_name(source: ErrorColumns, plan: ColumnPlan) -> str | None:
    """Name under which columns share a source; None where it is a column's own."""
    if source.mode is PropagationMode.GLOBAL:
        return source.name
    if source.mode in (PropagationMode.RANDOM, PropagationMode.SECTION) or not plan.serial:
        return None
    return f"{plan.serial}/{source.name}"


class ErrorBook:
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


def site_errors(plans: Sequence[ColumnPlan], depths: Array, surveyed: Array, wander: float) -> Array:
    """Setting out of the head, and the way an unsurveyed length may go (columns, depths, 2): m, either way alike."""
    below = np.maximum(depths - np.where(np.isfinite(surveyed), surveyed, np.inf)[:, None], 0.0)
    heads = np.array([plan.head_std for plan in plans])[:, None]
    return np.stack([np.broadcast_to(heads, below.shape), wander * below], axis=-1)


def plane_covariances(own: PlaneErrors, shared: PlaneErrors) -> Array:
    """Covariances (columns, depths, 2, 2) of own and shared errors together."""
    out = np.empty((*own.upper.shape, 2, 2))
    for k in range(0, len(out), AT_ONCE):
        some = range(k, min(k + AT_ONCE, len(out)))
        out[some] = sum(e @ np.swapaxes(e, -1, -2) for e in (own.at(some), shared.at(some)))
    return out
