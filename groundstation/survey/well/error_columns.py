"""Errors of surveyed positions as columns: the change of every position for one standard deviation of one error.

The covariance of any two positions, of one hole or of two, is the product of what they have in common. Errors of the
same name are common to two holes where they are global, or where one and the same instrument surveyed both.
Frame: north, east, down; m. Source: as ``error_model``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.tools.instruments import PropagationMode
from groundstation.survey.well.error_propagation import Propagation
from groundstation.survey.well.error_sources import Leg, Site, SurveyGeometry, WellSurvey, sources_of

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ErrorColumns:
    """One source: ``effects`` (..., n, 3, m), m = 1 but for what errs anew at every station or in every section."""

    name: str
    mode: PropagationMode
    effects: Array


def error_columns(survey: WellSurvey, legs: tuple[Leg, ...], site: Site) -> list[ErrorColumns]:
    """Effects of all sources on the positions of a survey (..., n); the sum of their squares is its covariance.

    The first station errs in nothing: what ties it to the ground is the caller's.

    Raises
    ------
    ToolError
        When a weight has no value at a station.
    """
    geometry = SurveyGeometry(survey, slot_allowance=legs[0].tool.slot_allowance)
    work = Propagation(survey, legs, site, geometry)
    found = []
    for source in sources_of(legs):
        work.evaluate(source)
        if source.random:
            effects = _random(work, source.axes)
        else:
            effects = np.concatenate([_constant(sums) for sums in work.sums()], axis=-1)
        found.append(ErrorColumns(source.name, source.rows[0][2].mode, effects))
    return found


def _constant(sums: Array) -> Array:
    """(axes, ..., n - 1) as (..., n, 3, 1)."""
    out = np.zeros((*sums.shape[1:-1], sums.shape[-1] + 1, 3, 1))
    out[..., 1:, : len(sums), 0] = np.moveaxis(sums, 0, -1)
    return out


def _random(work: Propagation, axes: int) -> Array:
    """(..., n, 3, n - 1): the error of station j moves it by its half of one leg, all below by its halves of both."""
    inner, last = np.moveaxis(work.inner[:axes], 0, -1), np.moveaxis(work.last[:axes], 0, -1)  # (..., n - 1, axes)
    stations = inner.shape[-2]
    out = np.zeros((*inner.shape[:-2], stations + 1, 3, stations))
    for j in range(stations):
        out[..., j + 1, :axes, j] = last[..., j, :]
        out[..., j + 2 :, :axes, j] = inner[..., j, None, :]
    return out


def position_covariance(columns: list[ErrorColumns]) -> Array:
    """Covariance (..., n, 3, 3) of every position."""
    return np.asarray(sum(c.effects @ np.swapaxes(c.effects, -1, -2) for c in columns))
