"""First levelling of a node that does not know how it leans: gravity's direction straight from the accelerometer.

The filter's levelling is linear about its present guess. From upright it finds a horizontal tube 8 degrees wrong and an
inverted one never, so a guess that is far off is replaced before the filter refines it.
"""

from __future__ import annotations

import math
from typing import Any, Final

from node.kernels.arithmetic.formats import DEG, Array
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import bounded_ratio, times_factor, vector_length
from node.kernels.arithmetic.quantity import factor_quantity, rate_quantity, variance_quantity
from node.kernels.record.filter_record import Err
from node.kernels.sensors.sensor_watch import largest_magnitude

TX, TY = kernel_constant(Err.TILT_X), kernel_constant(Err.TILT_Y)
UNKNOWN_VAR: Final = variance_quantity(0.25)  # rad^2 of tilt, above which nothing is known that a reading could spoil
SLOWEST: Final = rate_quantity(6.0 * DEG)  # rad/s, up to which a mean over a cycle is that of one attitude
GRAVITY_ERROR: Final = factor_quantity(0.05)  # of gravity, at rest
FAR_OFF: Final = factor_quantity(1.0 - math.cos(0.1))  # of an upright tube; more is not left to the linear levelling


@kernel
def level_coarsely(state: Any, config: Any, turning: Array, force: Array) -> None:
    """Take the direction of a slow node's specific force (3, m/s^2) if its tilt is unknown; ``turning`` in rad/s."""
    if min(state.P[TX, TX], state.P[TY, TY]) < UNKNOWN_VAR:
        return
    weight = vector_length(force[0], force[1], force[2])
    if (
        abs(weight - config.gravity) > times_factor(config.gravity, GRAVITY_ERROR)
        or largest_magnitude(turning) > SLOWEST
    ):
        return
    down = state.down
    along = times_factor(force[0], down[0]) + times_factor(force[1], down[1]) + times_factor(force[2], down[2])
    linear = times_factor(
        FAR_OFF, times_factor(down[2], down[2])
    )  # of one that lies a turn about its axis is many across it
    if -along < weight - times_factor(weight, linear):
        for k in range(3):
            down[k] = -bounded_ratio(force[k], weight)
