"""Is the encoder off by the same angle again and again? A bit of its counter that is stuck.

Single wrong readings differ. Where every series of rejected aidings begins with an innovation of the same size, the
readings have two values, this angle apart, and nothing shows which of them is right: at rest, where one reading is all
there is, it is right in half of the cases. So the angle is in doubt until it is not met for ``REMEMBERED`` aidings.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import angular_root, angular_square, as_number

REMEMBERED: Final = 32  # aidings used, for which the angle is
ENOUGH: Final = 3  # series after the first that begin alike
ALIKE: Final = 4  # sigmas of an innovation, by which those may differ


@kernel
def same_error_var(node: Any) -> float:
    """Variance (rad^2) of the yaw by an error that the encoder makes again and again."""
    same = node.guard.same
    return as_number(angular_square(same.angle)) if same.seen >= ENOUGH else as_number(0 * same.angle)


@kernel
def follow_same_errors(node: Any, rejected: int) -> None:
    """Take one judged aiding in; of a series that is ``rejected`` only the first counts, the rest may be a slip."""
    state, same = node.filter, node.guard.same
    if rejected == 0:
        same.left = max(same.left - 1, 0)
        if same.left == 0:
            same.seen = 0
    elif state.rejected == 1:
        angle = abs(state.innovation)
        is_alike = abs(angle - same.angle) < ALIKE * angular_root(state.innovation_var)
        same.seen = min(same.seen + 1, 2 * ENOUGH) if is_alike else max(same.seen - 1, 0)
        if is_alike or same.seen == 0:
            same.angle = angle
        same.left = REMEMBERED
