"""Impossible temperatures: told, and no correction by them.

A reading whose correction follows the temperature means nothing without it and is left out, so that the filter's
variance grows; another is as good as before, and keeps the last temperature that was one.
"""

from __future__ import annotations

from collections.abc import Callable

from node.firmware.imu_settings import ImuSettings
from node.firmware.inputs import ImuReading
from node.kernels.sensors.correction import USUAL
from node.process.drivers.source import NOTHING, Say
from telemetry.frozen import replace
from telemetry.messages import Scalar, Severity
from telemetry.parameters import ParameterBlock, SensorParameters

COLDEST, HOTTEST = -45.0, 125.0  # C, beyond any range in which a sensor is sold


class TemperatureWatch:
    """Of the IMUs of a node; ``block_in_use`` gives its parameters."""

    def __init__(self, say: Say, imus: tuple[ImuSettings, ...], block_in_use: Callable[[], ParameterBlock]) -> None:
        self._say, self._imus, self._block_in_use = say, imus, block_in_use
        self._last: dict[int, float] = {}
        self._lost: set[int] = set()

    def look(self, reading: ImuReading) -> ImuReading:
        """Reading of a cycle whose temperatures are temperatures."""
        if COLDEST < reading.temperature < HOTTEST and not (reading.others or self._lost):  # the usual one, in one call
            self._last[0] = reading.temperature
            return reading
        first = self._look_at(reading, 0)
        others = tuple(self._look_at(other, k) for k, other in enumerate(reading.others, 1))
        return replace(first, others=others) if others else first

    def _look_at(self, reading: ImuReading, imu: int) -> ImuReading:
        which: dict[str, Scalar] = {"imu": imu + 1} if len(self._imus) > 1 else {}
        if COLDEST < reading.temperature < HOTTEST:
            self._last[imu] = reading.temperature
            if imu in self._lost:
                self._lost.remove(imu)
                self._say(Severity.WARNING, "temperature_back", which)
            return reading
        own, block = self._imus[min(imu, len(self._imus) - 1)], self._block_in_use()
        sensors = (own.gyroscope, own.accelerometer, block.gyroscope, block.accelerometer)
        is_followed = any(map(follows_temperature, sensors))
        if imu not in self._lost:
            self._lost.add(imu)
            detail = f"expected {COLDEST:g}..{HOTTEST:g} C, got {reading.temperature:g}"
            self._say(Severity.ERROR, "temperature_lost", {"detail": detail, "readings_used": not is_followed, **which})
        known = replace(reading, temperature=self._last.get(imu, float(USUAL)))
        return replace(known, rate=NOTHING, force=NOTHING) if is_followed else known


def follows_temperature(sensor: SensorParameters) -> bool:
    """Whether a correction depends on the temperature."""
    slopes = [*sensor.bias_slopes, *(row for matrix in sensor.matrix_slopes for row in matrix)]
    return any(value != 0.0 for row in slopes for value in row)
