"""Words of a record between floats and integers, by a table of scales; see ``node.kernels.record.integer_node``.

NaN is ``NO_NUMBER`` in integers, and -inf ``NEVER``; a number beyond its range is held and counted.
"""

from __future__ import annotations

import math
from typing import Any, Final

from node.kernels.arithmetic.formats import NEVER, Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.quantity import NO_NUMBER

LARGEST: Final = NO_NUMBER - 1
LIMIT: Final = float(1 << 60)


@kernel
def scaled_integer(counter: Any, value: float, scale: float) -> int:
    """The integer of a float; one that does not fit adds to ``counter.overflows``."""
    scaled = value * scale
    if abs(scaled) < LIMIT:
        return math.floor(scaled + 0.5)
    if math.isfinite(value):
        counter.overflows += 1
        return LARGEST if value > 0.0 else -LARGEST
    return NEVER if value == -math.inf else NO_NUMBER


@kernel
def scaled_float(value: int, count: float) -> float:
    """The float of an integer whose 1 is ``count``."""
    if value == NO_NUMBER:
        return math.nan
    return -math.inf if value == NEVER else value * count


@kernel
def power_of(gravity: float, power: int) -> float:
    """``gravity`` to the ``power`` of 0, 1 or 2."""
    if power == 0:
        return 1.0
    return gravity if power == 1 else gravity * gravity


@kernel
def learn_words(
    counter: Any, made: Array, words: Array, floats: Array, scales: Array, powers: Array, gravity: float
) -> None:
    """Integers ``made`` (n,) of the same words as bits (``words``) and as ``floats``."""
    for k in range(words.shape[0]):
        if scales[k] == 0.0:
            made[k] = words[k]
        else:
            made[k] = scaled_integer(counter, floats[k], scales[k] / power_of(gravity, powers[k]))


@kernel
def learn_numbers(counter: Any, made: Array, floats: Array, scales: Array, powers: Array, gravity: float) -> None:
    """Integers ``made`` (n,) of ``floats`` that hold whole numbers where the scale is 1."""
    for k in range(floats.shape[0]):
        made[k] = scaled_integer(counter, floats[k], scales[k] / power_of(gravity, powers[k]))


@kernel
def show_words(
    integers: Array, last: Array, words: Array, floats: Array, counts: Array, powers: Array, gravity: float
) -> None:
    """Of words (n,) those whose ``integers`` are not as they were ``last``, as ``learn_words``; ``counts`` are of 1."""
    for k in range(integers.shape[0]):
        if integers[k] == last[k]:
            continue
        last[k] = integers[k]
        if counts[k] == 0.0:
            words[k] = integers[k]
        else:
            floats[k] = scaled_float(integers[k], counts[k] * power_of(gravity, powers[k]))


@kernel
def words_differ(kept: Array, words: Array) -> bool:
    """Whether one of ``words`` (n,) is not as it was ``kept``; the loop has no exit, so that it is a fast one."""
    found = 0
    for k in range(words.shape[0]):
        found |= kept[k] ^ words[k]
    return found != 0


@kernel
def copy_words(kept: Array, words: Array) -> None:
    """Copy ``words`` (n,)."""
    for k in range(words.shape[0]):
        kept[k] = words[k]
