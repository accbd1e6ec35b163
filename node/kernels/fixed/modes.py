"""State machine of a node in integers; the transitions and their reasons are those of ``node.kernels.modes``."""

from __future__ import annotations

from typing import Any, Final

from node.kernels.fixed.arithmetic import quotient, shift
from node.kernels.fixed.error_model import isolate
from node.kernels.fixed.layout import CEILING, RATE_Q, TIME_Q, UNKNOWN_VAR
from node.kernels.jit import constant, kernel
from node.kernels.layout import Array, Err, Status
from node.kernels.modes import STATIC_BIAS, TRACKING, UNBIASED_STILL_RATE

BX, PSI = constant(Err.BIAS_X), constant(Err.YAW)
STOPPED, STARTED, SURVEY_READY = int(Status.STOPPED), int(Status.STARTED), int(Status.SURVEY_READY)
JOINT_OPENED, JOINT_CLOSED = int(Status.JOINT_OPENED), int(Status.JOINT_CLOSED)
BIAS_KNOWN = int(Status.BIAS_KNOWN)
RATE_EXCEEDED, RATE_RECOVERED = int(Status.RATE_EXCEEDED), int(Status.RATE_RECOVERED)
UNBIASED_STILL: Final = round(UNBIASED_STILL_RATE * 2.0**RATE_Q)  # rad/s, Q46


@kernel
def is_quiet(state: Any, config: Any, rate: Array) -> int:
    """Whether a mean rate (3, rad/s, Q46) is that of a body at rest, 1 or 0."""
    if state.mode == STATIC_BIAS:
        return 1 if max(abs(rate[0]), abs(rate[1]), abs(rate[2])) < UNBIASED_STILL else 0
    for k in range(3):
        limit = config.still_rate if k == 2 else 2 * config.still_rate
        if abs(rate[k] - state.static_bias[k] - state.bias[k]) > limit:
            return 0
    return 1


@kernel
def learn_static_bias(state: Any, config: Any, rate: Array, dt: int, quiet: int) -> int:
    """Average the ``rate`` (3, Q46) of cycles of ``dt`` (s, Q28) at rest; returns status bits when it is known.

    var = (N^2 + 2 sigma_b^2 tau) / T: white noise and the Gauss-Markov part, averaged over T.
    """
    if quiet == 0:
        state.bias_count = 0
        for k in range(3):
            state.bias_sum[k] = 0
        return 0
    state.bias_count += 1
    for k in range(3):
        state.bias_sum[k] += rate[k]
    if state.bias_count < config.static_cycles:
        return 0
    total = max(state.bias_count * dt, 1)
    for k in range(3):
        state.static_bias[k] = (state.bias_sum[k] + (state.bias_count >> 1)) // state.bias_count
        state.static_bias_var[k] = shift(quotient(config.bias_area[k], total), 30 - TIME_Q)
        state.bias[k] = 0
        isolate(state.P, BX + k, min(config.bias_var[k] + state.static_bias_var[k], CEILING))
    state.mode = TRACKING
    return BIAS_KNOWN


@kernel
def guard_rate(state: Any, config: Any, rate_z: int) -> int:
    """Above one turn in two cycles the yaw aliases: it is declared unknown until the string slows down."""
    if abs(rate_z) >= config.rate_limit:
        first = state.rate_exceeded == 0
        state.rate_exceeded = 1
        state.yaw_known = 0
        isolate(state.P, PSI, UNKNOWN_VAR)
        return RATE_EXCEEDED if first else 0
    if state.rate_exceeded == 1:
        state.rate_exceeded = 0
        return RATE_RECOVERED
    return 0
