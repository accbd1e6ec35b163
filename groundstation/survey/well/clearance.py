"""Clearance between two holes: closest approach, correlated uncertainty and separation factor, all along both arcs.

    SF = (D - R_r - R_o - S_m) / (k sqrt(sigma_s^2 + sigma_pa^2)),    sigma_s^2 = u^T (C_r + C_o - C_ro - C_ro^T) u

D is the distance of a point of the reference hole from the nearest point of the offset hole, u its direction. What
both holes err alike, global sources and those of one instrument, cancels by C_ro where they run alike, and adds where
they run against each other. What a path may leave its arcs by (`hole_wander`) is a hole's own. It is told at every
station, and where it is least between them: holes may cross between two stations that are far apart. Frame: north,
east, down; m. Source: Sawaryn et al., SPE 187073-PA.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.path.leg_wander import STEADY, LegWander
from groundstation.survey.tools.instruments import PropagationMode
from groundstation.survey.well.error_sources import Leg, Site, WellSurvey
from groundstation.survey.well.hole_arcs import HoleArcs
from groundstation.survey.well.hole_wander import HoleWander
from groundstation.survey.well.leg_errors import LegErrors, SourceKey, leg_errors
from groundstation.survey.well.methods import check_stations, station_tangents
from groundstation.survey.well.path_search import least_place, leg_of, sample_places

Array = npt.NDArray[np.float64]
TOUCHING = 1e-9  # m, of two points between which there is no direction
SAME_HOLE = 1e-6  # m, within which one hole runs in the other
PARALLEL = 1e-6  # sine of the angle of two holes that have no common perpendicular of their own


@dataclass(frozen=True, slots=True)
class ClearanceHole:
    """A hole as surveyed: stations and positions (n, 3), its radius, and which instrument surveyed it."""

    survey: WellSurvey
    positions: Array
    legs: tuple[Leg, ...]
    radius: float  # m, of the open hole
    serial: str = ""  # number of the instrument; holes of one instrument share its systematic errors
    wander: LegWander = STEADY  # of the path between the stations, where the instrument's model does not have it


@dataclass(frozen=True, slots=True)
class Rule:
    """Constants of the separation rule, those of the publication by default."""

    k: float = 3.5
    sigma_ahead: float = 0.5  # m, of the projection ahead of the survey
    margin: float = 0.3  # m, at the surface


@dataclass(frozen=True, slots=True)
class Separations:
    """At points (k,) of the reference hole: the nearest point of the offset hole, and how far away it is."""

    md: Array
    offset_md: Array
    distance: Array  # m, between the centres
    sigma: Array  # m, of the distance
    factor: Array  # SF
    independent_factor: Array  # the published rule: as if the two shared no error

    @property
    def least_factor(self) -> Array:
        """The lesser (k,) of both factors, which decides."""
        return np.minimum(self.factor, self.independent_factor)


@dataclass(frozen=True, slots=True)
class Clearance:
    """Separations at the stations of the reference hole; and, stations or not, the one place each of two least ones."""

    stations: Separations
    least: Separations  # of the factor
    nearest: Separations  # of the distance

    @property
    def clear(self) -> bool:
        """Whether both factors are above 1 all along."""
        return bool(self.least.least_factor[0] > 1.0)


def clearance_between(
    reference: ClearanceHole, offset: ClearanceHole, site: Site, rule: Rule | None = None
) -> Clearance:
    """Clearance of one hole from another, at its stations and between them.

    Raises
    ------
    SurveyError, ToolError
        When a hole is not a survey, a radius is negative, one hole is the other, or a weight of an instrument has no
        value.
    """
    for name, hole in (("reference", reference), ("offset", offset)):
        check_stations(hole.survey.md, hole.survey.inclination, hole.survey.azimuth, f"clearance: {name} hole")
        if not hole.radius >= 0.0:
            raise SurveyError(f"clearance: expected a radius of the hole of 0 m or more, got {hole.radius:g} m")
    pair = HolePair(reference, offset, site, rule or Rule())
    stations = np.arange(len(reference.survey.md), dtype=float)
    places, apart = sample_places(pair.distance, pair.mine.length)
    if float(apart.max()) < SAME_HOLE:
        raise SurveyError("clearance: the reference hole runs in the offset hole all along; expected two holes")
    factors = pair.separations(places).least_factor
    least = least_place(lambda place: pair.separations(place).least_factor, places, factors)
    nearest = least_place(pair.distance, places, apart)
    return Clearance(*(pair.separations(place) for place in (stations, np.array([least]), np.array([nearest]))))


class HolePair:
    """Two holes, compared at any places along the reference hole: number of a leg plus fraction of it."""

    def __init__(self, reference: ClearanceHole, offset: ClearanceHole, site: Site, rule: Rule) -> None:
        self._reference, self._offset, self._rule = reference, offset, rule
        self.mine, self.theirs = (_arcs(hole) for hole in (reference, offset))
        self._errors = tuple(leg_errors(hole.survey, hole.legs, site) for hole in (reference, offset))
        self._wanders = tuple(HoleWander(hole.survey.md, hole.wander) for hole in (reference, offset))
        self._shared = [key for key in self._errors[0].constant if self._is_shared(key)]

    def _is_shared(self, key: SourceKey) -> bool:
        """Whether both holes have an error of this source, and the same."""
        if key not in self._errors[1].constant:
            return False
        one_instrument = self._reference.serial != "" and self._reference.serial == self._offset.serial
        return key[1] is PropagationMode.GLOBAL or one_instrument

    def distance(self, place: Array) -> Array:
        """Distance (k,) of the offset hole from places (k,)."""
        return self.theirs.nearest(self.mine.places(*leg_of(place, len(self.mine.length))))[2]

    def separations(self, place: Array) -> Separations:
        """Everything at places (k,)."""
        leg, fraction = leg_of(place, len(self.mine.length))
        points = self.mine.places(leg, fraction)
        their_leg, their_fraction, distance = self.theirs.nearest(points)
        apart = points - self.theirs.places(their_leg, their_fraction)
        across = self._across(leg, fraction, their_leg, their_fraction)
        meet = distance < TOUCHING
        unit = np.where(meet[:, None], across, apart / np.maximum(distance, TOUCHING)[:, None])
        here, there = (self._errors[0], leg, fraction), (self._errors[1], their_leg, their_fraction)
        variance = sum(_variance(*where, unit) for where in (here, there))
        for (wander, arcs), at in zip(
            zip(self._wanders, (self.mine, self.theirs), strict=True), ((leg, fraction), (their_leg, their_fraction)),
            strict=True,
        ):  # fmt: skip
            variance = variance + wander.variances(*at) * (1.0 - np.sum(arcs.tangents(*at) * unit, axis=-1) ** 2)
        common = np.zeros(len(place))
        for key in self._shared:
            effects = [np.sum(errors.effect(key, at, f) * unit, axis=-1) for errors, at, f in (here, there)]
            common += effects[0] * effects[1]
        sigma = np.sqrt(np.maximum(variance - 2.0 * common, 0.0))
        room = distance - self._reference.radius - self._offset.radius - self._rule.margin
        ahead = self._rule.sigma_ahead
        factor, independent = (
            room / (self._rule.k * np.maximum(np.hypot(size, ahead), TOUCHING)) for size in (sigma, np.sqrt(variance))
        )
        mds = (_md(self._reference, leg, fraction), _md(self._offset, their_leg, their_fraction))
        return Separations(*mds, distance, sigma, factor, independent)

    def _across(self, leg: npt.NDArray[np.intp], fraction: Array, other: npt.NDArray[np.intp], part: Array) -> Array:
        """Unit vector (k, 3) of holes that meet: across both, or across the first one where they run alike."""
        along = self.mine.tangents(leg, fraction)
        normal = np.cross(along, self.theirs.tangents(other, part))
        size = np.linalg.norm(normal, axis=-1)
        azimuth = self._reference.survey.azimuth[leg]
        aside = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)], axis=-1)
        crossing = (size > PARALLEL)[:, None]
        return np.where(crossing, normal / np.maximum(size, PARALLEL)[:, None], aside)


def _variance(errors: LegErrors, leg: npt.NDArray[np.intp], fraction: Array, unit: Array) -> Array:
    """Variance (k,) along unit vectors (k, 3)."""
    return np.asarray(np.maximum(np.einsum("ki,kij,kj->k", unit, errors.covariance(leg, fraction), unit), 0.0))


def _arcs(hole: ClearanceHole) -> HoleArcs:
    return HoleArcs.of_stations(
        hole.survey.md, hole.positions, station_tangents(hole.survey.inclination, hole.survey.azimuth)
    )


def _md(hole: ClearanceHole, leg: npt.NDArray[np.intp], fraction: Array) -> Array:
    return np.asarray((1.0 - fraction) * hole.survey.md[leg] + fraction * hole.survey.md[leg + 1])
