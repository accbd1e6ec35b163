"""The update with a measured yaw, in integers: gate, reset and recovery as in ``float64.fixed_lag``."""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import ANGLE_Q, CEILING, LEVEL_Q, RATE_Q, UNIT, VAR_Q
from node.kernels.arithmetic.integers import multiply_q31, rounded_shift
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.trigonometry import TURN, counts_difference, counts_to_radians
from node.kernels.filter.covariance import set_apart
from node.kernels.filter.fixed.update import UNITY, correct_states, innovation_var
from node.kernels.record.filter_record import CycleStatus, Err

PSI, BZ, D = kernel_constant(Err.YAW), kernel_constant(Err.BIAS_Z), kernel_constant(Err.STAMP)
AIDED, REJECTED, YAW_RESET = int(CycleStatus.AIDED), int(CycleStatus.REJECTED), int(CycleStatus.YAW_RESET)
RATE_RIGHT: Final = RATE_Q + UNIT - LEVEL_Q  # from rad/s to rad a stamp unit in Q31
SQUARE_RIGHT: Final = ANGLE_Q - VAR_Q // 2


@kernel
def reset_yaw(state: Any, config: Any, yaw: int, var: int) -> None:
    """Take the yaw (binary) from the aiding; the bias is re-inflated and no cross term is kept, for they are stale."""
    state.yaw = yaw & TURN
    set_apart(state, PSI, min(var, CEILING))
    set_apart(state, BZ, max(min(config.bias_var[2] + state.static_bias_var[2], CEILING), state.P[BZ, BZ]))
    state.bias[2] = 0
    state.yaw_known = 1
    state.rejected = 0


@kernel
def apply_aiding(state: Any, config: Any, yaw: int, r_var: int, rate: int, at: int) -> int:
    """Update with a yaw at the filter's epoch, where the spin is ``rate``; returns ``CycleStatus`` bits.

    Parameters
    ----------
    yaw : binary angle
    r_var : rad^2, Q56
    rate : rad/s, Q46, up to 32
    at : s, Q28
    """
    h = rounded_shift(rate, RATE_RIGHT)
    unknown_var = r_var + multiply_q31(multiply_q31(config.stamp_var, h), h)
    if state.yaw_known == 0:
        reset_yaw(state, config, yaw, unknown_var)
        state.last_aided = at
        return AIDED | YAW_RESET
    of_stamp = h if config.stamp_on == 1 else 0
    s = innovation_var(state, PSI, UNITY, D, of_stamp, r_var)
    residual = counts_to_radians(counts_difference(yaw, int(state.yaw)))
    state.innovation = residual
    state.innovation_var = s
    coarse = rounded_shift(residual, SQUARE_RIGHT)
    if multiply_q31(coarse * coarse, config.gate_inverse) > s:
        state.rejected += 1
        state.last_sequence = -1  # it was not used: its repetition at rest is to be judged again
        if state.rejected < config.reject_limit:
            return REJECTED
        reset_yaw(state, config, yaw, unknown_var)
        set_apart(state, D, config.stamp_var)
        state.stamp = 0
        state.last_aided = at
        return REJECTED | AIDED | YAW_RESET
    correct_states(state, PSI, UNITY, D, of_stamp, s, residual)
    state.rejected = 0
    state.last_aided = at
    return AIDED
