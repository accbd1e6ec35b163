"""Electrical resistivity of carbon steel over its carbon content and temperature, and the grades of API 5L.

Source of the table: British Iron and Steel Research Association, Physical Constants of Some Commercial Steels at
Elevated Temperatures (Butterworths, London 1953); Smithells's Metals Reference Book and the ASM Metals Handbook print
its values for plain carbon steels.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

import numpy as np
import numpy.typing as npt

from telemetry.errors import RadioError
from telemetry.radio.limits import Array, ModelRange, values_within

CARBON_PERCENT: Final = np.array([0.06, 0.08, 0.23, 0.42, 0.80, 1.22])
TEMPERATURES: Final = np.array([20.0, 100.0, 200.0, 400.0])  # C
RESISTIVITY: Final = 1e-8 * np.array(  # ohm m, a row for each carbon content
    [
        [13.0, 17.8, 25.2, 44.8],
        [14.2, 19.0, 26.3, 45.8],
        [16.9, 21.9, 29.2, 48.7],
        [17.1, 22.1, 29.6, 49.3],
        [18.0, 23.2, 30.8, 50.5],
        [19.6, 25.2, 33.3, 54.0],
    ]
)
CARBON: Final = ModelRange(CARBON_PERCENT[0], CARBON_PERCENT[-1], 1.0, "%")
TEMPERATURE: Final = ModelRange(TEMPERATURES[0], TEMPERATURES[-1], 1.0, "C")
API_5L: Final = MappingProxyType(  # grade of line pipe to its largest carbon content, % by weight
    {
        "A25": 0.21,
        "A seamless": 0.22,
        "B seamless": 0.27,
        "A welded": 0.21,
        "B welded": 0.26,
        "X42 seamless": 0.29,
        "X46 seamless": 0.31,
        "X52 seamless": 0.31,
        "X60 seamless": 0.26,
        "X42 welded": 0.28,
        "X46 welded": 0.30,
        "X52 welded": 0.30,
        "X60 welded": 0.26,
    }
)


def steel_resistivity(carbon_percent: npt.ArrayLike, temperature: npt.ArrayLike = 20.0) -> Array:
    """Resistivity of plain carbon steel, ohm m, bilinear between the measured points.

    Parameters
    ----------
    carbon_percent : % by weight, 0.06..1.22
    temperature : C, 20..400

    Raises
    ------
    RadioError
        With the valid range, for a value outside the measurements.
    """
    carbon = values_within("carbon", carbon_percent, CARBON)
    warm = values_within("temperature", temperature, TEMPERATURE)
    row, across = _place(CARBON_PERCENT, carbon)
    column, along = _place(TEMPERATURES, warm)
    cold_side = RESISTIVITY[row, column] * (1.0 - across) + RESISTIVITY[row + 1, column] * across
    warm_side = RESISTIVITY[row, column + 1] * (1.0 - across) + RESISTIVITY[row + 1, column + 1] * across
    return np.asarray(cold_side * (1.0 - along) + warm_side * along)


def carbon_of(grade: str) -> float:
    """Largest carbon content (% by weight) of a grade of API 5L.

    Raises
    ------
    RadioError
        For another grade; the message lists those that there are.
    """
    if grade not in API_5L:
        raise RadioError(f"grade: expected one of {', '.join(API_5L)}, got {grade!r:.40}")
    return API_5L[grade]


def _place(knots: Array, values: Array) -> tuple[npt.NDArray[np.intp], Array]:
    """Interval index of every value among the knots, and its place inside, 0..1."""
    k = np.clip(np.searchsorted(knots, values, side="right") - 1, 0, len(knots) - 2)
    return k, np.asarray((values - knots[k]) / (knots[k + 1] - knots[k]))
