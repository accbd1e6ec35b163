"""Views of the surveyed hole: stations, trajectory, region of uncertainty; the unit stands in every name."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.errors import SelectorError, SurveyError
from groundstation.service.answers.answer_views import member_view_of, view_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.selector_range import SelectorRange
from groundstation.service.answers.shapes.answer_fields import filled_answers
from groundstation.service.answers.shapes.hole_shapes import (
    PlanEllipse,
    PositionSigmas,
    SemiAxis,
    Station,
    StationRegion,
    StationsAnswer,
    TrajectoryAnswer,
    TrajectoryRow,
    UncertaintyAnswer,
)
from groundstation.service.answers.streamed_rows import Parameters
from groundstation.service.hole.station import SurveyStation
from groundstation.service.hole.surveyed_hole import SurveyedHole
from groundstation.survey.fusion.resolve import direction_angles
from groundstation.survey.fusion.sphere_direction import stds_of_directions
from groundstation.survey.well.ellipsoid import Ellipse, coverage_radius, ellipsoid_axes, plan_ellipses
from groundstation.survey.well.trajectory_rows import TrajectoryPoint

Array = npt.NDArray[np.float64]
Values = dict[str, Any]  # of some fields of a row
POSITION = ("north_m", "east_m", "tvd_m", "sigma_north_m", "sigma_east_m", "sigma_tvd_m")
CONFIDENCE = 0.95


@view_of(StationsAnswer)
def answer_stations(k: RigModel, p: Parameters) -> StationsAnswer:
    """All stations, fused; ``md`` selects."""
    numbers: Sequence[int] = range(1, len(k.hole.stations) + 1)
    if "md" in p:
        wanted = SelectorRange.parse("md", p["md"])
        numbers = [n for n in numbers if wanted.holds(k.hole.stations[n - 1].md)]
    return StationsAnswer(station_rows(k, numbers))


@member_view_of(Station, lambda k: range(1, len(k.hole.stations) + 1))
def answer_station(k: RigModel, n: int) -> Station:
    """One station, fused; ``n`` from 1."""
    return station_rows(k, [n])[0]


def station_rows(k: RigModel, numbers: Sequence[int]) -> list[Station]:
    """Stations of these numbers; those to which nothing has come since they were shown last are as they were.

    What a string turns by in a bent hole changes with the stations around, an adjusted hole with every stop.
    """
    known, hole = k.hole.stations, k.hole
    chosen, drawn = [known[n - 1] for n in numbers], hole.trajectory
    changed = chosen if hole.has_transport else [s for s in chosen if s.shown is None]
    for s, values in zip(changed, direction_values(hole, changed), strict=True):
        s.show(values)
    places = [hole.place_of(s) for s in chosen]
    positions = position_values(drawn.positions[places], drawn.covs[places])
    rows = zip(numbers, chosen, positions, strict=True)
    return filled_answers(
        Station, ({"station": n, "md_m": round(s.md, 6)} | (s.shown or {}) | position for n, s, position in rows)
    )


def direction_values(hole: SurveyedHole, chosen: Sequence[SurveyStation]) -> list[Values]:
    """Directions of stations and what each is made of."""
    if not chosen:
        return []
    found = [hole.direction_of(s) for s in chosen]
    stds = stds_of_directions(found)
    return [
        direction_value(s, direction_angles(one.lean, one.down), own, hole.transport_of(s))
        for s, one, own in zip(chosen, found, stds, strict=True)
    ]


def direction_value(
    s: SurveyStation, pointing: tuple[float, float], stds: tuple[float, float], transport: tuple[float, float]
) -> Values:
    """Direction of a station and what it is made of; angles, their standard deviations and the transport in rad."""
    inclination, azimuth = pointing
    return {
        "inclination_deg": math.degrees(inclination),
        "azimuth_deg": math.degrees(azimuth),
        "sigma_inclination_deg": math.degrees(stds[0]),
        "sigma_azimuth_deg": math.degrees(stds[1]),
        "transport_deg": math.degrees(transport[0]),
        "sigma_transport_deg": math.degrees(transport[1]),
        "measurements": s.count,
        "dropped_measurements": s.first,
        "untrusted_measurements": s.untrusted,
    } | typical_reading(s)


def typical_reading(s: SurveyStation) -> Values:
    """Root mean squares over the readings of a station; columns that ``borechain survey --instrument relay`` takes."""
    yaw, systematic, force = s.mean_variances()
    return {
        "sigma_yaw_deg": math.degrees(math.sqrt(yaw)),
        "sigma_systematic_deg": math.degrees(math.sqrt(systematic)),
        "sigma_force_mps2": math.sqrt(force),
    }


@view_of(TrajectoryAnswer)
def answer_trajectory(k: RigModel, p: Parameters) -> TrajectoryAnswer:
    """Positions with covariance: at the stations, in a range of depth, or interpolated at one depth."""
    drawn = k.hole.trajectory
    wanted = SelectorRange.of_parameter("md", p)
    if wanted.single:
        try:
            points = [drawn.at(wanted.low)]
        except SurveyError as error:
            raise SelectorError(f"parameter md: {error}") from error
    else:
        points = [point for point in drawn.points if "md" not in p or wanted.holds(point.md)]
    return TrajectoryAnswer(drawn.method.value, trajectory_points(points))


def trajectory_points(points: Sequence[TrajectoryPoint]) -> list[TrajectoryRow]:
    """Points of the trajectory."""
    if not points:
        return []
    positions = position_values(np.array([q.position for q in points]), np.array([q.cov for q in points]))
    return filled_answers(TrajectoryRow, map(point_values, points, positions))


def point_values(point: TrajectoryPoint, position: Values) -> Values:
    """One point of the trajectory."""
    inclination, azimuth = direction_angles(point.tangent[:2], float(point.tangent[2]))
    way = {
        "md_m": round(point.md, 6),
        "inclination_deg": math.degrees(inclination),
        "azimuth_deg": math.degrees(azimuth),
    }
    return way | position | {"covariance_m2": point.cov.tolist()}


def position_values(positions: Array, covs: Array) -> list[Values]:
    """Positions (n, 3), m, and their standard deviations from covariances (n, 3, 3)."""
    stds = np.sqrt(np.maximum(covs.diagonal(axis1=1, axis2=2), 0.0))
    rows = np.concatenate([positions, stds], axis=1).tolist()
    return [dict(zip(POSITION, row, strict=True)) for row in rows]


@view_of(UncertaintyAnswer)
def answer_uncertainty(k: RigModel, p: Parameters) -> UncertaintyAnswer:
    """Ellipse in plan and ellipsoid of every station at a confidence, and what they are made of."""
    drawn, by_source = k.hole.trajectory, k.hole.variances
    confidence = _confidence(p.get("confidence"))
    plane, space = coverage_radius(confidence, 2), coverage_radius(confidence, 3)
    names, stds = list(by_source), np.sqrt(np.stack(list(by_source.values()), axis=1))
    sizes, directions = ellipsoid_axes(drawn.covs, space)
    columns = (drawn.md, drawn.covs, sizes, directions, stds)
    rows = zip(*(column.tolist() for column in columns), plan_ellipses(drawn.covs, plane), strict=True)
    return UncertaintyAnswer(confidence, plane, space, [_region(names, *row) for row in rows])


def _confidence(text: str | None) -> float:
    try:
        confidence = CONFIDENCE if text is None else float(text)
        coverage_radius(confidence, 2)
    except (ValueError, SurveyError):
        raise SelectorError(f"parameter confidence: expected a number between 0 and 1, got {text!r}") from None
    return confidence


def _region(
    names: list[str], md: float, cov: list[list[float]], sizes: list[float], directions: list[list[float]],
    stds: list[list[float]], ellipse: Ellipse,
) -> StationRegion:  # fmt: skip
    return StationRegion(
        md_m=round(md, 6),
        covariance_m2=cov,
        plan_ellipse=PlanEllipse(ellipse.major, ellipse.minor, math.degrees(ellipse.azimuth)),
        ellipsoid=[SemiAxis(size, direction) for size, direction in zip(sizes, directions, strict=True)],
        sources={name: PositionSigmas(*own) for name, own in zip(names, stds, strict=True)},
    )
