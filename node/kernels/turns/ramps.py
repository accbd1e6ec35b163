"""Does the string follow the head through a ramp? What the aidings of a start, a stop or a turn back leave unexplained.

While the rate changes two things are told apart from noise by their size alone: a string that winds up below its head,
and readings that are not of the time they say. Either contradicts the encoder by far more than its variance within a
few aidings, and then no more: no bias and no step grows like that. The node cannot know which of the two was right, so
what they contradicted it by is systematic variance of the yaw, and half of that variance is left after every ramp that
fits. What the ramp taught of the gyroscope's scale is forgotten. In honest noise the sum of squares stays far below its
limit (0.7 an aiding, at most 22 in 640 ramps), and none of this happens.

The head at rest is measured once in a rest, and that measurement judges the turn to it, however slow it was: one beyond
two sigmas says that the string ran on into some play, or that the gyroscope's readings were not of their time. It is
used, and what it contradicted is in doubt likewise. One honest stop in twenty is doubted so, by what it deserves.

A gyroscope's scale is not the same in both directions (asymmetry, IEEE Std 528). It is learnt in the one in which the
string turns fast, so an angle turned back is off by a part of itself.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import ANGLE_Q, DEG, VECTOR_Q
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import (
    angular_root,
    angular_square,
    bounded_variance,
    half_of,
    mean_of_total,
    quantity_ratio,
    times_factor,
    turned_angle,
)
from node.kernels.arithmetic.quantity import NONE, factor_quantity, rate_quantity, variance_quantity
from node.kernels.filter.resets import doubt_yaw, forget_scale, open_yaw
from node.kernels.record.events import Code, event_degrees, event_number, queue_event
from node.kernels.record.filter_record import RING, Err
from node.kernels.string.twist import twist_var

LEAST_CHANGE: Final = rate_quantity(5.0 * DEG)  # rad/s, from one cycle to the next, on a ramp
REACH: Final = 10  # cycles after it, whose aidings still show what it did
LONGEST: Final = 16  # cycles; rates that change for longer are a drive that swings
MOST: Final = 16  # variances, that one innovation counts for
MOST_TIMES: Final = factor_quantity(16.0)
LIMIT: Final = factor_quantity(36.0)  # sum of innovation^2 / variance, from where the ramp does not fit
CONTRADICTED: Final = 4  # variances, from where the head at rest and the turn to it do not fit
LARGEST: Final = variance_quantity(DEG**2)  # rad^2, variance of an innovation that counts by itself
LEAST_DOUBT: Final = variance_quantity((0.002 * DEG) ** 2)  # rad^2, below which a doubt counts as zero
STARTING: Final = 14  # cycles of a string that has started, in which it may wind up, or be taken for a scale
AGES: Final = 1000  # cycles, that are counted
FAST: Final = rate_quantity(20.0 * DEG)  # rad/s, from where the scale is learnt
SLOW: Final = rate_quantity(0.5 * DEG)  # rad/s, up to which nothing turns back
ASYMMETRY: Final = factor_quantity(2e-3)  # of an angle turned back, its error
S = kernel_constant(Err.SCALE)
AIDING_DOUBTED = kernel_constant(Code.AIDING_DOUBTED)


@kernel
def is_starting(node: Any) -> bool:
    """Whether the string has started a few cycles ago, as the head did."""
    return bool(node.guard.rate != 0 and node.filter.still_cycles == 0 and 0 < node.guard.ramp.cycles <= STARTING)


@kernel
def follow_ramp(node: Any) -> None:
    """Take the cycle in that the filter has just had."""
    state, ramp = node.filter, node.guard.ramp
    if state.cycles < 2:
        return
    newest = state.cycles - 1
    change = abs(state.ring_rate[newest % RING, 2] - state.ring_rate[(newest - 1) % RING, 2])
    if change > LEAST_CHANGE and ramp.left == 0:
        begin_ramp(ramp)
    ramp.lasted += 1
    ramp.left = REACH if change > LEAST_CHANGE else max(ramp.left - 1, 0)
    if ramp.lasted > LONGEST:
        ramp.left = 0
    if state.still_cycles > 0:
        ramp.cycles, ramp.back = 0, 0
        ramp.scale, ramp.scale_std = state.scale, angular_root(state.P[S, S])
    else:
        ramp.cycles = min(ramp.cycles + 1, AGES)
        follow_back(node, state.ring_end[newest % RING] - state.ring_start[newest % RING])


@kernel
def begin_ramp(ramp: Any) -> None:
    """Begin the sums anew; the ramp before, if it fitted, halves what is in doubt."""
    if ramp.doubted == 0:
        ramp.doubt = half_of(ramp.doubt) if ramp.doubt > LEAST_DOUBT else 0
    ramp.lasted = ramp.seen = ramp.doubted = ramp.opened = 0
    ramp.misfit = ramp.largest = 0


@kernel
def follow_back(node: Any, period: float) -> None:
    """Open the yaw by what the scale does not say of an angle that the string turned back."""
    state, ramp = node.filter, node.guard.ramp
    spin = state.now_rate
    if abs(spin) > FAST:
        ramp.sense = -1 if spin < 0 else 1
    if abs(spin) < SLOW or ramp.sense == 0 or (spin < 0) == (ramp.sense < 0):
        return
    before = ramp.back
    ramp.back += turned_angle(abs(spin), period)
    open_yaw(
        state, angular_square(times_factor(ramp.back, ASYMMETRY)) - angular_square(times_factor(before, ASYMMETRY))
    )


@kernel
def follow_fit(node: Any, rejected: int) -> None:
    """Take the innovation of an aiding in; of those that are rejected the first in a row may be an outlier."""
    state, ramp = node.filter, node.guard.ramp
    whole = state.innovation_var
    if not whole > 0 or (rejected == 1 and state.rejected == 1):
        return
    own = angular_square(state.innovation)
    if ramp.left > 0:
        ramp.seen += 1
        ramp.misfit += min(quantity_ratio(own, whole), MOST_TIMES)
        ramp.largest = max(ramp.largest, min(own, MOST * min(whole, LARGEST)))
    if ramp.left > 0 and ramp.misfit > LIMIT:
        doubt_ramp(node, own, rejected)
    elif rejected == 0 and own > CONTRADICTED * whole and has_come_to_rest(node):
        doubt_stop(node, own - whole)


@kernel
def has_come_to_rest(node: Any) -> bool:
    """Whether the aiding used last is a head's at rest, well timed, of a string whose twist is not told.

    It is said only once in a rest. Where a twist is told the yaw was opened by it, and more is not to be doubted.
    """
    state = node.filter
    is_well_timed = state.still_cycles > 0 and state.last_sequence != -1
    return bool(node.guard.rate == 0 and is_well_timed and twist_var(node.twist) == 0)


@kernel
def doubt_stop(node: Any, var: float) -> None:
    """The head at rest is not where its string was turned to: a variance (rad^2) for whichever of the two is right."""
    state, ramp = node.filter, node.guard.ramp
    doubt = bounded_variance(max(ramp.doubt, var))
    state.systematic_var = bounded_variance(state.systematic_var + doubt - ramp.doubt)
    ramp.doubt = doubt


@kernel
def doubt_ramp(node: Any, own: float, rejected: int) -> None:
    """The ramp does not fit: an aiding that was used has moved the yaw by its innovation, of which ``own`` (rad^2)."""
    state, ramp = node.filter, node.guard.ramp
    ramp.doubt = max(ramp.doubt, ramp.largest)
    if ramp.doubted == 0:
        ramp.doubted = 1
        sigma = event_degrees(angular_root(ramp.doubt), ANGLE_Q)
        queue_event(
            node, AIDING_DOUBTED, event_number(mean_of_total(ramp.misfit, ramp.seen), VECTOR_Q), sigma, NONE, NONE
        )
    if rejected == 1:
        return
    ramp.doubt = bounded_variance(max(ramp.doubt, own))
    if ramp.opened == 0:
        ramp.opened = 1
        doubt_yaw(state, ramp.largest)
        learn_scale_anew(node)


@kernel
def learn_scale_anew(node: Any) -> None:
    """What the ramp taught of the scale is forgotten; that it is open again makes as much of a step as a start."""
    ramp = node.guard.ramp
    forget_scale(node.filter, ramp.scale, angular_square(ramp.scale_std))
    ramp.cycles = 0


@kernel
def explain_ramp(ramp: Any) -> None:
    """What did not fit was the gyroscope's doing."""
    if ramp.doubted == 1:
        ramp.doubt = 0
    begin_ramp(ramp)
    ramp.left = 0
