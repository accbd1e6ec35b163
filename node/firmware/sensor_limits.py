"""What a sane reading of one IMU is; validated where it enters."""

from __future__ import annotations

import math
from dataclasses import dataclass

from node.errors import NodeConfigurationError


@dataclass(frozen=True, slots=True)
class SensorLimits:
    """Ranges and repetitions beyond which a sensor is faulty."""

    rate_range: float = math.radians(500.0)  # rad/s
    force_range: float = 8.0 * 9.80665  # m/s^2
    repeats_together: int = 4  # of all axes of a sensor; 0 switches it off
    repeats_alone: int = 8  # of one axis; 0 switches it off, for a sensor whose noise is below its resolution

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises
        ------
        ConfigurationError
            With the field, its range and what was given.
        """
        for name, value in (("rate_range", self.rate_range), ("force_range", self.force_range)):
            if not (math.isfinite(value) and value > 0.0):
                raise NodeConfigurationError(f"limits.{name}: expected a range above 0, got {value}")
        for name, count in (("repeats_together", self.repeats_together), ("repeats_alone", self.repeats_alone)):
            if count < 0:
                raise NodeConfigurationError(f"limits.{name}: expected 0 or more cycles, got {count}")


USUAL_LIMITS = SensorLimits()
