"""Are x and y of both sensors exchanged? Gravity as a witness while the string turns.

A sensor that was initialised anew, or whose frames slipped, may give x for y and y for x. Its rate about the axis is
right, so the yaw is too; but the direction of the lean is that of a mirror, and every azimuth is wrong by up to 180
degrees. At rest nothing shows it. While the string turns gravity goes around in the tube, against the spin: with z the
force across the axis and p that which the gyroscope has turned along, both as complex numbers, z = p, and of exchanged
axes z = i conj(p), which goes around the other way. So Im(z p) has the mean |p|^2 of exchanged axes, and none else.

A mount that leans and a bias stay where they are in the tube, in the force and, since the node levels itself by it, in
the direction too; where they lie along the mirror's own axis, x = y, they look like exchanged axes. So p is made of how
that direction changes over a cycle, dp = -2i sin(turn / 2) p, in which nothing is that stays.

They are taken for exchanged where that mean explains 0.8 of the force across: vibration, however strong, is not alike
the gyroscope's turn over twelve cycles. The node exchanges them back, and says so.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import DEG
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import bounded_ratio, mean_of_total, times_factor
from node.kernels.arithmetic.quantity import NONE, factor_quantity, rate_quantity
from node.kernels.record.events import Code, queue_event

SLOWEST: Final = rate_quantity(30.0 * DEG)  # rad/s, from where twelve cycles are half a turn
CYCLES: Final = 12  # of turning, over which the means are taken
EXPLAINED: Final = factor_quantity(0.8)  # of the squares of the force across the axis
LARGEST: Final = factor_quantity(1.0)  # of gravity, of a force across the axis that counts
AXES_EXCHANGED = kernel_constant(Code.AXES_EXCHANGED)


@kernel
def put_axes_right(node: Any) -> None:
    """Exchange x and y of the cycle's reading, where they were seen to be exchanged."""
    if node.guard.mirror.exchanged == 1:
        node.rate[0], node.rate[1] = node.rate[1], node.rate[0]
        node.force[0], node.force[1] = node.force[1], node.force[0]


@kernel
def watch_axes(node: Any, settings: Any) -> None:
    """Take the cycle in that the filter has just had. Of several IMUs the others tell which one is wrong."""
    state, mirror, gravity = node.filter, node.guard.mirror, node.config.gravity
    down = state.now_down
    x, y = mirror.down[1] - down[1], down[0] - mirror.down[0]  # i dp
    if state.now_rate < 0:
        x, y = -x, -y
    mirror.down[0], mirror.down[1] = down[0], down[1]
    u, v = -bounded_ratio(node.force[0], gravity), -bounded_ratio(node.force[1], gravity)
    is_plain = node.guard.force.fault == 0 and abs(u) <= LARGEST and abs(v) <= LARGEST
    if settings.imus > 1 or not is_plain or abs(state.now_rate) < SLOWEST:
        return
    mirror.cycles = min(mirror.cycles + 1, CYCLES)
    mirror.across += mean_of_total(times_factor(u, y) + times_factor(v, x) - mirror.across, mirror.cycles)
    mirror.felt += mean_of_total(times_factor(u, u) + times_factor(v, v) - mirror.felt, mirror.cycles)
    mirror.turned += mean_of_total(times_factor(x, x) + times_factor(y, y) - mirror.turned, mirror.cycles)
    if mirror.cycles < CYCLES or mirror.across <= 0:
        return
    if times_factor(mirror.across, mirror.across) > times_factor(times_factor(mirror.felt, mirror.turned), EXPLAINED):
        mirror.exchanged, mirror.cycles = 1 - mirror.exchanged, 0
        queue_event(node, AXES_EXCHANGED, NONE, NONE, NONE, NONE)
