"""Walls and grids of columns: is there a gap? Thickness of every joint at every depth and its chance to be too thin.

Two columns of radius r whose centres are d apart overlap in a lens; the joint is as thick as the lens is long across
the line of the centres, t = 2 sqrt(r^2 - d^2/4), so it is thick enough as long as d <= 2 sqrt(r^2 - (t/2)^2). The
centres are uncertain: d is the length of a Gaussian vector in the plane, and the probability of d beyond that limit is
integrated along one axis of its covariance, with the tail of the other in closed form.
Source: thesis chapter 1 for the geometry. Frame: north, east, down; m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError

Array = npt.NDArray[np.float64]
NODES = 64  # of the quadrature
REACH = 9.0  # standard deviations that the quadrature covers
TOE = 0.05  # m, by which a column may be shorter than the depth asked for: its last leg goes on
SMALLEST_STD = 1e-9  # m, stands for none in the quadrature


def thickness(distance: Array, radius: float) -> Array:
    """Thickness (m) of a joint whose centres are ``distance`` apart; negative where they do not meet: the gap."""
    half = radius**2 - 0.25 * distance**2
    return np.where(half > 0.0, 2.0 * np.sqrt(np.maximum(half, 0.0)), 2.0 * radius - distance)


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


def margin(radius: float, required: float, spacing: float, length: float) -> tuple[float, float]:
    """How far (m) one centre may shift along the wall, and how much (rad) a column of ``length`` then deviates."""
    shift = largest_distance(radius, required) - spacing
    return shift, math.atan2(shift, length)


def probability_beyond(mean: Array, cov: Array, limit: float) -> Array:
    """P(|x| > limit) of Gaussian vectors in the plane: ``mean`` (..., 2), ``cov`` (..., 2, 2).

    Keeps its relative accuracy for small probabilities: only tails are summed, no probability is taken from one.
    """
    from scipy.special import ndtr

    values, vectors = np.linalg.eigh(cov)
    std = np.maximum(np.sqrt(np.maximum(values, 0.0)), SMALLEST_STD)
    centre = np.einsum("...ij,...i->...j", vectors, mean)
    # the outer axis (u) is the one along which the chord's end passes the fewest standard deviations of the other: at
    # most about one for each of its own, so that one set of nodes does whatever the shape and the direction
    steep = np.abs(centre) / np.sqrt(np.maximum(limit**2 - centre**2, std[..., ::-1] ** 2)) * std / std[..., ::-1]
    narrow = steep[..., 0] <= steep[..., 1]
    u, v = (np.where(narrow, centre[..., k], centre[..., 1 - k]) for k in (0, 1))
    su, sv = (np.where(narrow, std[..., k], std[..., 1 - k]) for k in (0, 1))
    outside = ndtr((-limit - u) / su) + ndtr((u - limit) / su)
    low, high = np.maximum(-limit, u - REACH * su), np.minimum(limit, u + REACH * su)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    # x = limit sin(a) takes away the root at the ends of the circle
    a1, a2 = (np.arcsin(np.clip(x / limit, -1.0, 1.0)) for x in (low, np.maximum(low, high)))
    angle = 0.5 * (a2 - a1)[..., None] * nodes + 0.5 * (a2 + a1)[..., None]
    x, chord = limit * np.sin(angle), limit * np.cos(angle)
    density = np.exp(-0.5 * ((x - u[..., None]) / su[..., None]) ** 2) / (su[..., None] * math.sqrt(math.tau))
    tails = ndtr((-chord - v[..., None]) / sv[..., None]) + ndtr((v[..., None] - chord) / sv[..., None])
    inside = np.sum(weights * density * tails * chord, axis=-1) * 0.5 * (a2 - a1)
    return np.asarray(np.clip(outside + inside, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Columns:
    """As-built columns at common depths: (columns, depths, ...)."""

    names: list[str]
    depths: Array  # (depths,) m, true vertical
    centres: Array  # (columns, depths, 2) north, east; nan below the toe of a column
    covs: Array  # (columns, depths, 2, 2)
    designs: Array  # (columns, 2) of the heads


def at_depths(positions: Array, tangents: Array, covs: Array, depths: Array) -> tuple[Array, Array]:
    """Centres (w, z, 2) and covariances (w, z, 2, 2) at true vertical depths, of wells (w, n, 3) and (w, n, 3, 3).

    Between stations the centre follows the cubic that has the stations' places and slopes; nan further than ``TOE``
    below the last.
    A depth error moves the centre by the slope of the hole: the covariance is that of the plane at a fixed depth.
    """
    tvd = positions[..., 2]
    slope = tangents[..., :2] / tangents[..., 2:]
    wells = np.arange(len(tvd))[:, None]
    k = np.clip(np.sum(tvd[:, None, :] <= depths[None, :, None], axis=-1) - 1, 0, tvd.shape[1] - 2)
    top, bottom = tvd[wells, k], tvd[wells, k + 1]
    step = bottom - top
    f = ((depths - top) / step)[..., None]
    p0, p1 = positions[wells, k][..., :2], positions[wells, k + 1][..., :2]
    m0, m1 = slope[wells, k] * step[..., None], slope[wells, k + 1] * step[..., None]
    centre = p0 + f * (m0 + f * (3.0 * (p1 - p0) - 2.0 * m0 - m1 + f * (2.0 * (p0 - p1) + m0 + m1)))
    lateral = np.concatenate([np.broadcast_to(np.eye(2), (*slope.shape[:2], 2, 2)), -slope[..., None]], axis=-1)
    plane = lateral @ covs @ np.swapaxes(lateral, -1, -2)
    g = f[..., None]
    cov = (1.0 - g) * plane[wells, k] + g * plane[wells, k + 1]
    beyond = depths[None, :] > tvd[:, -1:] + TOE
    centre[beyond] = np.nan
    return centre, cov


@dataclass(frozen=True, slots=True)
class Joints:
    """Joints between neighbours: (joints, depths)."""

    pairs: npt.NDArray[np.intp]  # (joints, 2)
    distance: Array
    thickness: Array
    probability: Array  # of being thinner than required
    offset: Array  # (joints, depths, 2) of the second centre from where it should be against the first


def joints(columns: Columns, pairs: npt.NDArray[np.intp], radius: float, required: float) -> Joints:
    """Judge every joint at every depth; columns err independently of each other."""
    limit = largest_distance(radius, required)
    a, b = pairs[:, 0], pairs[:, 1]
    apart = columns.centres[b] - columns.centres[a]
    cov = columns.covs[a] + columns.covs[b]
    distance = np.hypot(apart[..., 0], apart[..., 1])
    known = np.isfinite(distance)
    probability = np.full(distance.shape, np.nan)
    probability[known] = probability_beyond(apart[known], cov[known], limit)
    offset = apart - (columns.designs[b] - columns.designs[a])[:, None, :]
    return Joints(pairs, distance, thickness(distance, radius), probability, offset)


def worst_depths(found: Joints) -> npt.NDArray[np.intp]:
    """Depth (index) of every joint at which it most probably is too thin; of equals the thinnest."""
    probability = np.where(np.isfinite(found.probability), found.probability, -1.0)
    thin = np.where(np.isfinite(found.thickness), found.thickness, np.inf)
    likeliest = probability >= np.max(probability, axis=1, keepdims=True) * (1.0 - 1e-9)
    return np.asarray(np.argmin(np.where(likeliest, thin, np.inf), axis=1), np.intp)


def worst(found: Joints) -> tuple[int, int]:
    """Joint and depth (indices) that most probably is too thin; of equals the thinnest."""
    depths = worst_depths(found)
    joints_ = np.arange(len(depths))
    best = np.lexsort((found.thickness[joints_, depths], -found.probability[joints_, depths]))[0]
    return int(best), int(depths[best])


@dataclass(frozen=True, slots=True)
class ExtraColumn:
    """Where one more column would close a gap, and whether it would."""

    north: float
    east: float
    from_depth: float
    to_depth: float
    closes: bool


def extra_column(columns: Columns, found: Joints, joint: int, radius: float, required: float) -> ExtraColumn | None:
    """A vertical column midway between two neighbours where their joint is too thin; None if it is so nowhere."""
    thin = np.flatnonzero(found.thickness[joint] < required)
    if not len(thin):
        return None
    a, b = found.pairs[joint]
    middle = 0.5 * (columns.centres[a] + columns.centres[b])[thin]
    north, east = 0.5 * (middle.min(axis=0) + middle.max(axis=0))
    limit = largest_distance(radius, required)
    both = np.concatenate([columns.centres[a][thin], columns.centres[b][thin]])
    reach = float(np.max(np.hypot(both[:, 0] - north, both[:, 1] - east)))
    depths = columns.depths[thin]
    return ExtraColumn(float(north), float(east), float(depths[0]), float(depths[-1]), reach <= limit)


def neighbours_in_line(count: int, *, closed: bool) -> npt.NDArray[np.intp]:
    """Pairs (joints, 2) of a wall in its order; a closed one is a shaft."""
    pairs = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
    return np.concatenate([pairs, [[count - 1, 0]]]) if closed and count > 2 else pairs


def neighbours_in_grid(heads: Array, spacing: float) -> npt.NDArray[np.intp]:
    """Pairs of columns whose heads are within 1.2 spacings of each other."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(heads).query_pairs(1.2 * spacing, output_type="ndarray")
    return np.asarray(pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))], np.intp)
