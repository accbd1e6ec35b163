"""Two unit vectors across each direction of a hole, carried from each to the next without twist."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.jit import allocating_kernel, kernel

Array = npt.NDArray[np.float64]
TINY = 1e-12


@allocating_kernel
def carry_bases(tangents: Array, bases: Array) -> None:
    """Set bases (s, 2, 3) across unit vectors (s, 3), of which the first is given.

    The rotation along the great circle from one to the next is two reflections.
    """
    middle = np.empty(3)
    for k in range(len(tangents) - 1):
        before, after, new = tangents[k], tangents[k + 1], bases[k + 1]
        for i in range(3):
            middle[i] = before[i] + after[i]
        size = inner_product(middle, middle)
        for i in range(3):
            new[0, i] = bases[k, 0, i]
        if size > TINY:
            take_part(new[0], middle, 2.0 * inner_product(new[0], middle) / size)
            take_part(new[0], after, 2.0 * inner_product(new[0], after))
        take_part(new[0], after, inner_product(new[0], after))
        length = math.sqrt(inner_product(new[0], new[0]))
        for i in range(3):
            new[0, i] /= length
        new[1, 0] = after[1] * new[0, 2] - after[2] * new[0, 1]
        new[1, 1] = after[2] * new[0, 0] - after[0] * new[0, 2]
        new[1, 2] = after[0] * new[0, 1] - after[1] * new[0, 0]


@kernel
def inner_product(one: Array, other: Array) -> float:
    """Product of two vectors (3,)."""
    return float(one[0] * other[0] + one[1] * other[1] + one[2] * other[2])


@kernel
def take_part(from_this: Array, along: Array, amount: float) -> None:
    """Take so much of a vector (3,) from another."""
    for i in range(3):
        from_this[i] -= amount * along[i]
