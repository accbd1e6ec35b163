"""Gravity as a witness of an accelerometer at rest: a force that is far from it is the sensor's, by its size.

A range that falls back doubles or quarters every force, and an axis that is dead takes its part: neither shows in a
register that reads well, and a direction that is wrong looks like any other. A sensor from the box is off by 8 % at
most (MPU-6050: 3 % of scale, 80 mg of offset), so 15 % is a fault; smaller errors are for a calibration.
"""

from __future__ import annotations

import math
from typing import Final

from node.errors import SensorCause, SensorError
from telemetry.messages import Vector3

G: Final = 9.80665  # m/s^2
FARTHEST: Final = 0.15  # of gravity, of a force at rest
SAME_FORCE: Final = 0.1  # m/s^2, between two cycles at rest; turning about an axis that leans by 1 deg moves it by more
SAME_RATE: Final = math.radians(0.5)  # rad/s, the same; whatever the bias


class GravityWitness:
    """Of one IMU, cycle by cycle."""

    def __init__(self) -> None:
        self._rate: Vector3 | None = None
        self._force: Vector3 | None = None

    def look(self, rate: Vector3, force: Vector3) -> None:
        """Take the means of a cycle (rad/s, m/s^2).

        Raises
        ------
        SensorError
            When two cycles at rest show a force that is not gravity.
        """
        before, then = self._rate, self._force
        self._rate, self._force = rate, force
        if before is None or then is None:
            return
        if not (is_near(rate, before, SAME_RATE) and is_near(force, then, SAME_FORCE)):
            return
        size = math.hypot(*force)
        if abs(size - G) > FARTHEST * G:
            raise SensorError(
                f"a force of {size:.2f} m/s^2 at rest, expected gravity of {G:.2f} within {100 * FARTHEST:.0f} %",
                SensorCause.GRAVITY,
            )


def is_near(one: Vector3, other: Vector3, most: float) -> bool:
    """Whether three numbers differ by at most so much each; never for one that is not finite."""
    return all(abs(a - b) <= most for a, b in zip(one, other, strict=True))
