"""Do encoder and gyroscope turn in a constant ratio that is not one? An encoder of another number of lines.

A counter of n lines that is read as one of N shows n / N of every turn; so does a gyroscope whose scale is off, the
other way around. Each turn shows the ratio, and nothing which of the two is wrong, so a node that has never seen them
agree leaves it open: it tells the ratio, and its yaw is any yaw, for what was turned since is off by a part of itself.
It stays so until the node starts as new, since an encoder that is put right was not watched meanwhile. From ``OPEN``
cycles on, before it is told, the yaw is any yaw already: a conflict that is open does not end as it began.

Of two that agreed over ``ENOUGH`` cycles the one that changed is in doubt, and lines do not change: what comes later is
the gyroscope's (``node.kernels.turns.mismatches``). A ratio that swings, as on a ramp or of a drive that sticks, is
none. The limit leaves room for a gyroscope of its stated scale, and for what swings of a drive make of a ratio.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import DEG, RATE_Q, VECTOR_Q
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import (
    angular_root,
    as_number,
    bounded_ratio,
    factor_of,
    is_number,
    time_of_cycles,
)
from node.kernels.arithmetic.quantity import NONE, ONE, factor_quantity, rate_quantity
from node.kernels.filter.modes import STATIC_BIAS
from node.kernels.filter.priors import scale_var
from node.kernels.filter.resets import UNIFORM_VAR
from node.kernels.record.events import Code, event_number, queue_event

ENOUGH: Final = 12  # cycles of turning in a row that show a ratio
OPEN: Final = 6  # likewise, from where it may be one
FASTER: Final = rate_quantity(20.0 * DEG)  # rad/s, of the faster of the two, from where a cycle tells a ratio
SLOWER: Final = rate_quantity(1.0 * DEG)  # rad/s, of the slower one
FRESH: Final = 2  # cycles, of the encoder's word
LEAST: Final = factor_quantity(0.015)  # of a ratio beyond one: of a drive whose swings beat with the cycle
SIGMAS: Final = 5  # of a gyroscope's scale, likewise
ALIKE: Final = factor_quantity(0.01)  # by which those in a row may differ
ENCODER_RATIO = kernel_constant(Code.ENCODER_RATIO)


@kernel
def ratio_var(node: Any) -> float:
    """Variance (rad^2) of the yaw by a ratio that is not one."""
    none, ratio = 0 * node.guard.aiding_var, node.guard.ratio
    return as_number(UNIFORM_VAR + none if ratio.told == 1 or ratio.seen >= OPEN else none)


@kernel
def watch_ratio(node: Any, rate: float, at: float) -> None:
    """Compare the encoder's word with a ``rate`` (rad/s) of the gyroscope, in a cycle that ended ``at`` (s).

    A step that its bias has taken since may be this ratio, so the bias is that of before.
    """
    guard, ratio = node.guard, node.guard.ratio
    if ratio.told == 1 or ratio.agreed >= ENOUGH:
        return
    shown = rate - (guard.before_steps if is_number(guard.before_steps) else node.filter.static_bias[2])
    one, other = abs(guard.rate), abs(shown)
    is_fast = max(one, other) >= FASTER and min(one, other) >= SLOWER
    is_told = abs(at - guard.rate_at) <= time_of_cycles(at, FRESH) and (guard.rate < 0) == (shown < 0)
    if not (is_fast and is_told) or node.filter.mode == STATIC_BIAS:
        ratio.seen = 0
        return
    own = bounded_ratio(guard.rate, shown)
    if abs(own - ONE) <= LEAST + SIGMAS * factor_of(angular_root(scale_var(node.config)), RATE_Q):
        ratio.agreed += 1
        ratio.seen = 0
        return
    ratio.agreed = 0
    ratio.seen = ratio.seen + 1 if ratio.seen > 0 and abs(own - ratio.usual) <= ALIKE else 1
    if ratio.seen == 1:
        ratio.usual = own
    if ratio.seen == ENOUGH:
        ratio.told = 1
        queue_event(node, ENCODER_RATIO, event_number(ratio.usual, VECTOR_Q), NONE, NONE, NONE)
