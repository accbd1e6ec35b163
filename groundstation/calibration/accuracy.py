"""Accuracy and precision of a sensor against presets, and the posterior of several sensors.

m = (m1 s2^2 + m2 s1^2) / (s1^2 + s2^2) and s^-2 = s1^-2 + s2^-2, the product of two Gaussians.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Relative ``error`` (%) of a sensor and its standard deviation ``std``, as they are combined."""

    error: float
    std: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.error) and math.isfinite(self.std) and self.std > 0.0):
            raise CalibrationError(f"accuracy: expected a finite error and std > 0, got {self.error} and {self.std}")


@dataclass(frozen=True, slots=True)
class Characteristic:
    """Per preset (n,): mean, standard deviation and relative error (%) of a sensor."""

    preset: Array
    mean: Array
    std: Array
    error: Array

    def overall(self) -> Accuracy:
        """Mean relative error and mean standard deviation over the presets."""
        return Accuracy(float(self.error.mean()), float(self.std.mean()))


def relative_error(preset: Array, mean: Array) -> Array:
    """|x - mean| / |x| in %, of presets (n,) and means (n,) in one unit.

    Raises
    ------
    CalibrationError
        When a preset is zero, where nothing is relative, or a number is not finite.
    """
    if preset.shape != mean.shape or not (np.all(np.isfinite(preset)) and np.all(np.isfinite(mean))):
        raise CalibrationError(f"accuracy: expected a finite mean of each preset, got {preset.shape}, {mean.shape}")
    if np.any(preset == 0.0):
        raise CalibrationError("accuracy: expected presets other than 0, got 0: a relative error needs a size")
    return np.asarray(100.0 * np.abs(preset - mean) / np.abs(preset))


def sensor_characteristic(preset: Array, records: Sequence[Array]) -> Characteristic:
    """Characteristic of a sensor from a record of readings at each preset.

    Raises
    ------
    CalibrationError
        When a preset has no record, or one of fewer than two readings.
    """
    if len(records) != len(preset) or any(len(record) < 2 for record in records):
        counts = [len(record) for record in records]
        raise CalibrationError(f"accuracy: expected 2 readings or more of {len(preset)} presets, got {counts}")
    mean = np.array([record.mean() for record in records])
    std = np.array([record.std(ddof=1) for record in records])
    return Characteristic(preset, mean, std, relative_error(preset, mean))


def combined_accuracy(*sensors: Accuracy) -> Accuracy:
    """Posterior of independent sensors by inverse variance.

    Raises
    ------
    CalibrationError
        When there is no sensor.
    """
    if not sensors:
        raise CalibrationError("accuracy: expected at least one sensor, got none")
    # Weights relative to the best sensor neither overflow nor vanish.
    best = min(sensor.std for sensor in sensors)
    weights = [(best / sensor.std) ** 2 for sensor in sensors]
    total = math.fsum(weights)
    error = math.fsum(weight * sensor.error for weight, sensor in zip(weights, sensors, strict=True)) / total
    return Accuracy(error, best / math.sqrt(total))
