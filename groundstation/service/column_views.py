"""What the keys uncertainty, column and alarms hold: degrees, metres and seconds, the unit in every name."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from groundstation.errors import SelectorError, SurveyError
from groundstation.service.model import RigModel
from groundstation.survey.columns import Deviation, deviation, dominant
from groundstation.survey.ellipsoid import axes, coverage_radius, plan_ellipse
from groundstation.survey.trajectory import Point

View = dict[str, Any]
CONFIDENCE = 0.95


def uncertainty(k: RigModel, p: dict[str, str]) -> View:
    """Ellipse in plan and ellipsoid of every station at a confidence, and what they are made of."""
    confidence = _confidence(p.get("confidence"))
    plane, space = coverage_radius(confidence, 2), coverage_radius(confidence, 3)
    return {
        "confidence": confidence,
        "sigma_plane": plane,
        "sigma_space": space,
        "stations": [_region(k, point, plane, space) for point in k.trajectory],
    }


def _confidence(text: str | None) -> float:
    try:
        confidence = CONFIDENCE if text is None else float(text)
        coverage_radius(confidence, 2)
    except (ValueError, SurveyError):
        raise SelectorError(f"parameter confidence: expected a number between 0 and 1, got {text!r}") from None
    return confidence


def _region(k: RigModel, point: Point, plane: float, space: float) -> View:
    ellipse = plan_ellipse(point.cov, plane)
    sizes, directions = axes(point.cov, space)
    kinds = k.shared.by_kind(point.shared)
    random = point.cov - sum(kinds.values(), start=np.zeros((3, 3)))
    return {
        "md_m": round(point.md, 6),
        "covariance_m2": point.cov.tolist(),
        "plan_ellipse": {
            "major_m": ellipse.major,
            "minor_m": ellipse.minor,
            "azimuth_deg": math.degrees(ellipse.azimuth),
        },
        "ellipsoid": [
            {"semi_axis_m": float(s), "direction": d.tolist()} for s, d in zip(sizes, directions, strict=True)
        ],
        "sources": {name: _stds(cov) for name, cov in (("random", random), *sorted(kinds.items()))},
    }


def _stds(cov: Any) -> View:
    north, east, tvd = (math.sqrt(max(float(v), 0.0)) for v in np.diag(cov))
    return {"sigma_north_m": north, "sigma_east_m": east, "sigma_tvd_m": tvd}


def column(k: RigModel, _p: dict[str, str]) -> View:
    """Deviation from the design axis at every station, projected to the target, and which angle dominates."""
    design = k.config.design
    rows = [deviation(point, design) for point in k.trajectory]
    leaning = [station for station in k.stations if station.md > 0.0]
    found = dominant(k.fused(leaning[-1]), k.trajectory[-1].md) if leaning else None
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
        "projection": None if k.projection is None else deviation_view(k.projection),
        "dominant": None
        if found is None
        else {
            "angle": found.name,
            "by_inclination_m": found.by_inclination,
            "by_azimuth_m": found.by_azimuth,
        },
    }


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
