"""Noise of a gyroscope as ``borechain allan --out`` writes it: what a node takes of a record at rest."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from telemetry.bounded_bytes import bounded_text
from telemetry.errors import LoggerError
from telemetry.messages import Vector3
from telemetry.records.sensor_columns import RATE, UNITS

AXES: Final = "xyz"
LARGEST: Final = math.radians(10.0)  # rad/s of a bias that wanders, rad/s/sqrt(Hz) of white noise; beyond, no gyroscope
LONGEST: Final = 1e6  # s, of a correlation time


@dataclass(frozen=True, slots=True)
class GyroNoise:
    """White noise (rad/s/sqrt(Hz)) and a Gauss-Markov bias (rad/s, s) of each axis."""

    white: Vector3
    bias_std: Vector3
    bias_tau: Vector3


def read_gyro_noise(path: Path) -> GyroNoise:
    """Noise of a file of ``borechain allan`` on a gyroscope's record.

    Raises
    ------
    LoggerError
        When it cannot be read, is of another sensor, or holds a number that no gyroscope has.
    """
    try:
        found = json.loads(bounded_text(path))
        unit, axes = found["unit"], [found["axes"][axis]["filter"] for axis in AXES]
    except (OSError, UnicodeDecodeError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise LoggerError(
            f"{path}: expected the --out file of borechain allan with three axes, got {error!r}"
        ) from error
    if unit not in UNITS[RATE]:
        raise LoggerError(f"{path}: unit: expected one of the {RATE}, {', '.join(UNITS[RATE])}, got {unit!r}")
    scale = UNITS[RATE][unit]
    return GyroNoise(
        _numbers(path, axes, "white", scale, LARGEST),
        _numbers(path, axes, "bias_std", scale, LARGEST),
        _numbers(path, axes, "bias_tau", 1.0, LONGEST),
    )


def _numbers(path: Path, axes: list[Any], name: str, scale: float, largest: float) -> Vector3:
    """One number of each axis in SI."""
    found: list[Any] = [axis.get(name) if isinstance(axis, dict) else None for axis in axes]
    for axis, value in zip(AXES, found, strict=True):
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not is_number or not 0.0 < scale * value <= largest:
            raise LoggerError(
                f"{path}: {axis}.{name}: expected a number above 0, at most {largest / scale:g}, got {value}"
            )
    x, y, z = (scale * value for value in found)
    return (x, y, z)
