"""Numbers that a campaign draws for a node and cycle, and which three of them, a lane, a disturbance takes."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np

from node.kernels.arithmetic.formats import Array
from sim.kernel import kernel
from sim.world.disturbance.philox import fill_normal, fill_uniform

WIDTH: Final = 3  # numbers of a lane
CLOCK: Final = 9  # number, normal, of the clock of one hop, see ``sim.string.hops``
FREE: Final = 10  # number from which the lanes begin that rows may take
UNIFORM: Final = 2  # numbers at the end, of which the first decides whether a hop loses an aiding


class Lane(IntEnum):
    """Lane ``n`` is the numbers ``3 n`` to ``3 n + 2``, standard normal."""

    NEXT = -1  # the next one that no row has
    WHITE = 0
    WANDER = 1
    FORCE = 2


def count_numbers(free_lanes: int) -> int:
    """Numbers of a node and cycle with so many lanes beside the fixed ones, as many as whole blocks of four."""
    return -(-(FREE + WIDTH * free_lanes + UNIFORM) // 4) * 4


@kernel
def draw_numbers(counter: Array, key: Array, words: Array, drawn: Array, cycle: int, k: int) -> None:
    """Fill ``drawn`` (n,) for a tube and a cycle: all but the last ``UNIFORM`` normal."""
    counter[0], counter[1], counter[2] = np.uint64(cycle), np.uint64(k), np.uint64(0)
    fill_uniform(counter, key, words, drawn)
    fill_normal(drawn[:-UNIFORM])


@kernel
def draw_further(counter: Array, key: Array, words: Array, drawn: Array, cycle: int, k: int) -> None:
    """Fill ``drawn`` (n,) for the parts of a window of a tube and a cycle with standard normal numbers."""
    counter[0], counter[1], counter[2] = np.uint64(cycle), np.uint64(k), np.uint64(1)
    fill_uniform(counter, key, words, drawn)
    fill_normal(drawn)
