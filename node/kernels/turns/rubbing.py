"""Does the string rub against the rock? What rubs is wound while it is driven and creeps below a resting head.

A twist of a twentieth to a fifth of a degree that grows over half a minute, or a creep of a few thousandths of a degree
a second, is less than what the gyroscope's bias wanders by, and the encoder reads the head: no sensor of one node tells
it (``docs/field.md`` has the proof). What the node does sense is whether its string is one that rubs. A string that
hangs free turns evenly. One that drags swings about its rate, or vibrates about its axis: the rates of three cycles in
a row bend by more than three sigmas of their noise, or those of the eighths of one cycle scatter by more. A ramp does
so too, in fewer cycles than are asked for. Shaking along the axis is no sign, since any drilling shakes.

Of a string that rubs the yaw is open by the twist that it may have, until some seconds after the stop, and then by the
creep. A twist that is told has its own variance (``node.kernels.string.twist``), and nothing is added to it.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import DEG
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import angular_square, as_number, bounded_variance, half_of
from node.kernels.arithmetic.quantity import variance_quantity
from node.kernels.filter.priors import noise_over
from node.kernels.record.filter_record import PARTS, RECENT, RING
from node.kernels.record.ring import is_split
from node.kernels.string.twist import twist_var

SHOWS: Final = 2  # that an uneven cycle counts; an even one takes one away
ENOUGH: Final = 24  # from where the string rubs: twelve uneven cycles in a row, more than a ramp has
MOST: Final = 48  # that are counted
REMEMBERED: Final = 600  # cycles of turning, for which it is known to
BENT: Final = 14  # variances of a rate's noise, beyond which half a bend is none: three sigmas of it
SCATTER: Final = 18  # variances of an eighth's noise, beyond which the sum of eight is none: once in eighty cycles
LET_GO: Final = 32  # cycles of a rest, after which a string has let go what it held
WOUND: Final = variance_quantity((0.075 * DEG) ** 2)  # rad^2, of the yaw until then
CREPT: Final = variance_quantity((0.055 * DEG) ** 2)  # rad^2, from then on


@kernel
def rubbing_var(node: Any) -> float:
    """Variance (rad^2) of the yaw by what a string that rubs may have turned by, unseen."""
    guard, twist = node.guard, node.twist
    is_told = twist.torque != 0 or twist.holding == 1 or twist.wound == 1 or twist_var(twist) != 0
    none = 0 * guard.aiding_var
    if guard.rubbing.left == 0 or is_told:
        return as_number(none)
    return as_number(WOUND + none if guard.rest_cycles < LET_GO else CREPT + none)


@kernel
def follow_rubbing(node: Any) -> None:
    """Take the cycle in that the filter has just had, and open the yaw by what the string may have turned by."""
    state, guard, rubbing = node.filter, node.guard, node.guard.rubbing
    if guard.rate != 0 and state.still_cycles == 0 and state.cycles >= 3:
        shows = is_bent(state, node.config) or is_trembling(state, node.config)
        rubbing.score = min(rubbing.score + SHOWS, MOST) if shows else max(rubbing.score - 1, 0)
        rubbing.left = REMEMBERED if rubbing.score >= ENOUGH else max(rubbing.left - 1, 0)
    elif guard.rest_cycles == LET_GO:
        rubbing.score = 0  # else the ramps of a stop and of the next start would be one
    var = rubbing_var(node)
    state.systematic_var = bounded_variance(max(state.systematic_var + var - rubbing.var, 0))
    rubbing.var = var


@kernel
def is_bent(state: Any, config: Any) -> bool:
    """Whether the rates about the axis of the last three cycles bend by more than noise does."""
    newest = (state.cycles - 1) % RING
    one, other = state.ring_rate[newest, 2], state.ring_rate[(state.cycles - 3) % RING, 2]
    bend = one + other - 2 * state.ring_rate[(state.cycles - 2) % RING, 2]
    period = state.ring_end[newest] - state.ring_start[newest]
    return bool(angular_square(half_of(bend)) > noise_over(config, 2, BENT, period))


@kernel
def is_trembling(state: Any, config: Any) -> bool:
    """Whether the rates of the parts of the newest cycle scatter by more than noise does; not if they are not known."""
    newest = state.cycles - 1
    if not is_split(state, newest):
        return False
    slot, total = newest % RECENT, 0 * state.innovation_var
    period = state.ring_end[newest % RING] - state.ring_start[newest % RING]
    limit = noise_over(config, 2, SCATTER, half_of(half_of(half_of(period))))
    for part in range(PARTS):
        total += angular_square(state.ring_parts[slot, part])
        if total > limit:  # at once: of integers no larger sum would fit
            return True
    return False
