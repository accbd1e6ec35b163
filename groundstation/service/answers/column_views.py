"""What the keys uncertainty, column and alarms hold: degrees, metres and seconds, the unit in every name."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.errors import SelectorError, SurveyError
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.thinning import FEWEST, largest_triangles
from groundstation.service.hole.history import Moment
from groundstation.survey.fusion.shared import KIND_NAMES
from groundstation.survey.wall.column_deviation import Deviation, lateral_errors
from groundstation.survey.well.ellipsoid import Ellipse, coverage_radius, ellipsoid_axes, plan_ellipses

Array = npt.NDArray[np.float64]
View = dict[str, Any]
CONFIDENCE = 0.95
POINTS, MOST_POINTS = 200, 1000  # of the history
LONGEST_NUMBER = 18  # digits
SHOWN = 30  # numbers that a refusal names
CM = 100.0
SOURCES = ("random", *KIND_NAMES)
SIGMAS = ("sigma_north_m", "sigma_east_m", "sigma_tvd_m")


def uncertainty(k: RigModel, p: dict[str, str]) -> View:
    """Ellipse in plan and ellipsoid of every station at a confidence, and what they are made of."""
    confidence = _confidence(p.get("confidence"))
    plane, space = coverage_radius(confidence, 2), coverage_radius(confidence, 3)
    drawn, by_kind = k.hole.trajectory, k.hole.variances
    random = np.diagonal(drawn.covs, axis1=1, axis2=2) - by_kind.sum(axis=1)
    stds = np.sqrt(np.maximum(np.concatenate([random[:, None], by_kind], axis=1), 0.0))
    sizes, directions = ellipsoid_axes(drawn.covs, space)
    columns = (drawn.md, drawn.covs, sizes, directions, stds)
    rows = zip(*(column.tolist() for column in columns), plan_ellipses(drawn.covs, plane), strict=True)
    return {
        "confidence": confidence,
        "sigma_plane": plane,
        "sigma_space": space,
        "stations": [_region(*row) for row in rows],
    }


def _confidence(text: str | None) -> float:
    try:
        confidence = CONFIDENCE if text is None else float(text)
        coverage_radius(confidence, 2)
    except (ValueError, SurveyError):
        raise SelectorError(f"parameter confidence: expected a number between 0 and 1, got {text!r}") from None
    return confidence


def _region(
    md: float, cov: list[list[float]], sizes: list[float], directions: list[list[float]], stds: list[list[float]],
    ellipse: Ellipse,
) -> View:  # fmt: skip
    return {
        "md_m": round(md, 6),
        "covariance_m2": cov,
        "plan_ellipse": {
            "major_m": ellipse.major,
            "minor_m": ellipse.minor,
            "azimuth_deg": math.degrees(ellipse.azimuth),
        },
        "ellipsoid": [{"semi_axis_m": s, "direction": d} for s, d in zip(sizes, directions, strict=True)],
        "sources": {name: dict(zip(SIGMAS, own, strict=True)) for name, own in zip(SOURCES, stds, strict=True)},
    }


def column(k: RigModel, p: dict[str, str]) -> View:
    """Deviation from the design axis at every station, projected to the target, and which angle dominates.

    ``moment`` gives what was known at the end of an earlier stop.
    """
    design = k.config.design
    moment = _moment(k, p["moment"]) if "moment" in p else None
    rows = list(k.hole.deviations) if moment is None else moment.rows
    end = k.hole.projection if moment is None else moment.projection
    return {
        "design": {
            "inclination_deg": k.config.design_inclination_deg,
            "azimuth_deg": k.config.design_azimuth_deg,
            "target_m": design.length,
            "radius_m": design.radius,
            "tolerance": design.tolerance.name,
        },
        "stations": [deviation_view(row) for row in rows],
        "worst": deviation_view(max(rows, key=lambda row: row.ratio)),
        "projection": None if end is None else deviation_view(end),
        "dominant": None if moment is not None else _dominant(k),
    }


def history(k: RigModel, p: dict[str, str]) -> View:
    """What was known at the end of every stop, thinned to ``points`` of them."""
    moments = k.hole.history.moments
    points = _points(p.get("points"))
    if len(moments) > points:
        used = np.array([moment.about.ratio for moment in moments])
        moments = [moments[place] for place in largest_triangles(np.arange(len(used), dtype=float), used, points)]
    return {"moments": [moment_view(moment) for moment in moments]}


def moment_view(moment: Moment) -> View:
    """One moment of the history."""
    about = moment.about
    return {
        "moment": moment.number,
        "at_s": moment.at,
        "md_m": round(moment.deepest, 6),
        "deviation_cm": CM * about.size,
        "limit_cm": CM * about.limit,
        "used_percent": 100.0 * about.ratio,
    }


def _moment(k: RigModel, text: str) -> Moment:
    found = k.hole.history.find(int(text)) if text.isdecimal() and len(text) <= LONGEST_NUMBER else None
    if found is None:
        there_are = ", ".join(str(moment.number) for moment in k.hole.history.moments[-SHOWN:]) or "none yet"
        raise SelectorError(f"parameter moment: expected one of the history, got {text!r:.40}; there are {there_are}")
    return found


def _points(text: str | None) -> int:
    if text is None:
        return POINTS
    if not text.isdecimal() or len(text) > LONGEST_NUMBER or not FEWEST <= int(text) <= MOST_POINTS:
        raise SelectorError(f"parameter points: expected a whole number {FEWEST}..{MOST_POINTS}, got {text!r:.40}")
    return int(text)


def _dominant(k: RigModel) -> View | None:
    leaning = [station for station in k.hole.stations if station.md > 0.0]
    if not leaning:
        return None
    found = lateral_errors(k.hole.direction_of(leaning[-1]), k.hole.trajectory[-1].md)
    return {"angle": found.name, "by_inclination_m": found.by_inclination, "by_azimuth_m": found.by_azimuth}


def deviation_view(d: Deviation) -> View:
    """One deviation."""
    return {
        "md_m": round(d.md, 6),
        "along_m": d.along,
        "north_cm": 100.0 * float(d.offset[0]),
        "east_cm": 100.0 * float(d.offset[1]),
        "deviation_cm": 100.0 * d.size,
        "sigma_cm": 100.0 * d.std,
        "deviation_percent": 100.0 * d.size / d.along if d.along > 0.0 else 0.0,
        "direction_deg": math.degrees(math.atan2(d.offset[1], d.offset[0])) % 360.0,
        "limit_cm": 100.0 * d.limit,
        "used_percent": 100.0 * d.ratio,
        "level_percent": round(100.0 * d.level),
    }
