"""What gyroscope and aiding leave unexplained between them: variance of the yaw until it is explained.

Two kinds. A *misfit* is innovations that are larger than their variance again and again, or like the one before, which
those of a right filter are not: a disc off its centre, a sensor that leans or feels vibration, a drive that swings
between two samples. No filter averages it away, for it is not white: what the innovations have beyond their variance,
or in common with the one before, is systematic variance of the yaw. The variance of an aiding has it up to a limit
only: a gain that falls as innovations grow would let the yaw go. A *jump* is a reset after aidings that all
contradicted the yaw: either the string slipped or the encoder did, and the node cannot know which. What it jumped by
stays systematic until it jumps back.

A sensor whose window is not the cycle's is dated by its driver, which is a little off: by the delay of the sensor's
filter, that no data sheet tells exactly, and by the phase of its crystal. What stays of that, e, and the error d of the
aidings' time stamp have one effect on an aiding, (e + d) w, so the filter's state of the time stamp learns their sum t
on every ramp. But the yaw of the present is off by e w alone. Of two independent errors with the variances E and D the
share s = E / (E + D) of the sum is the estimate of e, and E (1 - s) the variance that no aiding takes from it: a state
without a row.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.angles import wrap_angle
from node.kernels.arithmetic.formats import ANGLE_Q, DEG, VECTOR_Q
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import (
    angular_product,
    angular_root,
    angular_square,
    as_number,
    bounded_ratio,
    bounded_variance,
    half_of,
    is_number,
    mean_of_total,
    quantity_ratio,
    stamp_square,
    stamp_time,
    time_of_cycles,
    times_factor,
    turned_angle,
    turned_binary,
)
from node.kernels.arithmetic.quantity import NONE, ONE, factor_quantity, variance_quantity
from node.kernels.filter.priors import stamp_var
from node.kernels.filter.resets import turn_present
from node.kernels.record.events import Code, event_degrees, event_number, queue_event
from node.kernels.turns.same_errors import same_error_var
from node.kernels.turns.swings import swing_var
from node.kernels.turns.turn_ratio import ratio_var

MEMORY: Final = 32  # aidings over which the misfit is averaged
DOUBTED: Final = factor_quantity(
    2.0
)  # mean of innovation^2 / variance, from where it is a misfit; of honest noise once in 10^5 hours
CLEARED: Final = factor_quantity(1.5)  # likewise, below which it is none any more
ALIKE: Final = factor_quantity(
    0.7
)  # mean of the products of neighbours over the variance, from where they hang together
UNLIKE: Final = factor_quantity(0.3)  # likewise, below which they do not any more
MOST: Final = 9  # variances, that one innovation counts for: outliers and faults are for the gate
SURE: Final = 5  # sigmas, from where what a gyroscope cannot explain is a jump
UNSURE_CYCLES: Final = 2  # in which it may have been wrong before it contradicted, or turned otherwise than last
SETTLED: Final = 9  # variances, within which two jumps cancel each other
LEAST: Final = factor_quantity(0.01)  # of a variance, that is left of it without the misfit
LARGEST_MISFIT: Final = variance_quantity((5.0 * DEG) ** 2)  # rad^2
LARGEST_NOISE: Final = variance_quantity((0.1 * DEG) ** 2)  # rad^2, of it in the variance of an aiding
AIDING_DOUBTED = kernel_constant(Code.AIDING_DOUBTED)


@kernel
def misfit_var(node: Any) -> float:
    """Variance (rad^2) of the yaw by the misfit; while the head turns also by its swings, which a rest ends."""
    guard = node.guard
    shown = max(guard.excess, guard.shared) if guard.doubted == 1 else 0
    swung = swing_var(node) if guard.rate != 0 else 0
    return as_number(min(max(shown, swung), LARGEST_MISFIT))


@kernel
def noise_var(node: Any) -> float:
    """Variance (rad^2) of an aiding by the misfit; of a head at rest none, for what misfits is the turning."""
    return min(misfit_var(node), LARGEST_NOISE) if node.guard.rate != 0 else 0


@kernel
def unexplained_var(node: Any) -> float:
    """Variance (rad^2) of the yaw that no filter averages away: of misfit, string, encoder, of a late window."""
    guard, dated = node.guard, passing_var(node) + delay_var(node)
    of_string = guard.ramp.doubt + guard.creep.doubt + guard.rubbing.var + angular_square(guard.disputed)
    of_encoder = angular_square(guard.jump) + same_error_var(node) + ratio_var(node)
    return bounded_variance(misfit_var(node) + of_string + of_encoder + dated)


@kernel
def is_dated(node: Any) -> bool:
    """Whether a driver dates the window of its readings."""
    late = node.cluster.delayed[0].late
    return bool(late != 0 and is_number(late))


@kernel
def window_var(node: Any) -> float:
    """Variance (rad^2) of the yaw while the head turns, by what that date may be off."""
    return angular_square(turned_angle(node.guard.rate, node.cluster.delayed[0].std)) if is_dated(node) else 0


@kernel
def passing_var(node: Any) -> float:
    """Variance (rad^2) of an aiding by that part of it which is another one in every window."""
    return (
        window_var(node) - angular_square(turned_angle(node.guard.rate, node.cluster.delayed[0].lasting))
        if is_dated(node)
        else 0
    )


@kernel
def delay_share(node: Any) -> float:
    """Share of the time stamp's estimate that is the error of the windows' date; 0 where nothing stays of that."""
    window = node.cluster.delayed[0]
    if not is_dated(node) or half_of(window.std) >= window.lasting:
        return 0
    lasting = stamp_square(window.lasting)
    return as_number(bounded_ratio(lasting, lasting + stamp_var(node.config)))


@kernel
def delay_var(node: Any) -> float:
    """Variance (rad^2) of the yaw while the head turns, by what is left of that error once the share is put right."""
    if not is_dated(node):
        return 0
    whole = angular_square(turned_angle(node.guard.rate, node.cluster.delayed[0].lasting))
    return times_factor(whole, ONE - delay_share(node))


@kernel
def put_delay_right(node: Any) -> None:
    """Turn the yaw of the present on by what the windows are late by beyond their date."""
    share, state = delay_share(node), node.filter
    if share != 0:
        late = times_factor(stamp_time(state.stamp), share)
        state.now_yaw = turned_binary(turned_angle(state.now_rate, late), state.now_yaw)
        turn_present(node, times_factor(state.now_rate, share))


@kernel
def follow_misfit(node: Any) -> None:
    """Take the innovation of an aiding in; ``state.innovation_var`` has the present misfit in it.

    m += (r^2 / S - m) / n and E += (r^2 - S - E) / n, with S the variance without the misfit and r^2 at most 9 times
    that with it; the same of the product with the innovation before, whose mean is that of no noise.
    """
    state, guard = node.filter, node.guard
    whole = state.innovation_var
    if not whole > 0:
        return
    plain = max(whole - noise_var(node), times_factor(whole, LEAST))
    own = min(angular_square(state.innovation), MOST * whole)
    guard.misfit += mean_of_total(quantity_ratio(own, plain) - guard.misfit, MEMORY)
    guard.excess = max(guard.excess + mean_of_total(own - plain - guard.excess, MEMORY), 0)
    common = max(min(angular_product(state.innovation, guard.before), MOST * whole), -MOST * whole)
    guard.likeness += mean_of_total(quantity_ratio(common, plain) - guard.likeness, MEMORY)
    guard.shared = max(guard.shared + mean_of_total(common - guard.shared, MEMORY), 0)
    guard.before = state.innovation
    if guard.doubted == 0 and (guard.misfit > DOUBTED or guard.likeness > ALIKE):
        guard.doubted = 1
        sigma = event_degrees(angular_root(misfit_var(node)), ANGLE_Q)
        queue_event(node, AIDING_DOUBTED, event_number(guard.misfit, VECTOR_Q), sigma, NONE, NONE)
    elif guard.doubted == 1 and guard.misfit < CLEARED and guard.likeness < UNLIKE:
        guard.doubted = 0


@kernel
def follow_jump(node: Any) -> None:
    """The yaw was taken from an aiding that contradicted it: it jumped by the innovation, unless it came back.

    The systematic variance says so at once; from the next aiding on it is that of the aiding.
    """
    state, guard, before = node.filter, node.guard, node.guard.jump
    guard.last_jump = state.innovation
    guard.jump = wrap_angle(guard.jump + state.innovation)
    if angular_square(guard.jump) < SETTLED * state.innovation_var:
        guard.jump = 0
    state.systematic_var = bounded_variance(
        max(state.systematic_var + angular_square(guard.jump) - angular_square(before), 0)
    )


@kernel
def keep_contradiction(node: Any) -> None:
    """The gyroscope turns out to give nothing while aidings contradict it: at rest it may explain what it turned by.

    What is left is a jump, of which the node will know nothing more. Where the head turned nothing can be said.
    """
    state, guard = node.filter, node.guard
    if state.rejected == 0 or guard.rest_cycles < state.rejected:
        return
    turned = turned_angle(state.now_rate, time_of_cycles(state.now, state.rejected))
    unsure = abs(turned_angle(state.now_rate, time_of_cycles(state.now, UNSURE_CYCLES))) + SURE * angular_root(
        state.innovation_var
    )
    jump = wrap_angle(state.innovation + turned)
    if abs(jump) > unsure:
        guard.jump = wrap_angle(guard.jump + jump)


@kernel
def explain_jump(node: Any) -> None:
    """The last reset was the gyroscope's doing: what the yaw jumped by is no longer in doubt."""
    guard = node.guard
    if guard.last_jump != 0:
        guard.jump = wrap_angle(guard.jump - guard.last_jump) if guard.jump != 0 else 0
        guard.last_jump = 0
