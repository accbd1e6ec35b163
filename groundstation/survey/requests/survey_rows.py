"""Rows of a survey's answer: stations with their regions of uncertainty in both axes, and sources."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from groundstation.survey.well.analysis import Analysis
from groundstation.survey.well.arcs import on_arc
from groundstation.survey.well.ellipsoid import hole_axes, plan_ellipse
from groundstation.survey.well.error_sources import VERTICAL
from groundstation.survey.well.methods import station_tangents

COORDINATES = ("northing_m", "easting_m", "height_m")


def station_rows(found: Analysis, sigma: float) -> list[dict[str, Any]]:
    """One object a station; uncertainty at ``sigma`` standard deviations, site coordinates where there is a grid."""
    covs, grid, rows = found.uncertainty.cov, found.frame.grid, []
    coordinates = None if grid is None else grid.of_places(found.positions).tolist()
    for k, md in enumerate(found.md.tolist()):
        north, east, tvd = found.positions[k].tolist()
        severity = 0.0 if k == 0 else float(found.dogleg_severity[k - 1])
        rows.append(
            {
                "station": k,
                "md_m": md,
                "inclination_deg": math.degrees(found.record.inclination[k]),
                "azimuth_deg": math.degrees(found.azimuth[k]),
                "north_m": north,
                "east_m": east,
                "tvd_m": tvd,
                "dogleg_severity_deg_per_30m": math.degrees(severity) * 30.0,
                "closure_m": float(found.closure_distance[k]),
                "vertical_section_m": float(found.vertical_section[k]),
                "uncertainty": uncertainty_region(covs[k], sigma)
                | highside_region(covs[k], sigma, found.record.inclination[k], station_bearing(found, k)),
            }
            | ({} if coordinates is None else dict(zip(COORDINATES, coordinates[k], strict=True)))
        )
    return rows


def station_bearing(found: Analysis, k: int) -> float:
    """Azimuth of a station, rad; north where it is vertical, for what a file says there means nothing."""
    return float(found.azimuth[k]) if math.sin(found.record.inclination[k]) > VERTICAL else 0.0


def uncertainty_region(cov: Any, sigma: float) -> dict[str, Any]:
    """Region of uncertainty: half-widths at ``sigma`` standard deviations, and the covariance (1 sigma)."""
    ellipse = plan_ellipse(cov, sigma)
    half = [sigma * math.sqrt(max(float(cov[i, i]), 0.0)) for i in range(3)]
    return {
        "north_m": half[0],
        "east_m": half[1],
        "tvd_m": half[2],
        "major_m": ellipse.major,
        "minor_m": ellipse.minor,
        "azimuth_deg": math.degrees(ellipse.azimuth),
        "covariance_m2": cov.tolist(),
    }


def highside_region(cov: Any, sigma: float, inclination: float, azimuth: float) -> dict[str, Any]:
    """The same in the axes of the hole: highside, to the right of it, along."""
    axes = hole_axes(inclination, azimuth)
    turned = axes @ cov @ axes.T
    names = ("highside_m", "lateral_m", "along_m")
    half = {name: sigma * math.sqrt(max(float(turned[i, i]), 0.0)) for i, name in enumerate(names)}
    return half | {"covariance_hla_m2": turned.tolist()}


def station_at_depth(found: Analysis, md: float, sigma: float) -> dict[str, Any]:
    """Position on the arc and its uncertainty at any depth."""
    cov, mds, positions = found.covariance_at(md), found.md, found.positions
    tangents = station_tangents(found.record.inclination, found.azimuth)
    k = max(int(np.searchsorted(mds, md)) - 1, 0)
    leg = float(mds[k + 1] - mds[k])
    moved, _ = on_arc(tangents[k], tangents[k + 1], positions[k + 1] - positions[k], leg, float(md - mds[k]) / leg)
    north, east, tvd = (positions[k] + moved).tolist()
    place = {"md_m": md, "north_m": north, "east_m": east, "tvd_m": tvd}
    return place | {"uncertainty": uncertainty_region(cov, sigma)}


def source_rows(found: Analysis, sigma: float) -> list[dict[str, Any]]:
    """Contribution of every source at the last station, largest first."""
    rows = []
    for name, cov in found.uncertainty.by_source().items():
        north, east, tvd = (sigma * math.sqrt(max(float(cov[-1, i, i]), 0.0)) for i in range(3))
        rows.append({"source": name, "north_m": north, "east_m": east, "tvd_m": tvd})
    return sorted(rows, key=lambda row: -math.hypot(row["north_m"], row["east_m"], row["tvd_m"]))
