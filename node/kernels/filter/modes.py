"""State machine of a node: static bias, tracking, still, survey, held. Every transition is a status bit."""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import bounded_variance, mean_of_total
from node.kernels.arithmetic.quantity import rate_quantity, variance_quantity
from node.kernels.filter.covariance import set_apart
from node.kernels.filter.priors import bias_mean_var, bias_var
from node.kernels.record.filter_record import UNKNOWN_YAW_VAR, CycleStatus, Err

BX = kernel_constant(Err.BIAS_X)
UNKNOWN_VAR: Final = variance_quantity(UNKNOWN_YAW_VAR)  # rad^2
PSI = kernel_constant(Err.YAW)
STATIC_BIAS, TRACKING, STILL, SURVEY, HELD = 1, 3, 4, 5, 6  # telemetry.messages.NodeMode, which kernels do not see
STOPPED, STARTED, SURVEY_READY = int(CycleStatus.STOPPED), int(CycleStatus.STARTED), int(CycleStatus.SURVEY_READY)
JOINT_OPENED, JOINT_CLOSED = int(CycleStatus.JOINT_OPENED), int(CycleStatus.JOINT_CLOSED)
BIAS_KNOWN, RATE_EXCEEDED, RATE_RECOVERED = (
    int(CycleStatus.BIAS_KNOWN),
    int(CycleStatus.RATE_EXCEEDED),
    int(CycleStatus.RATE_RECOVERED),
)
UNBIASED_STILL_RATE: Final = rate_quantity(
    0.0087
)  # rad/s, 0.5 deg/s: still, for a gyroscope whose bias is not known yet


@kernel
def is_quiet(state: Any, config: Any, rate: Array) -> int:
    """Whether a mean rate (3, rad/s) is that of a body at rest, 1 or 0."""
    if state.mode == STATIC_BIAS:
        limit = UNBIASED_STILL_RATE
        return 1 if abs(rate[0]) < limit and abs(rate[1]) < limit and abs(rate[2]) < limit else 0
    for k in range(3):
        limit = config.still_rate if k == 2 else 2 * config.still_rate
        if abs(rate[k] - state.static_bias[k] - state.bias[k]) > limit:
            return 0
    return 1


@kernel
def learn_static_bias(state: Any, config: Any, rate: Array, dt: float, quiet: int) -> int:
    """Average the rate while standing still; after ``static_cycles`` it is the constant bias, with its variance.

    var = N^2 / T + 2 sigma_b^2 tau / T: white noise and the Gauss-Markov part, averaged over T.
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
    total = state.bias_count * dt
    for k in range(3):
        state.static_bias[k] = mean_of_total(state.bias_sum[k], state.bias_count)
        state.static_bias_var[k] = bias_mean_var(config, k, total)
        state.bias[k] = 0
        set_apart(state, BX + k, bounded_variance(bias_var(config, k) + state.static_bias_var[k]))
    state.mode = TRACKING
    return BIAS_KNOWN


@kernel
def guard_rate(state: Any, config: Any, rate_z: float) -> int:
    """Above one turn in two cycles the yaw aliases: it is declared unknown until the string slows down."""
    if abs(rate_z) >= config.rate_limit:
        first = state.rate_exceeded == 0
        state.rate_exceeded = 1
        state.yaw_known = 0
        set_apart(state, PSI, UNKNOWN_VAR)
        return RATE_EXCEEDED if first else 0
    if state.rate_exceeded == 1:
        state.rate_exceeded = 0
        return RATE_RECOVERED
    return 0


@kernel
def step_modes(state: Any, config: Any, quiet: int, joined: int, end: float) -> int:
    """Move between tracking, still, survey and held at the end of a cycle (s, node's clock); returns status bits.

    With ``SURVEY_READY`` the caller is to average the force.
    """
    status = JOINT_CLOSED if state.mode == HELD and (joined == 1 or quiet == 0) else 0
    if quiet == 0:
        if state.still_cycles > 0:
            status |= STARTED
        state.still_cycles = 0
        state.surveyed = 0
        if state.mode != STATIC_BIAS:
            state.mode = TRACKING
        return status
    if state.still_cycles == 0:
        state.stopped_at = end
        status |= STOPPED
    state.still_cycles += 1
    if state.mode == STATIC_BIAS:
        return status
    if joined == 0 and state.mode != HELD:
        status |= JOINT_OPENED
    state.mode = STILL if joined == 1 else HELD
    if state.surveyed == 0 and joined == 1 and state.still_cycles >= config.settle_cycles:
        state.surveyed = 1
        state.mode = SURVEY
        status |= SURVEY_READY
    return status
