"""One node, compiled whole: what it does with a cycle's reading and with an aiding, over its one record.

A step is: admit the times, correct the readings, judge them, keep the time stamp's prior, level coarsely, run the
filter's cycle, judge what it made of it, and tell. The loop in the middle is that of the arithmetic chosen; what stands
before and after it serves every one, so each is a function of its own. Nothing here allocates, waits or raises.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from node.kernels.arithmetic.angles import wrap_angle
from node.kernels.arithmetic.formats import ANGLE_Q, DEG, VECTOR_Q, Array
from node.kernels.arithmetic.jit import entry_kernel, kernel, kernel_constant, shared_body
from node.kernels.arithmetic.operations import (
    angle_of,
    angular_root,
    bounded_variance,
    clock_drift_offset,
    half_of,
    is_number,
    quantity_ratio,
    stamp_square,
    time_of_cycles,
    time_root,
)
from node.kernels.arithmetic.quantity import (
    LONG_AGO,
    NONE,
    factor_quantity,
    rate_quantity,
    rate_variance_quantity,
    time_quantity,
)
from node.kernels.filter.float64.cycle import run_cycle
from node.kernels.filter.modes import STATIC_BIAS
from node.kernels.filter.priors import set_stamp
from node.kernels.filter.resets import doubt_stamp, forget_dates, move_dates, set_stamp_prior, start_over
from node.kernels.filter.revision import follow_revision, open_revision
from node.kernels.record.events import Code, event_degrees, event_number, queue_event
from node.kernels.record.filter_record import CLOCK_SLACK, CycleStatus, Err, Scheme
from node.kernels.record.node_record import (
    A_HOPS,
    A_OFFSET,
    A_SEQUENCE,
    A_SYSTEMATIC,
    A_TORQUE,
    A_TORSION,
    A_VALID,
    A_YAW,
    A_YAW_VAR,
    CLOCK_VAR,
    DRIFT,
    END,
    HOPS,
    JOINED,
    START,
    STEPPED,
    SYNCHRONISED,
)
from node.kernels.sensors.aligner import follow_alignment
from node.kernels.sensors.cluster import learn_offsets, survey_imus
from node.kernels.sensors.coarse_level import level_coarsely
from node.kernels.sensors.lying import turn_down
from node.kernels.sensors.parts import put_right
from node.kernels.sensors.reading_intake import take_readings
from node.kernels.sensors.sensor_watch import largest_magnitude
from node.kernels.sensors.static_average import follow_recording
from node.kernels.string.make_up import follow_joints
from node.kernels.string.relay import offer_aiding
from node.kernels.string.twist import gate_twist, holds_survey, reaching_var, twist_var
from node.kernels.turns.creep import follow_creep
from node.kernels.turns.exchanged_axes import put_axes_right, watch_axes
from node.kernels.turns.gates import admits_cycle, gate_aiding
from node.kernels.turns.guard import guard_reading, judge_cycle
from node.kernels.turns.mismatches import doubt_step
from node.kernels.turns.ramps import follow_ramp
from node.kernels.turns.rest_watch import watch_rest
from node.kernels.turns.rubbing import follow_rubbing
from node.kernels.turns.swings import follow_swing
from node.kernels.turns.yaw_doubts import noise_var, passing_var, put_delay_right, unexplained_var

STILL_CYCLES: Final = 4  # after which a node takes itself for standing
LARGEST_OFFSET: Final = rate_quantity(
    6.0 * DEG
)  # rad/s, of a gyroscope never calibrated; the slow alignment turn is faster
LEAST_STAMP: Final = time_quantity(1e-4)  # s, of a time stamp, whatever the clock says
MOST_STAMP: Final = time_quantity(CLOCK_SLACK)
NEAR, FAR = factor_quantity(0.8), factor_quantity(1.25)  # of a time stamp's prior that is left alone
LARGE_MOVE_VAR: Final = rate_variance_quantity(
    3e-3 * 3e-3
)  # s^2, of a clock, beyond what the wander of the time stamp covers
SAY_EVENTS, SAY_SURVEY, SAY_ESTIMATE, SAY_STATE, SAY_RECORD, ADMITTED, SAY_REVISION = 1, 2, 4, 8, 16, 32, 64
REFUSED: Final = -1  # the times of a cycle are such that it cannot be run
USED, ONWARD = 1, 2  # of an aiding: it is for the filter, and it goes down
FORWARD, FILTER_FAULT = int(Scheme.FORWARD), int(CycleStatus.FILTER_FAULT)
AIDED, SURVEY_READY, STOPPED = int(CycleStatus.AIDED), int(CycleStatus.SURVEY_READY), int(CycleStatus.STOPPED)
TOLD_FIRST, TOLD_LAST = 16, 26  # codes of ``STATUS_TOLD``
STATUS_TOLD: Final = (
    int(CycleStatus.STOPPED),
    int(CycleStatus.STARTED),
    int(CycleStatus.JOINT_OPENED),
    int(CycleStatus.JOINT_CLOSED),
    int(CycleStatus.BIAS_KNOWN),
    int(CycleStatus.REFERENCE_CHANGED),
    int(CycleStatus.YAW_RESET),
    int(CycleStatus.RATE_EXCEEDED),
    int(CycleStatus.RATE_RECOVERED),
    int(CycleStatus.BAD_SAMPLE),
    FILTER_FAULT,
)
AIDING_REJECTED, D = kernel_constant(Code.AIDING_REJECTED), kernel_constant(Err.STAMP)


@entry_kernel
def node_step(nodes: Array, settings: Array, parameters: Array, readings: Array, moment: Array) -> int:
    """One cycle of one node with the float64 loop; returns what there is to say.

    Parameters
    ----------
    nodes, settings : one-element arrays of dtype ``NODE`` and ``SETTINGS``
    parameters : of dtype ``PARAMETERS``: the block in use, then the own correction of each IMU
    readings : (imus, 20) rates (rad/s), forces (m/s^2), temperature (C), bits of what was at the range, by how much (s)
        the window that they are of ended before the cycle, its standard deviation (s), and 1 where the inside of the
        window is known: then mean rates about z (rad/s) follow, of what it shows of the cycle before, and of the
        eighths of this one as far as it shows them
    moment : (8,) start and end (s, own clock), joined, hops, variance of the clock (s^2), synchronised, by how much (s)
        the clock dates later than in the last cycle for it was put right (NaN: unknown), and by how much its
        rate may be off (s/s)
    """
    return int(step_around(run_cycle, nodes, settings, parameters, readings, moment))


@shared_body
def step_around(
    run_cycle: Callable[..., int], nodes: Array, settings: Array, parameters: Array, readings: Array, moment: Array
) -> int:
    """One cycle of one node around the loop ``run_cycle`` over its float64 record; see ``node_step``."""
    node = nodes[0]
    waits = begin_step(nodes, settings, parameters, readings, moment)
    if waits == REFUSED:
        return say_events(node)
    joined = 1 if moment[JOINED] != 0 else 0
    status = run_cycle(node.filter, node.config, node.rate, node.force, moment[START], moment[END], joined)
    return int(end_step(nodes, settings, moment, status, waits))


@kernel
def begin_step(nodes: Array, settings: Array, parameters: Array, readings: Array, moment: Array) -> int:
    """What comes before the loop: its ``rate_quantity`` and ``force`` are left in the record; see ``node_step``.

    Returns ``REFUSED``, and the step ends here, or what ``end_step`` is to be told: whether the survey waits.
    """
    node, node_settings = nodes[0], settings[0]
    if not admits_cycle(node, moment[START], moment[END]):
        return REFUSED
    saturated = take_readings(node, node_settings, parameters, readings, moment[END] - moment[START])
    return before_loop(node, node_settings, moment, saturated)


@kernel
def end_step(nodes: Array, settings: Array, moment: Array, status: int, waits: int) -> int:
    """What comes after a loop that returned ``status``; ``waits`` is the answer of ``begin_step``."""
    node = nodes[0]
    after_loop(node, settings[0], moment, status, waits)
    return conclude_cycle(nodes, settings, moment)


@kernel
def conclude_cycle(nodes: Array, settings: Array, moment: Array) -> int:
    """What comes after the cycle was judged: alignment, offsets of the IMUs, and what there is to say."""
    node, node_settings = nodes[0], settings[0]
    follow_alignment(node, node_settings, moment[START], moment[END])
    if node_settings.imus > 1 and is_quiet(node):
        learn_offsets(node, node_settings)
    return report_cycle(node, node_settings, moment)


@kernel
def before_loop(node: Any, settings: Any, moment: Array, saturated: int) -> int:
    """Judge the readings, follow the clock, level coarsely, count; 1 if the survey of this stop has to wait."""
    state = node.filter
    start, end = moment[START], moment[END]
    put_axes_right(node)
    turn_down(node)
    guard_reading(node, settings, saturated, end)
    put_right(node, settings.imus)
    watch_rest(node, settings, end)
    follow_clock(node, settings, moment)
    level_coarsely(state, node.config, node.rate, node.force)
    node.slow_cycles = node.slow_cycles + 1 if largest_magnitude(node.rate) < LARGEST_OFFSET else 0
    if node.cycles > 0 and start - state.now > half_of(end - start):
        node.overruns += 1
    waits = 1 if state.surveyed == 0 and holds_survey(node, settings, end) else 0
    if waits == 1:
        state.surveyed = 1
    return waits


@kernel
def after_loop(node: Any, settings: Any, moment: Array, status: int, waits: int) -> None:
    """Take what the loop made of the cycle, and judge it."""
    take_status(node, status, waits)
    follow_swing(node)
    follow_ramp(node)
    follow_creep(node, settings)
    follow_rubbing(node)
    watch_axes(node, settings)
    put_delay_right(node)
    doubt_step(node, moment[END] - moment[START])
    judge_cycle(node, node.status, moment[END])


@kernel
def take_status(node: Any, status: int, waits: int) -> None:
    """Take what the loop says of the cycle; see ``end_step``."""
    if waits == 1:
        node.filter.surveyed = 0
    node.status = status | node.noticed
    if node.guard.odd > 0:
        node.status &= ~STOPPED  # the average of the stop begins again, the string has not come to rest
    node.noticed = 0
    node.cycles += 1
    if node.status & FILTER_FAULT:
        start_over(node.filter, node.config)


@kernel
def report_cycle(node: Any, settings: Any, moment: Array) -> int:
    """Tell what the cycle found, as events, and record it; returns what there is to say."""
    state, status = node.filter, node.status
    if status & ~AIDED:
        tell_status(node)
    if state.rejected > 0 and node.rejecting == 0:
        sigmas = quantity_ratio(abs(state.innovation), angular_root(state.innovation_var))
        queue_event(node, AIDING_REJECTED, event_number(sigmas, VECTOR_Q), NONE, NONE, NONE)
    node.rejecting = 1 if state.rejected > 0 else 0
    says = say_events(node) | ADMITTED
    if follow_recording(node, moment[START], moment[END], 1 if is_standing(node) else 0):
        says |= SAY_RECORD
    if status & SURVEY_READY:
        says |= SAY_SURVEY
        open_revision(node, settings)
        if settings.imus > 1:
            survey_imus(node, settings, node.config.survey_samples)
    elif follow_revision(node, status):
        says |= SAY_REVISION
    if settings.scheme != FORWARD and state.yaw_known == 1:
        says |= SAY_ESTIMATE
    if status & ~AIDED or node.cycles % settings.state_every == 0:
        says |= SAY_STATE
    return says


@kernel
def is_quiet(node: Any) -> bool:
    """Whether the node stands still by the block and the bias in use."""
    return bool(node.filter.still_cycles >= STILL_CYCLES)


@kernel
def is_standing(node: Any) -> bool:
    """Whether the node may be at rest: quiet, or slow and without a bias, whose offset may look like a rate."""
    return bool(is_quiet(node) or (node.filter.mode == STATIC_BIAS and node.slow_cycles >= STILL_CYCLES))


@kernel
def tell_status(node: Any) -> None:
    """An event for every status bit that has one."""
    state = node.filter
    yaw_deg = event_degrees(angle_of(state.now_rate, state.now_yaw), ANGLE_Q)
    for k in range(TOLD_LAST - TOLD_FIRST + 1):
        if node.status & STATUS_TOLD[k]:
            queue_event(node, TOLD_FIRST + k, yaw_deg, NONE, NONE, NONE)


@kernel
def say_events(node: Any) -> int:
    """``SAY_EVENTS`` if there are events that were not taken yet, else 0."""
    return SAY_EVENTS if node.events.told != node.events.said else 0


@kernel
def follow_clock(node: Any, settings: Any, moment: Array) -> None:
    """Let the prior of the time stamp be what the clock says of itself, and its wander that of the hops.

    The prior is left alone while it is about right: another one costs the integer loop a conversion. A clock that was
    put right dates by a known step later, and what the filter has learnt of its error still holds, but for what it
    wanders, until the clock knows better.
    """
    config, state = node.config, node.filter
    if moment[SYNCHRONISED] == 0 or config.stamp_std == 0:
        return
    std = min(max(time_root(moment[CLOCK_VAR]), LEAST_STAMP), MOST_STAMP)
    var, stepped, is_aided = stamp_square(std), moment[STEPPED], state.last_aided != LONG_AGO
    is_void = not is_number(stepped)
    if is_aided and moment[DRIFT] > 0:
        doubt_stamp(state, wander_var(state, moment[END], moment[DRIFT]))
    if is_void:
        forget_dates(state)
    elif is_aided and stepped != 0:
        move_dates(state, stepped)
        is_void = state.P[D, D] > var
    hops = max(int(moment[HOPS]), 1)
    is_other = hops != node.stamp_hops or not NEAR < quantity_ratio(std, config.stamp_std) < FAR
    grown = var - stamp_square(config.stamp_std)
    if is_other:
        node.stamp_hops = hops
        set_stamp(config, std, settings.stamp_walk, hops)
    if is_void or (is_other and not is_aided):
        set_stamp_prior(state, var)
    elif is_other and grown > LARGE_MOVE_VAR:
        doubt_stamp(state, grown)


@kernel
def wander_var(state: Any, end: float, drift: float) -> float:
    """Variance of what the time stamp has wandered in a cycle, by a clock's ``drift`` (s/s) that stays what it is.

    The aidings of a string that turns show the stamp; since the last of them it wanders in proportion to the time.
    """
    unseen = max(time_of_cycles(end, state.still_cycles + 1), end - state.last_aided)
    return stamp_square(clock_drift_offset(drift, unseen)) - stamp_square(
        clock_drift_offset(drift, unseen - time_of_cycles(end, 1))
    )


@entry_kernel
def node_aiding(nodes: Array, settings: Array, aiding: Array) -> int:
    """Take one aiding into a node with the float64 loop; returns whether it was used and whether it goes down.

    What goes down is the aiding itself with the ``down_*`` of the record in the place of its own.

    Parameters
    ----------
    nodes, settings : one-element arrays of dtype ``NODE`` and ``SETTINGS``
    aiding : (12,) yaw, its variance, systematic variance, offset, rate (rad, rad/s), time of validity (s, own clock),
        sequence, hops, torque (N m), torsion variance (rad^2), under torque, variance of the clock (s^2)
    """
    return int(aiding_around(offer_aiding, nodes, settings, aiding))


@shared_body
def aiding_around(offer_aiding: Callable[..., int], nodes: Array, settings: Array, aiding: Array) -> int:
    """Take one aiding into a node whose loop queues it by ``offer_aiding``; see ``node_aiding``."""
    node = nodes[0]
    gates = take_aiding(nodes, settings, aiding)
    if gates & USED:
        node.noticed |= offer_aiding(
            node.filter,
            node.config,
            aiding[A_YAW],
            aiding[A_YAW_VAR] + noise_var(node) + passing_var(node),
            own_systematic(node),
            node.down_offset,
            aiding[A_VALID],
            int(aiding[A_SEQUENCE]),
            int(aiding[A_HOPS]),
        )
    if gates & ONWARD:
        hand_down(nodes, settings)
    return int(gates)


@kernel
def take_aiding(nodes: Array, settings: Array, aiding: Array) -> int:
    """Gate an aiding, and leave this node's offset and systematic variance in its record; ``USED`` and ``ONWARD``."""
    node, node_settings = nodes[0], settings[0]
    from_drive = aiding[A_HOPS] == 0
    node.down_offset = wrap_angle(aiding[A_OFFSET] + (node_settings.drive_angle if from_drive else 0))
    node.down_systematic = bounded_variance(aiding[A_SYSTEMATIC] + (node_settings.drive_var if from_drive else 0))
    node.down_torsion = reaching_var(aiding[A_TORSION], aiding[A_TORQUE], node_settings.stiffness)
    follow_joints(node, node_settings, aiding)
    used = gate_aiding(node, aiding) and gate_twist(node, node_settings, aiding)
    return (USED if used else 0) | (ONWARD if node_settings.scheme == FORWARD else 0)


@kernel
def own_systematic(node: Any) -> float:
    """Systematic variance (rad^2) of the aiding taken last, with this node's twist and what it cannot explain."""
    return bounded_variance(node.down_systematic + twist_var(node.twist) + unexplained_var(node))


@kernel
def hand_down(nodes: Array, settings: Array) -> None:
    """Add the joint below to what the record hands down."""
    node, node_settings = nodes[0], settings[0]
    node.down_offset = wrap_angle(node.down_offset + node_settings.lower_angle)
    node.down_systematic = bounded_variance(node.down_systematic + node_settings.lower_var)
