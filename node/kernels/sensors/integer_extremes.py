"""The law of the largest of noisy samples around a circle, in integers: ``node.kernels.sensors.alignment.extreme_var``.

Its product of normal distributions is a sum of their logarithms, from a table, and 2 to minus that sum.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from node.kernels.arithmetic.formats import ANGLE_Q, VECTOR_Q
from node.kernels.arithmetic.integers import bit_length, multiply_q31, quotient_q30, root_of, rounded_shift
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.trigonometry import exponential_decay, radians_to_counts, sine_cosine

LIMIT, STEP = 8.0, 0.1  # sigmas, range and step of the integrals over the law of an extreme
PHASES: Final = 4  # of the sampling against the extremes, over which their law is averaged
LEVEL_Q: Final = 24  # of a level, sigmas
CELL_Q: Final = LEVEL_Q - 5  # of the table: 32 a sigma
COUNT: Final = round(2.0 * LIMIT / STEP)
LOWEST: Final = round(-LIMIT * 2.0**LEVEL_Q)
LEVELS: Final = np.arange(-LIMIT, LIMIT + 0.05, 1.0 / 32.0)
LOGS: Final = np.array(
    [round(-math.log2(0.5 * math.erfc(-x / math.sqrt(2.0))) * 2.0**32) for x in LEVELS], np.int64
)  # -log2 of the normal distribution, Q32
NOTHING: Final = 32 << 32  # of a sum of them: the law is 0 in 31 bits
LARGEST: Final = 1 << (LEVEL_Q + 20)  # ratio of radius and noise
HALF_STEP_SQUARED: Final = round(STEP * STEP / 4.0 * 2.0**31)
MOST_TAKEN: Final = (
    128  # samples at a low ratio; at a high one only those near the extreme count. Of more each stands for several
)
NEVER_BELOW: Final = 1 << 4  # rad, Q40, of a noise: as 1e-12 rad for floats, and a ratio still fits
ONE: Final = 1 << VECTOR_Q


@kernel
def nonexceedance_probability(z: int, ratio: int, samples: int, phase: int) -> int:
    """How probable it is (Q31) that no sample is above the radius by ``z`` sigmas (Q24)."""
    taken = min(samples, MOST_TAKEN << (max(bit_length(ratio >> LEVEL_Q) - 4, 0) >> 1))
    before = taken >> 1
    total = logs_outward(z, ratio, taken, phase, 0, taken - before, 1)
    if total <= NOTHING:
        total += logs_outward(z, ratio, taken, phase, taken - 1, before, -1)
    total = total * samples // taken
    if total > NOTHING:
        return 0
    return exponential_decay(total << 10, 1 << 28)


@kernel
def logs_outward(z: int, ratio: int, samples: int, phase: int, nearest: int, count: int, step: int) -> int:
    """Sum of -log2 (Q32) of the ``count`` samples on one side of the extreme, from the ``nearest`` on.

    The farther a sample, the less it can be above: behind the first that cannot, none can.
    """
    total = 0
    for n in range(count):
        k = nearest + step * n
        cosine = sine_cosine((((k << 3) + 2 * phase + 1) << 32) // (samples << 3))[1]
        level = z + (multiply_q31(ratio, max(ONE - cosine, 0)) << 1) - LOWEST
        cell = level >> CELL_Q
        if cell >= LOGS.shape[0] - 1 or total > NOTHING:
            return total
        beyond = level & ((1 << CELL_Q) - 1)
        total += LOGS[cell] - (((LOGS[cell] - LOGS[cell + 1]) * beyond) >> CELL_Q)
    return total


@kernel
def last_impossible(ratio: int, samples: int, phase: int) -> int:
    """The last step of the integral at which the law is 0: below it all are."""
    low, high = 0, COUNT
    while high - low > 1:
        middle = (low + high) >> 1
        if nonexceedance_probability(level_of(middle), ratio, samples, phase) == 0:
            low = middle
        else:
            high = middle
    return low


@kernel
def level_of(m: int) -> int:
    """Sigmas (Q24) of step ``m`` of the integral."""
    return LOWEST + (m << LEVEL_Q) // 10


@kernel
def variance_in_integers(ratio: int, samples: int) -> int:
    """As ``alignment.extreme_var``, Q38; ``ratio`` in Q24. In half steps the middles are odd numbers.

    Only the steps in which the law rises are summed: a chip has a cycle for all of it.
    """
    first = second = 0
    certain = exponential_decay(0, 1 << 28)
    for phase in range(PHASES):
        below, m = 0, last_impossible(ratio, samples, phase)
        while below < certain and m < COUNT:
            m += 1
            above = nonexceedance_probability(level_of(m), ratio, samples, phase)
            middle = 2 * m - 1 - COUNT
            first += (above - below) * middle
            second += (above - below) * middle * middle
            below = above
    mean = rounded_shift(first // PHASES, 8)
    spread = max((second // PHASES << 15) - mean * mean, 0)
    return rounded_shift(multiply_q31(spread, HALF_STEP_SQUARED), 8)


def std_in_integers(lean: int, noise: int, samples: int) -> int:
    """As ``node.kernels.sensors.alignment.extreme_std``, rad in Q40."""
    sine = sine_cosine(radians_to_counts(lean, ANGLE_Q))[0]
    ratio = min(quotient_q30(sine << 4, max(noise, NEVER_BELOW)), LARGEST)
    return multiply_q31(noise, rounded_shift(root_of(variance_in_integers(ratio, samples) << 17), 12)) << 3
