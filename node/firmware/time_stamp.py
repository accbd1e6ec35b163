"""Prior of the filter's time-stamp state: what the clock says of itself."""

from __future__ import annotations

import math

from node.firmware.inputs import RigContext
from node.kernels.error_model import isolate
from node.kernels.layout import CLOCK_SLACK, Array, Err

LEAST, LARGEST = 1e-4, CLOCK_SLACK  # s, whatever the clock says


class TimeStampPrior:
    """Keeps the configuration of one node in step with its clock.

    Parameters
    ----------
    states, configs : the node's records, one-element arrays
    """

    def __init__(self, states: Array, configs: Array) -> None:
        self._state, self._config = states[0], configs[0]
        self._walk, self._hops = float(self._config["stamp_walk"]), 0  # of one joint, s/sqrt(s)

    def follow(self, context: RigContext) -> None:
        """Let the prior be what the clock says of itself, and its wander that of the hops.

        The configuration is left alone while it is about right: another one costs the integer loop a conversion.
        """
        config = self._config
        if not context.synchronised or config["stamp_std"] == 0.0:
            return
        std = min(max(math.sqrt(context.clock_var), LEAST), LARGEST)
        hops = max(context.hops, 1)
        if hops == self._hops and 0.8 < std / float(config["stamp_std"]) < 1.25:
            return
        self._hops = hops
        config["stamp_std"] = std
        config["stamp_walk"] = self._walk * math.sqrt(hops)
        if self._state["last_aided"] == -math.inf:
            isolate(self._state["P"], Err.STAMP, std * std)
