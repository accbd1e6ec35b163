"""What a node does about a faulty sensor: the safe state, the way back, and the events of both.

While the gyroscope's readings are wrong the encoder's rate stands for them and the yaw's variance is that of an unknown
yaw. A step or a new scale is learnt: the readings go on, the constant bias takes the mismatch, and the
variances of yaw and bias are opened. Either way no cross term is kept. The node trusts itself again when readings are
sane and several aidings in a row agree within a gate that is narrow again.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.aiding_watch import AT_ONCE, AT_REST, STARTING, STEADY, find_mismatch, forget
from node.kernels.angles import wrap
from node.kernels.doubts import explain_jump, follow_jump, follow_misfit, misfit_var
from node.kernels.events import Code, Fault, tell, told, told_count, told_degrees
from node.kernels.fixed.layout import ANGLE_Q, RATE_Q, TIME_Q
from node.kernels.jit import constant, kernel
from node.kernels.layout import CLOCK_SLACK, DEG, PERIOD, Array, Err, Status
from node.kernels.modes import STATIC_BIAS
from node.kernels.numbers import (
    angle_of,
    factor_of,
    fraction,
    half,
    is_number,
    lasting,
    length,
    root,
    scale_square,
    scaled,
    square,
    time_root,
    times,
    turn,
    unscaled,
)
from node.kernels.priors import bias_var, is_beyond_gate, scale_var
from node.kernels.quantity import NONE, angle, factor, rate, rate_variance, seconds, variance
from node.kernels.ramps import explain_ramp, follow_fit, is_starting
from node.kernels.record import A_CLOCK_VAR, A_RATE, A_VALID, A_YAW, A_YAW_VAR
from node.kernels.resets import (
    begin_epoch,
    forget_scale,
    lose_tilt,
    lose_yaw,
    lose_yaw_ahead,
    open_biases,
    open_yaw,
    settle_yaw,
    take_mismatch,
)
from node.kernels.sensor_watch import find_faults

SANE_CYCLES: Final = 3  # in a row, until the readings are used again; more than the filter's lag
AGREEING: Final = 4  # aidings in a row, until the node is trusted again
NARROW_STD: Final = angle(1.0 * DEG)  # of an innovation that can show agreement
LEARNT_VAR: Final = rate_variance(
    (0.05 * DEG) * (0.05 * DEG)
)  # (rad/s)^2, error of a bias that was read from a mismatch
LARGEST_STEP: Final = rate(10.0 * DEG)  # rad/s, that a bias may take; a gyroscope farther off is not listened to
CREDIBLE: Final = rate(
    0.5 * LARGEST_STEP
)  # rad/s, from the encoder's rate, of a gyroscope that may be listened to again
LARGEST_DRIFT: Final = rate(1.0 * DEG)  # rad/s, of a bias since the last rest; more is a fault, or a motion
SLOWEST_SCALE: Final = rate(DEG)  # rad/s, from where a mismatch tells the size of a scale
LARGEST_SCALE: Final = factor(0.1)  # 1, that is looked for
UNSURE: Final = factor(0.1)  # of a step that was read, its error
TAKEN_BACK: Final = factor(0.2)  # of a step, by which what cancels it may differ
SLOWEST_REVERSED: Final = rate(5.0 * DEG)  # rad/s, from where encoder and gyroscope are seen to turn against each other
RATE_AGE: Final = seconds(3.0)  # s, of an encoder's rate that may stand for the gyroscope
BACKWARD: Final = seconds(
    PERIOD
)  # s, that a cycle may begin before the end of the last; beyond it is a jump of the clock
LONGEST_CYCLE: Final = seconds(10.0 * PERIOD)  # s
FARTHEST: Final = LONGEST_CYCLE  # s, that a cycle may begin after the end of the last; no rate stands for more
LONGEST_KNOCK: Final = 8  # cycles of an odd force; one that lasts has shown what it is by then, or is a tilt
GRAVITY_ERROR: Final = factor(0.05)  # of gravity, of a force at rest
LEAST_TILT_VAR: Final = variance((3.0 * DEG) * (3.0 * DEG))  # rad^2, of a tilt at rest that no gyroscope misses
SURE_VAR: Final = variance(0.01)  # rad^2, of the tilt, from where the filter is not sure of it
FAR_OFF: Final = 4  # sigmas, that a clock or a tilt may be wrong by
SLACK_VAR: Final = variance(CLOCK_SLACK * CLOCK_SLACK)  # s^2, of a clock that can place an aiding in a turn
TX, TY = constant(Err.TILT_X), constant(Err.TILT_Y)
PSI, BZ, S = constant(Err.YAW), constant(Err.BIAS_Z), constant(Err.SCALE)
BAD_SAMPLE, GYRO_STEP, GYRO_SCALE = constant(Fault.BAD_SAMPLE), constant(Fault.GYRO_STEP), constant(Fault.GYRO_SCALE)
ENCODER_REVERSED = constant(Code.ENCODER_REVERSED)
AIDING_UNTIMELY, CLOCK_JUMPED = constant(Code.AIDING_UNTIMELY), constant(Code.CLOCK_JUMPED)
SENSOR_RECOVERED = constant(Code.SENSOR_RECOVERED)
AIDED, REJECTED, YAW_RESET = int(Status.AIDED), int(Status.REJECTED), int(Status.YAW_RESET)
REFERENCE_CHANGED = int(Status.REFERENCE_CHANGED)


@kernel
def is_faulty(trust: Any) -> bool:
    """Whether a sensor's readings are not to be relied on."""
    return bool(trust.fault != 0 and trust.proving == 0)


@kernel
def is_heard(node: Any) -> bool:
    """Whether the encoder reported its rate lately."""
    return bool(abs(node.filter.now - node.guard.rate_at) <= RATE_AGE)


@kernel
def gate_aiding(node: Any, aiding: Array) -> bool:
    """Whether an ``aiding`` of ``node.kernels.step.node_aiding`` is for the filter.

    One with an invalid time, or one far ahead, would wait for ever and hold up all others. One that a poor clock
    cannot place in a turning is of another angle than the node's, by as much in the next and the next.
    """
    state, guard, valid_local = node.filter, node.guard, aiding[A_VALID]
    timely = is_number(valid_local) and not (state.cycles > 0 and valid_local - state.now > LONGEST_CYCLE)
    if not timely and guard.untimely == 0:
        tell(node, AIDING_UNTIMELY, NONE, NONE, NONE, NONE)
    guard.untimely = 0 if timely else 1
    if not timely:
        return False
    if aiding[A_RATE] == 0 and guard.rate != 0:  # what the turning left unexplained, a rest shows
        open_misfit(node)
    guard.rate, guard.rate_at, guard.aiding_var = aiding[A_RATE], valid_local, aiding[A_YAW_VAR]
    if is_reversed(node) or not is_placed(state, aiding):
        return False
    if guard.gyro.fault != 0 or contradicts(node, aiding[A_YAW] + node.down_offset, valid_local):
        state.last_sequence = -1  # a repetition at rest is to be judged again
    return True


@kernel
def open_misfit(node: Any) -> None:
    """What innovations showed beyond their variance is of the yaw too."""
    var = misfit_var(node)
    if var > 0:
        open_yaw(node.filter, var)


@kernel
def is_reversed(node: Any) -> bool:
    """Whether the encoder counts backwards, which is told once: as fast as the gyroscope turns, the other way."""
    state, guard = node.filter, node.guard
    slowest = min(abs(guard.rate), abs(state.now_rate))
    if slowest < SLOWEST_REVERSED or is_faulty(guard.gyro):
        return False
    against = bool((guard.rate < 0) != (state.now_rate < 0) and abs(guard.rate + state.now_rate) < half(slowest))
    if against and guard.reversed == 0:
        told, own = told_degrees(guard.rate, RATE_Q), told_degrees(state.now_rate, RATE_Q)
        tell(node, ENCODER_REVERSED, told, own, NONE, NONE)
    guard.reversed = 1 if against else 0
    return against


@kernel
def is_placed(state: Any, aiding: Array) -> bool:
    """Whether the clock is good enough for the time stamp's state, or the string rests for as long as it may be off."""
    clock_var = aiding[A_CLOCK_VAR]
    if clock_var <= SLACK_VAR:
        return True
    if aiding[A_RATE] != 0 or not is_number(clock_var):
        return False
    return bool(lasting(clock_var, state.still_cycles) > FAR_OFF * time_root(clock_var))


@kernel
def contradicts(node: Any, yaw: float, valid_local: float) -> bool:
    """Whether a reference at rest (rad) is beyond the gate while the gyroscope turns, or of one that turned unaided."""
    state, guard = node.filter, node.guard
    if guard.rate != 0 or state.yaw_known == 0 or state.mode == STATIC_BIAS:
        return False
    if state.still_cycles > 0 and not state.stopped_at > state.last_aided:
        return False
    then = angle_of(state.now_rate, state.now_yaw) + turn(state.now_rate, valid_local - state.now)
    return is_beyond_gate(node.config, wrap(yaw - then), state.now_P[PSI, PSI] + guard.aiding_var)


@kernel
def admits(node: Any, start: float, end: float) -> bool:
    """Whether a cycle of these times (s, own clock) can be run; a clock that jumped begins a new epoch."""
    state, guard = node.filter, node.guard
    plain = is_number(start) and is_number(end) and 0 < end - start <= LONGEST_CYCLE
    ahead = start - state.now if state.cycles > 0 else 0
    jumped = not plain or -ahead > BACKWARD or ahead > FARTHEST
    if jumped and guard.jumped == 0:
        by = told(start - state.now, TIME_Q) if state.cycles > 0 else told_count(start, 0)
        tell(node, CLOCK_JUMPED, by if is_number(start) else NONE, NONE, NONE, NONE)
    if not jumped and ahead < 0:  # the increments overlap, and the turn that was counted once is in doubt
        open_yaw(state, square(turn(state.now_rate, ahead)))
    guard.jumped = 1 if jumped else 0
    if jumped and plain:
        begin_epoch(state)
        forget(guard.aidings)
    return plain


@kernel
def guard_reading(node: Any, settings: Any, saturated: int, at: float) -> None:
    """Judge the raw reading, and replace in ``node.rate`` and ``node.force`` what is not to be used."""
    state, guard, turning, force = node.filter, node.guard, node.rate, node.force
    gyro, accelerometer = find_faults(guard.readings, settings, node.raw_rate[:], node.raw_force[:], saturated)
    known = abs(at - guard.rate_at) <= RATE_AGE
    measured = unscaled(turning[2] - state.static_bias[2] - state.bias[2], state.scale)
    if gyro == 0 and is_faulty(guard.gyro) and known and abs(measured - guard.rate) > CREDIBLE:
        gyro = guard.gyro.fault
    follow_gyro(node, gyro)
    follow_force(node, accelerometer)
    if gyro != 0:
        for k in range(3):
            turning[k] = state.static_bias[k] + state.bias[k]
        turning[2] += scaled(guard.rate if known else guard.sane_rate, state.scale)
    else:
        guard.sane_rate = measured
    if accelerometer != 0 or keeps_out(node):
        for k in range(3):
            force[k] = -times(node.config.gravity, state.now_down[k])
    hold(node)


@kernel
def keeps_out(node: Any) -> bool:
    """Whether the force of a node at rest is not to be used: a knock, or a fault that shows later.

    Levelled by two such cycles a filter that is sure of its tilt explains the rest by the gyroscope's biases. If it
    stays and is no fault the tube was tilted and no gyroscope saw it: nothing is known of the tilt, until what was
    kept out has left the filter's lag.
    """
    guard = node.guard
    if not (is_odd(node) or LONGEST_KNOCK <= guard.odd < LONGEST_KNOCK + SANE_CYCLES):
        guard.odd = 0
        return False
    guard.odd = min(guard.odd + 1, LONGEST_KNOCK + SANE_CYCLES)
    if guard.odd < LONGEST_KNOCK:
        node.filter.still_cycles = 0  # the average of a stop begins again
        return True
    if guard.odd < LONGEST_KNOCK + SANE_CYCLES:
        lose_tilt(node.filter)
        node.filter.surveyed = 0  # it leans otherwise
    return False


@kernel
def is_odd(node: Any) -> bool:
    """Whether a node at rest feels a force that is not gravity's, or from where the filter is sure it is not."""
    state, force, gravity = node.filter, node.force, node.config.gravity
    if state.still_cycles == 0 and node.guard.odd == 0:
        return False
    weight = length(force[0], force[1], force[2])
    if abs(weight - gravity) > times(gravity, GRAVITY_ERROR):
        return True
    tilt_var = state.P[TX, TX] + state.P[TY, TY]
    if tilt_var > SURE_VAR:
        return False
    down = state.now_down
    x, y, z = fraction(force[0], weight), fraction(force[1], weight), fraction(force[2], weight)
    apart = length(x + down[0], y + down[1], z + down[2])
    return bool(apart > factor_of(root(tilt_var * FAR_OFF * FAR_OFF + LEAST_TILT_VAR), ANGLE_Q))


@kernel
def judge_cycle(node: Any, status: int, at: float) -> None:
    """See what the filter made of the cycle that ended at ``at`` (s, own clock)."""
    hold(node)
    state, guard = node.filter, node.guard
    if state.mode == STATIC_BIAS:
        guard.before_steps = NONE  # the constant bias is measured again
    if state.mode == STATIC_BIAS or status & REFERENCE_CHANGED or is_faulty(guard.gyro):
        forget(guard.aidings)
        return
    if guard.reversed == 1 and guard.rate != 0:
        forget(guard.aidings)
        return
    rejected = 1 if status & REJECTED else 0
    reset = 1 if status & YAW_RESET else 0
    if is_settling(node) or is_handled(node):
        forget(guard.aidings)
        return
    if rejected == 0 and (status & AIDED == 0 or reset == 1):
        guard.jump = guard.jump if reset == 0 else 0  # a yaw that was unknown has nothing to be contradicted
        return
    sigma = root(max(state.innovation_var, 0) + misfit_var(node))
    patience = patience_of(node)
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
    if rejected == 0:
        guard.last_jump = 0
    if rejected == 0 or guard.found.refuted == 1:
        follow_misfit(node)
    if reset == 1:
        follow_jump(node)
        if is_starting(node):
            forget_scale(node.filter, guard.ramp.scale, square(guard.ramp.scale_std))


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
    """Whether the node has stood still since the head did."""
    state = node.filter
    return bool(state.stopped_at > state.now - lasting(state.now, node.guard.rest_cycles + 1))


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
            tell(node, fault, NONE, NONE, NONE, NONE)
        if trust.fault == 0:
            trust.cycles = 0
        if trust.fault == GYRO_STEP and trust.proving == 1 and guard.step.fault != 0:
            node.filter.static_bias[2] += guard.step.rate  # what looked like a step was this fault's beginning
            guard.step.fault = 0
        trust.fault, trust.proving, trust.sane = fault, 0, 0
    elif is_faulty(trust):
        trust.sane += 1
        if trust.sane > SANE_CYCLES:
            trust.proving = 1
            guard.agreed = 0
            forget(guard.aidings)
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
            tell(node, fault, NONE, NONE, NONE, NONE)
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


@kernel
def hold(node: Any) -> None:
    """Keep the safe state around a cycle: what needs the faulty sensor is unknown, and nothing is learnt."""
    state = node.filter
    if is_faulty(node.guard.gyro):
        lose_yaw(state)
        state.bias_count = 0
        for k in range(3):
            state.bias_sum[k] = 0
    if is_faulty(node.guard.force):
        state.surveyed = 1


@kernel
def learn_mismatch(node: Any) -> None:
    """A lasting mismatch belongs to the sensor: its bias or its scale takes it, and the yaw starts again."""
    state, config, guard = node.filter, node.config, node.guard
    trust, found = guard.gyro, guard.found
    reconsider(node)
    explain_jump(node)
    explain_ramp(guard.ramp)
    prior = max(bias_var(config, 2) + state.static_bias_var[2], LEARNT_VAR)
    of_scale = state.P[S, S]
    learnable = found.steady == 1 and abs(found.rate) <= LARGEST_STEP
    if found.fault == GYRO_SCALE and scale_var(config) > 0:
        change = fraction(abs(found.rate), abs(found.spin)) if abs(found.spin) > SLOWEST_SCALE else LARGEST_SCALE
        of_scale = max(of_scale, scale_square(min(change, LARGEST_SCALE)))
        learnable = True
        undo_steps(node)
    elif learnable:
        if not is_number(guard.before_steps):
            guard.before_steps, guard.first_step = state.static_bias[2], abs(found.rate)
        state.static_bias[2] -= found.rate
        prior += square(times(found.rate, UNSURE))
    take_mismatch(state, prior, of_scale)
    state.rejected = 0
    guard.step.fault = found.fault if found.fault == GYRO_STEP and learnable else 0
    guard.step.rate, guard.step.spin, guard.step.steady = found.rate, found.spin, found.steady
    if trust.fault != found.fault:
        tell(node, found.fault, told_degrees(found.rate, RATE_Q), told_degrees(found.spin, RATE_Q), NONE, NONE)
    if trust.fault == 0:
        trust.cycles = 0
    trust.fault, trust.proving, trust.sane = found.fault, 1 if learnable else 0, 0
    guard.agreed = 0


@kernel
def reconsider(node: Any) -> None:
    """What a change of speed takes back was no step but the scale; the constant bias gets back what it took."""
    found, before = node.guard.found, node.guard.step
    if before.fault == 0 or abs(found.spin - before.spin) < half(abs(before.spin)):
        return
    if found.steady == 0 or abs(found.rate + before.rate) > times(abs(before.rate), TAKEN_BACK):
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
    if abs(state.static_bias[2] - earlier) < times(guard.first_step, STEADY):
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


@kernel
def tell_recovery(node: Any, trust: Any) -> None:
    """Tell that a sensor has proved itself, of what fault and after how many cycles."""
    after, cycles = told_count(node.guard.rate, trust.fault), told_count(node.guard.rate, trust.cycles)
    tell(node, SENSOR_RECOVERED, after, cycles, NONE, NONE)
