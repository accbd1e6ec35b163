"""The turn inside a cycle, part by part: how much faster each eighth of it turned than the whole.

A sensor with a FIFO knows more of a cycle than its mean. Where it tells, the spin inside is that of its parts, linear
in each by the slope of those beside it, and an aiding is taken at its own instant though the drive starts or stops
there. Of sensors that give means alone nothing is known inside, and the loop takes a line through the cycles beside.
Written once for both arithmetics (``node.kernels.arithmetic.operations``).
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import (
    as_number,
    bounded_ratio,
    half_of,
    is_number,
    proportional_share,
    times_factor,
    turned_angle,
)
from node.kernels.arithmetic.quantity import NONE, ONE, factor_quantity, time_quantity
from node.kernels.record.filter_record import PARTS, RECENT, RING
from node.kernels.record.ring import is_split

INSTANT: Final = time_quantity(1e-6)  # s, shorter spans count as zero
GAP: Final = time_quantity(1e-3)  # s, between two cycles that adjoin
BENT: Final = factor_quantity(0.25)  # of a bend, see ``bent_angle``


@kernel
def part_length(state: Any, cycle: int) -> float:
    """Length of a part of ``cycle``, s."""
    slot = cycle % RING
    return half_of(half_of(half_of(state.ring_end[slot] - state.ring_start[slot])))


@kernel
def part_at(state: Any, cycle: int, at: float) -> int:
    """Number of the part of ``cycle`` in which ``at`` (s) lies, 0..PARTS - 1."""
    passed, length = at - state.ring_start[cycle % RING], part_length(state, cycle)
    for part in range(1, PARTS):
        if passed < part * length:
            return part - 1
    return PARTS - 1


@kernel
def rate_rise(state: Any, cycle: int, part: int) -> float:
    """How much faster (rad/s) a part turned than the one before; parts beyond those of ``cycle`` are its neighbours'.

    No number where one of the two is not known.
    """
    if part < 0 or part > PARTS:
        cycle += -1 if part < 0 else 1
        part += PARTS if part < 0 else -PARTS
    if 0 < part < PARTS:
        own = state.ring_parts[cycle % RECENT]
        return as_number(own[part] - own[part - 1]) if is_split(state, cycle) else NONE
    before = cycle - 1 if part == 0 else cycle
    after = before + 1
    if not (is_split(state, before) and is_split(state, after)):
        return NONE
    if state.ring_start[after % RING] - state.ring_end[before % RING] > GAP:
        return NONE
    last = state.ring_rate[before % RING, 2] + state.ring_parts[before % RECENT, PARTS - 1]
    return as_number(state.ring_rate[after % RING, 2] + state.ring_parts[after % RECENT, 0] - last)


@kernel
def part_rate(state: Any, cycle: int, part: int, off: float, length: float) -> float:
    """How much faster than its cycle a part turns (rad/s) at ``off`` (s) from its middle; it is ``length`` (s) long."""
    into, out = rate_rise(state, cycle, part), rate_rise(state, cycle, part + 1)
    if not is_number(into):
        slope = out
    elif not is_number(out):
        slope = into
    else:
        slope = half_of(into + out)
    return as_number(state.ring_parts[cycle % RECENT, part] + times_factor(slope, bounded_ratio(off, length)))


@kernel
def mean_excess_rate(state: Any, cycle: int, begin: float, end: float) -> float:
    """Mean from ``begin`` to ``end`` (s) inside a split ``cycle`` of how much faster than its mean it turns (rad/s)."""
    start, length = state.ring_start[cycle % RING], part_length(state, cycle)
    if end - begin <= INSTANT:
        part = part_at(state, cycle, begin)
        return part_rate(state, cycle, part, begin - start - part * length - half_of(length), length)
    total: float = 0
    if begin == start and end == state.ring_end[cycle % RING]:
        return total
    for part in range(PARTS):
        border = start + part * length
        since = max(begin, border)
        until = end if part == PARTS - 1 else min(end, border + length)
        if until > since:
            middle = half_of(since - border) + half_of(until - border) - half_of(length)
            total += proportional_share(part_rate(state, cycle, part, middle, length), until - since, end - begin)
    return total


@kernel
def rate_bend(state: Any, cycle: int, part: int) -> float:
    """How much the rates of three parts bend (rad/s): the rise to the one in the middle less the rise from it."""
    into, out = rate_rise(state, cycle, part), rate_rise(state, cycle, part + 1)
    if not is_number(into):
        return as_number(out) if is_number(out) else 0
    return as_number(into - out) if is_number(out) else as_number(into)


@kernel
def bend_at(state: Any, cycle: int, at: float) -> float:
    """How much the rates about ``at`` (s) bend or jump (rad/s), as one bend.

    A head that stops dead within a part leaves bends of two signs in the parts beside it, and perhaps none in its own.
    Their sum is the jump, which counts for two bends; where a ramp begins or ends all three are of one sign.
    """
    part = part_at(state, cycle, at)
    own, before, after = (
        rate_bend(state, cycle, part),
        rate_bend(state, cycle, part - 1),
        rate_bend(state, cycle, part + 1),
    )
    if (before < 0) == (after < 0):
        return as_number(own)
    return as_number(max(abs(own), 2 * (abs(before) + abs(after))))


@kernel
def bent_angle(state: Any, cycle: int, at: float) -> float:
    """Standard deviation (rad) of the angle to ``at`` (s) in a split ``cycle``, for the spin is linear in each part.

    A drive that starts or ends a ramp anywhere within a part or in those beside it, of a bend b: the angle up to the
    fraction f of the part, of length T, is off by at most b T f (1 - f) / 4, and by four fifths of that rms.
    One that jumps by c makes twice that of it.
    """
    length = part_length(state, cycle)
    off = at - state.ring_start[cycle % RING] - part_at(state, cycle, at) * length
    inside = bounded_ratio(min(max(off, 0), length), length)
    return turned_angle(
        times_factor(bend_at(state, cycle, at), times_factor(times_factor(inside, ONE - inside), BENT)), length
    )
