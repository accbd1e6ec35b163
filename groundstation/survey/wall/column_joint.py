"""Joint of two columns: how thick it is, and its chance to be thinner than required.

Two columns of radii r1, r2 whose centres are d apart overlap in a lens. It is as thick as it is long across the line of
the centres, so it is at least t thick as long as d <= sqrt(r1^2 - t^2/4) + sqrt(r2^2 - t^2/4). Centres and radii are
uncertain: d is the length of a Gaussian vector in the plane, and the probability of d beyond that limit is integrated
along one axis of its covariance, with the tail of the other in closed form; radii are integrated over beside it.
Source: thesis chapter 1 for the geometry. Frame: the plane across the columns; m.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError

Array = npt.NDArray[np.float64]
NODES = 64  # of the quadrature
REACH = 9.0  # standard deviations that the quadrature covers
NO_TAIL = 39.0  # standard deviations, beyond which a tail is below the least number
SMALLEST_STD = 1e-9  # m, stands for none in the quadrature
RADIUS_REACH = 8.0  # standard deviations of the radii that are integrated over
RADIUS_NODES = 16  # of each of three panels
STEP_WIDTHS = 6.0  # standard deviations of the distance, on either side of where the joint is just thick enough
SIDEWAYS = ((-math.sqrt(3.0), 1.0 / 6.0), (0.0, 2.0 / 3.0), (math.sqrt(3.0), 1.0 / 6.0))  # Gauss-Hermite
SMALLEST_LIMIT = 1e-6  # m, stands for radii that never make the joint


def joint_thickness(distance: Array, radius: Array | float, other: Array | float | None = None) -> Array:
    """Thickness (m) of a joint whose centres are ``distance`` apart; negative where they do not meet: the gap.

    ``other`` is the radius of the second column, that of the first by default. A column whose centre lies within the
    chord of a larger one joins it over its whole diameter.
    """
    first, second = np.asarray(radius, float), np.asarray(radius if other is None else other, float)
    apart = np.maximum(distance, 1e-12)
    chord = 0.5 * (apart**2 + first**2 - second**2) / apart  # of the first centre from the line of the two cusps
    half = np.maximum(first**2 - chord**2, 0.0)
    joined = np.where(apart**2 <= np.abs(first**2 - second**2), 2.0 * np.minimum(first, second), 2.0 * np.sqrt(half))
    return np.asarray(np.where(distance < first + second, joined, first + second - distance))


def limit_distances(radius: Array, other: Array, required: float) -> Array:
    """Distance (m) at which the joint of two columns is as thick as required; 0 where it never can be."""
    return limit_of_reaches(chord_reaches(radius, required), chord_reaches(other, required))


def chord_reaches(radius: Array, required: float) -> Array:
    """Distance (m) of a column's centre from a chord as long as required; 0 where it has none."""
    return np.sqrt(np.where(radius > 0.0, np.maximum(radius**2 - 0.25 * required**2, 0.0), 0.0))


def limit_of_reaches(first: Array, second: Array) -> Array:
    """``limit_distances`` of two columns by their ``chord_reaches``."""
    return np.where((first > 0.0) & (second > 0.0), first + second, 0.0)


def largest_distance(radius: float, required: float) -> float:
    """Distance (m) of two centres at which their joint is just as thick as required.

    Raises
    ------
    SurveyError
        When two columns of that radius never make such a joint.
    """
    if not 0.0 <= required < 2.0 * radius:
        raise SurveyError(f"wall: expected a thickness below the diameter of {2.0 * radius:g} m, got {required:g} m")
    return 2.0 * math.sqrt(radius**2 - 0.25 * required**2)


def shift_margin(radius: float, required: float, spacing: float, length: float) -> tuple[float, float]:
    """Largest shift (m) of a centre along the wall, and the deviation (rad) of a column of ``length`` by it."""
    shift = largest_distance(radius, required) - spacing
    return shift, math.atan2(shift, length)


def probability_beyond(mean: Array, cov: Array, limit: Array | float) -> Array:
    """P(|x| > limit) of Gaussian vectors in the plane: ``mean`` (..., 2), ``cov`` (..., 2, 2), ``limit`` (...).

    Keeps its relative accuracy for small probabilities: only tails are summed, no probability is taken from one.
    """
    from scipy.special import ndtr

    limit = np.asarray(limit, float)
    values, vectors = np.linalg.eigh(cov)
    std = np.maximum(np.sqrt(np.maximum(values, 0.0)), SMALLEST_STD)
    centre = np.einsum("...ij,...i->...j", vectors, mean)
    # the outer axis (u) is the one along which the chord's end passes the fewest standard deviations of the other: at
    # most about one for each of its own, so that one set of nodes does whatever the shape and the direction
    free = np.maximum(limit[..., None] ** 2 - centre**2, std[..., ::-1] ** 2)
    steep = np.abs(centre) / np.sqrt(free) * std / std[..., ::-1]
    narrow = steep[..., 0] <= steep[..., 1]
    u, v = (np.where(narrow, centre[..., k], centre[..., 1 - k]) for k in (0, 1))
    su, sv = (np.where(narrow, std[..., k], std[..., 1 - k]) for k in (0, 1))
    outside = ndtr((-limit - u) / su) + ndtr((u - limit) / su)
    low, high = np.maximum(-limit, u - REACH * su), np.minimum(limit, u + REACH * su)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    # x = limit sin(a) takes away the root at the ends of the circle
    a1, a2 = (np.arcsin(np.clip(x / limit, -1.0, 1.0)) for x in (low, np.maximum(low, high)))
    angle = 0.5 * (a2 - a1)[..., None] * nodes + 0.5 * (a2 + a1)[..., None]
    sine = np.sin(angle)
    x, chord = limit[..., None] * sine, limit[..., None] * np.sqrt((1.0 - sine) * (1.0 + sine))
    density = np.exp(-0.5 * ((x - u[..., None]) / su[..., None]) ** 2) / (su[..., None] * math.sqrt(math.tau))
    size, far = np.abs(v), chord.min(axis=-1, initial=np.inf)
    tails = ndtr((size[..., None] - chord) / sv[..., None])
    both = (size + far) / sv < NO_TAIL  # beyond that the tail of the other side is 0
    tails[both] += ndtr((-chord[both] - size[both, None]) / sv[both, None])
    inside = np.sum(weights * density * tails * chord, axis=-1) * 0.5 * (a2 - a1)
    return np.asarray(np.clip(outside + inside, 0.0, 1.0))


def probability_thin(mean: Array, cov: Array, radii: Array, radius_cov: Array, required: float) -> Array:
    """P(joint thinner than required) with uncertain centres and radii.

    Parameters
    ----------
    mean, cov : (n, 2) and (n, 2, 2), of the second centre against the first, m
    radii : (n, 2) m
    radius_cov : (n, 2, 2) m^2, of the two radii; they err independently of the centres
    required : m
    """
    limit = np.maximum(limit_distances(radii[:, 0], radii[:, 1], required), SMALLEST_LIMIT)
    found = np.asarray(probability_beyond(mean, cov, limit))
    uncertain = np.flatnonzero(np.trace(radius_cov, axis1=-2, axis2=-1) > 0.0)
    if len(uncertain):
        m, c, r, s = mean[uncertain], cov[uncertain], radii[uncertain], radius_cov[uncertain]
        found[uncertain] = _over_radii(m, c, r, s, required)
    return found


def _over_radii(mean: Array, cov: Array, radii: Array, radius_cov: Array, required: float) -> Array:
    """Integral over the radii: along the direction that changes the limit most, and three nodes across it."""
    main, across = _directions(radii, radius_cov, required)
    step, width = _step(mean, cov, radii, main, required)
    low, high = np.full(len(mean), -RADIUS_REACH), np.full(len(mean), RADIUS_REACH)
    inner = np.clip(step - STEP_WIDTHS * width, low, high), np.clip(step + STEP_WIDTHS * width, low, high)
    nodes, weights = np.polynomial.legendre.leggauss(RADIUS_NODES)
    total = np.zeros(len(mean))
    for first, last in ((low, inner[0]), (*inner,), (inner[1], high)):
        half, middle = 0.5 * (last - first), 0.5 * (last + first)
        for node, weight in zip(nodes, weights, strict=True):
            t = middle + half * node
            density = weight * half * np.exp(-0.5 * t**2) / math.sqrt(math.tau)
            for sideways, share in SIDEWAYS:
                drawn = radii + t[:, None] * main + sideways * across
                limit = np.maximum(limit_distances(drawn[:, 0], drawn[:, 1], required), SMALLEST_LIMIT)
                total += share * density * probability_beyond(mean, cov, limit)
    return np.clip(total, 0.0, 1.0)


def _directions(radii: Array, radius_cov: Array, required: float) -> tuple[Array, Array]:
    """One standard deviation (n, 2) of the radii along the steepest change of the limit, and the rest across it."""
    half = 0.25 * required**2
    gradient = radii / np.sqrt(np.maximum(radii**2 - half, 1e-6 * radii**2))
    towards = np.einsum("nij,nj->ni", radius_cov, gradient)
    size = np.sqrt(np.maximum(np.einsum("ni,ni->n", gradient, towards), 1e-300))
    main = towards / size[:, None]
    left = radius_cov - main[:, :, None] * main[:, None, :]
    values, vectors = np.linalg.eigh(left)
    return main, vectors[:, :, 1] * np.sqrt(np.maximum(values[:, 1:], 0.0))


def _step(mean: Array, cov: Array, radii: Array, main: Array, required: float) -> tuple[Array, Array]:
    """Place along ``main`` (standard deviations) of a joint as thick as required, and the width of that change."""
    distance = np.hypot(mean[:, 0], mean[:, 1])
    low, high = np.full(len(mean), -RADIUS_REACH), np.full(len(mean), RADIUS_REACH)
    for _ in range(40):
        t = 0.5 * (low + high)
        drawn = radii + t[:, None] * main
        thin = limit_distances(drawn[:, 0], drawn[:, 1], required) < distance
        low, high = np.where(thin, t, low), np.where(thin, high, t)
    half = 0.25 * required**2
    gradient = radii / np.sqrt(np.maximum(radii**2 - half, 1e-6 * radii**2))
    change = np.maximum(np.einsum("ni,ni->n", gradient, main), 1e-12)
    std = np.sqrt(np.maximum(np.linalg.eigvalsh(cov)[:, 1], SMALLEST_STD**2))
    return 0.5 * (low + high), std / change
