"""The integer loop behind the interface of the float64 kernels: one object a node, on the node's float64 records.

The integers are the filter. The float64 record is their shadow: it is written after every call, for reports and the
saved state, and read back when somebody changed it (a new parameter block, a start from the saved state).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from node.kernels.angles import to_binary
from node.kernels.fixed.border import (
    COVARIANCE,
    LARGEST,
    learn_config,
    learn_state,
    show_aiding,
    show_covariance,
    show_cycle,
    show_survey,
    take_reading,
    to_fixed,
)
from node.kernels.fixed.cycle import run_cycle
from node.kernels.fixed.layout import CEILING, FIXED_STATE, TIME_Q, VAR_Q
from node.kernels.fixed.relay import offer_aiding
from node.kernels.layout import Array, Status
from node.kernels.warm import warm_loop


class FixedNode:
    """Integers of one node; ``run_cycle`` and ``offer_aiding`` have the signatures of the float64 kernels."""

    def __init__(self) -> None:
        self._state = np.zeros(1, FIXED_STATE)
        self._config = np.zeros(1, np.int64)
        self._shown = self._settings = b""
        self._gravity = 1.0
        self._rate, self._force = np.zeros(3, np.int64), np.zeros(3, np.int64)

    @property
    def overflows(self) -> int:
        """Numbers that did not fit since the start."""
        return int(self._state[0]["overflows"])

    @property
    def state(self) -> Any:
        """The integers, one record of dtype ``FIXED_STATE``."""
        return self._state[0]

    def run_cycle(
        self, state: Any, config: Any, rate: Array, force: Array, start: float, end: float, joined: int
    ) -> int:
        """One execution cycle as ``node.kernels.cycle.run_cycle``."""
        if not (np.isfinite(rate).all() and np.isfinite(force).all()):
            return int(Status.BAD_SAMPLE)
        self._learn(state, config)
        fixed = self._state[0]
        take_reading(fixed, rate, force, self._gravity, self._rate, self._force)
        begin, until = (to_fixed(fixed, at, TIME_Q, LARGEST) for at in (start, end))
        status = int(run_cycle(fixed, self._config[0], self._rate, self._force, begin, until, joined))
        show_cycle(fixed, state, self._gravity)
        show_covariance(fixed, state, COVARIANCE)
        show_aiding(fixed, state)
        if status & Status.SURVEY_READY:
            show_survey(fixed, state, self._gravity)
        self._shown = state.tobytes()
        return status

    def offer_aiding(
        self,
        state: Any,
        config: Any,
        yaw: float,
        yaw_var: float,
        systematic_var: float,
        offset: float,
        valid_at: float,
        sequence: int,
        hops: int,
    ) -> int:
        """Queue one aiding as ``node.kernels.relay.offer_aiding``."""
        self._learn(state, config)
        fixed = self._state[0]
        status = int(
            offer_aiding(
                fixed,
                self._config[0],
                to_binary(yaw),
                to_fixed(fixed, yaw_var, VAR_Q, CEILING),
                to_fixed(fixed, systematic_var, VAR_Q, CEILING),
                to_binary(offset),
                to_fixed(fixed, valid_at, TIME_Q, LARGEST),
                sequence,
                hops,
            )
        )
        show_aiding(fixed, state)
        if status & Status.REFERENCE_CHANGED:
            show_covariance(fixed, state, COVARIANCE)
        self._shown = state.tobytes()
        return status

    def _learn(self, state: Any, config: Any) -> None:
        """Read configuration and state when they are not what was read or shown last."""
        overflows = self.overflows
        settings = config.tobytes()
        if settings != self._settings:
            self._settings = settings
            self._gravity = float(config["gravity"])
            self._config, beyond = learn_config(config)
            overflows += beyond
            self._state[0]["overflows"] = overflows
        if state.tobytes() != self._shown:
            self._state = learn_state(state, self._gravity, overflows)


def warm_up() -> None:
    """Compile the integer loop, or load it from the cache, on a state that is thrown away."""
    node = FixedNode()
    warm_loop(node.run_cycle, node.offer_aiding)
