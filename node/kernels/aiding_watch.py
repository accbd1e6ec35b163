"""Is the gyroscope sane? What the growth of the filter's innovations shows of it.

========== ======================================================================= =================
fault      evidence                                                                flagged after
========== ======================================================================= =================
step       innovations beyond the gate that grow, while the readings look sane     3 aidings in a row
scale      the same, in proportion to the rate                                     3 aidings in a row
========== ======================================================================= =================

A wrong aiding makes one large innovation that then stays; a wrong gyroscope makes it grow with every cycle. That is
how the two are distinguished. A string that unwinds below a standing drive head looks like a step.
"""

from __future__ import annotations

import math
from typing import Any, Final

from node.kernels.events import Fault
from node.kernels.jit import constant, kernel
from node.kernels.record import DISAGREEMENTS

GROWTH: Final = 1.5  # sigmas from one aiding to the next, in one direction
SMALLEST_STEP: Final = math.radians(0.03)  # rad/s
STEADY: Final = 0.3  # of a mismatch, what two in a row may differ by to be one step
SLOWEST_SCALE: Final = math.radians(5.0)  # rad/s, from where a mismatch may be one of scale
GYRO_STEP, GYRO_SCALE = constant(Fault.GYRO_STEP), constant(Fault.GYRO_SCALE)


@kernel
def forget(watch: Any) -> None:
    """Begin again: the yaw was set, or the reference is another one. ``watch`` is a record of dtype ``AIDINGS``."""
    watch.left = 0.0
    watch.at = math.nan
    watch.seen = 0


@kernel
def find_mismatch(
    watch: Any, found: Any, innovation: float, sigma: float, spin: float, now: float, rejected: int, reset: int
) -> None:
    """Take one judged aiding (rad, sigmas, rad/s, s) into ``watch``; leaves what enough of them show in ``found``.

    Parameters
    ----------
    watch, found : records of dtype ``AIDINGS`` and ``MISMATCH``; no fault in ``found``: they show nothing
    rejected, reset : 1 when the filter rejected the aiding, and when it took its yaw from it
    """
    found.fault = 0
    grown = innovation - watch.left
    if grown > math.pi:
        grown -= 2.0 * math.pi
    elif grown < -math.pi:
        grown += 2.0 * math.pi
    elapsed = now - watch.at if math.isfinite(watch.at) else 0.0
    watch.left = 0.0 if reset == 1 or rejected == 0 else innovation
    watch.at = now
    if rejected == 0:
        watch.seen = 0
        return
    mismatch = grown / elapsed if elapsed > 0.0 else 0.0
    if abs(grown) <= GROWTH * sigma or abs(mismatch) < SMALLEST_STEP:
        watch.seen = 0
        return
    if watch.seen > 0 and watch.mismatch[watch.seen - 1] * mismatch < 0.0:
        watch.seen = 0
    watch.mismatch[watch.seen] = mismatch
    watch.spin[watch.seen] = spin + mismatch
    watch.seen += 1
    if watch.seen < DISAGREEMENTS:
        return
    before = watch.mismatch[watch.seen - 2]
    steady = abs(mismatch - before) <= STEADY * abs(mismatch)
    found.fault = GYRO_SCALE if is_proportional(watch) else GYRO_STEP
    found.rate = 0.5 * (mismatch + before) if steady else mismatch
    found.spin = spin + mismatch
    found.steady = 1 if steady else 0
    watch.seen = 0


@kernel
def is_proportional(watch: Any) -> bool:
    """Whether the mismatches m seen follow the spins w as m = k w clearly better than as m = constant (both rad/s)."""
    n, m, w = watch.seen, watch.mismatch, watch.spin
    slowest, highest, fastest = w[0], w[0], abs(w[0])
    products, squares, total = 0.0, 0.0, 0.0
    for i in range(n):
        slowest, highest, fastest = min(slowest, w[i]), max(highest, w[i]), max(fastest, abs(w[i]))
        products += m[i] * w[i]
        squares += w[i] * w[i]
        total += m[i]
    if fastest < SLOWEST_SCALE or highest - slowest < STEADY * fastest:
        return False
    k, mean = products / squares, total / n
    along, apart = 0.0, 0.0
    for i in range(n):
        along += (m[i] - k * w[i]) ** 2
        apart += (m[i] - mean) ** 2
    return bool(4.0 * along < apart)
