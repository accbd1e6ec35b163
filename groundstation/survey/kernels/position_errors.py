"""Errors of the positions of a hole, station by station: what stations share and what is each one's own.

A station that another one follows counts with both of its legs from then on, the last one with its upper leg alone,

    C_K = sum_{k<K} R_k + R*_K + (sum_{k<K} e_k + e*_K) (sum_{k<K} e_k + e*_K)^T

so two running sums are all that is kept. The last product is the caller's: it is a matter of the BLAS. Source: thesis
eqs. I.1-I.12. Frame: north, east, down; m.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from node.kernels.jit import kernel

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]


@kernel
def add_stations(
    weights: Array, ends: Array, starts: Places, places: Places, lean: Array, down: Array, covs: Array,
    passed: Array, own: Array, shared: Array, out: Array,
) -> None:  # fmt: skip
    """Go on down a hole from the station where the sums end.

    Parameters
    ----------
    weights, ends : (n,) m, half of both legs of the station before, half of the upper leg of each
    starts, places, lean, down : (n + 2,), (c,), (2, c) and (c,), of every tangent from the station before on: the
        columns from ``starts[k]`` to before ``starts[k + 1]`` are its change, level and vertical, for one standard
        deviation of the shared errors at these places, and all others do not change it
    covs : (n + 1, 3, 3), of the same tangents: the covariance that is its own
    passed, own : (3, s) and (3, 3), the running sums e and R; they go on with every station but the last
    shared, out : (n, 3, s) m and (n, 3, 3) m^2, set: columns e + e* of every position and R + R*, its own covariance
    """
    for k in range(len(weights)):
        weight, end = weights[k], ends[k]
        for i in range(3):
            for c in range(starts[k], starts[k + 1]):
                passed[i, places[c]] += weight * (down[c] if i == 2 else lean[i, c])
            for s in range(passed.shape[1]):
                shared[k, i, s] = passed[i, s]
            for c in range(starts[k + 1], starts[k + 2]):
                shared[k, i, places[c]] += end * (down[c] if i == 2 else lean[i, c])
            for j in range(3):
                own[i, j] += weight * weight * covs[k, i, j]
                out[k, i, j] = own[i, j] + end * end * covs[k + 1, i, j]


def warm_up() -> None:
    """Compile the loop or load it from the cache, so that nobody's first survey waits for it."""
    starts, places = np.array([0, 0, 1]), np.zeros(1, np.intp)
    add_stations(
        np.ones(1), np.ones(1), starts, places, np.zeros((2, 1)), np.zeros(1), np.zeros((2, 3, 3)), np.zeros((3, 1)),
        np.zeros((3, 3)), np.empty((1, 3, 1)), np.empty((1, 3, 3)),
    )  # fmt: skip
