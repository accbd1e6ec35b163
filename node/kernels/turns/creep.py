"""Does the string turn below a head at rest? The gyroscope against its own past, with gravity as a witness.

A string that runs on into its play, unwinds or creeps turns while the encoder shows a head at rest. A rest is where the
filter takes whatever its gyroscope shows for the bias, so the turn goes there. Here the rates of a rest are summed up
beyond the bias of before it,

    A = sum (w - b) T,    var A = t^2 (f^2 P_b + (1 - f)^2 P_c + h sigma_b^2 + N^2 / t),

with P_b the variance of the bias b as the string came to rest, of which the part that wanders decays, P_c that of its
constant part, which b becomes, and N the noise.
Of a Gauss-Markov bias f = (1 - e^-x) / x, and h = 2 / x - (3 - 4 e^-x + e^-2x) / x^2 with x = t / tau, which is x / 2.1
but for 0.04, at most 3/8. Where A is beyond that it is in doubt whether the string turned: its square, times the chance
that it did, is systematic variance of the yaw, of which the end of every rest leaves half. Of z sigmas that chance is
taken as (z^2 - 6) / 19 from z = 3.5 on: from five on it is certain, and at 3.5, which one honest rest in two hundred
shows, the variance still covers A with 1.8 sigmas.

Two witnesses are asked. The *other axes*: a sensor that warms up, or feels another force, moves all its biases, a
string none of those across. *Gravity*: of a tube that leans by I the tool face, the mean of eight samples against that
of the first eight, shows a turn to within half of a sample's tilt over sin I, whatever the bias did. Where that is
finer than the turn claimed since then the two must agree, or the doubt is withdrawn.

What is less than both noises is seen by neither: `docs/field.md` has the proof.
"""

from __future__ import annotations

import math
from typing import Any, Final

from node.kernels.arithmetic.formats import ANGLE_Q, DEG, PERIOD, VECTOR_Q
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import (
    angular_root,
    angular_square,
    as_number,
    bounded_ratio,
    bounded_variance,
    factor_of,
    half_of,
    mean_of_total,
    quantity_ratio,
    time_of_cycles,
    times_factor,
    turned_angle,
    vector_length,
)
from node.kernels.arithmetic.quantity import (
    NONE,
    ONE,
    angle_quantity,
    factor_quantity,
    rate_quantity,
    variance_quantity,
)
from node.kernels.filter.modes import HELD, STATIC_BIAS
from node.kernels.filter.priors import bias_var, noise_over
from node.kernels.record.events import Code, event_degrees, event_number, queue_event
from node.kernels.record.filter_record import RING, Err

QUICK: Final = 8  # cycles of a rest, in which a string runs on, and of a mean of gravity
FASTEST: Final = rate_quantity(DEG)  # rad/s, of a string that creeps; one that is faster is turned
LONGEST: Final = 600  # cycles of a rest, over which turns are summed up
DECAY: Final = factor_quantity(math.exp(-PERIOD / 15.87))  # of the part of a bias that wanders, in a cycle
WANDERS: Final = 64  # cycles, in units of which h is the time: 2.1 time constants
WANDERED: Final = 24  # cycles, after which it grows no more
SHOWN: Final = 5  # sigmas of a turn, which chance does not make however many rests there are
TWICE_LEAST: Final = 7  # likewise, twice the sigmas from where it is in doubt
UNCERTAIN: Final = 6  # squares of sigmas that show nothing
TOLD: Final = 9  # sigmas of one that is told: a scale that was learnt wrongly leaves a bias that is eight of them off
BEYOND: Final = 3  # sigmas, of what is not noise
RADIAN: Final = angle_quantity(1.0)
ALONE: Final = 2  # sigmas, within which the other axes leave a turn of less than ``SHOWN`` to the string
LEAST_LEAN: Final = factor_quantity(0.5 * DEG)  # sine of the lean, from where there is a tool face
LEAST_SQUARE: Final = factor_quantity((0.5 * DEG) ** 2)  # its square
UNSEEN: Final = factor_quantity(1.9)  # rad, standard deviation of a tool face that tells nothing
LEAST_DOUBT: Final = variance_quantity((0.002 * DEG) ** 2)  # rad^2, below which a doubt counts as zero
BX = kernel_constant(Err.BIAS_X)
STRING_TURNED = kernel_constant(Code.STRING_TURNED)


@kernel
def follow_creep(node: Any, settings: Any) -> None:
    """Take the cycle in before the one that the filter has just had, in which the head may have started."""
    state, creep = node.filter, node.guard.creep
    if not is_resting(node):
        end_rest(creep)
        remember_biases(state, creep)
        return
    if creep.waits == 0:
        creep.waits = 1
        return
    take_cycle(node, (state.cycles - 2) % RING)
    if has_sensor_moved(node, BEYOND):
        if 2 * abs(creep.angle[2]) > TWICE_LEAST * turn_std(node, 2):  # what it had shown before they moved stays
            withdraw_doubt(node)
    elif 1 < creep.cycles < LONGEST:
        judge_turn(node, settings)


@kernel
def take_cycle(node: Any, slot: int) -> None:
    """Sum up what the cycle in a slot of the ring has turned by, and keep gravity's first mean."""
    state, creep = node.filter, node.guard.creep
    period = state.ring_end[slot] - state.ring_start[slot]
    creep.cycles = min(creep.cycles + 1, LONGEST)
    creep.decay = times_factor(creep.decay, DECAY)
    creep.decays += creep.decay
    for k in range(3):
        creep.angle[k] += turned_angle(state.ring_rate[slot, k] - expected_bias(creep, k), period)
    if creep.cycles == QUICK // 2:
        creep.first = creep.angle[2]
    if creep.cycles == QUICK:
        for k in range(2):
            creep.across[k] = bounded_ratio(mean_force(state, k), node.config.gravity)


@kernel
def is_resting(node: Any) -> bool:
    """Whether the encoder reports a head at rest to a string that hangs on it without torque, whose bias is known."""
    state, guard, twist = node.filter, node.guard, node.twist
    is_held = state.mode in (STATIC_BIAS, HELD)
    is_known = guard.creep.bias_var[2] > 0
    is_slow = state.cycles > 1 and abs(state.now_rate) < FASTEST
    is_free = twist.torque == 0 and twist.holding == 0 and twist.wound == 0
    return bool(guard.rest_cycles > 0 and is_known and is_slow and is_free and not is_held and guard.gyro.fault == 0)


@kernel
def remember_biases(state: Any, creep: Any) -> None:
    """Keep each bias and its variance, as the filter has them before a rest."""
    for k in range(3):
        creep.bias[k], creep.wander[k] = state.static_bias[k], state.bias[k]
        creep.bias_var[k] = state.P[BX + k, BX + k] if state.mode != STATIC_BIAS else 0
        creep.constant_var[k] = state.static_bias_var[k]
        creep.angle[k] = 0
    creep.decay, creep.decays = ONE, 0


@kernel
def expected_bias(creep: Any, k: int) -> float:
    """Bias (rad/s) about axis ``k`` that the one of before the rest has become."""
    return as_number(creep.bias[k] + times_factor(creep.wander[k], creep.decay))


@kernel
def end_rest(creep: Any) -> None:
    """A rest that was looked at is over: a head that turns takes the string along again, and half is left in doubt."""
    if creep.cycles > 2 * QUICK:
        creep.doubt = half_of(creep.doubt) if creep.doubt > LEAST_DOUBT else 0
    creep.cycles, creep.doubted, creep.waits = 0, 0, 0
    creep.standing = creep.doubt


@kernel
def mean_force(state: Any, k: int) -> float:
    """Mean (m/s^2) of the last ``QUICK`` forces along axis ``k``, but for the newest."""
    total: float = 0
    for n in range(QUICK):
        total += state.ring_force[(state.cycles - 2 - n) % RING, k]
    return mean_of_total(total, QUICK)


@kernel
def turn_std(node: Any, k: int) -> float:
    """Standard deviation (rad) of the angle summed up about axis ``k``, of a string that did not turn."""
    config, creep = node.config, node.guard.creep
    time = time_of_cycles(node.filter.now, creep.cycles)
    f = mean_of_total(creep.decays, creep.cycles)
    gone = ONE - f
    known = times_factor(creep.bias_var[k], times_factor(f, f))
    known += times_factor(creep.constant_var[k], times_factor(gone, gone))
    wander = mean_of_total(bias_var(config, k), WANDERS) * min(creep.cycles, WANDERED)
    var = bounded_variance(known + wander + noise_over(config, k, 1, time))
    return turned_angle(angular_root(var), time)


@kernel
def has_sensor_moved(node: Any, sigmas: int) -> bool:
    """Whether the gyroscope shows a turn across the axis too, which a string does not make: its biases have moved."""
    creep = node.guard.creep
    moved = 0
    for k in range(2):
        moved += 1 if abs(creep.angle[k]) > sigmas * turn_std(node, k) else 0
    return moved > 0


@kernel
def judge_turn(node: Any, settings: Any) -> None:
    """Doubt the yaw by a turn that the gyroscope shows and gravity does not deny."""
    creep = node.guard.creep
    angle, std = abs(creep.angle[2]), turn_std(node, 2)
    if creep.cycles >= 2 * QUICK:
        felt, felt_std = tool_face_turn(node), tool_face_std(node, settings)
        if is_denied(node, std, felt, felt_std):
            withdraw_doubt(node)
            return
        take_witness(node, std, abs(felt), felt_std)
    if angle > SHOWN * std or (2 * angle > TWICE_LEAST * std and not has_sensor_moved(node, ALONE)):
        doubt_turn(node, angle, turned_chance(angle, std))
    if creep.doubted == 1 and angle > TOLD * std and creep.cycles >= 2 * QUICK:
        creep.doubted = 2
        sigmas = event_number(quantity_ratio(angle, std), VECTOR_Q)
        queue_event(node, STRING_TURNED, sigmas, event_degrees(angle, ANGLE_Q), NONE, NONE)


@kernel
def is_denied(node: Any, std: float, felt: float, felt_std: float) -> bool:
    """Whether gravity shows a turn that is not the one that the gyroscope shows to within ``std`` (rad)."""
    own, own_std = factor_of(turn_between(node), ANGLE_Q), factor_of(std, ANGLE_Q)
    both = times_factor(own_std, own_std) + times_factor(felt_std, felt_std)
    agree = times_factor(own - felt, own - felt) < BEYOND * BEYOND * both
    return bool(BEYOND * felt_std < abs(own) and not agree)


@kernel
def take_witness(node: Any, std: float, felt: float, felt_std: float) -> None:
    """Doubt the yaw by a turn that gravity shows, where it tells turns finer than the gyroscope's ``std`` (rad).

    It shows what the string turned by between the middles of two means; over the whole rest it turned as evenly.
    """
    creep = node.guard.creep
    if felt_std < factor_of(std, ANGLE_Q) and 2 * felt > TWICE_LEAST * felt_std:
        whole = mean_of_total(creep.cycles * times_factor(RADIAN, felt), creep.cycles - QUICK)
        doubt_turn(node, whole, turned_chance(felt, felt_std))


@kernel
def turn_between(node: Any) -> float:
    """Turn (rad) that the gyroscope shows from the middle of gravity's first mean to the middle of its last."""
    state, creep = node.filter, node.guard.creep
    since: float = 0
    bias = expected_bias(creep, 2)
    for n in range(QUICK // 2):
        slot = (state.cycles - 2 - n) % RING
        since += turned_angle(state.ring_rate[slot, 2] - bias, state.ring_end[slot] - state.ring_start[slot])
    return as_number(creep.angle[2] - creep.first - since)


@kernel
def tool_face_turn(node: Any) -> float:
    """Turn of the tube (rad, as a factor) by its tool face since the rest began; 0 where it does not lean."""
    state, creep, gravity = node.filter, node.guard.creep, node.config.gravity
    u, v = bounded_ratio(mean_force(state, 0), gravity), bounded_ratio(mean_force(state, 1), gravity)
    square = times_factor(creep.across[0], creep.across[0]) + times_factor(creep.across[1], creep.across[1])
    if square < LEAST_SQUARE:
        return 0 * square
    return bounded_ratio(times_factor(u, creep.across[1]) - times_factor(v, creep.across[0]), square)


@kernel
def tool_face_std(node: Any, settings: Any) -> float:
    """Standard deviation (rad, as a factor) of that turn: of two means of eight samples, sqrt(2 / 8) of one."""
    state = node.filter
    across = vector_length(mean_force(state, 0), mean_force(state, 1), 0 * state.ring_force[0, 0])
    lean = bounded_ratio(across, node.config.gravity)
    if lean < LEAST_LEAN:
        return UNSEEN + 0 * lean
    return bounded_ratio(half_of(factor_of(settings.tilt_noise, ANGLE_Q)), lean)


@kernel
def turned_chance(angle: float, std: float) -> float:
    """Chance of a turn (a factor) where the gyroscope shows an ``angle`` of at least 3.5 times ``std`` (rad)."""
    part, certain = bounded_ratio(angle, SHOWN * std), ONE + 0 * angle
    if part >= certain:
        return certain
    return mean_of_total(SHOWN * SHOWN * times_factor(part, part) - UNCERTAIN * certain, SHOWN * SHOWN - UNCERTAIN)


@kernel
def doubt_turn(node: Any, angle: float, chance: float) -> None:
    """The yaw is in doubt by an ``angle`` (rad), which the string has turned by with a ``chance``."""
    creep, doubt = node.guard.creep, bounded_variance(times_factor(angular_square(angle), chance))
    creep.doubted = max(creep.doubted, 1)
    if doubt > creep.doubt:
        take_doubt(node, doubt)


@kernel
def withdraw_doubt(node: Any) -> None:
    """What looked like a turn in this rest was none: what is in doubt is what was when it began."""
    creep = node.guard.creep
    creep.doubted = 0
    take_doubt(node, creep.standing)


@kernel
def take_doubt(node: Any, doubt: float) -> None:
    """Have a variance (rad^2) in doubt, in what is said of the present too."""
    state, creep = node.filter, node.guard.creep
    state.systematic_var = bounded_variance(max(state.systematic_var + doubt - creep.doubt, 0))
    creep.doubt = doubt
