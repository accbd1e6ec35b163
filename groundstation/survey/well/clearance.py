"""Clearance between two holes: closest approach, correlated uncertainty and separation factor.

    SF = (D - R_r - R_o - S_m) / (k sqrt(sigma_s^2 + sigma_pa^2)),    sigma_s^2 = u^T (C_r + C_o - C_ro - C_ro^T) u

D is the distance of a station of the reference hole from the nearest point of the offset hole, u its direction. What
both holes err alike, global sources and those of one instrument, cancels by C_ro where they run alike, and adds where
they run against each other. Frame: north, east, down; m.
Source: Sawaryn et al., SPE 187073-PA.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.tools.instruments import PropagationMode
from groundstation.survey.well.error_columns import ErrorColumns, error_columns
from groundstation.survey.well.error_sources import Leg, Site, WellSurvey
from groundstation.survey.well.methods import station_tangents

Array = npt.NDArray[np.float64]
PIECES = 16  # of a leg, between which the nearest point is sought on a line


@dataclass(frozen=True, slots=True)
class ClearanceHole:
    """A hole as surveyed: stations and positions (n, 3), its radius, and which instrument surveyed it."""

    survey: WellSurvey
    positions: Array
    legs: tuple[Leg, ...]
    radius: float  # m, of the open hole
    serial: str = ""  # number of the instrument; holes of one instrument share its systematic errors


@dataclass(frozen=True, slots=True)
class Rule:
    """Constants of the separation rule, those of the publication by default."""

    k: float = 3.5
    sigma_ahead: float = 0.5  # m, of the projection ahead of the survey
    margin: float = 0.3  # m, at the surface


@dataclass(frozen=True, slots=True)
class Clearance:
    """At every station (n,) of the reference hole: the nearest point of the offset hole, and how far away it is."""

    offset_md: Array
    distance: Array  # m, between the centres
    sigma: Array  # m, of the distance
    factor: Array  # SF
    independent_factor: Array  # the published rule: as if the two shared no error


def clearance_between(
    reference: ClearanceHole, offset: ClearanceHole, site: Site, rule: Rule | None = None
) -> Clearance:
    """Clearance of every station of one hole from another.

    Raises
    ------
    SurveyError, ToolError
        When a radius is negative, or a weight of an instrument has no value.
    """
    rule = rule or Rule()
    for hole in (reference, offset):
        if not hole.radius >= 0.0:
            raise SurveyError(f"clearance: expected a radius of the hole of 0 m or more, got {hole.radius:g} m")
    leg, fraction, nearest = _nearest(reference.positions, offset)
    apart = reference.positions - nearest
    distance = np.linalg.norm(apart, axis=-1)
    across = np.where(distance[:, None] > 1e-9, apart / np.maximum(distance, 1e-9)[:, None], _aside(reference))
    mine = _along(error_columns(reference.survey, reference.legs, site), across)
    theirs = _along(_between(error_columns(offset.survey, offset.legs, site), leg, fraction), across)
    variance = np.zeros(len(distance))
    for columns in (mine, theirs):
        for _, effects in columns:
            variance += np.sum(effects**2, axis=-1)
    shared = np.zeros(len(distance))
    keys = {key: effects for key, effects in theirs if _is_shared(key, reference, offset)}
    for key, effects in mine:
        if key in keys:
            shared += np.sum(effects * keys[key], axis=-1)
    sigma = np.sqrt(np.maximum(variance - 2.0 * shared, 0.0))
    room = distance - reference.radius - offset.radius - rule.margin
    factor, independent = (room / (rule.k * np.hypot(size, rule.sigma_ahead)) for size in (sigma, np.sqrt(variance)))
    offset_md = (1.0 - fraction) * offset.survey.md[leg] + fraction * offset.survey.md[leg + 1]
    return Clearance(offset_md, distance, sigma, factor, independent)


Key = tuple[str, PropagationMode]


def _is_shared(key: Key, reference: ClearanceHole, offset: ClearanceHole) -> bool:
    if key[1] is PropagationMode.GLOBAL:
        return True
    return (
        key[1] in (PropagationMode.SYSTEMATIC, PropagationMode.WELL)
        and reference.serial != ""
        and reference.serial == offset.serial
    )


def _along(columns: Sequence[ErrorColumns], direction: Array) -> list[tuple[Key, Array]]:
    """Effects (n, m) of every source along unit vectors (n, 3)."""
    return [((c.name, c.mode), np.einsum("nam,na->nm", c.effects, direction)) for c in columns]


def _between(columns: Sequence[ErrorColumns], leg: npt.NDArray[np.int64], fraction: Array) -> list[ErrorColumns]:
    """Errors of points at fractions of legs: those of the two stations, blended as the hole is."""
    f = fraction[:, None, None]
    return [ErrorColumns(c.name, c.mode, (1.0 - f) * c.effects[leg] + f * c.effects[leg + 1]) for c in columns]


def _aside(hole: ClearanceHole) -> Array:
    """Unit vector (n, 3) across each station, for holes that meet."""
    inclination, azimuth = hole.survey.inclination, hole.survey.azimuth
    return np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(inclination)], axis=-1)


def _nearest(points: Array, hole: ClearanceHole) -> tuple[npt.NDArray[np.int64], Array, Array]:
    """Leg (n,), fraction of its length (n,) and place (n, 3) of the nearest point of a hole."""
    path, at = _path(hole)
    begin, step = path[:-1], np.diff(path, axis=0)
    length2 = np.maximum(np.sum(step**2, axis=-1), 1e-30)
    along = np.clip(np.einsum("nsa,sa->ns", points[:, None, :] - begin, step) / length2, 0.0, 1.0)
    gaps = np.linalg.norm(points[:, None, :] - begin - along[..., None] * step, axis=-1)
    best = np.argmin(gaps, axis=1)
    rows = np.arange(len(points))
    f = along[rows, best]
    places = begin[best] + f[:, None] * step[best]
    place = (1.0 - f) * at[best] + f * at[best + 1]
    leg = np.minimum(place.astype(np.int64), len(hole.positions) - 2)
    return leg, place - leg, places


def _path(hole: ClearanceHole) -> tuple[Array, Array]:
    """Points (s, 3) of the arcs of a hole, and the station that each is at, with its fraction."""
    t = station_tangents(hole.survey.inclination, hole.survey.azimuth)
    f = np.arange(PIECES)[:, None, None] / PIECES
    p0, p1, d = hole.positions[:-1], hole.positions[1:], np.diff(hole.survey.md)[:, None]
    # the curve that has the two stations' positions and directions; between them an arc of the same bend
    curve = (
        p0 * (1.0 + 2.0 * f) * (1.0 - f) ** 2
        + p1 * f**2 * (3.0 - 2.0 * f)
        + d * t[:-1] * f * (1.0 - f) ** 2
        - d * t[1:] * f**2 * (1.0 - f)
    )
    points = np.concatenate([np.moveaxis(curve, 0, 1).reshape(-1, 3), hole.positions[-1:]])
    return points, np.arange(len(points)) / PIECES
