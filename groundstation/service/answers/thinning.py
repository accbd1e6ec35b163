"""Fewer points of a long line that still looks the same: largest-triangle-three-buckets (Steinarsson 2013)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
FEWEST = 3


def largest_triangles(x: Array, y: Array, count: int) -> list[int]:
    """Places of at most ``count`` points of the line (x, y), each (n,): the first, the last, one of every bucket.

    From each bucket comes the point that spans the largest triangle with the one kept before it and the mean of the
    bucket after it, so that a short peak stays.

    Raises
    ------
    ValueError
        When fewer than three points are asked for, or x and y are not of one length.
    """
    if count < FEWEST or x.shape != y.shape:
        raise ValueError(f"expected at least {FEWEST} points of two equal arrays, got {count} of {x.shape}, {y.shape}")
    n = len(x)
    if n <= count:
        return list(range(n))
    edges = np.linspace(1, n - 1, count - 1).astype(int)
    kept = [0]
    for k, (low, high) in enumerate(pairwise(edges)):
        after = slice(high, edges[k + 2]) if k + 2 < len(edges) else slice(n - 1, n)
        ahead_x, ahead_y = x[after].mean(), y[after].mean()
        last = kept[-1]
        areas = np.abs((x[last] - ahead_x) * (y[low:high] - y[last]) - (x[last] - x[low:high]) * (ahead_y - y[last]))
        kept.append(int(low + areas.argmax()))
    return [*kept, n - 1]
