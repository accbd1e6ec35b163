"""What a node does about a faulty sensor: the safe state, the way back, and the events of both.

While the gyroscope's readings are wrong the encoder's rate stands for them and the yaw's variance is that of an unknown
yaw. A step or a new scale is learnt (`mismatches`). Either way no cross term is kept. The node trusts itself again
when readings are sane and several aidings in a row agree within a gate that is narrow again.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import DEG
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import (
    angular_root,
    half_of,
    indicated_rate,
    time_of_cycles,
    times_factor,
    true_rate,
)
from node.kernels.arithmetic.quantity import NONE, angle_quantity, rate_quantity
from node.kernels.filter.modes import STATIC_BIAS
from node.kernels.filter.resets import lose_tilt, lose_yaw_ahead, open_biases
from node.kernels.record.events import Fault, queue_event
from node.kernels.record.filter_record import RECENT, CycleStatus
from node.kernels.sensors.sensor_watch import find_faults
from node.kernels.string.encoder_rate import RATE_AGE
from node.kernels.turns.aiding_watch import AT_ONCE, AT_REST, STARTING, find_mismatch, keep_newest, reset_aiding_watch
from node.kernels.turns.mismatches import learn_mismatch, recover_gyro
from node.kernels.turns.odd_force import keeps_out
from node.kernels.turns.ramps import follow_fit, is_starting, learn_scale_anew
from node.kernels.turns.same_errors import follow_same_errors
from node.kernels.turns.sensor_trust import SANE_CYCLES, hold_safe_state, is_faulty, tell_recovery
from node.kernels.turns.turn_ratio import watch_ratio
from node.kernels.turns.yaw_doubts import follow_jump, follow_misfit, keep_contradiction, misfit_var

AGREEING: Final = 4  # aidings in a row, until the node is trusted again
NARROW_STD: Final = angle_quantity(1.0 * DEG)  # of an innovation that can show agreement
CREDIBLE: Final = rate_quantity(
    5.0 * DEG
)  # rad/s, from the encoder's rate, of a gyroscope that may be listened to again
UNCHANGED: Final = rate_quantity(2.0 * DEG)  # rad/s, by which a rate that goes on may differ from what it was
CHANGED: Final = rate_quantity(6.0 * DEG)  # rad/s, from where half a rate is another one
LARGEST_DRIFT: Final = rate_quantity(1.0 * DEG)  # rad/s, of a bias since the last rest; more is a fault, or a motion
BAD_SAMPLE, GYRO_STEP = kernel_constant(Fault.BAD_SAMPLE), kernel_constant(Fault.GYRO_STEP)
AIDED, REJECTED, YAW_RESET = int(CycleStatus.AIDED), int(CycleStatus.REJECTED), int(CycleStatus.YAW_RESET)
REFERENCE_CHANGED = int(CycleStatus.REFERENCE_CHANGED)


@kernel
def guard_reading(node: Any, settings: Any, saturated: int, at: float) -> None:
    """Judge the raw reading, and replace in ``node.rate`` and ``node.force`` what is not to be used."""
    state, guard, turning, force = node.filter, node.guard, node.rate, node.force
    gyro, accelerometer = find_faults(guard.readings, settings, node.raw_rate[:], node.raw_force[:], saturated)
    known = abs(at - guard.rate_at) <= RATE_AGE
    measured = true_rate(turning[2] - state.static_bias[2] - state.bias[2], state.scale)
    if gyro == 0:
        watch_ratio(node, turning[2], at)
    if gyro == 0 and is_faulty(guard.gyro) and known and abs(measured - guard.rate) > CREDIBLE:
        gyro = guard.gyro.fault
    follow_gyro(node, gyro)
    follow_force(node, accelerometer)
    if gyro != 0:
        for k in range(3):
            turning[k] = state.static_bias[k] + state.bias[k]
        turning[2] += indicated_rate(guard.rate if known else guard.sane_rate, state.scale)
        state.ring_split[state.cycles % RECENT] = 0
    else:
        guard.sane_rate = measured
    if accelerometer != 0 or keeps_out(node):
        for k in range(3):
            force[k] = -times_factor(node.config.gravity, state.now_down[k])
    hold_safe_state(node)


@kernel
def judge_cycle(node: Any, status: int, at: float) -> None:
    """See what the filter made of the cycle that ended at ``at`` (s, own clock)."""
    hold_safe_state(node)
    state, guard = node.filter, node.guard
    if state.mode == STATIC_BIAS:
        guard.before_steps = NONE  # the constant bias is measured again
    if state.mode == STATIC_BIAS or status & REFERENCE_CHANGED or is_faulty(guard.gyro):
        reset_aiding_watch(guard.aidings)
        return
    if guard.reversed == 1 and guard.rate != 0:
        reset_aiding_watch(guard.aidings)
        return
    rejected = 1 if status & REJECTED else 0
    reset = 1 if status & YAW_RESET else 0
    if is_settling(node) or is_handled(node):
        reset_aiding_watch(guard.aidings)
        return
    if rejected == 0 and (status & AIDED == 0 or reset == 1):
        guard.jump = guard.jump if reset == 0 else 0  # a yaw that was unknown has nothing to be contradicted
        return
    sigma = angular_root(max(state.innovation_var, 0) + misfit_var(node))
    patience = patience_of(node)
    if has_encoder_changed(node, rejected):
        reset_aiding_watch(guard.aidings)
    find_mismatch(guard.aidings, guard.found, state.innovation, sigma, state.now_rate, at, rejected, reset, patience)
    if guard.gyro.fault == 0:
        follow_doubts(node, rejected, reset)
    if guard.found.fault != 0:
        learn_mismatch(node)
    elif guard.gyro.proving == 1:
        guard.agreed = 0 if rejected == 1 else guard.agreed + (1 if sigma < NARROW_STD else 0)
        if guard.agreed >= AGREEING:
            recover_gyro(node)


@kernel
def has_encoder_changed(node: Any, rejected: int) -> bool:
    """Whether an aiding that contradicts comes of an encoder that turns at less than half of what it agreed with last.

    Each of the two is compared with its own past: a gyroscope that goes on as it did, and does not repeat itself, takes
    no step while the counter stands or slips.
    """
    state, guard = node.filter, node.guard
    if rejected == 0:
        guard.agreed_rate = state.now_rate
        return False
    goes_on = abs(state.now_rate - guard.agreed_rate) < UNCHANGED and guard.readings.rates.counts[2] == 0
    return bool(goes_on and abs(guard.agreed_rate) > CHANGED and abs(guard.rate) < half_of(abs(guard.agreed_rate)))


@kernel
def patience_of(node: Any) -> int:
    """How long a mismatch is looked at: a string that starts may wind up, one that stood still may unwind."""
    if is_starting(node):
        return STARTING
    return AT_REST if node.guard.rest_cycles > 0 and stood_in_this_rest(node) else AT_ONCE


@kernel
def follow_doubts(node: Any, rejected: int, reset: int) -> None:
    """What an aiding shows that was used, or rejected but not for a step, is a misfit; a reset is a jump.

    A reset soon after a start: what the string did then may have gone into the scale before it was rejected.
    """
    guard = node.guard
    follow_fit(node, rejected)
    follow_same_errors(node, rejected)
    if rejected == 0:
        guard.last_jump = 0
    if rejected == 0 or guard.found.refuted == 1:
        follow_misfit(node)
    if reset == 1:
        follow_jump(node)
        if is_starting(node):
            learn_scale_anew(node)
            keep_newest(guard.aidings)  # they contradicted by a scale that is gone


@kernel
def is_settling(node: Any) -> bool:
    """Whether the head rests and the node by its bias has not yet, by little: the rest will show which is wrong.

    A node that stood still in this rest and does not any more is another matter: its gyroscope took a step.
    """
    guard, state = node.guard, node.filter
    if guard.rest_cycles == 0 or state.still_cycles > 0 or abs(state.now_rate) > LARGEST_DRIFT:
        return False
    return not stood_in_this_rest(node)


@kernel
def stood_in_this_rest(node: Any) -> bool:
    """Whether the node has stood still since the head did, or the cycle before: half a cycle off the grid of cycles."""
    state = node.filter
    return bool(state.stopped_at > state.now - half_of(time_of_cycles(state.now, 2 * node.guard.rest_cycles + 3)))


@kernel
def is_handled(node: Any) -> bool:
    """Whether the tube is tilted while the head rests: it hangs on no string, and the encoder tells nothing of it."""
    guard, state = node.guard, node.filter
    across = 0
    for k in range(2):
        across = max(across, abs(node.rate[k] - state.static_bias[k] - state.bias[k]))
    return bool(guard.rest_cycles > 0 and across > LARGEST_DRIFT)


@kernel
def follow_gyro(node: Any, fault: int) -> None:
    """Take one cycle's judgement of the gyroscope."""
    guard, trust = node.guard, node.guard.gyro
    if fault != 0:
        if trust.fault != fault:
            queue_event(node, fault, NONE, NONE, NONE, NONE)
        if trust.fault == 0:
            trust.cycles = 0
            keep_contradiction(node)
        if trust.fault == GYRO_STEP and trust.proving == 1 and guard.step.fault != 0:
            node.filter.static_bias[2] += guard.step.rate  # what looked like a step was this fault's beginning
            guard.step.fault = 0
        trust.fault, trust.proving, trust.sane = fault, 0, 0
    elif is_faulty(trust):
        trust.sane += 1
        if trust.sane > SANE_CYCLES:
            trust.proving = 1
            guard.agreed = 0
            reset_aiding_watch(guard.aidings)
            lose_yaw_ahead(node.filter)
            open_biases(node.filter, node.config)
    if trust.fault != 0:
        trust.cycles += 1


@kernel
def follow_force(node: Any, fault: int) -> None:
    """Take one cycle's judgement of the accelerometer."""
    trust, state = node.guard.force, node.filter
    if fault != 0:
        told = BAD_SAMPLE in (trust.fault, fault)  # by the gyroscope, whose reading it is too
        if trust.fault != fault and not told:
            queue_event(node, fault, NONE, NONE, NONE, NONE)
        if trust.fault == 0:
            trust.cycles = 0
        trust.fault, trust.proving, trust.sane = fault, 0, 0
    elif is_faulty(trust):
        trust.sane += 1
        if trust.sane > SANE_CYCLES:
            lose_tilt(state)
            state.surveyed = 0
            state.still_cycles = 0  # the average of a stop begins again
            if trust.fault != BAD_SAMPLE:
                tell_recovery(node, trust)
            trust.fault, trust.proving, trust.sane, trust.cycles = 0, 0, 0, 0
    if trust.fault != 0:
        trust.cycles += 1
