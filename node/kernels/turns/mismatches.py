"""A lasting mismatch of gyroscope and aiding is learnt as a step of the bias or as a scale, and may be reconsidered.

The readings go on, the constant bias takes the mismatch, and the variances of yaw and bias are opened. A string that
winds up below its head looks like a small step of the gyroscope, and what the two differed by as that was found is then
its twist. Until a rest shows whose it was the angle is systematic variance of the yaw: a bias that stays was the
gyroscope's, one that goes back was none, and the twist is in doubt as that of a ramp.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import DEG, RATE_Q
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import (
    angular_square,
    bounded_ratio,
    bounded_variance,
    half_of,
    is_number,
    scale_square,
    times_factor,
    turned_angle,
)
from node.kernels.arithmetic.quantity import LONG_AGO, NONE, factor_quantity, rate_quantity, rate_variance_quantity
from node.kernels.filter.priors import bias_var, scale_var
from node.kernels.filter.resets import open_yaw, settle_yaw, take_mismatch
from node.kernels.record.events import Fault, event_degrees, queue_event
from node.kernels.record.filter_record import Err
from node.kernels.turns.aiding_watch import STEADY, UNWINDING
from node.kernels.turns.ramps import explain_ramp
from node.kernels.turns.sensor_trust import tell_recovery
from node.kernels.turns.yaw_doubts import explain_jump

LEARNT_VAR: Final = rate_variance_quantity(
    (0.05 * DEG) * (0.05 * DEG)
)  # (rad/s)^2, error of a bias read from a mismatch
LARGEST_STEP: Final = rate_quantity(
    10.0 * DEG
)  # rad/s, that a bias may take; a gyroscope farther off is not listened to
SLOWEST_SCALE: Final = rate_quantity(DEG)  # rad/s, from where a mismatch tells the size of a scale
LARGEST_SCALE: Final = factor_quantity(0.1)  # 1, that is looked for
UNSURE: Final = factor_quantity(0.1)  # of a step that was read, its error
TAKEN_BACK: Final = factor_quantity(0.2)  # of a step, by which what cancels it may differ
PSI, BZ, S = kernel_constant(Err.YAW), kernel_constant(Err.BIAS_Z), kernel_constant(Err.SCALE)
GYRO_STEP, GYRO_SCALE = kernel_constant(Fault.GYRO_STEP), kernel_constant(Fault.GYRO_SCALE)


@kernel
def learn_mismatch(node: Any) -> None:
    """A lasting mismatch belongs to the sensor: its bias or its scale takes it, and the yaw starts again."""
    state, config, guard = node.filter, node.config, node.guard
    trust, found = guard.gyro, guard.found
    reassign_step_to_scale(node)
    apart = abs(state.innovation + guard.last_jump)
    explain_jump(node)
    explain_ramp(guard.ramp)
    prior = max(bias_var(config, 2) + state.static_bias_var[2], LEARNT_VAR)
    of_scale = state.P[S, S]
    learnable = found.steady == 1 and abs(found.rate) <= LARGEST_STEP
    if found.fault == GYRO_SCALE and scale_var(config) > 0:
        change = bounded_ratio(abs(found.rate), abs(found.spin)) if abs(found.spin) > SLOWEST_SCALE else LARGEST_SCALE
        of_scale = max(of_scale, scale_square(min(change, LARGEST_SCALE)))
        learnable = True
        undo_steps(node)
    elif learnable:
        if not is_number(guard.before_steps):
            guard.before_steps, guard.first_step = state.static_bias[2], abs(found.rate)
        state.static_bias[2] -= found.rate
        guard.unproven = max(guard.unproven, min(abs(found.rate), UNWINDING))
        if abs(found.rate) <= UNWINDING:
            guard.disputed = max(guard.disputed, apart)
        prior += angular_square(times_factor(found.rate, UNSURE))
    take_mismatch(state, prior, of_scale)
    state.rejected = 0
    guard.step.fault = found.fault if found.fault == GYRO_STEP and learnable else 0
    guard.step.rate, guard.step.spin, guard.step.steady = found.rate, found.spin, found.steady
    if trust.fault != found.fault:
        queue_event(node, found.fault, event_degrees(found.rate, RATE_Q), event_degrees(found.spin, RATE_Q), NONE, NONE)
    if trust.fault == 0:
        trust.cycles = 0
    trust.fault, trust.proving, trust.sane = found.fault, 1 if learnable else 0, 0
    guard.agreed = 0


@kernel
def doubt_step(node: Any, period: float) -> None:
    """Of a step that no rest has confirmed a part may be the string's: a yaw is open by that while no aiding comes.

    A string winds or unwinds no faster than ``UNWINDING``, and a larger step is the sensor's. Without this a node whose
    aiding ends meanwhile would hold a false step for as sure as the noise of the aidings that showed it.
    """
    state, rate = node.filter, node.guard.unproven
    if rate == 0 or state.last_aided == LONG_AGO:
        return
    age = state.now - max(state.last_aided, node.guard.rate_at)
    if age > 2 * period:
        before = angular_square(turned_angle(rate, age - period))
        open_yaw(state, angular_square(turned_angle(rate, age)) - before)


@kernel
def settle_dispute(node: Any, is_strings: int) -> None:
    """A rest has shown whose a step was: the gyroscope's, or the string's, whose twist stays in doubt."""
    state, guard, ramp = node.filter, node.guard, node.guard.ramp
    apart = angular_square(guard.disputed)
    kept = bounded_variance(max(ramp.doubt, apart)) if is_strings == 1 else ramp.doubt
    state.systematic_var = bounded_variance(max(state.systematic_var + kept - ramp.doubt - apart, 0))
    ramp.doubt = kept
    guard.unproven, guard.disputed = 0, 0


@kernel
def reassign_step_to_scale(node: Any) -> None:
    """What a change of speed takes back was no step but the scale; the constant bias gets back what it took."""
    found, before = node.guard.found, node.guard.step
    if before.fault == 0 or abs(found.spin - before.spin) < half_of(abs(before.spin)):
        return
    if found.steady == 0 or abs(found.rate + before.rate) > times_factor(abs(before.rate), TAKEN_BACK):
        return
    node.filter.static_bias[2] += before.rate
    found.fault, found.rate, found.spin, found.steady = GYRO_SCALE, before.rate, before.spin, 1


@kernel
def undo_steps(node: Any) -> None:
    """Steps that cancelled each other were the scale that is learnt now: the constant bias is the earlier one."""
    state, guard = node.filter, node.guard
    earlier = guard.before_steps
    guard.before_steps = NONE
    if not is_number(earlier):
        return
    if abs(state.static_bias[2] - earlier) < times_factor(guard.first_step, STEADY):
        state.static_bias[2] = earlier
        state.bias[2] = 0


@kernel
def recover_gyro(node: Any) -> None:
    """The gyroscope has proved itself."""
    state, guard, trust = node.filter, node.guard, node.guard.gyro
    if trust.fault == GYRO_STEP:  # it lasts, and the Gauss-Markov part would forget it
        state.static_bias[2] += state.bias[2]
        state.bias[2] = 0
    settle_yaw(state, guard.aiding_var)
    tell_recovery(node, trust)
    trust.fault, trust.proving, trust.sane, trust.cycles = 0, 0, 0, 0
