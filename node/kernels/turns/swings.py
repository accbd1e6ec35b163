"""Does the drive swing faster than a cycle can follow? Variance of the yaw from how the rates of three cycles bend.

Inside a cycle the spin is linear about its mean (``node.kernels.filter.float64.fixed_lag``). Where it bends by w''
(rad/s^3) the angle to a moment inside is off by up to ``w'' T^3 / (72 sqrt(3)) = b T / 62``, with b = w'' T^2 / 2 what
the mean of a cycle is off from those beside it. A ramp bends where it begins and ends, and that is over with the next
cycles. A head that ripples, or sticks and slips, bends in nearly all of them: from one aiding to the next such errors
hang together, and they come before innovations can show them. The slope from the neighbours' means is wrong too, by up
to three times as much in swings of 3 s; that swings about zero, and the filter averages it.
"""

from __future__ import annotations

import math
from typing import Any, Final

from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import angular_square, as_number, half_of, mean_of_total, turned_angle
from node.kernels.arithmetic.quantity import rate_quantity, time_quantity
from node.kernels.record.filter_record import RING
from node.kernels.record.ring import is_split

LEAST_BEND: Final = rate_quantity(0.5 * DEG)  # rad/s, that no noise of a gyroscope reaches
SWINGING: Final = 10  # cycles that bend, less those that do not, from where it is no ramp
MOST: Final = 16  # likewise, that are counted
MEMORY: Final = 16  # cycles over which the variance is averaged
INSIDE: Final = 4  # aidings at rates that no cycle has, less those at others, from where a swing is inside the cycles
LEAST_OUTSIDE: Final = rate_quantity(2.0 * DEG)  # rad/s, of such a rate
AVERAGED: Final = 8  # aidings, over which it is
LARGER: Final = 4  # times, that it is larger than what a beat makes of it
LONGEST_SWING: Final = time_quantity(0.25)  # s, of the rate by which the yaw may be off, from one end to the other
REACH: Final = time_quantity(PERIOD / (36.0 * math.sqrt(3.0)))  # s, largest error (rad) of a bend of 1 rad/s


@kernel
def swing_var(node: Any) -> float:
    """Variance (rad^2) of the yaw by a drive that swings."""
    swing = node.guard.swing
    return as_number(swing.excess) if swing.cycles >= SWINGING else 0


@kernel
def follow_swing(node: Any) -> None:
    """Take the cycle in that the filter has just had."""
    state, swing = node.filter, node.guard.swing
    if state.cycles < 3:
        return
    newest = state.cycles - 1
    if is_split(state, newest - 1):
        swing.cycles, swing.excess = 0, 0 * swing.excess
        return
    outer = half_of(state.ring_rate[newest % RING, 2] + state.ring_rate[(newest - 2) % RING, 2])
    bend = abs(outer - state.ring_rate[(newest - 1) % RING, 2])
    swing.cycles = min(swing.cycles + 1, MOST) if bend > LEAST_BEND else max(swing.cycles - 1, 0)
    swing.excess += mean_of_total(angular_square(turned_angle(bend, REACH)) - swing.excess, MEMORY)


@kernel
def follow_inside(node: Any) -> None:
    """Take in whether the encoder's rate of the last aiding is one that the cycles beside it do not have."""
    state, swing = node.filter, node.guard.swing
    newest = state.cycles - 1
    if newest < 2 or is_split(state, newest - 1) or node.guard.rate == 0:
        swing.inside = max(swing.inside - 1, 0)
        return
    least = most = state.ring_rate[newest % RING, 2]
    for n in range(1, 3):
        rate = state.ring_rate[(newest - n) % RING, 2]
        least, most = min(least, rate), max(most, rate)
    told = node.guard.rate + state.static_bias[2] + state.bias[2]
    outside = max(told - most, least - told, 0)
    swing.inside = min(swing.inside + 1, MOST) if outside > LEAST_OUTSIDE else max(swing.inside - 1, 0)
    swing.outside += mean_of_total(outside - swing.outside, AVERAGED)


@kernel
def is_beat(node: Any, mismatch: float) -> bool:
    """Whether a ``mismatch`` (rad/s) that aidings show alike is that of a swing inside the cycles."""
    swing = node.guard.swing
    return bool(swing.inside >= INSIDE and swing.outside > LARGER * abs(mismatch))


@kernel
def explains_jump(node: Any) -> bool:
    """Whether a swing inside the cycles explains the innovation that the yaw was reset by."""
    swing = node.guard.swing
    return bool(swing.inside >= INSIDE and abs(node.filter.innovation) < turned_angle(swing.outside, LONGEST_SWING))
