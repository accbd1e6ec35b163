"""One array written over another, for kernels."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.jit import kernel

Array = npt.NDArray[np.float64]


@kernel
def copy_rows(source: Array, target: Array) -> None:
    """Write ``source`` (m, n) over ``target`` (m, n).

    An assignment of whole arrays would have numba compile its refusal of other shapes too, text and all: three seconds.
    """
    for i in range(source.shape[0]):
        for s in range(source.shape[1]):
            target[i, s] = source[i, s]
