"""The legs of a hole: by how much each departs from going on as the station above it does, and what that comes to.

A state is direction and curvature, each across two axes; it goes on by the process of the path, see
``groundstation.survey.path.curvature_process``.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.kernels.path_elimination import divide_by_transposed, invert_transposed
from node.kernels.arithmetic.jit import allocating_kernel, kernel

Array = npt.NDArray[np.float64]
TINY = 1e-12


@kernel
def bend_to(before: Array, after: Array, basis: Array, out: Array) -> None:
    """Set the bend (2), rad, from one direction (3,) to another along the great circle, in a basis (2, 3)."""
    for a in range(2):
        v = basis[a]
        out[a] = v[0] * after[0] + v[1] * after[1] + v[2] * after[2]
    size = math.sqrt(out[0] * out[0] + out[1] * out[1])
    angle = math.atan2(size, before[0] * after[0] + before[1] * after[1] + before[2] * after[2])
    scale = angle / size if size > TINY else 1.0
    for a in range(2):
        out[a] *= scale


@kernel
def leg_departure(k: int, go: Array, tangents: Array, bases: Array, curvatures: Array, out: Array) -> None:
    """Set by how much (4,) the station below a leg departs from what the one above it leads to.

    Parameters
    ----------
    k : the leg, from the one at the collar on
    go : (s, 4, 4), how a state goes on over each leg
    tangents, bases, curvatures : (s + 1, 3), (s + 1, 2, 3) and (s + 1, 2) of collar and stations
    """
    bend_to(tangents[k], tangents[k + 1], bases[k], out)
    for a in range(2):
        out[2 + a] = curvatures[k + 1, a]
    for a in range(4):
        out[a] -= go[k, a, 2] * curvatures[k, 0] + go[k, a, 3] * curvatures[k, 1]


@kernel
def leg_departures(go: Array, tangents: Array, bases: Array, curvatures: Array, out: Array) -> None:
    """Set the departures (s, 4) of all legs, see ``leg_departure``."""
    for k in range(len(out)):
        leg_departure(k, go, tangents, bases, curvatures, out[k])


@allocating_kernel
def add_legs(
    go: Array, rigid: Array, leg_vars: Array, tangents: Array, bases: Array, curvatures: Array, diagonal: Array,
    tied: Array, right: Array,
) -> None:  # fmt: skip
    """Add what is known of every leg to the normal equations of a path.

    Parameters
    ----------
    go, rigid : (s, 4, 4), how a state goes on over each leg, and its information for a curvature of variance 1
    leg_vars : (s,), variance by which each is driven
    tangents, bases, curvatures : where the path stands, see ``leg_departure``
    diagonal, tied, right : (s + 1, 4, 4), (s + 1, 4, 4) and (s + 1, 4): blocks, added to; those between a station and
        the one above, set; right sides, added to
    """
    off, weighed = np.empty(4), np.empty((4, 4))
    for k in range(len(leg_vars)):
        leg_departure(k, go, tangents, bases, curvatures, off)
        for a in range(4):
            pull = 0.0
            for b in range(4):
                weight = rigid[k, a, b] / leg_vars[k]
                diagonal[k + 1, a, b] += weight
                pull += weight * off[b]
                weighed[a, b] = 0.0
                for i in range(4):
                    weighed[a, b] += rigid[k, a, i] / leg_vars[k] * go[k, i, b]
                tied[k + 1, a, b] = -weighed[a, b]
            right[k + 1, a] -= pull
            for b in range(4):
                right[k, b] += go[k, a, b] * pull
        for a in range(4):
            for b in range(4):
                for i in range(4):
                    diagonal[k, a, b] += go[k, i, a] * weighed[i, b]


@allocating_kernel
def leg_squares(
    go: Array, rigid: Array, tangents: Array, bases: Array, curvatures: Array, diagonal: Array, tied: Array,
    own_covs: Array, columns: Array, squares: Array, told: Array,
) -> None:  # fmt: skip
    """Weighted square of what each leg departs by, and that of its errors in the mean.

    Parameters
    ----------
    go, rigid, tangents, bases, curvatures : as of ``add_legs``
    diagonal, tied : from ``eliminate_path``
    own_covs, columns : (s + 1, 4, 4) and (s + 1, 4, p), covariances of the states were all that stations have in common
        known, and their change for one standard deviation of independent errors in common
    squares, told : (s,) set
    """
    off, root, carried, lever = np.empty(4), np.empty((4, 4)), np.empty((4, 4)), np.empty((4, 4))
    for k in range(len(squares)):
        leg_departure(k, go, tangents, bases, curvatures, off)
        invert_transposed(diagonal[k + 1], root)
        for a in range(4):
            for b in range(4):
                carried[a, b] = -tied[k + 1, a, b]
        divide_by_transposed(diagonal[k + 1], carried)
        square = of_errors = 0.0
        for a in range(4):
            for b in range(4):
                lever[a, b] = carried[a, b] - go[k, a, b]
                square += off[a] * rigid[k, a, b] * off[b]
        for a in range(4):
            for b in range(4):
                # what is left of the state below where the one above is known, and the lever of that one
                cov = 0.0
                for i in range(4):
                    cov += root[a, i] * root[b, i]
                    for m in range(4):
                        cov += lever[a, i] * own_covs[k, i, m] * lever[b, m]
                of_errors += rigid[k, a, b] * cov
        squares[k] = square
        told[k] = of_errors + departed_squares(go[k], rigid[k], columns[k], columns[k + 1], off)


@kernel
def departed_squares(go: Array, rigid: Array, upper: Array, lower: Array, off: Array) -> float:
    """Weighted squares, summed, of what changes (4, p) of a state and of the one below make their leg depart by.

    ``off`` (4,) is to work in.
    """
    total = 0.0
    for c in range(upper.shape[1]):
        for a in range(4):
            off[a] = lower[a, c]
            for b in range(4):
                off[a] -= go[a, b] * upper[b, c]
        for a in range(4):
            for b in range(4):
                total += off[a] * rigid[a, b] * off[b]
    return total
