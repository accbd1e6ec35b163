"""Numbers that a campaign draws for a node and cycle, and which three of them, a lane, a disturbance takes."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np

from node.kernels.arithmetic.formats import Array
from sim.kernel import kernel
from sim.world.disturbance.philox import normals, uniforms

WIDTH: Final = 3  # numbers of a lane
GAUSSIAN: Final = 10  # of the numbers of the fixed lanes are normal, the two after them uniform
FIXED: Final = 12
CLOCK, LOSS = 9, 10  # of one hop, see ``sim.string.hops``


class Lane(IntEnum):
    """Lane ``n`` is the numbers ``3 n`` to ``3 n + 2``, standard normal."""

    NEXT = -1  # the next one that no row has
    WHITE = 0
    WANDER = 1
    FORCE = 2
    HOP = 3  # of the aiding: ``CLOCK``, ``LOSS``, which is uniform, and one to spare


def numbers_of(lanes: int) -> int:
    """Numbers of so many lanes, as many as whole blocks of four."""
    return -(-WIDTH * lanes // 4) * 4


@kernel
def draw_numbers(counter: Array, key: Array, words: Array, drawn: Array, cycle: int, k: int) -> None:
    """Fill ``drawn`` (n,) for a tube and a cycle, see ``Lane``."""
    counter[0], counter[1], counter[2] = np.uint64(cycle), np.uint64(k), np.uint64(0)
    uniforms(counter, key, words, drawn)
    normals(drawn[:GAUSSIAN])
    if drawn.shape[0] > FIXED:
        normals(drawn[FIXED:])


@kernel
def draw_further(counter: Array, key: Array, words: Array, drawn: Array, cycle: int, k: int) -> None:
    """Fill ``drawn`` (n,) for the parts of a window of a tube and a cycle with standard normal numbers."""
    counter[0], counter[1], counter[2] = np.uint64(cycle), np.uint64(k), np.uint64(1)
    uniforms(counter, key, words, drawn)
    normals(drawn)
