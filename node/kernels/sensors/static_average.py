"""Mean and covariance of raw readings at rest, as running sums: nothing is stored of the samples themselves."""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import FORCE_PART, FORCE_Q, MEAN_Q, RATE_PART, STRONGEST, Array
from node.kernels.arithmetic.integers import bit_length, multiply_q31, rounded_shift
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import are_numbers, as_number, by_type, is_number, mean_of_total
from node.kernels.sensors.correction import USUAL

FARTHEST: Final = 1 << (MEAN_Q + 4)  # from the mean that counts: 16 rad/s, 16 g
FEWEST: Final = 2  # samples of a covariance
MOST: Final = 1 << 59  # of a sum of products: 512 (rad/s)^2, 32768 g^2


@by_type(lambda f: max(min(f, STRONGEST), -STRONGEST) << (MEAN_Q - FORCE_Q))
def force_for_mean(f: float) -> float:
    """A force in the format of the means; integers are held at 32 g."""
    return f


@by_type(lambda d, n: d - mean_of_total(d, n))
def without_one(d: float, n: int) -> float:
    """The part (n - 1)/n of a deviation."""
    return (n - 1.0) / n * d


def _joint(a: int, b: int, q: int) -> int:
    one, other = max(min(a, FARTHEST), -FARTHEST), max(min(b, FARTHEST), -FARTHEST)
    spare = max(bit_length(abs(other)) - 31, 0)
    return rounded_shift(multiply_q31(one, other >> spare), 2 * MEAN_Q - 31 - spare - q)


@by_type(_joint)
def deviation_product(a: float, b: float, q: int) -> float:
    """Product of two deviations; integers: in Q``q``, each held at 16 rad/s or 16 g."""
    return a * b


@by_type(lambda total, a: max(min(total + a, MOST), -MOST))
def bounded_sum(total: float, a: float) -> float:
    """A sum and one product more; integers are held."""
    return total + a


@kernel
def add_static(record: Any, rate: Array, force: Array, temperature: float, standing: int) -> int:
    """Take one cycle's raw reading into the sums; returns 0 if it is not finite and left out.

    n m_n = (n - 1) m_(n-1) + x_n,  S_n = S_(n-1) + (n - 1)/n d d^T with d = x_n - m_(n-1).

    Parameters
    ----------
    record : record of dtype ``STATIC``
    rate, force : (3,) raw, rad/s and m/s^2
    temperature : C
    standing : 0 when the node was not at rest in this cycle

    Source: Welford, Technometrics 4 (1962) 419.
    """
    if not are_numbers(rate, force):
        return 0
    record.samples += 1
    n = record.samples
    if standing == 0:
        record.moved = 1
    record.temperature += mean_of_total(temperature - record.temperature, n)
    for i in range(6):
        x = rate[i] if i < 3 else force_for_mean(force[i - 3])
        if n > 1:
            step = x - record.last[i]
            record.steps[i] = bounded_sum(record.steps[i], deviation_product(step, step, 2 * part_of(i)))
        record.last[i] = x
        record.delta[i] = x - record.mean[i]
        record.mean[i] += mean_of_total(record.delta[i], n)
    for i in range(6):
        rest = without_one(record.delta[i], n)
        for j in range(6):
            product = deviation_product(rest, record.delta[j], part_of(i) + part_of(j))
            record.scatter[i, j] = bounded_sum(record.scatter[i, j], product)
    return 1


@kernel
def part_of(i: int) -> int:
    """What quantity ``i`` of a reading adds to the Q of a product of deviations."""
    return RATE_PART if i < 3 else FORCE_PART


@kernel
def begin_sums(record: Any) -> None:
    """Begin anew."""
    record.samples, record.temperature, record.moved = 0, 0.0, 0
    for i in range(6):
        record.mean[i], record.last[i], record.steps[i] = 0.0, 0.0, 0.0
        for j in range(6):
            record.scatter[i, j] = 0.0


@kernel
def follow_recording(node: Any, start: float, end: float, standing: int) -> bool:
    """Take the cycle's raw reading (``start`` to ``end``, s, own clock) into the record being taken; whether it is due.

    One that moved is due at once: it is worth nothing, and the node is free for the next. What is due is no longer
    running.
    """
    recording = node.recording
    if recording.running == 0:
        return False
    if not is_number(recording.begun):
        recording.begun = start
    temperature = as_number(node.temperature) if is_number(node.temperature) else USUAL
    add_static(recording.sums, node.raw_rate, node.raw_force, temperature, standing)
    has_ended = recording.sums.moved == 1 and recording.sums.samples >= FEWEST
    if end - recording.begun < recording.seconds and not has_ended:
        return False
    recording.running = 0
    return True


@kernel
def has_moved(record: Any, limit: float) -> int:
    """Whether the spread of any axis is beyond ``limit`` times the noise that its neighbours show, 1 or 0.

    s^2 = S/(n - 1) against limit^2 sum (x_k - x_(k-1))^2 / (2 (n - 1)): neighbours at rest differ by the noise alone,
    whatever the mean does slowly. Source: von Neumann, Ann. Math. Stat. 12 (1941) 367.
    """
    if record.moved == 1:
        return 1
    for i in range(6):
        if record.scatter[i, i] > 0.5 * limit * limit * record.steps[i]:
            return 1
    return 0
