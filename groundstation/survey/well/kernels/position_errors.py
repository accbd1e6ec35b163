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
from groundstation.survey.well.trajectory_rows import ROW
from node.kernels.arithmetic.jit import kernel

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
Rows = npt.NDArray[np.void]


@kernel
def add_stations(
    rows: Rows, length: float, known: int, places: Places, lean: Array, down: Array, depth_places: Places,
    depths: Array, passed: Array, here: Array, own: Array, first: int, every: int, marks: Array, own_marks: Array,
    shared: Array, out: Array,
) -> None:  # fmt: skip
    """Go on down a hole from the station where the sums end.

    Parameters
    ----------
    rows : (n + 1,) of ``trajectory_rows.ROW``, the station where the sums end and those below; read alone. A leg is
        half of the weight of either end, and a metre of a depth moves the station itself by ``along``, and what is
        below by that less the one of the leg below
    length, known : of the leg above the first of them, m; how many shared errors the sums know
    places, lean, down : (c,), (2, c) and (c,), of every tangent in turn, ``count`` of each: its change, level and
        vertical, for one standard deviation of the shared errors at these places, and all others do not change it
    depth_places, depths : (d,) and (d,) m, of every depth in turn, ``depths`` of each: the same as of the tangents
    passed, own : (3, s) and (3, 3), the running sums e and R; they go on with every station but the last
    here : (3, s), to work in
    first, every, marks, own_marks : the sums after the station ``first``, and after every so many from there, are put
        into (m, 3, s) and (m, 3, 3)
    shared : (n, 3, s) m, set: columns e + e* of every position; zero rows where they are not wanted
    out : (n, 3, 3) m^2, set: C of every position
    """
    width, mark, above = max(known, rows[0]["width"]), 0, 0.5 * length
    column, column_end, depth, depth_end = 0, rows[0]["count"], 0, rows[0]["depths"]
    for k in range(len(rows) - 1):
        upper, lower = rows[k], rows[k + 1]
        end = 0.5 * (lower["md"] - upper["md"])
        weight, above = end + above, end
        width = max(width, lower["width"])
        for c in range(column, column_end):
            s = places[c]
            passed[0, s] += weight * lean[0, c]
            passed[1, s] += weight * lean[1, c]
            passed[2, s] += weight * down[c]
        for c in range(depth, depth_end):
            s = depth_places[c]
            for i in range(3):
                passed[i, s] += (upper["along"][i] - lower["along"][i]) * depths[c]
        column, column_end = column_end, column_end + lower["count"]
        depth, depth_end = depth_end, depth_end + lower["depths"]
        copy_rows(passed, here)
        for c in range(column, column_end):
            s = places[c]
            here[0, s] += end * lean[0, c]
            here[1, s] += end * lean[1, c]
            here[2, s] += end * down[c]
        for c in range(depth, depth_end):
            s = depth_places[c]
            for i in range(3):
                here[i, s] += lower["along"][i] * depths[c]
        if len(shared) > 0:
            copy_rows(here, shared[k])
        nn = ne = nd = ee = ed = dd = 0.0
        for s in range(width):
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
                own[i, j] += weight * weight * upper["own"][i, j]
                out[k, i, j] = own[i, j] + end * end * lower["own"][i, j] + of_shared[i][j]
        if k == first + mark * every:
            copy_rows(passed, marks[mark])
            copy_rows(own, own_marks[mark])
            mark += 1


@kernel
def follow_legs(rows: Rows, legs: Array, moments: Array, std: float, more: Array) -> None:
    """Go on down a hole with its positions, what its depths err by themselves, and what its path does between stations.

    See ``groundstation.survey.path.leg_wander``.

    Parameters
    ----------
    rows : (n + 1,) of ``trajectory_rows.ROW``, the station before, known, and those below, of which ``position``,
        ``along``, ``memory``, ``kinks`` and ``path`` are set
    legs : (n, 3) m, displacements
    moments : (n, 4), of every leg: v, b, a and what is kept of a curvature
    std : rad/m, of the curvature
    more : (n, 3, 3) m^2, set: both, with the own error of the depth of each
    """
    for k in range(len(legs)):
        upper, lower = rows[k], rows[k + 1]
        length, size = lower["md"] - upper["md"], 0.0
        for i in range(3):
            lower["position"][i] = upper["position"][i] + legs[k, i]
            lower["along"][i] = legs[k, i] / length
            size += lower["along"][i] * lower["along"][i]
        grown = std * std * max(moments[k, 0] + 2.0 * moments[k, 1] * upper["memory"], 0.0)
        lower["memory"] = moments[k, 3] * upper["memory"] + moments[k, 2]
        for i in range(3):
            bent = upper["along"][i] - lower["along"][i]
            for j in range(3):
                both = lower["along"][i] * lower["along"][j]
                across = (1.0 if i == j else 0.0) - (both / size if size > 0.0 else 0.0)
                kink = upper["depth_var"] * bent * (upper["along"][j] - lower["along"][j])
                lower["kinks"][i, j] = upper["kinks"][i, j] + kink
                lower["path"][i, j] = upper["path"][i, j] + grown * across
                more[k, i, j] = lower["kinks"][i, j] + lower["path"][i, j] + lower["depth_var"] * both


def warm_up() -> None:
    """Compile the loop or load it from the cache, so that the first survey does not wait for it."""
    rows, places = np.zeros(2, ROW), np.zeros(1, np.intp)
    rows["md"], rows["width"], rows["count"] = (0.0, 1.0), 1, (0, 1)
    add_stations(
        rows, 0.0, 1, places, np.zeros((2, 1)), np.zeros(1), places[:0], np.zeros(0), np.zeros((3, 1)),
        np.zeros((3, 1)), np.zeros((3, 3)), 0, 1, np.empty((1, 3, 1)), np.empty((1, 3, 3)), np.empty((0, 3, 1)),
        np.empty((1, 3, 3)),
    )  # fmt: skip
    follow_legs(rows, np.ones((1, 3)), np.zeros((1, 4)), 0.0, np.empty((1, 3, 3)))
