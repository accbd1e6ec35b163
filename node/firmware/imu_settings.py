"""Settings of one IMU of a tube."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from node.errors import NodeConfigurationError
from telemetry.parameters import SensorParameters

MAX_CONDITION: Final = 100.0  # of a matrix in any unit; a turned mount has 1
FARTHEST: Final = 1.0  # m, of an IMU from the axis
UNCORRECTED: Final = SensorParameters()
ANYWHERE: Final = (-math.inf, math.inf)  # C
NOISIEST: Final = 100.0  # times the noise of the configuration, or the part of it


@dataclass(frozen=True, slots=True)
class ImuSettings:
    """What is known of one IMU."""

    offset: tuple[float, float] = (0.0, 0.0)  # m, place of the sensor across the tube's axis, x and y
    noise: float = 1.0  # standard deviation of its noise, in that of the node's configuration
    gyroscope: SensorParameters = UNCORRECTED  # its own correction, before the parameter block of the tube
    accelerometer: SensorParameters = UNCORRECTED
    corrected_within: tuple[float, float] = ANYWHERE  # C, temperatures at which these corrections were measured

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises
        ------
        ConfigurationError
            With the field, its range and what was given.
        """
        if not all(math.isfinite(x) and abs(x) < FARTHEST for x in self.offset):
            raise NodeConfigurationError(f"imu.offset: expected x and y within +-{FARTHEST:g} m, got {self.offset}")
        if not 1.0 / NOISIEST <= self.noise <= NOISIEST:
            raise NodeConfigurationError(
                f"imu.noise: expected a factor of {1.0 / NOISIEST:g}..{NOISIEST:g}, got {self.noise}"
            )
        low, high = self.corrected_within
        if not low < high:
            raise NodeConfigurationError(
                f"imu.corrected_within: expected a temperature and a higher one, got {low:g} and {high:g} C: the "
                "calibrations of its sensors have none in common"
            )
        for name in ("gyroscope", "accelerometer"):
            sensor: SensorParameters = getattr(self, name)
            finite = all(map(math.isfinite, sensor.numbers()))
            if not finite or np.linalg.cond(np.array(sensor.matrix)) > MAX_CONDITION:
                raise NodeConfigurationError(f"imu.{name}: expected finite numbers and a matrix that can be inverted")
