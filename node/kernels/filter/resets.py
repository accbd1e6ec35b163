"""What makes a filter start anew in part: every write to the covariance from outside the filter's own mathematics.

A reset keeps no cross term of what it sets: they are stale. Each is named by its reason; nothing else in the firmware
writes the covariance.
"""

from __future__ import annotations

import math
from typing import Any, Final

from node.kernels.arithmetic.formats import RATE_Q, UNIT
from node.kernels.arithmetic.integers import multiply_q31, rounded_shift
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import bounded_variance, by_record, stamp_before
from node.kernels.arithmetic.quantity import LONG_AGO, NOT_YET, ONE, variance_quantity
from node.kernels.filter.covariance import isolate_state, set_apart
from node.kernels.filter.modes import STATIC_BIAS
from node.kernels.filter.priors import bias_var, boot_bias_var, scale_var, stamp_var
from node.kernels.record.filter_record import STATES, UNKNOWN_YAW_VAR, Err

TX, TY, PSI = kernel_constant(Err.TILT_X), kernel_constant(Err.TILT_Y), kernel_constant(Err.YAW)
BX, BZ, S, D = (
    kernel_constant(Err.BIAS_X),
    kernel_constant(Err.BIAS_Z),
    kernel_constant(Err.SCALE),
    kernel_constant(Err.STAMP),
)
RATE_RIGHT: Final = RATE_Q - 31 + UNIT  # from rad/s to rad a unit of time in Q31
UNKNOWN_TILT_VAR: Final = variance_quantity(1.0)  # rad^2
UNKNOWN_VAR: Final = variance_quantity(UNKNOWN_YAW_VAR)  # rad^2
UNIFORM_VAR: Final = variance_quantity((math.pi / math.sqrt(3.0)) ** 2)  # rad^2, of the whole turn


@kernel
def copy_covariance(state: Any) -> None:
    """Show the filter's covariance as the present one."""
    for i in range(STATES):
        for j in range(STATES):
            state.now_P[i, j] = state.P[i, j]


def _turn_present(node: Any, rate: int) -> None:
    state = node.filter
    a_unit = rounded_shift(rate, RATE_RIGHT)
    with_stamp = multiply_q31(state.now_P[PSI, D], a_unit)
    own = multiply_q31(multiply_q31(state.now_P[D, D], a_unit), a_unit)
    state.now_P[PSI, PSI] = max(state.now_P[PSI, PSI] + 2 * with_stamp + own, 0)


@by_record(_turn_present)
def turn_present(node: Any, rate: float) -> None:
    """The yaw of the present was turned on by the time stamp's estimate times a ``rate`` (rad/s): its variance.

    An aiding shows yaw and time stamp together, so the error of the one is mostly taken back by that of the other.
    """
    state = node.filter
    with_stamp, own = rate * state.now_P[PSI, D], rate * rate * state.now_P[D, D]
    state.now_P[PSI, PSI] = max(state.now_P[PSI, PSI] + 2.0 * with_stamp + own, 0.0)


@kernel
def open_yaw(state: Any, var: float) -> None:
    """The yaw may have moved by a further ``var`` (rad^2), of which the rest knows nothing; cross terms stay true."""
    state.P[PSI, PSI] = bounded_variance(state.P[PSI, PSI] + var)


@kernel
def doubt_yaw(state: Any, var: float) -> None:
    """The yaw may be off by a further ``var`` (rad^2): an encoder at rest, which repeats itself, is to tell it anew."""
    open_yaw(state, var)
    state.last_sequence = -1


@kernel
def lose_yaw(state: Any) -> None:
    """Nothing is known of the yaw, now and at the filter's epoch."""
    set_apart(state, PSI, UNKNOWN_VAR)
    isolate_state(state.now_P, PSI, UNKNOWN_VAR)


@kernel
def lose_yaw_ahead(state: Any) -> None:
    """Nothing is known of the yaw from the filter's epoch on; what is said of the present stays until the cycle."""
    set_apart(state, PSI, UNKNOWN_VAR)


@kernel
def settle_yaw(state: Any, aiding_var: float) -> None:
    """A yaw that proved itself: a rest is one measurement (``aiding_var``, rad^2), however often it was used."""
    var = max(state.P[PSI, PSI], aiding_var)
    set_apart(state, PSI, var)
    state.now_P[PSI, PSI] = max(state.now_P[PSI, PSI], var)


@kernel
def open_biases(state: Any, config: Any) -> None:
    """A gyroscope that may be another one: each bias has at least its prior, the scale no cross terms."""
    for k in range(3):
        prior = bounded_variance(bias_var(config, k) + state.static_bias_var[k])
        set_apart(state, BX + k, max(prior, state.P[BX + k, BX + k]))
    set_apart(state, S, state.P[S, S])


@kernel
def take_mismatch(state: Any, of_bias: float, of_scale: float) -> None:
    """The gyroscope's bias or scale took a step: their variances are opened, and the yaw starts again."""
    set_apart(state, PSI, UNKNOWN_VAR)
    set_apart(state, BZ, bounded_variance(of_bias))
    set_apart(state, S, of_scale)
    isolate_state(state.now_P, PSI, UNKNOWN_VAR)


@kernel
def forget_scale(state: Any, scale: float, var: float) -> None:
    """What was learnt of the scale since it was ``scale``, with a variance of ``var``, was not the gyroscope's."""
    state.scale = scale
    set_apart(state, S, var)


@kernel
def lose_tilt(state: Any) -> None:
    """Nothing is known of how the tube leans: an old tilt would be explained as a gyroscope's bias."""
    set_apart(state, TX, UNKNOWN_TILT_VAR)
    set_apart(state, TY, UNKNOWN_TILT_VAR)


@kernel
def set_stamp_prior(state: Any, var: float) -> None:
    """The time stamp of an aiding is off by so much (s^2) for all that is known: what was learnt of it is void."""
    state.stamp = 0
    set_apart(state, D, var)


@kernel
def move_dates(state: Any, later: float) -> None:
    """The clock has dated everything by a known time ``later`` (s) since: what was learnt of its error still holds."""
    state.stamp = stamp_before(state.stamp, later)
    for k in range(state.pending):
        state.pending_at[k] += later


@kernel
def forget_dates(state: Any) -> None:
    """Drop waiting aidings: their clock cannot be compared with the present one. They may come again, dated anew."""
    state.pending = 0
    state.last_sequence = -1


@kernel
def doubt_stamp(state: Any, var: float) -> None:
    """The clock has moved by so much (s^2) since the time stamp's error was learnt."""
    state.P[D, D] = bounded_variance(state.P[D, D] + var)


@kernel
def doubt_bias(state: Any, k: int, var: float) -> None:
    """The mean of the cluster's gyroscopes is another one: bias ``k`` is in doubt by a further ``var`` ((rad/s)^2)."""
    state.P[BX + k, BX + k] = bounded_variance(state.P[BX + k, BX + k] + var)


@kernel
def move_bias(state: Any, k: int, rate: float, var: float, wander_var: float) -> None:
    """The constant bias ``k`` is another one (rad/s, its variance and that of what it may wander, (rad/s)^2)."""
    state.static_bias[k] = rate
    state.static_bias_var[k] = var
    state.bias[k] = 0
    set_apart(state, BX + k, bounded_variance(var + wander_var))


@kernel
def forget_bias(state: Any, config: Any) -> None:
    """Learn the static bias again, as after a first start: what was learnt was that of other parameters."""
    for k in range(3):
        state.static_bias[k] = 0
        state.static_bias_var[k] = 0
        state.bias[k] = 0
        state.bias_sum[k] = 0
        set_apart(state, BX + k, boot_bias_var(config))
    state.scale = 0
    state.bias_count = 0
    state.mode = STATIC_BIAS
    set_apart(state, S, scale_var(config))


@kernel
def resume_filter(state: Any) -> None:
    """Make a saved filter ready for its first cycle after an outage of unknown length.

    The constants (bias, scale, offset) are kept. The attitude is kept as the best guess; if the string was turning when
    the state was saved nothing is known of it: the variance of the yaw says so and the first aiding decides, and the
    tilt, whose direction turns with the body, is levelled anew.
    """
    was_turning = state.still_cycles == 0
    state.cycles = 0
    state.consumed = 0
    state.pending = 0
    state.still_cycles = 0
    state.rejected = 0
    state.smoothing = 0
    state.bias_count = 0
    for k in range(3):
        state.bias_sum[k] = 0
    state.yaw = state.now_yaw
    if was_turning:
        state.last_sequence = -1
        set_apart(state, PSI, UNKNOWN_VAR)
        lose_tilt(state)
    copy_covariance(state)


@kernel
def begin_epoch(state: Any) -> None:
    """After a jump of the clock: earlier times and increments are void, and how far the string turned is unknown."""
    resume_filter(state)
    state.yaw_known = 0
    state.last_sequence = -1
    state.last_aided = LONG_AGO
    state.stopped_at = NOT_YET
    set_apart(state, PSI, UNKNOWN_VAR)
    copy_covariance(state)


@kernel
def start_over(state: Any, config: Any) -> None:
    """Invalid covariance: nothing is known but the constant bias and the mode; as ``filter_record.new_state``."""
    for i in range(STATES):
        for j in range(STATES):
            state.P[i, j] = 0
    state.P[TX, TX] = state.P[TY, TY] = UNKNOWN_TILT_VAR
    state.P[PSI, PSI] = UNIFORM_VAR
    for k in range(3):
        state.P[BX + k, BX + k] = boot_bias_var(config)
    state.P[S, S] = scale_var(config)
    state.P[D, D] = stamp_var(config)
    copy_covariance(state)
    state.epoch = 0
    state.now = 0
    state.yaw = 0
    state.now_yaw = 0
    state.yaw_known = 0
    state.scale = 0
    state.stamp = 0
    state.now_rate = 0
    for k in range(3):
        state.down[k] = 0
        state.now_down[k] = 0
        state.bias[k] = 0
        state.bias_sum[k] = 0
    state.down[2] = ONE
    state.reference_hops = -1
    state.reference_offset = 0
    state.systematic_var = 0
    state.last_sequence = -1
    state.last_aided = LONG_AGO
    state.innovation = 0
    state.innovation_var = 0
    state.rejected = 0
    state.pending = 0
    state.cycles = 0
    state.consumed = 0
    state.still_cycles = 0
    state.stopped_at = NOT_YET
    state.surveyed = 1
    state.smoothing = 0
    state.rate_exceeded = 0
    state.bias_count = 0
