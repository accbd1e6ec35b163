"""Plausibility of stations: a tube bends by no more than so much, and no station stands alone.

A decimal point in the wrong place makes 123 deg of 12.3. The hole would bend there and back again: sharper than steel
does, or away from two neighbours that agree. Neither proves an error, so both are warnings; what a survey says is used.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from groundstation.entry.entry_warning import EntryWarning

Array = npt.NDArray[np.float64]
SHARPEST = math.radians(1.0)  # rad/m, of a steel string: a circle of 57 m radius
READING = math.radians(2.0)  # rad, that two readings over a short leg may differ by
APART = math.radians(5.0)  # rad, of a station from both its neighbours ...
ALONE = 3.0  # ... and times the angle between these, from where on it stands alone
SHARPEST_DESIGN = math.radians(3.0)  # rad/m, that a plan may ask for: a circle of 19 m radius
LARGEST_RADIUS = 3.0  # m, of a column


def station_warnings(md: Array, inclination: Array, azimuth: Array, what: str) -> tuple[EntryWarning, ...]:
    """Warnings of stations (n,); m and rad."""
    bends, across, sharp, alone = _departures(md, inclination, azimuth)
    found = [
        EntryWarning(
            "spike", what,
            f"{what}: the station at {md[k]:g} m departs by {math.degrees(bends[k - 1]):.1f} and "
            f"{math.degrees(bends[k]):.1f} deg from its neighbours, which differ by {math.degrees(across[k - 1]):.1f}: "
            f"inclination {math.degrees(inclination[k]):g} deg, azimuth {math.degrees(azimuth[k]):g} deg",
            float(md[k - 1]), float(md[k + 1]),
        )
        for k in np.flatnonzero(alone) + 1
    ]  # fmt: skip
    told = set((np.flatnonzero(alone) + 1).tolist())
    for k in np.flatnonzero(sharp).tolist():
        if k in told or k + 1 in told:
            continue
        severity = math.degrees(bends[k]) / (md[k + 1] - md[k]) * 30.0
        text = (
            f"{what}: a dogleg of {math.degrees(bends[k]):.1f} deg from {md[k]:g} to {md[k + 1]:g} m, {severity:.0f} "
            f"deg in 30 m; expected at most 2 deg and 1 deg a metre"
        )
        found.append(EntryWarning("dogleg", what, text, float(md[k]), float(md[k + 1])))
    return tuple(found)


def departing_holes(md: Array, inclination: Array, azimuth: Array, hole: npt.NDArray[np.intp]) -> set[int]:
    """Holes that have a warning of `station_warnings`; of stations (n,) of many, one hole after the other."""
    _, _, sharp, alone = _departures(md, inclination, azimuth)
    same = hole[1:] == hole[:-1]
    return {*hole[1:][sharp & same].tolist(), *hole[1:-1][alone & same[1:] & same[:-1]].tolist()}


def _departures(
    md: Array, inclination: Array, azimuth: Array
) -> tuple[Array, Array, npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Angles between neighbours (n - 1,) and across each (n - 2,), rad; which legs are sharp, which stations alone."""
    bends, across = _angles(inclination, azimuth, 1), _angles(inclination, azimuth, 2)
    sharp = bends > READING + SHARPEST * np.diff(md)
    return bends, across, sharp, np.minimum(bends[:-1], bends[1:]) > APART + ALONE * across


def _angles(inclination: Array, azimuth: Array, apart: int) -> Array:
    """Angles (n - apart,) between stations so many apart, rad."""
    i1, i2, a1, a2 = inclination[:-apart], inclination[apart:], azimuth[:-apart], azimuth[apart:]
    half = np.sin(0.5 * (i2 - i1)) ** 2 + np.sin(i1) * np.sin(i2) * np.sin(0.5 * (a2 - a1)) ** 2
    return np.asarray(2.0 * np.arcsin(np.sqrt(np.clip(half, 0.0, 1.0))))


def design_warnings(md: Array, tangents: Array, what: str) -> tuple[EntryWarning, ...]:
    """Warning of the sharpest bend of a design, tangents (n, 3) at depths (n,), m, where hardly any string follows."""
    bends = 2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(np.diff(tangents, axis=0), axis=1), 0.0, 1.0))
    rates = bends / np.diff(md)
    k = int(np.argmax(rates))
    if rates[k] <= SHARPEST_DESIGN:
        return ()
    text = (
        f"{what}: its design bends by {math.degrees(rates[k]):.1f} deg a metre at {md[k]:g} m; "
        f"expected at most {math.degrees(SHARPEST_DESIGN):g} deg a metre"
    )
    return (EntryWarning("dogleg", what, text, float(md[k]), float(md[k + 1])),)


def radius_warnings(radius: float, what: str) -> tuple[EntryWarning, ...]:
    """Warning of a radius (m) that no column has."""
    if radius <= LARGEST_RADIUS:
        return ()
    text = f"{what}: a radius of {radius:g} m; expected at most {LARGEST_RADIUS:g} m"
    return (EntryWarning("radius", what, text),)
