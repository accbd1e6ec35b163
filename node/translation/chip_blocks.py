"""A parameter block on a chip: whether it may be tried, whether it fits a rest, and what it changes, in integers.

Plain functions in the language of the kernels, to be translated into C (``orders_file``). The oracle of their test is
Python's node: ``block_trial``, and ``prepare`` and ``use`` of its tube.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import FORCE_Q, VECTOR_Q, Array
from node.kernels.arithmetic.operations import are_numbers, times_factor
from node.kernels.arithmetic.quantity import NONE, factor_quantity, force_quantity, rate_quantity, temperature_quantity
from node.kernels.filter.modes import UNBIASED_STILL_RATE
from node.kernels.filter.resets import forget_bias, lose_tilt
from node.kernels.record.events import TOLD_Q, Code, queue_event
from node.kernels.sensors.aligner import Reason, refuse_alignment
from node.kernels.sensors.correction import COLDEST, HOTTEST, correct_cycle, correct_sensor, cubic_polynomial
from node.kernels.sensors.realign import add_axes, realign_filter
from node.kernels.step.node_step import STILL_CYCLES
from node.translation.chip_orders import is_at_rest
from telemetry.parameters import MAX_BIAS, MAX_CONDITION, MAX_DISTANCE, MAX_DRIFT, MAX_FORCE_ERROR

FIT, BAD_REFERENCE, BAD_MATRIX, DRIFTS, LARGE_BIAS, FAR = 0, 1, 2, 3, 4, 5  # findings on a sensor
ACCELEROMETER: Final = 8  # added to a finding on it
NO_REST, AGREES, DIFFERS, MAY_TURN = 0, 1, 2, 3  # findings on a cycle
OF_RATES, OF_FORCES = 1, 2  # bits of what a block changes
COLD, HOT = COLDEST.fixed, HOTTEST.fixed
TEMPERATURES: Final = 22  # from the coldest to the hottest
APART: Final = temperature_quantity(5.0).fixed
LARGEST_FACTOR: Final = 1 << (VECTOR_Q + 1)  # of a matrix, as a factor; of its slopes over 128 K
LARGEST_TERM: Final = 1 << 54  # of a bias and of its slopes, likewise
DRIFT, DISTANCE = factor_quantity(MAX_DRIFT).fixed, factor_quantity(MAX_DISTANCE).fixed
MOST_RATE, MOST_FORCE = rate_quantity(MAX_BIAS["gyroscope"]).fixed, force_quantity(MAX_BIAS["accelerometer"]).fixed
MOST_RATIO: Final = round(MAX_CONDITION**2)  # of the squares of a matrix's stretches
UNITY: Final = 1 << VECTOR_Q
PLACES, SQUARE_Q = 20, 24  # of entries and of squares, where a condition is looked at
ROUNDS: Final = 60  # of Newton's method, which ends before
FASTEST: Final = UNBIASED_STILL_RATE.fixed
HEAVIEST: Final = 2 << FORCE_Q
LIGHT, HEAVY = round((1.0 - MAX_FORCE_ERROR) ** 2 * 2.0**52), round((1.0 + MAX_FORCE_ERROR) ** 2 * 2.0**52)
OTHER_ACCELEROMETER, OTHER_GYROSCOPE = int(Reason.OTHER_ACCELEROMETER), int(Reason.OTHER_GYROSCOPE)
DROPPED: Final = int(Code.ALIGNMENT_DROPPED)


def judge_block(parameters: Array, others: Array) -> int:
    """Why another block may not be tried after the one in use; 0: it may."""
    before, block = parameters[0], others[0]
    found = judge_sensor(block.gyroscope, MOST_RATE)
    if found != FIT:
        return found
    found = judge_sensor(block.accelerometer, MOST_FORCE)
    if found != FIT:
        return found + ACCELEROMETER
    if is_far(block.gyroscope, before.gyroscope):
        return FAR
    return FAR + ACCELEROMETER if is_far(block.accelerometer, before.accelerometer) else FIT


def judge_sensor(sensor: Any, most_bias: int) -> int:
    """Whether a sensor can be corrected so at every temperature."""
    if sensor.reference < COLD or sensor.reference > HOT:
        return BAD_REFERENCE
    for p in range(4):
        for i in range(3):
            if abs(sensor.bias[p, i]) > LARGEST_TERM:
                return LARGE_BIAS
            for j in range(3):
                if abs(sensor.matrix[p, i, j]) > LARGEST_FACTOR:
                    return BAD_MATRIX
    for k in range(TEMPERATURES):
        found = judge_temperature(sensor, COLD + k * APART - sensor.reference, most_bias)
        if found != FIT:
            return found
    return FIT


def judge_temperature(sensor: Any, x: int, most_bias: int) -> int:
    """Whether a sensor can be corrected so at ``x`` above its reference."""
    c, b, m = sensor.matrix, sensor.bias, sensor.m
    drift, is_large = 0, False
    for i in range(3):
        if abs(cubic_polynomial(b[0, i], b[1, i], b[2, i], b[3, i], x)) > most_bias:
            is_large = True
        for j in range(3):
            m[i, j] = cubic_polynomial(c[0, i, j], c[1, i, j], c[2, i, j], c[3, i, j], x)
            drift = max(drift, abs(m[i, j] - c[0, i, j]))
    if not is_well_conditioned(m):
        return BAD_MATRIX
    if drift > DRIFT:
        return DRIFTS
    return LARGE_BIAS if is_large else FIT


def is_far(sensor: Any, before: Any) -> bool:
    """Whether a matrix is neither near the identity nor near the one before."""
    from_unit, from_before = 0, 0
    for i in range(3):
        for j in range(3):
            own = sensor.matrix[0, i, j]
            from_unit = max(from_unit, abs(own - (UNITY if i == j else 0)))
            from_before = max(from_before, abs(own - before.matrix[0, i, j]))
    return min(from_unit, from_before) > DISTANCE


def is_well_conditioned(m: Array) -> bool:
    """Whether a matrix (3, 3) of entries up to 2 is right-handed and stretches by a ratio of up to ``MAX_CONDITION``.

    The squares of its stretches are the roots of t^3 - c2 t^2 + c1 t - c0, the characteristic polynomial of M^T M.
    """
    right = VECTOR_Q - PLACES
    a, b, c = m[0, 0] >> right, m[0, 1] >> right, m[0, 2] >> right
    d, e, f = m[1, 0] >> right, m[1, 1] >> right, m[1, 2] >> right
    g, h, k = m[2, 0] >> right, m[2, 1] >> right, m[2, 2] >> right
    if max(abs(a), abs(b), abs(c), abs(d), abs(e), abs(f), abs(g), abs(h), abs(k)) > 2 << PLACES:
        return False
    of_squares = 2 * PLACES - SQUARE_Q
    s00, s11 = (a * a + d * d + g * g) >> of_squares, (b * b + e * e + h * h) >> of_squares
    s22 = (c * c + f * f + k * k) >> of_squares
    s01, s02 = (a * b + d * e + g * h) >> of_squares, (a * c + d * f + g * k) >> of_squares
    s12 = (b * c + e * f + h * k) >> of_squares
    u, v, w = (e * k - f * h) >> PLACES, (d * k - f * g) >> PLACES, (d * h - e * g) >> PLACES
    determinant = (a * u - b * v + c * w) >> PLACES  # Q of PLACES
    if determinant <= 0:
        return False
    c2 = s00 + s11 + s22
    c1 = (s00 * s11 - s01 * s01 + s00 * s22 - s02 * s02 + s11 * s22 - s12 * s12) >> SQUARE_Q
    c0 = (determinant * determinant) >> of_squares
    least = root_from(c2, c1, c0, 0)
    return root_from(c2, c1, c0, c2) <= MOST_RATIO * least


def root_from(c2: int, c1: int, c0: int, begin: int) -> int:
    """Root of t^3 - c2 t^2 + c1 t - c0 (Q of SQUARE_Q) that Newton's method comes to from outside of all three."""
    t = begin
    for _ in range(ROUNDS):
        square = (t * t) >> SQUARE_Q
        value = (((t - c2) * square) >> SQUARE_Q) + ((c1 * t) >> SQUARE_Q) - c0
        slope = 3 * square - ((2 * c2 * t) >> SQUARE_Q) + c1
        if slope <= 0:
            return t
        step = (abs(value) << SQUARE_Q) // slope
        if step == 0 or (begin > 0 and value < 0) or (begin == 0 and value > 0):
            return t
        t = t - step if begin > 0 else t + step
    return t


def try_block(nodes: Array, others: Array, rate: Array, force: Array) -> int:
    """Whether another block fits the newest cycle, whose raw rate and force (3) it corrects in place."""
    node = nodes[0]
    if not is_at_rest(node):
        return NO_REST
    correct_cycle(others[0], node.temperature, rate, force)
    if not are_numbers(rate, force):
        return NO_REST
    fastest, heaviest, weight = 0, 0, 0
    for k in range(3):
        fastest, heaviest = max(fastest, abs(rate[k])), max(heaviest, abs(force[k]))
    if heaviest <= HEAVIEST:
        weight = force[0] * force[0] + force[1] * force[1] + force[2] * force[2]
    if fastest < FASTEST and weight >= LIGHT and weight <= HEAVY:
        return AGREES
    return DIFFERS if node.filter.still_cycles >= STILL_CYCLES else MAY_TURN


def take_block(nodes: Array, settings: Array, parameters: Array, others: Array, changed: int) -> int:
    """Forget what was learnt under the block in use, and read the last cycles by another one."""
    node = nodes[0]
    state = node.filter
    if changed & OF_FORCES:
        forget_mount(node, settings[0])
    if changed & OF_RATES:
        if node.aligner.method != 0:
            refuse_alignment(node, OTHER_GYROSCOPE, 0, NONE, NONE)
        forget_bias(state, node.config)
    if changed & OF_FORCES:
        lose_tilt(state)
    warmth = min(max(node.temperature, COLD), HOT)
    before, block = parameters[0], others[0]
    for slot in range(state.ring_rate.shape[0]):
        if not are_numbers(state.ring_rate[slot], state.ring_force[slot]):
            continue
        if changed & OF_RATES:
            restore_raw(before.gyroscope, warmth, state.ring_rate[slot])
            correct_sensor(block.gyroscope, warmth, state.ring_rate[slot])
        if changed & OF_FORCES:
            restore_raw(before.accelerometer, warmth, state.ring_force[slot])
            correct_sensor(block.accelerometer, warmth, state.ring_force[slot])
    if changed & OF_RATES:
        for slot in range(state.ring_split.shape[0]):
            state.ring_split[slot] = 0
    state.smoothing = 0
    return 0


def forget_mount(node: Any, settings: Any) -> None:
    """Forget the mounts in use, and end the alignment under way, as ``drop_alignment`` does."""
    if node.aligner.method != 0:
        refuse_alignment(node, OTHER_ACCELEROMETER, 0, NONE, NONE)
    mount = node.mount
    if mount.method == 0:
        return
    add_axes(node, settings, 0)
    mount.method = 0
    for k in range(settings.imus):
        mount.axis[k, 0], mount.axis[k, 1], mount.axis[k, 2] = 0, 0, UNITY
        mount.std[k, 0], mount.std[k, 1] = 0, 0
    queue_event(node, DROPPED, OTHER_ACCELEROMETER << TOLD_Q, NONE, NONE, NONE)
    realign_filter(node, settings)


def restore_raw(sensor: Any, temperature: int, reading: Array) -> None:
    """What a corrected reading (3) was before: M(T) w + b(T)."""
    m, c, b = sensor.m, sensor.matrix, sensor.bias
    x = temperature - sensor.reference
    w0, w1, w2 = reading[0], reading[1], reading[2]
    for i in range(3):
        for j in range(3):
            m[i, j] = cubic_polynomial(c[0, i, j], c[1, i, j], c[2, i, j], c[3, i, j], x)
        reading[i] = times_factor(w0, m[i, 0]) + times_factor(w1, m[i, 1]) + times_factor(w2, m[i, 2])
        reading[i] += cubic_polynomial(b[0, i], b[1, i], b[2, i], b[3, i], x)
