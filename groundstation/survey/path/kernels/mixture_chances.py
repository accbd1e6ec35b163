"""Chances of a mixture of normals in the plane within a circle or a strip, and the circle or strip of a chance.

Of one normal with principal axes u (narrow, sigma_u) and v, about the middle of a circle of radius r,

    P = int phi(y; mu_u, sigma_u) [Phi((c - mu_v) / sigma_v) - Phi((-c - mu_v) / sigma_v)] dy,    c = sqrt(r^2 - y^2),

with y = r sin(t): smooth to the edge of the circle, and a quadrature of Gauss and Legendre over that part of t in
which the narrow normal lies. The same nodes every time, so the same figure every time. m.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.jit import kernel

Array = npt.NDArray[np.float64]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)
REACH = 8.0  # standard deviations that are integrated over
SAME, ROUNDISH = 1e-9, 3.0  # of two standard deviations, up to which they are one, and up to which either axis will do
STEEP, MOST_PANELS = 6.0, 40  # standard deviations by which the chord may change in one panel of nodes; panels
ROOT_TWO, ROOT_TWO_PI = math.sqrt(2.0), math.sqrt(2.0 * math.pi)
LEAST = 1e-12  # m, of a standard deviation
CLOSE = 1e-8  # of a chance that is looked for
TRIES = 60  # of that


@kernel
def normal_between(low: float, high: float) -> float:
    """Chance of a normal between two numbers of its standard deviations."""
    if low > 0.0:  # where both are near 1 their difference has no digits
        low, high = -high, -low
    return 0.5 * (math.erfc(-high / ROOT_TWO) - math.erfc(-low / ROOT_TWO))


@kernel
def one_within_circle(x: float, y: float, xx: float, xy: float, yy: float, radius: float) -> float:
    """Chance of a normal with mean (x, y) and covariance ((xx, xy), (xy, yy)) within a radius of (0, 0)."""
    middle, half = 0.5 * (xx + yy), math.hypot(0.5 * (xx - yy), xy)
    turn = 0.5 * math.atan2(2.0 * xy, xx - yy)  # of the wide axis
    wide, narrow = math.sqrt(max(middle + half, 0.0)) + LEAST, math.sqrt(max(middle - half, 0.0)) + LEAST
    cos, sin = math.cos(turn), math.sin(turn)
    along, across = cos * x + sin * y, cos * y - sin * x
    if wide - narrow < SAME * wide:  # round: any axis is one of its own
        wide = narrow = math.sqrt(max(middle, 0.0)) + LEAST
        along, across = math.hypot(x, y), 0.0
    elif wide < ROUNDISH * narrow and abs(across) > abs(along):  # the chord changes least where its end is far off
        wide, narrow, along, across = narrow, wide, across, along
    first = math.asin(min(max((across - REACH * narrow) / radius, -1.0), 1.0))
    last = math.asin(min(max((across + REACH * narrow) / radius, -1.0), 1.0))
    changed = radius * max(abs(math.cos(first) - math.cos(last)), abs(1.0 - math.cos(first)) * (first * last < 0.0))
    panels = 1 + min(int(changed / (STEEP * wide)), MOST_PANELS)
    total, width = 0.0, (last - first) / panels
    for place in range(panels):
        for k in range(len(NODES)):
            t = first + (place + 0.5 + 0.5 * NODES[k]) * width
            chord, off = radius * math.cos(t), (radius * math.sin(t) - across) / narrow
            density = math.exp(-0.5 * off * off) / (ROOT_TWO_PI * narrow)
            total += WEIGHTS[k] * chord * density * normal_between((-chord - along) / wide, (chord - along) / wide)
    return 0.5 * width * total


@kernel
def chance_in_circle(weights: Array, means: Array, covs: Array, centre: Array, radius: float) -> float:
    """Chance of a mixture within a radius (m) of a centre (2,).

    Parameters
    ----------
    weights, means, covs : (c,), (c, 2) m and (c, 2, 2) m^2
    """
    if radius <= 0.0:
        return 0.0
    total = 0.0
    for k in range(len(weights)):
        x, y = means[k, 0] - centre[0], means[k, 1] - centre[1]
        total += weights[k] * one_within_circle(x, y, covs[k, 0, 0], covs[k, 0, 1], covs[k, 1, 1], radius)
    return total


@kernel
def chance_in_strip(weights: Array, means: Array, covs: Array, centre: Array, unit: Array, half_width: float) -> float:
    """Chance of a mixture within a half width (m) of a centre (2,) along a unit vector (2,)."""
    total = 0.0
    for k in range(len(weights)):
        off = unit[0] * (means[k, 0] - centre[0]) + unit[1] * (means[k, 1] - centre[1])
        var = unit[0] ** 2 * covs[k, 0, 0] + 2.0 * unit[0] * unit[1] * covs[k, 0, 1] + unit[1] ** 2 * covs[k, 1, 1]
        std = math.sqrt(max(var, 0.0)) + LEAST
        total += weights[k] * normal_between((-half_width - off) / std, (half_width - off) / std)
    return total


@kernel
def reach_of_chance(weights: Array, means: Array, covs: Array, centre: Array, unit: Array, chance: float) -> float:
    """Half width (m) along ``unit`` about a centre that has a chance; the radius of a circle where that is (0, 0)."""
    is_circle = unit[0] == 0.0 and unit[1] == 0.0
    low, high, under, over, side = 0.0, 0.0, -chance, 1.0 - chance, 0
    for k in range(len(weights)):
        off = math.hypot(means[k, 0] - centre[0], means[k, 1] - centre[1])
        high = max(high, off + (REACH + 2.0) * (math.sqrt(covs[k, 0, 0] + covs[k, 1, 1]) + LEAST))
    middle = 0.0
    for number in range(TRIES):
        # the Illinois form of the false position, and every fourth time the half: it never stands still
        middle = 0.5 * (low + high) if number % 4 == 0 else (low * over - high * under) / (over - under)
        if is_circle:
            found = chance_in_circle(weights, means, covs, centre, middle) - chance
        else:
            found = chance_in_strip(weights, means, covs, centre, unit, middle) - chance
        if abs(found) < CLOSE or high - low < LEAST:
            break
        if found < 0.0:
            low, under = middle, found
            over = 0.5 * over if side < 0 else over
            side = -1
        else:
            high, over = middle, found
            under = 0.5 * under if side > 0 else under
            side = 1
    return middle


def warm_up() -> None:
    """Compile them or load them from the cache."""
    mixture = (np.ones(1), np.zeros((1, 2)), np.broadcast_to(np.eye(2), (1, 2, 2)).copy(), np.zeros(2))
    chance_in_circle(*mixture, 1.0)
    reach_of_chance(*mixture, np.zeros(2), 0.95)
