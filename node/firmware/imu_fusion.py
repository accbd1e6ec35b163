"""Readings of a cluster's IMUs on their way into the step: corrected, turned into the tube's frame, fused."""

from __future__ import annotations

import math

import numpy as np

from node.firmware.cluster import Cluster
from node.firmware.settings import TubeSettings
from node.kernels.calibration import USUAL
from node.kernels.guard import is_heard
from node.kernels.layout import Array
from node.kernels.record import FX, TEMPERATURE, WX
from node.kernels.step import correct_one, correct_reading


class ImuFusion:
    """Leaves in the node's record what one IMU would have read.

    Parameters
    ----------
    settings : of the tube, with those of at least two IMUs
    crew : the same as a record, one-element array of dtype ``SETTINGS``
    nodes, configs : the node's records, one-element arrays
    """

    def __init__(self, settings: TubeSettings, crew: Array, nodes: Array, configs: Array) -> None:
        count = len(settings.imus)
        self.rates, self._forces = np.zeros((2, count, 3))  # of each, tube's frame
        self.cluster = Cluster(settings.imus, crew, nodes, configs)
        self._node, self._gravity = nodes[0], float(configs["gravity"][0])

    def fuse(self, parameters: Array, readings: Array) -> None:
        """Correct and fuse one cycle's ``readings`` (imus, 8); ``parameters`` as ``node.kernels.step.node_step``."""
        node = self._node
        for k in range(len(readings)):
            correct_reading(node, parameters, readings, k)
            self.rates[k], self._forces[k] = readings[k, WX : WX + 3], readings[k, FX : FX + 3]
            correct_one(node, parameters, k, readings[k, TEMPERATURE], self.rates[k], self._forces[k])
        cluster = self.cluster
        cluster.fuse_readings(readings, self.rates, self._forces, self._expected(), heard=bool(is_heard(node)))
        node["rate"], node["force"] = cluster.rate, cluster.force
        node["raw_rate"], node["raw_force"] = cluster.mean_raw(readings)
        used = readings[cluster.used, TEMPERATURE].tolist()
        node["temperature"] = math.fsum(used) / len(used) if used else USUAL

    def _expected(self) -> Array:
        """Rate (rad/s) and force (m/s^2) that the node would read in this cycle if nothing had changed: (6,)."""
        state, guard = self._node["filter"], self._node["guard"]
        rate = state["static_bias"] + state["bias"]
        rate[2] += guard["rate"] if is_heard(self._node) else guard["sane_rate"]
        return np.concatenate([rate, -self._gravity * state["now_down"]])
