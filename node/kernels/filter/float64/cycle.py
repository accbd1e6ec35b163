"""One execution cycle of a node, compiled whole: modes, increments, filter, prediction to now."""

from __future__ import annotations

import math
from typing import Any

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.filter.float64.fixed_lag import filter_due_cycles, predict_to_now
from node.kernels.filter.modes import STATIC_BIAS, SURVEY_READY, guard_rate, is_quiet, learn_static_bias, step_modes
from node.kernels.filter.moving_average import average_force
from node.kernels.record.filter_record import STATES, CycleStatus
from node.kernels.record.ring import push_increments

BAD_SAMPLE, FILTER_FAULT = int(CycleStatus.BAD_SAMPLE), int(CycleStatus.FILTER_FAULT)


@kernel
def run_cycle(state: Any, config: Any, rate: Array, force: Array, start: float, end: float, joined: int) -> int:
    """Take one cycle's IMU reading and leave the yaw at its end in the ``now_*`` fields; returns ``CycleStatus`` bits.

    Parameters
    ----------
    state, config : records of dtype ``STATE`` and ``CONFIG``
    rate : (3,) mean angular rate over the cycle, calibrated, rad/s, body frame
    force : (3,) mean specific force over the cycle, calibrated, m/s^2, body frame
    start, end : s, the node's clock
    joined : 1 while the upper joint is closed, else 0
    """
    for k in range(3):
        if not (math.isfinite(rate[k]) and math.isfinite(force[k])):
            return BAD_SAMPLE
    quiet = is_quiet(state, config, rate)
    status = guard_rate(state, config, rate[2])
    push_increments(state, start, end, rate, force, quiet)
    if state.mode == STATIC_BIAS:
        status |= learn_static_bias(state, config, rate, end - start, quiet)
    status |= filter_due_cycles(state, config)
    predict_to_now(state, config)
    status |= step_modes(state, config, quiet, joined, end)
    if status & SURVEY_READY:
        average_force(state, config.survey_samples)
    for i in range(STATES):
        if not (state.P[i, i] >= 0.0 and math.isfinite(state.P[i, i])):
            return status | FILTER_FAULT
    return status
