"""The course that a hole is to take: arcs and straight lines one after the other, and its point nearest to a place.

Between its stations a plan follows minimum curvature, a circle or a straight line; above its first station and below
its last it goes on straight. Frame: north, east, down; m and rad.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.well.arcs import arc_displacements, bend_angles
from groundstation.survey.well.hole_arcs import HoleArcs
from groundstation.survey.well.methods import station_tangents

Array = npt.NDArray[np.float64]
PIECE = math.radians(0.5)  # of an even build and turn, that is drawn as one arc: it is off by micrometres a metre
SAME_MD = 1e-6  # m
CUT = 1e-12  # m, of a plane that has been found
CUTS = 50  # steps to it: each of them makes what is left smaller by the bend of an arc


class PlanLeg(NamedTuple):
    """One leg of a plan: a length (m) with even rates (rad/m) of inclination and azimuth, or an arc to a direction."""

    length: float
    build: float = 0.0
    turn: float = 0.0
    to: tuple[float, float] | None = None  # inclination and azimuth (rad) at the end of an arc


@dataclass(frozen=True, slots=True)
class NearestPoints:
    """Points of a plan nearest to some places, (n, ...)."""

    along: Array  # (n,) m, length of the plan there
    points: Array  # (n, 3) m
    tangents: Array  # (n, 3)


@dataclass(frozen=True)  # with a dictionary, for what is worked out once
class WellPlan:
    """A plan from its head at zero.

    Parameters
    ----------
    md : (n,) m, lengths along it of the stations between which it is an arc
    tangents : (n, 3) there
    """

    md: Array
    tangents: Array

    @classmethod
    def of_stations(cls, md: Array, inclination: Array, azimuth: Array) -> Self:
        """Plan through stations (n,): measured depths, inclinations and azimuths.

        Raises
        ------
        SurveyError
            When it does not begin at 0 m, a leg has no length, or it turns back on itself.
        """
        return cls._checked(md, station_tangents(inclination, azimuth))

    @classmethod
    def of_legs(cls, inclination: float, azimuth: float, legs: Sequence[PlanLeg]) -> Self:
        """Plan of legs from a direction at the head; errors as ``of_stations``."""
        md, tangents, now = [0.0], [_tangent(inclination, azimuth)], (inclination, azimuth)
        if not legs:
            raise SurveyError("plan: expected at least one leg")
        for number, leg in enumerate(legs, 1):
            _check_leg(number, leg, now[0])
            begin = md[-1]
            pieces = 1 if leg.to is not None else _pieces(leg)
            for share in (np.arange(1, pieces + 1) / pieces).tolist():
                at = leg.to or (now[0] + share * leg.length * leg.build, now[1] + share * leg.length * leg.turn)
                md.append(begin + share * leg.length)
                tangents.append(_tangent(*at))
            now = at
        return cls._checked(np.array(md), np.array(tangents))

    @classmethod
    def _checked(cls, md: Array, tangents: Array) -> Self:
        if len(md) < 2:
            raise SurveyError(f"plan: expected at least two stations, got {len(md)}")
        if not np.all(np.isfinite(md)) or not np.all(np.isfinite(tangents)):
            raise SurveyError("plan: expected finite depths and directions")
        if abs(md[0]) > SAME_MD:
            raise SurveyError(f"plan: it begins at {md[0]:g} m; expected its head at 0 m, without a gap")
        short = np.flatnonzero(~(np.diff(md) > SAME_MD))
        if len(short):
            k = int(short[0])
            raise SurveyError(f"plan: expected a station beyond {md[k]:g} m, got {md[k + 1]:g} m: a leg has a length")
        back = np.flatnonzero(bend_angles(tangents[:-1], tangents[1:]) > math.radians(179.0))
        if len(back):
            k = int(back[0])
            raise SurveyError(f"plan: it turns back on itself between {md[k]:g} and {md[k + 1]:g} m")
        return cls(md, tangents)

    @property
    def length(self) -> float:
        """Length of the plan, m."""
        return float(self.md[-1])

    @cached_property
    def positions(self) -> Array:
        """Positions (n, 3) of the stations, m."""
        legs = arc_displacements(np.diff(self.md), self.tangents[:-1], self.tangents[1:])
        return np.concatenate([np.zeros((1, 3)), np.cumsum(legs, axis=0)])

    @cached_property
    def _arcs(self) -> HoleArcs:
        return HoleArcs.of_stations(self.md, self.positions, self.tangents)

    def points_at(self, along: Array) -> NearestPoints:
        """Points at lengths (k,) along the plan, m."""
        within = np.clip(along, 0.0, self.length)
        leg = np.clip(np.searchsorted(self.md, within, side="right") - 1, 0, len(self.md) - 2)
        fraction = (within - self.md[leg]) / (self.md[leg + 1] - self.md[leg])
        tangents = self._arcs.tangents(leg, fraction)
        points = self._arcs.places(leg, fraction) + (along - within)[:, None] * tangents
        return NearestPoints(np.asarray(along, float), points, tangents)

    def cross_planes(self, normal: Array, depths: Array) -> NearestPoints:
        """Points at which planes cut a plan that never runs along them: ``depths`` (k,) along their normal (3,), m."""
        begin, end = 0.0, float(self.positions[-1] @ normal)
        along = self.length * (depths - begin) / (end - begin)
        for _ in range(CUTS):
            found = self.points_at(along)
            step = (depths - found.points @ normal) / (found.tangents @ normal)
            along = along + step
            if float(np.max(np.abs(step), initial=0.0)) < CUT:
                break
        return self.points_at(along)

    def nearest(self, places: Array) -> NearestPoints:
        """Points of the plan nearest to places (k, 3), m."""
        if not len(places):
            return self.points_at(np.zeros(0))
        leg, fraction, distance = self._arcs.nearest(places)
        along = self.md[leg] + fraction * (self.md[leg + 1] - self.md[leg])
        # straight on above the head and below the end
        for begin, tangent, end in (
            (self.positions[0], self.tangents[0], 0.0),
            (self.positions[-1], self.tangents[-1], self.length),
        ):
            beyond = ((places - begin) * tangent).sum(axis=1)
            away = np.sqrt((((places - begin) - beyond[:, None] * tangent) ** 2).sum(axis=1))
            is_there = (beyond < 0.0) if end == 0.0 else (beyond > 0.0)
            nearer = is_there & (away < distance)
            along, distance = np.where(nearer, end + beyond, along), np.where(nearer, away, distance)
        return self.points_at(along)


def _tangent(inclination: float, azimuth: float) -> Array:
    return np.asarray(station_tangents(np.array(inclination), np.array(azimuth)))


def _pieces(leg: PlanLeg) -> int:
    return max(math.ceil(leg.length * math.hypot(leg.build, leg.turn) / PIECE), 1)


def _check_leg(number: int, leg: PlanLeg, inclination: float) -> None:
    """Refuse a leg without length, or one that turns back."""
    if not (math.isfinite(leg.length) and leg.length > SAME_MD):
        raise SurveyError(f"plan: leg {number}: expected a length above 0 m, got {leg.length:g} m")
    turned = leg.length * math.hypot(leg.build, leg.turn)
    if not turned <= math.pi:
        raise SurveyError(f"plan: leg {number}: it turns back: {math.degrees(turned):g} deg in one leg, at most 180")
    end = inclination + leg.length * leg.build
    if not -1e-9 <= end <= math.pi + 1e-9:
        raise SurveyError(
            f"plan: leg {number}: expected an inclination of 0..180 deg at its end, got {math.degrees(end):g} deg"
        )
