"""Where along a hole a quantity is least: sampled as finely as the nearest other hole asks for, then bracketed.

A place along a hole is the number of its leg plus the fraction of that leg. A metre along it brings it nearer to
another hole by a metre at the most, so two samples bound the distance between them from below; direction and errors of
the distance turn over a length of its own size. Samples therefore lie within a quarter of that bound of each other.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
PIECES = 8  # of a leg, at the least
SHARE = 0.25  # of the least distance in between, that two samples may lie apart
FINEST = 0.1  # m, samples are not set closer
MOST_BRACKETS = 64  # of the lowest samples, that are searched
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
NARROWINGS = 52  # of a bracket: to less than 1e-10 of it


def leg_of(place: Array, legs: int) -> tuple[npt.NDArray[np.intp], Array]:
    """Leg and fraction of places along a hole."""
    leg = np.clip(place.astype(np.intp), 0, legs - 1)
    return leg, place - leg


def sample_places(distance: Callable[[Array], Array], lengths: Array) -> tuple[Array, Array]:
    """Places (p,) along a hole of legs of these ``lengths`` (m), and the distance (p,) of another hole from each."""
    place = np.linspace(0.0, len(lengths), PIECES * len(lengths) + 1)
    apart = distance(place)
    while True:
        middle = 0.5 * (place[1:] + place[:-1])
        width = np.diff(place) * lengths[leg_of(middle, len(lengths))[0]]
        nearest = 0.5 * (apart[1:] + apart[:-1] - width)
        wide = np.flatnonzero(width > np.maximum(SHARE * nearest, FINEST))
        if not len(wide):
            return place, apart
        place, apart = (
            np.insert(old, wide + 1, new) for old, new in ((place, middle[wide]), (apart, distance(middle[wide])))
        )


def least_place(value: Callable[[Array], Array], place: Array, sampled: Array) -> float:
    """Place of the least value, from values (p,) that were sampled at places (p,)."""
    padded = np.concatenate([[np.inf], sampled, [np.inf]])
    low = np.flatnonzero((padded[1:-1] <= padded[:-2]) & (padded[1:-1] <= padded[2:]))
    low = low[np.argsort(sampled[low], kind="stable")[:MOST_BRACKETS]]
    left, right = place[np.maximum(low - 1, 0)], place[np.minimum(low + 1, len(place) - 1)]
    found, least = _narrow(value, left, right)
    best = int(np.argmin(least))
    lowest = int(np.argmin(sampled))
    return float(found[best]) if least[best] < sampled[lowest] else float(place[lowest])


def _narrow(value: Callable[[Array], Array], left: Array, right: Array) -> tuple[Array, Array]:
    """Golden sections of brackets (b,), all at once: places and values of their minima."""
    inner, outer = right - GOLDEN * (right - left), left + GOLDEN * (right - left)
    at_inner, at_outer = value(inner), value(outer)
    for _ in range(NARROWINGS):
        down = at_inner <= at_outer  # the minimum lies left of the outer one
        left, right = np.where(down, left, inner), np.where(down, outer, right)
        new = np.where(down, right - GOLDEN * (right - left), left + GOLDEN * (right - left))
        at_new = value(new)
        inner, outer = np.where(down, new, outer), np.where(down, inner, new)
        at_inner, at_outer = np.where(down, at_new, at_outer), np.where(down, at_inner, at_new)
    lower = at_inner <= at_outer
    return np.where(lower, inner, outer), np.where(lower, at_inner, at_outer)
