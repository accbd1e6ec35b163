"""What gyroscope and aiding leave unexplained between them: variance of the yaw until it is explained.

Two kinds. A *misfit* is innovations that are larger than their variance again and again, or like the one before, which
those of a right filter are not: a disc off its centre, a sensor that leans or feels vibration, a drive that swings
between two samples. No filter averages it away, for it is not white: what the innovations have beyond their variance,
or in common with the one before, is systematic variance of the yaw. The variance of an aiding has it up to a limit
only: a gain that falls as innovations grow would let the yaw go. A *jump* is a reset after aidings that all
contradicted the yaw: either the string slipped or the encoder did, and the node cannot know which. What it jumped by
stays systematic until it jumps back. A sensor whose window is not the cycle's is dated by its driver, which is a little
off for as long as its crystal is.
"""

from __future__ import annotations

import math
from typing import Any, Final

from node.kernels.angles import wrap
from node.kernels.events import NONE, Code, tell
from node.kernels.jit import constant, kernel
from node.kernels.layout import DEG

MEMORY: Final = 32.0  # aidings over which the misfit is averaged
DOUBTED: Final = 2.0  # mean of innovation^2 / variance, from where it is a misfit; of honest noise once in 10^5 hours
CLEARED: Final = 1.5  # likewise, below which it is none any more
ALIKE: Final = 0.7  # mean of the products of neighbours over the variance, from where they hang together
UNLIKE: Final = 0.3  # likewise, below which they do not any more
MOST: Final = 9.0  # variances, that one innovation counts for: outliers and faults are for the gate
SETTLED: Final = 3.0  # sigmas, within which two jumps cancel each other
LARGEST_MISFIT: Final = (5.0 * DEG) ** 2  # rad^2
LARGEST_NOISE: Final = (0.1 * DEG) ** 2  # rad^2, of it in the variance of an aiding
WINDOW_STD: Final = 2.5e-4  # s, of the end of a window that a driver dates
AIDING_DOUBTED = constant(Code.AIDING_DOUBTED)


@kernel
def misfit_var(node: Any) -> float:
    """Variance (rad^2) of the yaw by the misfit."""
    guard = node.guard
    return float(min(max(guard.excess, guard.shared), LARGEST_MISFIT)) if guard.doubted == 1 else 0.0


@kernel
def noise_var(node: Any) -> float:
    """Variance (rad^2) of an aiding by the misfit; of a head at rest none, for what misfits is the turning."""
    return float(min(misfit_var(node), LARGEST_NOISE)) if node.guard.rate != 0.0 else 0.0


@kernel
def unexplained_var(node: Any) -> float:
    """Variance (rad^2) of the yaw that no filter averages away: of the misfit, of the jump, of a late window."""
    return float(misfit_var(node) + node.guard.jump * node.guard.jump + window_var(node))


@kernel
def window_var(node: Any) -> float:
    """Variance (rad^2) of the yaw while the head turns, for a driver that dates the window of its readings."""
    late = node.cluster.delayed[0].late
    if late == 0.0 or not math.isfinite(late):
        return 0.0
    return float((node.guard.rate * WINDOW_STD) ** 2)


@kernel
def follow_misfit(node: Any) -> None:
    """Take the innovation of an aiding in; ``state.innovation_var`` has the present misfit in it.

    m += (r^2 / S - m) / n and E += (r^2 - S - E) / n, with S the variance without the misfit and r^2 at most 9 times
    that with it; the same of the product with the innovation before, whose mean is that of no noise.
    """
    state, guard = node.filter, node.guard
    whole = state.innovation_var
    if not whole > 0.0:
        return
    plain = max(whole - noise_var(node), 0.01 * whole)
    square = min(state.innovation * state.innovation, MOST * whole)
    guard.misfit += (square / plain - guard.misfit) / MEMORY
    guard.excess = max(guard.excess + (square - plain - guard.excess) / MEMORY, 0.0)
    product = max(min(state.innovation * guard.before, MOST * whole), -MOST * whole)
    guard.likeness += (product / plain - guard.likeness) / MEMORY
    guard.shared = max(guard.shared + (product - guard.shared) / MEMORY, 0.0)
    guard.before = state.innovation
    if guard.doubted == 0 and (guard.misfit > DOUBTED or guard.likeness > ALIKE):
        guard.doubted = 1
        tell(node, AIDING_DOUBTED, guard.misfit, math.sqrt(misfit_var(node)) / DEG, NONE, NONE)
    elif guard.doubted == 1 and guard.misfit < CLEARED and guard.likeness < UNLIKE:
        guard.doubted = 0


@kernel
def follow_jump(node: Any) -> None:
    """The yaw was taken from an aiding that contradicted it: it jumped by the innovation, unless it came back.

    The systematic variance says so at once; from the next aiding on it is that of the aiding.
    """
    state, guard, before = node.filter, node.guard, node.guard.jump
    guard.last_jump = state.innovation
    guard.jump = wrap(guard.jump + state.innovation)
    if guard.jump * guard.jump < SETTLED * SETTLED * state.innovation_var:
        guard.jump = 0.0
    state.systematic_var = max(state.systematic_var + guard.jump * guard.jump - before * before, 0.0)


@kernel
def explain_jump(node: Any) -> None:
    """The last reset was the gyroscope's doing: what the yaw jumped by is no longer in doubt."""
    guard = node.guard
    if guard.last_jump != 0.0:
        guard.jump = wrap(guard.jump - guard.last_jump) if guard.jump != 0.0 else 0.0
        guard.last_jump = 0.0
