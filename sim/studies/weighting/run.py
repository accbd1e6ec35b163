"""Weights of the readings of one station when the hole moves: thesis 4.3, figures 4.28-4.37.

Four tubes pass stations at 2, 4, 6 and 8 m, the hole leans 1 deg towards 120 deg. At the fourth stop one station's
inclination, then its azimuth, is another: station 2 has three readings by then and station 3 two, and only the last
sees the change. What remains of the error depends on the weight of that last reading.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.fusion import Weighting, fuse_by_scheme, sequence_weights
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.well.methods import Method
from groundstation.survey.well.trajectory import Trajectory
from sim.studies.pool import Step

Array = npt.NDArray[np.float64]
SPACING = 2.0  # m
STATIONS = 4
INCLINATION_DEG, AZIMUTH_DEG = 1.0, 120.0
INCLINATIONS_DEG = np.arange(1.5, 10.01, 0.5)
AZIMUTHS_DEG = np.arange(125.0, 200.01, 5.0)
READING_STD = math.radians(0.02)  # rad, of the lean; decides only what the adaptive scheme takes for large
SCHEMES = (Weighting.EQUAL, Weighting.LINEAR, Weighting.QUADRATIC, Weighting.CUBIC, Weighting.ADAPTIVE)
# Fig. 4.35: remaining error against equal weights, by station
PUBLISHED_RATIO = {
    (2, Weighting.LINEAR): 0.75,
    (2, Weighting.QUADRATIC): 0.53,
    (3, Weighting.LINEAR): 0.67,
    (3, Weighting.QUADRATIC): 0.4,
}
# Fig. 4.29d, inclination + 2 deg at station 2, equal weights
PUBLISHED_CM = {"north": 1.18, "east": 2.0}


def direction_reading(inclination_deg: float, azimuth_deg: float) -> Direction:
    """Return a reading of a direction."""
    i, a = math.radians(inclination_deg), math.radians(azimuth_deg)
    horizontal = math.sin(i) * np.array([math.cos(a), math.sin(a)])
    return Direction(horizontal, math.cos(i), READING_STD**2 * np.eye(2), np.zeros((2, 0)))


def station_positions(changed: int, now: Direction, scheme: Weighting | None) -> Array:
    """Positions (5, 3) at the fourth stop by a scheme, or the true ones for None; ``changed`` is a station from 1."""
    before = direction_reading(INCLINATION_DEG, AZIMUTH_DEG)
    trajectory = Trajectory(Method.BALANCED_TANGENTIAL)
    for station in range(1, STATIONS + 1):
        readings = [before] * (STATIONS - station + 1)
        if station == changed:
            readings[-1] = now
        direction = readings[-1] if scheme is None else fuse_by_scheme(readings, scheme)
        trajectory.append(SPACING * station, direction)
    return np.array([point.position for point in trajectory.points])


def errors_cm(changed: int, now: Direction, scheme: Weighting) -> Array:
    """Error (4, 3) of every station north, east and down, cm."""
    return 100.0 * (station_positions(changed, now, scheme) - station_positions(changed, now, None))[1:]


def count_steps() -> int:
    """Steps of the study: one."""
    return 1


def run_study(step: Step) -> dict[str, Any]:
    """Error-reduction factors beside the published ones, and the sweeps behind the figures."""
    result = {
        "experiment": "weighting",
        "cases": [*_reductions(), *_worked()],
        "weights": {
            scheme.value: [sequence_weights(n, p).tolist() for n in (2, 3, 4)] for p, scheme in enumerate(SCHEMES[:4])
        },
        "sweeps": [*_sweep("inclination", INCLINATIONS_DEG), *_sweep("azimuth", AZIMUTHS_DEG)],
    }
    step()
    return result


def _reductions() -> list[dict[str, Any]]:
    rows = []
    now = direction_reading(INCLINATION_DEG + 2.0, AZIMUTH_DEG)
    for station in (2, 3):
        equal = np.linalg.norm(errors_cm(station, now, Weighting.EQUAL)[station - 1])
        for scheme in SCHEMES[1:]:
            ratio = float(np.linalg.norm(errors_cm(station, now, scheme)[station - 1]) / equal)
            rows.append(
                {
                    "case": f"station {station} {scheme.value}",
                    "published": PUBLISHED_RATIO.get((station, scheme)),
                    "ours": ratio,
                    "unit": "of the error with equal weights",
                }
            )
    return rows


def _worked() -> list[dict[str, Any]]:
    error = errors_cm(2, direction_reading(INCLINATION_DEG + 2.0, AZIMUTH_DEG), Weighting.EQUAL)[1]
    return [
        {
            "case": f"+2 deg at station 2, {axis}",
            "published": PUBLISHED_CM[axis],
            "ours": abs(float(error[k])),
            "unit": "cm",
        }
        for k, axis in enumerate(("north", "east"))
    ]


def _sweep(angle: str, values_deg: Array) -> list[dict[str, Any]]:
    rows = []
    for value in values_deg.tolist():
        now = (
            direction_reading(value, AZIMUTH_DEG)
            if angle == "inclination"
            else direction_reading(INCLINATION_DEG, value)
        )
        for scheme in SCHEMES:
            error = errors_cm(2, now, scheme)
            for station in range(1, STATIONS + 1):
                north, east, tvd = error[station - 1].tolist()
                rows.append(
                    {
                        "changed": angle,
                        "value_deg": value,
                        "scheme": scheme.value,
                        "station": station,
                        "north_cm": north,
                        "east_cm": east,
                        "tvd_cm": tvd,
                    }
                )
    return rows
