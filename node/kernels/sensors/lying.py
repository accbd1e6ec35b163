"""A tube that lies: turned about its axis it feels gravity from another side, which its tilt does not say.

The tilt of the filter is two small turns across the axis. Of an upright tube they are where gravity comes from; of one
that lies one of them is, and a turn about the axis, by what the scale was wrong, is none of them: levelling would take
3 deg of it for 90 deg across and the rest for biases. So at the begin of a rest gravity is turned about the axis to
where the accelerometer feels it.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import bounded_ratio, times_factor, vector_length
from node.kernels.arithmetic.quantity import factor_quantity
from node.kernels.sensors.coarse_level import GRAVITY_ERROR

LYING: Final = factor_quantity(0.5)  # part of gravity along the axis, below which a tube lies
FIRST: Final = 2  # cycles of a rest, in which it is turned: then the filter levels
LEAST: Final = factor_quantity(2e-3)  # of a turn, rad: five sigmas of a force


@kernel
def turn_down(node: Any) -> None:
    """Turn gravity about the axis of a tube that lies and has come to rest in a string that turns."""
    state, force = node.filter, node.force
    if not 0 < state.still_cycles <= FIRST or abs(state.now_down[2]) > LYING or node.guard.ramp.sense == 0:
        return
    weight = vector_length(force[0], force[1], force[2])
    if abs(weight - node.config.gravity) > times_factor(node.config.gravity, GRAVITY_ERROR):
        return
    felt, known = vector_length(force[0], force[1], 0), vector_length(state.now_down[0], state.now_down[1], 0)
    if not (felt > times_factor(weight, LYING) and known > 0):
        return
    fx, fy = -bounded_ratio(force[0], felt), -bounded_ratio(force[1], felt)
    ux, uy = bounded_ratio(state.now_down[0], known), bounded_ratio(state.now_down[1], known)
    c, s = times_factor(ux, fx) + times_factor(uy, fy), times_factor(ux, fy) - times_factor(uy, fx)
    if c > 0 and abs(s) < LEAST:
        return
    turn_about_axis(state.down, c, s)
    turn_about_axis(state.now_down, c, s)


@kernel
def turn_about_axis(down: Array, c: float, s: float) -> None:
    """Turn a direction (3) about the axis by an angle of cosine ``c`` and sine ``s``."""
    x, y = down[0], down[1]
    down[0] = times_factor(x, c) - times_factor(y, s)
    down[1] = times_factor(x, s) + times_factor(y, c)
