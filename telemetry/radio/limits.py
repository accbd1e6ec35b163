"""Validity ranges of the models, and the one line that says which was left."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from telemetry.errors import RadioError

Array = npt.NDArray[np.float64]
SPEED_OF_LIGHT: Final = 299_792_458.0  # m/s
MAGNETIC_CONSTANT: Final = 4e-7 * np.pi  # H/m
ELECTRIC_CONSTANT: Final = 1.0 / (MAGNETIC_CONSTANT * SPEED_OF_LIGHT**2)  # F/m
IMPEDANCE: Final = MAGNETIC_CONSTANT * SPEED_OF_LIGHT  # ohm, of free space


class ModelRange(NamedTuple):
    """Closed interval in which a model holds; ``scale`` and ``unit`` are those of its text."""

    low: float
    high: float
    scale: float = 1.0
    unit: str = ""

    def __str__(self) -> str:
        return f"{self.low * self.scale:g}..{self.high * self.scale:g} {self.unit}".rstrip()


def values_within(name: str, values: npt.ArrayLike, limits: ModelRange) -> Array:
    """Values as floats, every one inside the limits.

    Raises
    ------
    RadioError
        Naming the quantity, the valid range and the first value outside.
    """
    array = np.asarray(values, float)
    outside = ~((array >= limits.low) & (array <= limits.high))  # NaN is outside
    if outside.any():
        first = float(array[outside].flat[0]) if array.ndim else float(array)
        raise RadioError(f"{name}: expected {limits}, got {first * limits.scale:g}")
    return array


def positive_values(name: str, values: npt.ArrayLike, unit: str, scale: float = 1.0) -> Array:
    """Values as floats, every one finite and above zero.

    Raises
    ------
    RadioError
        Naming the quantity and the first value that is not.
    """
    array = np.asarray(values, float)
    outside = ~((array > 0.0) & np.isfinite(array))
    if outside.any():
        first = float(array[outside].flat[0]) if array.ndim else float(array)
        raise RadioError(f"{name}: expected more than 0 {unit}, got {first * scale:g}")
    return array
