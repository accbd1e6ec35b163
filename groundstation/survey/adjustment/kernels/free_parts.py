"""How far each look could contradict all others: its part of the redundancy. Source: Baarda, 1968."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.path.kernels.copied_rows import copy_rows
from node.kernels.arithmetic.jit import allocating_kernel

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]


@allocating_kernel
def free_parts(
    station: Places, tube: Places, make_up: Places, jacobians: Array, weights: Array, extra: Array, gravity_at: int,
    of_direction: Array, coupled: Array, of_common: Array, out: Array,
) -> None:  # fmt: skip
    """Set W - W J Q J^T W of every look (n, 3, 3).

    Parameters
    ----------
    station, tube, make_up, jacobians, weights, extra, gravity_at : of the looks, see ``add_looks``
    of_direction, coupled, of_common : (s + 1, 2, 2), (s + 1, 2, p) and (p, p), covariance of the unknowns
    """
    count = extra.shape[2]
    width, size = 10 + count, len(of_common)
    at = np.empty(width, np.intp)
    cov, rows = np.empty((width, width)), np.empty((3, width))
    for k in range(len(station)):
        for i in range(3):
            for a in range(9):
                rows[i, a] = jacobians[k, i, a]
            rows[i, 9] = jacobians[k, i, 7]
            for a in range(count):
                rows[i, 10 + a] = extra[k, i, a]
        for a in range(6):
            at[2 + a] = 6 * tube[k] + a
        at[8], at[9] = gravity_at, gravity_at + 1 + make_up[k]
        for a in range(count):
            at[10 + a] = size - count + a
        gather_covariance(of_direction[station[k]], coupled[station[k]], of_common, at, cov)
        take_from_weight(weights[k], rows, cov, out[k])


@allocating_kernel
def gather_covariance(of_direction: Array, coupled: Array, of_common: Array, at: Places, out: Array) -> None:
    """Covariance of the unknowns of one look: a direction (2) and what it has in common with others."""
    for a in range(2):
        for b in range(2):
            out[a, b] = of_direction[a, b]
    for a in range(2, len(at)):
        for b in range(2):
            out[a, b] = out[b, a] = coupled[b, at[a]]
        for b in range(2, len(at)):
            out[a, b] = of_common[at[a], at[b]]


@allocating_kernel
def take_from_weight(weight: Array, rows: Array, cov: Array, out: Array) -> None:
    """Set W - W R C R^T W, (3, 3)."""
    weighed = np.zeros(rows.shape)
    for a in range(3):
        for i in range(3):
            for b in range(rows.shape[1]):
                weighed[a, b] += weight[a, i] * rows[i, b]
    copy_rows(weight, out)
    for a in range(rows.shape[1]):
        for b in range(rows.shape[1]):
            for i in range(3):
                for m in range(3):
                    out[i, m] -= weighed[i, a] * cov[a, b] * weighed[m, b]
