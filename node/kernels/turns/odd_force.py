"""Odd forces at rest: a knock, the begin of a fault, or a tube that was tilted and no gyroscope saw it."""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import ANGLE_Q, DEG
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import angular_root, bounded_ratio, factor_of, times_factor, vector_length
from node.kernels.arithmetic.quantity import factor_quantity, variance_quantity
from node.kernels.filter.resets import lose_tilt
from node.kernels.record.filter_record import Err
from node.kernels.turns.sensor_trust import SANE_CYCLES

LONGEST_KNOCK: Final = 8  # cycles of an odd force; one that lasts has shown what it is by then, or is a tilt
GRAVITY_ERROR: Final = factor_quantity(0.05)  # of gravity, of a force at rest
LEAST_TILT_VAR: Final = variance_quantity(
    (3.0 * DEG) * (3.0 * DEG)
)  # rad^2, of a tilt at rest that no gyroscope misses
SURE_VAR: Final = variance_quantity(0.01)  # rad^2, of the tilt, from where the filter is not sure of it
FAR_OFF: Final = 4  # sigmas, that a tilt may be wrong by
TX, TY = kernel_constant(Err.TILT_X), kernel_constant(Err.TILT_Y)


@kernel
def keeps_out(node: Any) -> bool:
    """Whether the force of a node at rest is not to be used: a knock, or a fault that shows later.

    Levelled by two such cycles a filter that is sure of its tilt explains the rest by the gyroscope's biases. If it
    stays and is no fault the tube was tilted and no gyroscope saw it: nothing is known of the tilt, until what was
    kept out has left the filter's lag.
    """
    guard = node.guard
    if not (is_odd(node) or LONGEST_KNOCK <= guard.odd < LONGEST_KNOCK + SANE_CYCLES):
        guard.odd = 0
        return False
    guard.odd = min(guard.odd + 1, LONGEST_KNOCK + SANE_CYCLES)
    if guard.odd < LONGEST_KNOCK:
        node.filter.still_cycles = 0  # the average of a stop begins again
        return True
    if guard.odd < LONGEST_KNOCK + SANE_CYCLES:
        lose_tilt(node.filter)
        node.filter.surveyed = 0  # it leans otherwise
    return False


@kernel
def is_odd(node: Any) -> bool:
    """Whether a node at rest feels a force that is not gravity's, or from where the filter is sure it is not."""
    state, force, gravity = node.filter, node.force, node.config.gravity
    if state.still_cycles == 0 and node.guard.odd == 0:
        return False
    weight = vector_length(force[0], force[1], force[2])
    if abs(weight - gravity) > times_factor(gravity, GRAVITY_ERROR):
        return True
    tilt_var = state.P[TX, TX] + state.P[TY, TY]
    if tilt_var > SURE_VAR:
        return False
    down = state.now_down
    x, y, z = bounded_ratio(force[0], weight), bounded_ratio(force[1], weight), bounded_ratio(force[2], weight)
    apart = vector_length(x + down[0], y + down[1], z + down[2])
    return bool(apart > factor_of(angular_root(tilt_var * FAR_OFF * FAR_OFF + LEAST_TILT_VAR), ANGLE_Q))
