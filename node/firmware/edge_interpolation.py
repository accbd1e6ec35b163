"""Where inside a count the drive head stopped: the times of its last edges show how it slowed down.

A head that slows down as ``counts to go = c (time to go)^p`` passes the edge k counts before its last one at

    t_k = T - b (k + x)^(1/p) - g (k + x)^(2/p)

with x in 0..1 what it went beyond the last edge. A brake of constant torque has p = 2, a drive that eases out p = 3 or
1.5; g is the first order of friction that grows with the rate. For every x and p the times are linear in T, b and g, so
their weighted sum of squares, with T, b and g integrated out, is the likelihood of x. Stops like none of these are
recognised by their residuals, and those of a head that stops dead by a g that outweighs b: to the edges it was still
turning. The place in the count then stays unknown.
Source: least squares with flat priors, integrated in closed form (any text on linear models); see decision 0016.
"""

from __future__ import annotations

import functools

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
EDGES = 12  # that are kept; over more of them the stop is no longer a power of time
FEWEST = 8
POWERS = np.array([1.5, 2.0, 3.0])
STEPS = 32
PLACES = (np.arange(STEPS) + 0.5) / STEPS
WORST = 2.5  # sum of squares by degree of freedom; beyond, the stop is of another kind
ABRUPT = 1.7  # share of g in the time to the oldest edge over that of b; beyond, the head did not slow down to rest
UNKNOWN = (0.5, 1.0 / 12.0)
FARTHEST, BOUNCE = 1e12, 1e-7  # s, of a time, and between two edges


def stopped_at(times: tuple[float, ...], edge_std: float) -> tuple[float, float]:
    """Mean and variance of what the head went beyond its last edge.

    Parameters
    ----------
    times : s, of its last edges in one direction, the newest first; ignored from the first on that is not older
    edge_std : counts, error of an edge's place and of the stop's form

    Returns
    -------
    mean and variance, counts and counts^2; those of a uniform place when there are too few edges, or they fit no stop
    """
    t = _falling(times[:EDGES])
    if len(t) < FEWEST:
        return UNKNOWN
    y, terms, steepness = _powers_of(len(t))
    # an edge out of place is early or late by its place's error over the rate; twice, as the rate follows from the fit
    slopes = np.zeros((*y.shape[:2], 3))
    slopes[..., 1] = 1.0 / (y[..., -1] - y[..., 0])
    try:
        for _ in range(2):
            late = edge_std * _pace(y, steepness, slopes)
            slopes, square, information = _fit(terms, t, late)
    except np.linalg.LinAlgError:
        return UNKNOWN
    likely = -0.5 * square - np.log(late).sum(axis=-1) - 0.5 * information
    likely[slopes[..., 1] <= 0.0] = -np.inf
    if not np.min(square) < WORST * (len(t) - 3) or not np.isfinite(np.max(likely)):
        return UNKNOWN
    best = np.unravel_index(np.argmax(likely), likely.shape)
    if slopes[best][2] * y[best][-1] > ABRUPT * slopes[best][1]:
        return UNKNOWN
    weight = np.exp(likely - np.max(likely)).sum(axis=0)
    weight /= weight.sum()
    mean = float(weight @ PLACES)
    return mean, float(weight @ (PLACES - mean) ** 2) + 1.0 / (12.0 * STEPS**2)


def _falling(times: tuple[float, ...]) -> Array:
    """Times before the last edge in parts of all of them (0 to -1), as long as each is older than the one before."""
    falling: list[float] = []
    for time in times:
        if not abs(time) < FARTHEST or (falling and not time < falling[-1] - BOUNCE):
            break
        falling.append(time)
    t = np.array(falling)
    return t if len(t) < 2 else (t - t[0]) / (t[0] - t[-1])


@functools.cache
def _powers_of(edges: int) -> tuple[Array, Array, Array]:
    """Powers of so many edges' counts, (powers, places, edges): (k + x)^(1/p), what T, b, g go by, (k + x)^(1/p - 1).

    They are the same at every stop, and would take a tenth of its time.
    """
    y = (np.arange(edges) + PLACES[:, None]) ** (1.0 / POWERS[:, None, None])
    made = y, np.stack([np.ones_like(y), -y, -(y**2)], axis=-1), y ** (1.0 - POWERS[:, None, None])
    for one in made:
        one.flags.writeable = False
    return made


def _pace(y: Array, steepness: Array, slopes: Array) -> Array:
    """Time a count at every edge, d t_k / d k; see ``_powers_of`` for the first two."""
    b, g = slopes[..., 1, None], slopes[..., 2, None]
    return np.asarray(np.maximum(np.abs(steepness * (b + 2.0 * g * y) / POWERS[:, None, None]), 1e-9))


def _fit(terms: Array, t: Array, late: Array) -> tuple[Array, Array, Array]:
    """T, b, g of the weighted least squares; their sum of squares; log determinant of their information."""
    a = terms / late[..., None]
    z = t / late
    normal = np.einsum("...ki,...kj->...ij", a, a)
    slopes = np.linalg.solve(normal, np.einsum("...ki,...k->...i", a, z)[..., None])[..., 0]
    square = ((np.einsum("...ki,...i->...k", a, slopes) - z) ** 2).sum(axis=-1)
    return slopes, square, np.linalg.slogdet(normal)[1]
