"""Trajectory methods: from measured depth, inclination and azimuth at the ends of a leg to its displacement.

Every leg is D (sin a cos b, sin a sin b, cos c) with angles and lengths that the method defines; all are regular where
inclination or azimuth does not change. ``leg_displacement`` is written once for scalars (``math``) and for whole wells
(``numpy``). Frame: north, east, down; rad and m. Source: thesis 2.1-2.3 and Appendix IV.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.bearings import wrap_angle

Array = npt.NDArray[np.float64]
SMALL = 1e-4  # rad, below which a series is exact to the last digit
NO_LEAN = 1e-9  # sine of an inclination, below which there is no azimuth
OPPOSITE = 1e-6  # rad, of two tangents, short of which an arc between them is not defined


class Method(Enum):
    """Shape of a leg between the directions at its ends."""

    TANGENTIAL = "tangential"
    BALANCED_TANGENTIAL = "balanced-tangential"
    AVERAGE_ANGLE = "average-angle"
    RADIUS_OF_CURVATURE = "radius-of-curvature"
    MINIMUM_CURVATURE = "minimum-curvature"


def sinc(m: Any, x: Any) -> Any:
    """sin(x) / x."""
    if m is math:
        return 1.0 - x * x / 6.0 if abs(x) < SMALL else math.sin(x) / x
    small = np.abs(x) < SMALL
    safe = np.where(small, 1.0, x)
    return np.where(small, 1.0 - x * x / 6.0, np.sin(safe) / safe)


def ratio_factor(m: Any, bend: Any) -> Any:
    """(2/b) tan(b/2) of the minimum curvature method; b in rad."""
    if m is math:
        return 1.0 + bend * bend / 12.0 if bend < SMALL else 2.0 / bend * math.tan(0.5 * bend)
    small = bend < SMALL
    safe = np.where(small, 1.0, bend)
    return np.where(small, 1.0 + bend * bend / 12.0, 2.0 / safe * np.tan(0.5 * safe))


def dogleg(m: Any, i1: Any, a1: Any, i2: Any, a2: Any) -> Any:
    """Angle (rad) between two directions: sin^2(b/2) = sin^2(dI/2) + sin I1 sin I2 sin^2(dA/2), exact when small."""
    half = m.sin(0.5 * (i2 - i1)) ** 2 + m.sin(i1) * m.sin(i2) * m.sin(0.5 * (a2 - a1)) ** 2
    return 2.0 * m.asin(m.sqrt(half)) if m is not math else 2.0 * math.asin(math.sqrt(min(max(half, 0.0), 1.0)))


def leg_displacement(m: Any, method: Method, length: Any, i1: Any, a1: Any, i2: Any, a2: Any) -> tuple[Any, Any, Any]:
    """Displacement north, east and down (m) of one leg; ``m`` is ``math`` for numbers or ``numpy`` for arrays."""
    if method is Method.TANGENTIAL:
        return length * m.sin(i2) * m.cos(a2), length * m.sin(i2) * m.sin(a2), length * m.cos(i2)
    if method in (Method.AVERAGE_ANGLE, Method.RADIUS_OF_CURVATURE):
        a1, a2 = _where_leaning(m, i1, a1, a2), _where_leaning(m, i2, a2, a1)
        mean_i, mean_a = 0.5 * (i1 + i2), a1 + 0.5 * wrap_angle(a2 - a1)
        along = length * m.sin(mean_i)
        if method is Method.AVERAGE_ANGLE:
            return along * m.cos(mean_a), along * m.sin(mean_a), length * m.cos(mean_i)
        # (cos I1 - cos I2) / (I2 - I1) = sin(mean I) sinc(dI / 2), and likewise for the azimuth
        bent_i, bent_a = sinc(m, 0.5 * (i2 - i1)), sinc(m, 0.5 * wrap_angle(a2 - a1))
        along = along * bent_i * bent_a
        return along * m.cos(mean_a), along * m.sin(mean_a), length * m.cos(mean_i) * bent_i
    half = 0.5 * length
    if method is Method.MINIMUM_CURVATURE:
        half = half * ratio_factor(m, dogleg(m, i1, a1, i2, a2))
    s1, s2 = m.sin(i1), m.sin(i2)
    north = half * (s1 * m.cos(a1) + s2 * m.cos(a2))
    east = half * (s1 * m.sin(a1) + s2 * m.sin(a2))
    return north, east, half * (m.cos(i1) + m.cos(i2))


def _where_leaning(m: Any, inclination: Any, azimuth: Any, other: Any) -> Any:
    """Azimuth of an end of a leg; that of the other end where this one is vertical."""
    if m is math:
        return azimuth if abs(math.sin(inclination)) > NO_LEAN else other
    return np.where(np.abs(np.sin(inclination)) > NO_LEAN, azimuth, other)


def check_stations(md: Array, inclination: Array, azimuth: Array, where: str = "survey") -> None:
    """Refuse arrays (..., n) that are not a survey.

    Raises
    ------
    SurveyError
        Names the first station (from 0) that is not finite, does not go deeper or leans outside 0..180 deg.
    """
    if not md.shape[-1] == inclination.shape[-1] == azimuth.shape[-1]:
        sizes = f"{md.shape[-1]}, {inclination.shape[-1]} and {azimuth.shape[-1]}"
        raise SurveyError(f"{where}: expected as many depths as inclinations and azimuths, got {sizes}")
    if _is_survey(md, inclination, azimuth):
        return
    wrong: tuple[tuple[npt.NDArray[np.bool_], str, Array, float, str], ...] = (
        (~np.isfinite(md), "a finite measured depth", md, 1.0, "m"),
        (~((inclination >= 0.0) & (inclination <= math.pi)), "an inclination of 0..180 deg", inclination, 0.0, "deg"),
        (~np.isfinite(azimuth), "a finite azimuth", azimuth, 0.0, "deg"),
    )
    for mask, expected, values, scale, unit in wrong:
        if np.any(mask):
            at = tuple(np.argwhere(mask)[0])
            value = float(values[at]) if scale else math.degrees(values[at])
            raise SurveyError(f"{where}: station {at[-1]}: expected {expected}, got {value:g} {unit}")
    back = np.argwhere(~(np.diff(md, axis=-1) > 0.0))
    if len(back):
        at = tuple(back[0])
        before, after = float(md[at]), float(md[(*at[:-1], at[-1] + 1)])
        raise SurveyError(f"{where}: station {at[-1] + 1}: expected a depth beyond {before:g} m, got {after:g} m")


def _is_survey(md: Array, inclination: Array, azimuth: Array) -> bool:
    """Whether all stations are valid; the invalid one is searched for only if not."""
    return bool(
        inclination.size
        and inclination.min() >= 0.0
        and inclination.max() <= math.pi
        and np.isfinite(azimuth).all()
        and np.isfinite(md).all()
        and (md[..., 1:] > md[..., :-1]).all()
    )


def station_positions(method: Method, md: Array, inclination: Array, azimuth: Array) -> Array:
    """Positions (..., n, 3) of the stations (..., n) of whole wells, from the first station.

    Raises
    ------
    SurveyError
        When the numbers are not a survey, or an arc of minimum curvature turns straight back.
    """
    check_stations(md, inclination, azimuth)
    i1, i2, a1, a2 = inclination[..., :-1], inclination[..., 1:], azimuth[..., :-1], azimuth[..., 1:]
    if method is Method.MINIMUM_CURVATURE:
        back = np.argwhere(dogleg(np, i1, a1, i2, a2) > math.pi - OPPOSITE)
        if len(back):
            raise SurveyError(f"survey: station {back[0][-1] + 1}: the hole turns straight back on itself")
    out = np.zeros((*md.shape, 3))
    for axis, step in enumerate(leg_displacement(np, method, np.diff(md, axis=-1), i1, a1, i2, a2)):
        np.cumsum(step, axis=-1, out=out[..., 1:, axis])
    return out


def station_tangents(inclination: Array, azimuth: Array) -> Array:
    """Downhole unit vectors (..., n, 3)."""
    sine = np.sin(inclination)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(inclination)], axis=-1)


def dogleg_severity(md: Array, inclination: Array, azimuth: Array) -> Array:
    """Curvature (..., n - 1) of the legs, rad/m."""
    sine = np.sin(inclination)  # once a station; otherwise as ``dogleg``
    turn = sine[..., :-1] * sine[..., 1:] * np.sin(0.5 * (azimuth[..., 1:] - azimuth[..., :-1])) ** 2
    half = np.sin(0.5 * (inclination[..., 1:] - inclination[..., :-1])) ** 2 + turn
    return np.asarray(2.0 * np.arcsin(np.sqrt(half)) / (md[..., 1:] - md[..., :-1]))


def horizontal_closure(position: Array) -> tuple[Array, Array]:
    """Horizontal distance (m) and direction in [0, 2 pi) (rad) of positions (..., 3) from the collar."""
    distance = np.hypot(position[..., 0], position[..., 1])
    direction = np.arctan2(position[..., 1], position[..., 0])
    turned = np.where(direction < 0.0, direction + math.tau, direction)
    return distance, np.where(turned < math.tau, turned, 0.0)  # of a direction just short of zero


def vertical_section(position: Array, azimuth: float) -> Array:
    """Horizontal displacement (m) of positions (..., 3) along an azimuth (rad)."""
    return np.asarray(position[..., 0] * math.cos(azimuth) + position[..., 1] * math.sin(azimuth))
