"""When a survey is said again: its yaw is known much better by what came since (``node.kernels.filter.smoothing``).

Half of its variance is worth a message. While the string rests an aiding that was missing is enough. Once it turns, the
ramp has to be over and to fit, for a twist or a wrong time stamp would go into the yaw of the rest as it goes into the
scale. What contradicts the yaw ends it: what was said before stands, with the variance that it had. So do a new
reference, another frame and the next survey; and two minutes of turning, after which the biases are others.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import half_of, times_factor
from node.kernels.arithmetic.quantity import factor_quantity
from node.kernels.filter.smoothing import begin_smoothing
from node.kernels.record.filter_record import CycleStatus, Err, Scheme

PSI = kernel_constant(Err.YAW)
FORWARD = int(Scheme.FORWARD)
REFERENCE_CHANGED = int(CycleStatus.REFERENCE_CHANGED)
CONTRADICTED = int(CycleStatus.YAW_RESET | CycleStatus.FILTER_FAULT)
LONGEST: Final = 240  # cycles of turning
SETTLED: Final = 20  # cycles of the next rest, in which its ramp has been judged
WORTH_LAST: Final = factor_quantity(0.8)  # of the variance said before, that is worth a last message


@kernel
def open_revision(node: Any, settings: Any) -> None:
    """The survey that is said now may be said again, where its yaw is known and what contradicts it would be seen."""
    state, revision = node.filter, node.revision
    revision.turned = 0
    revision.said_var = state.now_P[PSI, PSI]
    revision.systematic = state.systematic_var
    state.smoothing = 0
    if settings.scheme == FORWARD and not is_doubted(node):
        begin_smoothing(state)


@kernel
def is_doubted(node: Any) -> bool:
    """Whether anything that the node measures contradicts its yaw."""
    guard = node.guard
    faulty = guard.gyro.fault != 0 or guard.force.fault != 0
    return bool(faulty or guard.doubted == 1 or guard.ramp.doubted == 1 or guard.jump != 0 or guard.reversed == 1)


@kernel
def follow_revision(node: Any, status: int) -> bool:
    """Whether the last survey is to be said again, with the yaw in ``surveyed_yaw``."""
    state, revision = node.filter, node.revision
    if state.smoothing == 0:
        return False
    if status & CONTRADICTED or is_doubted(node):
        state.smoothing = 0
        return False
    is_last = is_over(node, status)
    judged = state.rejected == 0 and (node.guard.ramp.left == 0 or is_last)
    found = node.guard.ramp.doubt if revision.turned == 0 else 0
    worth = judged and is_worth(state, revision, found, is_last)
    if worth:
        revision.systematic = max(revision.systematic, state.systematic_var)
        revision.said_var = state.surveyed_var
    if is_last:
        state.smoothing = 0
    return worth


@kernel
def is_over(node: Any, status: int) -> bool:
    """Whether nothing more is to be learnt of the survey."""
    state, revision = node.filter, node.revision
    if status & REFERENCE_CHANGED:
        return True
    if state.still_cycles == 0:
        revision.turned += 1
        return bool(revision.turned >= LONGEST)
    return bool(revision.turned > 0 and state.still_cycles >= SETTLED)


@kernel
def is_worth(state: Any, revision: Any, found: float, is_last: bool) -> bool:
    """Whether the yaw of the survey is known so much better; a twist that came since is in all that tells of it.

    What ``found`` (rad^2) an aiding of the same rest contradicts the turn to it by was as wrong when the survey was
    said, so it is held against neither.
    """
    limit = times_factor(revision.said_var, WORTH_LAST) if is_last else half_of(revision.said_var)
    var, came = state.surveyed_var, max(state.systematic_var - found, 0)
    return bool(var < limit and var + came < revision.said_var + revision.systematic)
