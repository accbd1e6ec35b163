"""Readings of a node's IMUs on their way into the loop: corrected, turned into the tube's frame, fused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from node.firmware.block_trial import record_of
from node.firmware.cluster import Cluster
from node.firmware.inputs import ImuReading
from node.firmware.settings import TubeSettings
from node.kernels.alignment import to_tube
from node.kernels.calibration import USUAL, calibrate
from node.kernels.layout import Array
from telemetry.parameters import ParameterBlock


class ImuFusion:
    """What the loop gets of one cycle.

    Parameters
    ----------
    settings : of the tube, with those of every IMU
    mount, states, configs : the node's records, one-element arrays
    """

    def __init__(self, settings: TubeSettings, mount: Array, states: Array, configs: Array) -> None:
        count = len(settings.imus)
        self.rate, self.force = np.zeros(3), np.zeros(3)  # rad/s, m/s^2, of all IMUs together, tube's frame
        self.rates, self._forces = np.zeros((2, count, 3))  # of each
        self.unaligned = np.zeros((count, 3))  # m/s^2, corrected, in the frame of each IMU
        self.axes = mount[0]["axis"][:count]
        own = [ParameterBlock(settings.tube, 0, imu.gyroscope, imu.accelerometer) for imu in settings.imus]
        self._own = [record_of(block)[0] for block in own]
        self.cluster: Cluster | None = None
        if count > 1:
            self.cluster = Cluster(settings.imus, mount, states, configs, settings.limits)

    def fuse(self, reading: ImuReading, correction: Array, expected: Array, *, heard: bool) -> ImuReading:
        """Leave ``rate`` and ``force`` of the cycle; returns the raw reading behind them.

        Parameters
        ----------
        correction : the parameter block in use, one-element array
        expected : (6,) rad/s and m/s^2, the reading if nothing had changed
        heard : the encoder's rate is known
        """
        readings = self._readings(reading)
        for k, one in enumerate(readings):
            rate, force = self.rates[k], self._forces[k]
            rate[:], force[:] = one.rate, one.force
            if not self._own[k]["identity"]:
                calibrate(self._own[k], one.temperature, rate, force)
                readings[k] = replace(one, rate=tuple(rate.tolist()), force=tuple(force.tolist()))
            calibrate(correction[0], one.temperature, rate, force)
            self.unaligned[k] = force
            to_tube(self.axes[k], rate)
            to_tube(self.axes[k], force)
        if self.cluster is None:
            self.rate[:], self.force[:] = self.rates[0], self._forces[0]
            return readings[0]
        raw = [(one.rate, one.force, one.saturated) for one in readings]
        self.cluster.fuse_readings(raw, self.rates, self._forces, expected, heard=heard)
        self.rate[:], self.force[:] = self.cluster.rate, self.cluster.force
        used = [one.temperature for one, used in zip(readings, self.cluster.used, strict=True) if used]
        temperature = math.fsum(used) / len(used) if used else USUAL
        return ImuReading(reading.start, reading.end, *self.cluster.mean_raw(raw), temperature)

    def _readings(self, reading: ImuReading) -> list[ImuReading]:
        """Of every IMU of the cluster; no numbers of one that brought none."""
        came = [reading, *reading.others][: len(self.axes)]
        none = ImuReading(reading.start, reading.end, (math.nan,) * 3, (math.nan,) * 3)
        return came + [none] * (len(self.axes) - len(came))
