"""Directions and curvatures of a hole taken out of the normal equations, from the toe up, and found again.

Station by station a state of four (direction and curvature, each across two axes) is tied to the one above by the
process of the path alone, so the equations are a chain of blocks: S z + B g = b. Seen from the collar down what is left
is a Markov chain z_j = A_j z_{j-1} + noise, from which every covariance follows.
Source: block elimination of a tridiagonal system; Rauch, Tung and Striebel, AIAA J. 3 (1965).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.jit import allocating_kernel, kernel, kernel_constant

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
STATE = kernel_constant(4)  # columns of a block; that loops over them begin at a literal zero makes them vectors


@kernel
def eliminate_path(diagonal: Array, tied: Array, coupled: Array, ends: Places, tail: int) -> None:
    """Factorise the chain in place.

    Parameters
    ----------
    diagonal : (s + 1, 4, 4), blocks of S; set to the lower Cholesky factors L_j of what is left of each
    tied : (s + 1, 4, 4), blocks of S between a station and the one above; set to L_j^-1 of them
    coupled : (s + 1, 4, p + 1), B with b as the last column; set to L_j^-1 of what is left
    ends : (s + 1,), columns of B from each on to before ``tail`` are zero there and further down; they do not grow
    tail : from which on any column may be other than zero
    """
    for j in range(len(diagonal) - 1, -1, -1):
        factorise_block(diagonal[j])
        divide_columns(diagonal[j], tied[j], 0, STATE)
        divide_columns(diagonal[j], coupled[j], 0, ends[j])
        divide_columns(diagonal[j], coupled[j], tail, coupled.shape[2])
        if j > 0:
            take_columns(tied[j], tied[j], diagonal[j - 1], 0, STATE)
            take_columns(tied[j], coupled[j], coupled[j - 1], 0, ends[j])
            take_columns(tied[j], coupled[j], coupled[j - 1], tail, coupled.shape[2])


@kernel
def divide_columns(lower: Array, right: Array, begin: int, end: int) -> None:
    """Put L^-1 R in the place of some columns of R (4, r)."""
    for a in range(4):
        for i in range(a):
            for b in range(begin, end):
                right[a, b] -= lower[a, i] * right[i, b]
        for b in range(begin, end):
            right[a, b] /= lower[a, a]


@kernel
def take_columns(one: Array, other: Array, out: Array, begin: int, end: int) -> None:
    """Take some columns of M^T N, of (4, 4) and (4, r), from those of ``out``."""
    for a in range(4):
        for i in range(4):
            for b in range(begin, end):
                out[a, b] -= one[i, a] * other[i, b]


@kernel
def reduce_right(diagonal: Array, tied: Array, right: Array) -> None:
    """Bring further right sides (s + 1, 4, r) into the form that ``substitute_path`` takes, in place."""
    for j in range(len(diagonal) - 1, -1, -1):
        divide_columns(diagonal[j], right[j], 0, right.shape[2])
        if j > 0:
            take_columns(tied[j], right[j], right[j - 1], 0, right.shape[2])


@kernel
def substitute_path(diagonal: Array, tied: Array, right: Array) -> None:
    """Solve the factorised chain from the collar down for several right sides, in place.

    Parameters
    ----------
    diagonal, tied : from ``eliminate_path``
    right : (s + 1, 4, r), L_j^-1 of right sides as ``eliminate_path`` leaves them; set to the solutions
    """
    for j in range(len(diagonal)):
        if j > 0:
            take_image(tied[j], right[j - 1], right[j])
        divide_by_transposed(diagonal[j], right[j])


@allocating_kernel
def path_covariances(diagonal: Array, tied: Array, covs: Array) -> None:
    """Covariances (s + 1, 4, 4) of the states where what stations have in common is known, set."""
    root, passed, spread = np.empty((4, 4)), np.empty((4, 4)), np.empty((4, 4))
    for j in range(len(diagonal)):
        invert_transposed(diagonal[j], root)
        covs[j] = 0.0
        add_outer(root, root, covs[j])
        if j > 0:
            passed[:], spread[:] = 0.0, 0.0
            take_image(root, tied[j], passed)  # from the state above
            add_product(passed, covs[j - 1], spread)
            add_outer(spread, passed, covs[j])


@kernel
def factorise_block(m: Array) -> None:
    """Put the lower Cholesky factor of a matrix (4, 4) in its place."""
    for a in range(4):
        for b in range(a + 1):
            for i in range(b):
                m[a, b] -= m[a, i] * m[b, i]
            if a == b:
                m[a, a] = np.sqrt(m[a, a])
            else:
                m[a, b] /= m[b, b]


@kernel
def invert_transposed(lower: Array, out: Array) -> None:
    """Set L^-T (4, 4)."""
    for a in range(4):
        for b in range(4):
            out[a, b] = 1.0 if a == b else 0.0
    divide_by_transposed(lower, out)


@kernel
def divide_by_transposed(lower: Array, right: Array) -> None:
    """Put L^-T R in the place of R (4, r)."""
    for a in range(3, -1, -1):
        for i in range(a + 1, 4):
            for b in range(right.shape[1]):
                right[a, b] -= lower[i, a] * right[i, b]
        for b in range(right.shape[1]):
            right[a, b] /= lower[a, a]


@kernel
def take_image(one: Array, other: Array, out: Array) -> None:
    """Take M N, of (4, 4) and (4, r), from ``out``."""
    for a in range(4):
        for i in range(4):
            for b in range(other.shape[1]):
                out[a, b] -= one[a, i] * other[i, b]


@kernel
def add_product(one: Array, other: Array, out: Array) -> None:
    """Add M N to ``out``."""
    for a in range(one.shape[0]):
        for i in range(one.shape[1]):
            for b in range(other.shape[1]):
                out[a, b] += one[a, i] * other[i, b]


@kernel
def add_outer(one: Array, other: Array, out: Array) -> None:
    """Add M N^T to ``out``; what is transposed is read as it lies, so that one form of it is compiled."""
    for a in range(one.shape[0]):
        for i in range(one.shape[1]):
            for b in range(other.shape[0]):
                out[a, b] += one[a, i] * other[b, i]
