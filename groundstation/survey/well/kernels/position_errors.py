"""Errors of the positions of a hole, station by station: what stations share and what is each one's own.

A station that another one follows counts with both of its legs from then on, the last one with its upper leg alone,

    C_K = sum_{k<K} R_k + R*_K + (sum_{k<K} e_k + e*_K) (sum_{k<K} e_k + e*_K)^T

and an error of its depth moves it along the leg above, tau_K, and what is below by the kink there, tau_k - tau_(k+1).
So two running sums are all that is kept. Source: thesis eqs. I.1-I.12. Frame: north, east, down; m.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.path.kernels.copied_rows import copy_rows
from node.kernels.arithmetic.jit import kernel

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]


@kernel
def add_stations(
    weights: Array, ends: Array, starts: Places, places: Places, lean: Array, down: Array, covs: Array, kinks: Array,
    alongs: Array, depth_starts: Places, depth_places: Places, depths: Array, widths: Places, passed: Array,
    here: Array, own: Array, first: int, every: int, marks: Array, own_marks: Array, shared: Array, out: Array,
) -> None:  # fmt: skip
    """Go on down a hole from the station where the sums end.

    Parameters
    ----------
    weights, ends : (n,) m, half of both legs of the station before, half of the upper leg of each
    starts, places, lean, down : (n + 2,), (c,), (2, c) and (c,), of every tangent from the station before on: the
        columns from ``starts[k]`` to before ``starts[k + 1]`` are its change, level and vertical, for one standard
        deviation of the shared errors at these places, and all others do not change it
    covs : (n + 1, 3, 3), of the same tangents: the covariance that is its own
    kinks, alongs : (n, 3), of the station before each: by how much a metre of its depth moves what is below it; of
        each: by how much a metre of its depth moves itself
    depth_starts, depth_places, depths : (n + 2,), (d,) and (d,) m, of every depth from the station before on: the same
        as of the tangents
    widths : (n,), how many shared errors are known at each position
    passed, own : (3, s) and (3, 3), the running sums e and R; they go on with every station but the last
    here : (3, s), to work in
    first, every, marks, own_marks : the sums after the station ``first``, and after every so many from there, are put
        into (m, 3, s) and (m, 3, 3)
    shared : (n, 3, s) m, set: columns e + e* of every position; zero rows where they are not wanted
    out : (n, 3, 3) m^2, set: C of every position
    """
    mark = 0
    for k in range(len(weights)):
        weight, end = weights[k], ends[k]
        for c in range(starts[k], starts[k + 1]):
            s = places[c]
            passed[0, s] += weight * lean[0, c]
            passed[1, s] += weight * lean[1, c]
            passed[2, s] += weight * down[c]
        for c in range(depth_starts[k], depth_starts[k + 1]):
            s = depth_places[c]
            for i in range(3):
                passed[i, s] += kinks[k, i] * depths[c]
        copy_rows(passed, here)
        for c in range(starts[k + 1], starts[k + 2]):
            s = places[c]
            here[0, s] += end * lean[0, c]
            here[1, s] += end * lean[1, c]
            here[2, s] += end * down[c]
        for c in range(depth_starts[k + 1], depth_starts[k + 2]):
            s = depth_places[c]
            for i in range(3):
                here[i, s] += alongs[k, i] * depths[c]
        if len(shared) > 0:
            copy_rows(here, shared[k])
        nn = ne = nd = ee = ed = dd = 0.0
        for s in range(widths[k]):
            n, e, d = here[0, s], here[1, s], here[2, s]
            nn += n * n
            ne += n * e
            nd += n * d
            ee += e * e
            ed += e * d
            dd += d * d
        of_shared = ((nn, ne, nd), (ne, ee, ed), (nd, ed, dd))
        for i in range(3):
            for j in range(3):
                own[i, j] += weight * weight * covs[k, i, j]
                out[k, i, j] = own[i, j] + end * end * covs[k + 1, i, j] + of_shared[i][j]
        if k == first + mark * every:
            copy_rows(passed, marks[mark])
            copy_rows(own, own_marks[mark])
            mark += 1


@kernel
def follow_legs(
    legs: Array, lengths: Array, depth_vars: Array, moments: Array, std: float, alongs: Array, memories: Array,
    kinks: Array, path: Array, more: Array,
) -> None:  # fmt: skip
    """Go on down a hole with what its depths err by themselves, and what its path does between stations.

    See ``groundstation.survey.path.leg_wander``. The first row of what is set is that of the station before, known.

    Parameters
    ----------
    legs, lengths : (n, 3) and (n,) m, displacements and lengths
    depth_vars : (n + 1,) m^2, of the depths of the station before and of all below, that no other shares
    moments : (n, 4), of every leg: v, b, a and what is kept of a curvature
    std : rad/m, of the curvature
    alongs : (n + 1, 3), set: displacement of the leg above each for a metre of it
    memories : (n + 1,), set: c of the leg below each
    kinks, path : (n + 1, 3, 3) m^2, set: what the own errors of the depths above, and the path above come to
    more : (n, 3, 3) m^2, set: both, with the own error of the depth of each
    """
    for k in range(len(lengths)):
        size = 0.0
        for i in range(3):
            alongs[k + 1, i] = legs[k, i] / lengths[k]
            size += alongs[k + 1, i] * alongs[k + 1, i]
        grown = std * std * max(moments[k, 0] + 2.0 * moments[k, 1] * memories[k], 0.0)
        memories[k + 1] = moments[k, 3] * memories[k] + moments[k, 2]
        for i in range(3):
            bent = alongs[k, i] - alongs[k + 1, i]
            for j in range(3):
                both = alongs[k + 1, i] * alongs[k + 1, j]
                across = (1.0 if i == j else 0.0) - (both / size if size > 0.0 else 0.0)
                kinks[k + 1, i, j] = kinks[k, i, j] + depth_vars[k] * bent * (alongs[k, j] - alongs[k + 1, j])
                path[k + 1, i, j] = path[k, i, j] + grown * across
                more[k, i, j] = kinks[k + 1, i, j] + path[k + 1, i, j] + depth_vars[k + 1] * both


def warm_up() -> None:
    """Compile the loop or load it from the cache, so that the first survey does not wait for it."""
    starts, places = np.array([0, 0, 1]), np.zeros(1, np.intp)
    add_stations(
        np.ones(1), np.ones(1), starts, places, np.zeros((2, 1)), np.zeros(1), np.zeros((2, 3, 3)), np.zeros((1, 3)),
        np.zeros((1, 3)), np.zeros(3, np.intp), places[:0], np.zeros(0), np.ones(1, np.intp),
        np.zeros((3, 1)), np.zeros((3, 1)), np.zeros((3, 3)), 0, 1, np.empty((1, 3, 1)), np.empty((1, 3, 3)),
        np.empty((0, 3, 1)), np.empty((1, 3, 3)),
    )  # fmt: skip
    follow_legs(
        np.ones((1, 3)), np.ones(1), np.zeros(2), np.zeros((1, 4)), 0.0, np.zeros((2, 3)), np.zeros(2),
        np.zeros((2, 3, 3)), np.zeros((2, 3, 3)), np.empty((1, 3, 3)),
    )  # fmt: skip
