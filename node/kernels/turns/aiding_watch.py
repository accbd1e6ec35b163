"""Is the gyroscope sane? What the growth of the filter's innovations shows of it.

========== ======================================================================= =================
fault      evidence                                                                flagged after
========== ======================================================================= =================
step       innovations beyond the gate that grow alike, while readings look sane   3 aidings in a row
small step the same, by less than 0.15 deg/s, or 0.3 deg/s at 60 deg/s or more    6 aidings in a row
slowing    a step of less than 0.22 deg/s, while the string slows down             4 aidings in a row
winding    a step of a string that has just started: it may be its twist            6 aidings in a row
unwinding  a step of more than 0.5 deg/s of one at rest: likewise                   7 aidings in a row
outliers   a step of any size, where an aiding was wrong lately                     4 aidings in a row
scale      innovations beyond the gate that grow in proportion to the rate         3 aidings in a row
========== ======================================================================= =================

A wrong aiding makes one large innovation that then stays; a wrong gyroscope makes it grow with every cycle, and alike.
That is how the two are distinguished: what a ripple of the drive, a disc off its centre or a sensor that leans leaves
between two aidings comes and goes, and is a misfit (``node.kernels.turns.yaw_doubts``). A small step is looked at for
longer, for a part of a swing looks like one: of a swing of once a turn (ten aidings at 71 deg/s) six are never alike. A
string that winds up as it starts, or unwinds below a standing drive head, looks like a step too, until it has: within
three seconds it is never alike in six while it speeds up, nor in seven however evenly it does. So do, in three, the
readings of a string that slows down which are older than they say. And where one aiding in five is wrong, three in a
row may be, each by about as much more than the one before.
"""

from __future__ import annotations

import math
from typing import Any, Final

from node.kernels.arithmetic.angles import HALF_TURN, WHOLE_TURN
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import (
    angular_product,
    angular_square,
    bounded_ratio,
    coarse_rate,
    half_of,
    is_number,
    mean_of_total,
    times_factor,
    turning_rate,
)
from node.kernels.arithmetic.quantity import NONE, factor_quantity, rate_quantity
from node.kernels.record.events import Fault
from node.kernels.record.node_record import DISAGREEMENTS, MOST_DISAGREEMENTS

GROWTH: Final = factor_quantity(1.5)  # sigmas from one aiding to the next, in one direction
SMALLEST_STEP: Final = rate_quantity(math.radians(0.03))  # rad/s
SMALL_STEP: Final = rate_quantity(math.radians(0.15))  # rad/s, up to which a step is looked at for longer
SMALL_SWING: Final = rate_quantity(math.radians(0.3))  # rad/s, likewise, where the string turns at full speed
SLOWEST_SWING: Final = rate_quantity(
    math.radians(60.0)
)  # rad/s, from where it does: the slower, the smaller are its swings
SLOWED: Final = rate_quantity(
    math.radians(10.0)
)  # rad/s, by which a string that comes to rest has slowed down meanwhile
LATE_READINGS: Final = rate_quantity(
    math.radians(0.22)
)  # rad/s, of such that are 6 ms late while it slows by 35 deg/s^2
STEADY: Final = factor_quantity(0.3)  # of the mean mismatch, by which those of one step may differ from it
WINDING: Final = rate_quantity(
    math.radians(0.15)
)  # rad/s, from where one of a string that starts is looked at for longer
UNWINDING: Final = rate_quantity(math.radians(0.5))  # rad/s, likewise, of one that rests
GROSS: Final = rate_quantity(math.radians(5.0))  # rad/s, from where a mismatch is a fault however it changes
SLOWEST_SCALE: Final = rate_quantity(math.radians(5.0))  # rad/s, from where a mismatch may be one of scale
ONE_MORE: Final = DISAGREEMENTS + 1  # aidings in a row, of a string that slows, or where an aiding was wrong lately
REMEMBERED: Final = 32  # aidings used, for which one that was wrong is
STILL_WANTED: Final = 2  # aidings, of a step that was seen before the scale was forgotten
AT_ONCE, STARTING, AT_REST = (
    kernel_constant(0),
    kernel_constant(1),
    kernel_constant(2),
)  # how long a mismatch is looked at
GYRO_STEP, GYRO_SCALE = kernel_constant(Fault.GYRO_STEP), kernel_constant(Fault.GYRO_SCALE)


@kernel
def reset_aiding_watch(watch: Any) -> None:
    """Begin again: the yaw was set, or the reference is another one. ``watch`` is a record of dtype ``AIDINGS``."""
    watch.left = 0
    watch.at = NONE
    watch.seen = 0


@kernel
def keep_newest(watch: Any) -> None:
    """Have two aidings more show a step: what the filter had learnt, and has forgotten now, may have made it."""
    while watch.seen > MOST_DISAGREEMENTS - STILL_WANTED:
        drop_oldest(watch)


@kernel
def find_mismatch(
    watch: Any,
    found: Any,
    innovation: float,
    sigma: float,
    spin: float,
    now: float,
    rejected: int,
    reset: int,
    patience: int,
) -> None:
    """Take one judged aiding (rad, sigmas, rad/s, s) into ``watch``; leaves what enough of them show in ``found``.

    Parameters
    ----------
    watch, found : records of dtype ``AIDINGS`` and ``MISMATCH``; no fault in ``found``: they show nothing
    rejected, reset : 1 when the filter rejected the aiding, and when it took its yaw from it
    patience : ``AT_ONCE``, or ``STARTING`` or ``AT_REST`` while a string may wind up or unwind
    """
    found.fault = found.refuted = 0
    grown = innovation - watch.left
    if grown > HALF_TURN:
        grown -= WHOLE_TURN
    elif -grown > HALF_TURN:
        grown += WHOLE_TURN
    elapsed = now - watch.at if is_number(watch.at) else 0
    if rejected == 0:
        watch.wrong = REMEMBERED if watch.left != 0 else max(watch.wrong - 1, 0)
    watch.left = 0 if reset == 1 or rejected == 0 else innovation
    watch.at = now
    if rejected == 0:
        watch.seen = 0
        return
    mismatch = turning_rate(grown, elapsed) if elapsed > 0 else 0
    if abs(grown) <= times_factor(sigma, GROWTH) or abs(mismatch) < SMALLEST_STEP:
        watch.seen, found.refuted = 0, 1
        return
    if watch.seen > 0 and (watch.mismatch[watch.seen - 1] < 0) != (mismatch < 0):
        watch.seen, found.refuted = 0, 1
    watch.mismatch[watch.seen] = mismatch
    watch.spin[watch.seen] = spin + mismatch
    watch.seen += 1
    if watch.seen < DISAGREEMENTS:
        return
    usual = recent_mismatch(watch)
    steady, proportional = is_steady(watch, usual), is_proportional(watch)
    gross = abs(mismatch) >= GROSS
    wanted = DISAGREEMENTS if is_large(watch, abs(usual), abs(spin), patience) else MOST_DISAGREEMENTS
    if watch.wrong > 0 or is_slowing(watch, abs(usual), abs(spin)):
        wanted = max(wanted, ONE_MORE)
    enough = steady and watch.seen >= wanted
    if enough and patience == AT_REST and abs(usual) >= UNWINDING and found.steady == 0:
        enough, found.steady = False, 1  # one more: within three seconds it may yet have been a twist
    elif not enough:
        found.steady = 0
    if not (proportional or gross or enough):
        found.refuted = 0 if steady else 1
        if watch.seen == MOST_DISAGREEMENTS or not steady:
            drop_oldest(watch)
        return
    found.fault = GYRO_SCALE if proportional else GYRO_STEP
    found.rate = usual if steady else mismatch
    found.spin = spin + mismatch
    found.steady = 1 if steady else 0
    watch.seen = 0


@kernel
def is_large(watch: Any, usual: float, spin: float, patience: int) -> bool:
    """Whether three mismatches of this size (rad/s) are enough at this ``spin`` (rad/s)."""
    if (patience == STARTING and usual >= WINDING) or (patience == AT_REST and usual >= UNWINDING):
        return False
    slowest = min(abs(watch.spin[0]), spin)
    return bool(usual >= SMALL_SWING if slowest >= SLOWEST_SWING else usual >= SMALL_STEP)


@kernel
def is_slowing(watch: Any, usual: float, spin: float) -> bool:
    """Whether mismatches of this size (rad/s) may be those of late readings, at a ``spin`` (rad/s) on its way down."""
    return bool(usual < LATE_READINGS and abs(watch.spin[0]) - spin >= SLOWED)


@kernel
def drop_oldest(watch: Any) -> None:
    """Wait for one mismatch more."""
    for i in range(watch.seen - 1):
        watch.mismatch[i], watch.spin[i] = watch.mismatch[i + 1], watch.spin[i + 1]
    watch.seen -= 1


@kernel
def recent_mismatch(watch: Any) -> float:
    """Mean of the mismatches seen (rad/s) but the oldest, within which a step may have come."""
    total: float = 0
    for i in range(1, watch.seen):
        total += watch.mismatch[i]
    return mean_of_total(total, watch.seen - 1)


@kernel
def is_steady(watch: Any, usual: float) -> bool:
    """Whether every mismatch seen but the oldest is near the ``usual`` one (rad/s)."""
    apart: float = 0
    for i in range(1, watch.seen):
        apart = max(apart, abs(watch.mismatch[i] - usual))
    return bool(apart <= times_factor(abs(usual), STEADY))


@kernel
def is_proportional(watch: Any) -> bool:
    """Whether the mismatches m seen follow the spins w as m = k w clearly better than as m = constant (both rad/s)."""
    n, m, w = watch.seen, watch.mismatch, watch.spin
    slowest, highest, fastest = w[0], w[0], abs(w[0])
    products: float = 0
    squares: float = 0
    along: float = 0
    apart: float = 0
    total: float = 0
    for i in range(n):
        slowest, highest, fastest = min(slowest, w[i]), max(highest, w[i]), max(fastest, abs(w[i]))
        products += angular_product(coarse_rate(m[i]), coarse_rate(w[i]))
        squares += angular_square(coarse_rate(w[i]))
        total += m[i]
    if fastest < SLOWEST_SCALE or highest - slowest < times_factor(fastest, STEADY):
        return False
    k, usual = bounded_ratio(products, squares), mean_of_total(total, n)
    for i in range(n):
        along += angular_square(coarse_rate(m[i] - times_factor(w[i], k)))
        apart += angular_square(coarse_rate(m[i] - usual))
    return bool(along < half_of(half_of(apart)))
