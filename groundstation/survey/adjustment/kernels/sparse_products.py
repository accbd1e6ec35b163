"""Products with what couples directions and tubes before the path is taken out: most of it is zero."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.jit import kernel

Array = npt.NDArray[np.float64]


@kernel
def add_rooted(coupled: Array, root: Array, scale: float, out: Array) -> None:
    """Add ``scale`` C R, leaving out what is zero in C.

    Parameters
    ----------
    coupled : C (s + 1, 2 or more, p or more), of directions and what stations have in common; two rows of each are used
    root : R (p, p), upper triangular
    out : (s + 1, 2 or more, p), added to
    """
    for k in range(len(coupled)):
        for a in range(2):
            for j in range(len(root)):
                if coupled[k, a, j] != 0.0:
                    part = scale * coupled[k, a, j]
                    here, row = out[k, a, j:], root[j, j:]
                    for m in range(len(row)):  # from a literal zero on, so that it is done with vectors
                        here[m] += part * row[m]


@kernel
def add_squares(coupled: Array, by_common: Array, out: Array) -> None:
    """Add C^T B to a matrix at and above its diagonal, leaving out what is zero in C.

    Parameters
    ----------
    coupled : C (s + 1, 2 or more, p or more), two rows of each are used
    by_common : B (s + 1, 2 or more, p), likewise, of which the product is symmetric
    out : (p or more, p or more), added to
    """
    width = by_common.shape[2]
    for k in range(len(coupled)):
        for a in range(2):
            for j in range(width):
                if coupled[k, a, j] != 0.0:
                    part = coupled[k, a, j]
                    here, row = out[j, j:width], by_common[k, a, j:]
                    for m in range(len(row)):
                        here[m] += part * row[m]
