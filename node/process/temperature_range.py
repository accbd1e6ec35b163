"""Temperatures beyond those at which a correction was measured: told, and in the variance of the bias.

A polynomial is followed beyond its temperatures, for a line goes on better than it stops; but what it adds there was
measured nowhere, and may be wrong by all of it. So the gyroscope's bias wanders by as much, until the temperature is
back.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from node.firmware.imu_settings import ImuSettings
from node.firmware.inputs import ImuReading
from node.kernels.arithmetic.formats import Array
from node.kernels.filter.resets import doubt_bias
from node.process.drivers.source import Say
from telemetry.messages import Scalar, Severity
from telemetry.parameters import SensorParameters

NARROWER: Final = 0.5  # K within the range, before a temperature is said to be back


class TemperatureRange:
    """Of the IMUs of a node.

    Parameters
    ----------
    say : tells an event
    imus : settings, with the ranges of their corrections
    """

    def __init__(self, say: Say, imus: tuple[ImuSettings, ...]) -> None:
        self._say, self._imus = say, imus
        self._told = [False] * len(imus)
        self._largest = np.zeros(3)  # rad/s, that the bias was doubted by since it was beyond
        self._usual = np.zeros(3)  # rad/s, that it wandered by before, and by what was written then
        self._written = np.zeros(3)
        self.watched = any(math.isfinite(end) for imu in imus for end in imu.corrected_within)

    def look(self, reading: ImuReading, state: Any, config: Any) -> None:
        """Take the temperatures of a cycle; ``state`` and ``config`` of the filter have what it may be wrong by."""
        if not self.watched:
            return
        added, beyond = np.zeros(3), False
        for k, one in enumerate((reading, *reading.others)[: len(self._imus)]):
            if math.isfinite(one.temperature):
                low, high = self._imus[k].corrected_within
                off = one.temperature - min(max(one.temperature, low), high)
                self._tell(k, one.temperature, off)
                added += np.abs(unmeasured_bias(self._imus[k], off))
                beyond = beyond or off != 0.0
        self._doubt(added / len(self._imus), state, config)
        if not beyond:
            self._calm(config)

    def _doubt(self, added: Array, state: Any, config: Any) -> None:
        """The bias wanders by what was ``added`` (3,) rad/s, from now on."""
        for k, moved in enumerate(added.tolist()):
            if moved > config["bias_std"][k]:
                self._usual[k] = self._usual[k] or config["bias_std"][k]
                self._written[k] = config["bias_std"][k] = moved
            if moved > self._largest[k]:
                doubt_bias(state, k, moved**2 - self._largest[k] ** 2)
                self._largest[k] = moved

    def _calm(self, config: Any) -> None:
        """Within again: the bias wanders as before, unless something else has widened it since."""
        for k in range(3):
            if self._usual[k] and config["bias_std"][k] == self._written[k]:
                config["bias_std"][k] = self._usual[k]
        self._largest[:] = self._usual[:] = 0.0

    def _tell(self, imu: int, temperature: float, off: float) -> None:
        low, high = self._imus[imu].corrected_within
        which: dict[str, Scalar] = {"imu": imu + 1} if len(self._imus) > 1 else {}
        if off != 0.0 and not self._told[imu]:
            self._told[imu] = True
            found: dict[str, Scalar] = {"temperature_c": temperature, "low_c": low, "high_c": high}
            self._say(Severity.WARNING, "temperature_beyond", found | which)
        elif self._told[imu] and low + NARROWER <= temperature <= high - NARROWER:
            self._told[imu] = False
            self._say(Severity.WARNING, "temperature_within", which)


def unmeasured_bias(imu: ImuSettings, off: float) -> Array:
    """What a gyroscope's polynomials add (3,) rad/s from the end of their range to ``off`` it (K, negative below)."""
    if off == 0.0:
        return np.zeros(3)
    end = imu.corrected_within[1 if off > 0.0 else 0]
    return np.asarray(bias_at(imu.gyroscope, end + off) - bias_at(imu.gyroscope, end))


def bias_at(sensor: SensorParameters, temperature: float) -> Array:
    """Bias (3,) of a sensor at a temperature (C), beyond its constant."""
    powers = np.arange(1, len(sensor.bias_slopes) + 1)
    return np.asarray((temperature - sensor.reference) ** powers @ np.array(sensor.bias_slopes))
