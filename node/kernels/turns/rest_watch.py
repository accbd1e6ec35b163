"""Is the node at rest, whatever its bias? The spread of its readings and the aiding say so, and the bias follows.

A bias that was learnt at the start is not that of a sensor which has warmed up since. While the encoder reports a head
at rest and the gyroscope's readings scatter as noise does, their mean is the bias: where it is beyond five sigmas of
the one in use it takes its place, and the node stands still again. A tube that is tilted steadily under a resting head
reads a steady rate too, but its gravity turns with it. How far the bias moved is from then on the standard deviation of
what it may do until the next stop; every rest without a move halves that.

A node without a bias that hears of no head, as on a table, has its readings alone: what is steady within its limit of
rest for as long as a bias is learnt over, and does not turn gravity, is a bias, up to the size that one may have.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import ANGLE_Q, DEG, FORCE_Q, RATE_Q
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import (
    angular_root,
    angular_square,
    bounded_variance,
    factor_of,
    half_of,
    mean_of_total,
    times_factor,
    turned_angle,
)
from node.kernels.arithmetic.quantity import NONE, rate_quantity, time_quantity
from node.kernels.filter.modes import STATIC_BIAS, TRACKING, UNBIASED_STILL_RATE
from node.kernels.filter.priors import bias_var, calm_bias, noise_over, widen_bias
from node.kernels.filter.resets import doubt_yaw, move_bias
from node.kernels.record.events import Code, event_degrees, queue_event
from node.kernels.record.filter_record import RING
from node.kernels.turns.mismatches import settle_dispute
from node.kernels.turns.sensor_trust import is_faulty

CYCLES: Final = 8  # whose mean and spread are looked at
SETTLING: Final = 2  # cycles of a rest before those
LOUDEST: Final = 4  # spread of a rest, in variances of the noise
MOVED: Final = 5  # sigmas of a bias in use
LARGEST: Final = rate_quantity(6.0 * DEG)  # rad/s, of a bias; the slow alignment turn is faster
RATE_AGE: Final = time_quantity(3.0)  # s, of the encoder's word
BIAS_MOVED = kernel_constant(Code.BIAS_MOVED)


@kernel
def watch_rest(node: Any, settings: Any, at: float) -> None:
    """Look at the rest that the encoder reports, every ``CYCLES`` cycles; ``at`` (s, own clock) is now."""
    state, guard = node.filter, node.guard
    heard = abs(at - guard.rate_at) <= RATE_AGE
    searching = state.mode == STATIC_BIAS and not is_faulty(guard.gyro)  # no aiding proves a gyroscope without a bias
    if searching and not heard:
        watch_alone(node, settings)
        return
    told = guard.rate == 0 and heard and (searching or guard.gyro.fault == 0)
    guard.rest_cycles = max(guard.rest_cycles, 0) + 1 if told else 0
    since = guard.rest_cycles - SETTLING
    if since < CYCLES or since % CYCLES != 0 or state.cycles < CYCLES or not is_calm(state, node.config):
        return
    if has_moved(state, node.config):
        if not is_tilting(state, node.config):
            take_bias(node, settings, since)
    else:
        settle_dispute(node, 0)
        if since == CYCLES:
            calm_down(node, settings)


@kernel
def watch_alone(node: Any, settings: Any) -> None:
    """Look, every ``CYCLES`` cycles, whether the readings of a node that has no bias and hears of no head are steady.

    Less than 0 ``rest_cycles`` counts such cycles: no rest that an encoder reports.
    """
    state, guard = node.filter, node.guard
    guard.rest_cycles = min(guard.rest_cycles, 0) - 1
    since = -guard.rest_cycles - SETTLING
    if since < CYCLES or since % CYCLES != 0 or state.cycles < CYCLES:
        return
    if not is_steady(state, node.config):
        guard.rest_cycles = 0
    elif since >= node.config.static_cycles and has_moved(state, node.config) and not is_tilting(state, node.config):
        take_bias(node, settings, since)
        guard.rest_cycles = 0


@kernel
def is_steady(state: Any, config: Any) -> bool:
    """Whether each of the last cycles is as near to their mean as a node at rest is to its bias."""
    for k in range(3):
        usual = mean_rate(state, k)
        limit = config.still_rate if k == 2 else 2 * config.still_rate
        for n in range(CYCLES):
            if abs(state.ring_rate[(state.cycles - 1 - n) % RING, k] - usual) > limit:
                return False
    return True


@kernel
def mean_rate(state: Any, k: int) -> float:
    """Mean (rad/s) of the last cycles about axis ``k``."""
    total: float = 0
    for n in range(CYCLES):
        total += state.ring_rate[(state.cycles - 1 - n) % RING, k]
    return mean_of_total(total, CYCLES)


@kernel
def is_calm(state: Any, config: Any) -> bool:
    """Whether the last cycles scatter as noise does: s^2 <= 4 N^2 / T about each axis."""
    newest = (state.cycles - 1) % RING
    period = state.ring_end[newest] - state.ring_start[newest]
    for k in range(3):
        total: float = 0
        usual = mean_rate(state, k)
        loudest = noise_over(config, k, LOUDEST * (CYCLES - 1), period)
        for n in range(CYCLES):
            total += angular_square(state.ring_rate[(state.cycles - 1 - n) % RING, k] - usual)
            if total > loudest:  # at once: of integers no larger sum would fit
                return False
    return True


@kernel
def mean_down(state: Any, k: int, first: int) -> float:
    """Part ``k`` of the direction of gravity: mean of half of the last cycles, from the ``first``-newest back."""
    total: float = 0
    for n in range(CYCLES // 2):
        total -= state.ring_force[(state.cycles - 1 - first - n) % RING, k]
    return factor_of(mean_of_total(total, CYCLES // 2), FORCE_Q)


@kernel
def is_tilting(state: Any, config: Any) -> bool:
    """Whether gravity turns as the rates beyond the bias in use say: u' = u x w, at least half of it."""
    newest = (state.cycles - 1) % RING
    apart = (CYCLES // 2) * (state.ring_end[newest] - state.ring_start[newest])
    seen: float = 0
    told: float = 0
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        turning_i = mean_rate(state, i) - state.static_bias[i] - state.bias[i]
        turning_j = mean_rate(state, j) - state.static_bias[j] - state.bias[j]
        moved = times_factor(turning_j, mean_down(state, i, 0)) - times_factor(turning_i, mean_down(state, j, 0))
        turned = turned_angle(moved, apart)
        seen += times_factor(turned, mean_down(state, k, 0) - mean_down(state, k, CYCLES // 2))
        told += times_factor(turned, factor_of(turned, ANGLE_Q))
    return bool(seen > half_of(told))


@kernel
def has_moved(state: Any, config: Any) -> bool:
    """Whether the mean of the last cycles is beyond the constant bias; before there is one, beyond what counts as rest.

    What the filter has put into the part that wanders does not count: it would forget it. A node that does not stand
    still by its bias needs no more evidence. Before there is a bias, a mean that is as near to the limit of a rest as
    noise takes single cycles beyond it is one too: those would begin the average anew for ever.
    """
    newest = (state.cycles - 1) % RING
    period = state.ring_end[newest] - state.ring_start[newest]
    length = CYCLES * period
    moved = bool(state.mode != STATIC_BIAS and state.still_cycles == 0)
    for k in range(3):
        usual = mean_rate(state, k)
        if abs(usual) > LARGEST:
            return False
        if state.mode == STATIC_BIAS:
            loud = MOVED * angular_root(noise_over(config, k, 1, period))
            moved = moved or bool(abs(usual) > UNBIASED_STILL_RATE - loud)
            continue
        var = state.static_bias_var[k] + bias_var(config, k) + noise_over(config, k, 1, length)
        moved = moved or bool(abs(usual - state.static_bias[k]) > MOVED * angular_root(var))
    return moved


@kernel
def take_bias(node: Any, settings: Any, since: int) -> None:
    """Let the means of the last cycles be the bias; what the old one turned the yaw by since is in doubt."""
    state, config, guard = node.filter, node.config, node.guard
    newest = (state.cycles - 1) % RING
    period = state.ring_end[newest] - state.ring_start[newest]
    known = state.mode != STATIC_BIAS
    for k in range(3):
        usual = mean_rate(state, k)
        moved = usual - state.static_bias[k]
        off = moved - state.bias[k]
        var = noise_over(config, k, 1, CYCLES * period) + bias_var(config, k)
        if known and settings.imus == 1:
            widen_bias(config, k, abs(moved))
        move_bias(state, k, usual, bounded_variance(var), bias_var(config, k))
    moved_z = off
    if not known:
        state.mode = TRACKING
    doubt_yaw(state, angular_square(turned_angle(moved_z * since, period)))
    state.rejected = 0
    guard.before_steps = NONE
    guard.step.fault = 0
    settle_dispute(node, 1)
    queue_event(node, BIAS_MOVED, event_degrees(moved_z, RATE_Q), NONE, NONE, NONE)


@kernel
def calm_down(node: Any, settings: Any) -> None:
    """A rest without a move: the bias wanders as little as it is stated to, sooner or later."""
    if settings.imus > 1:
        return
    for k in range(3):
        calm_bias(node.config, k, settings.plain_bias_std[k])
