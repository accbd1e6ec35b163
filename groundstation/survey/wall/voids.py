"""Voids of a grid: parts of the plane that no column covers though columns stand all around them.

The boundary of a union of discs consists of arcs. Followed with the disc on the left, an outer boundary turns
counter-clockwise and the boundary of a void clockwise, so a loop whose area is negative is a void and that is its size,
less the columns that stand free inside it.
The deepest point of a void is where the power lines of three discs meet. Frame: the plane across the columns; m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
SAME_POINT = 1e-6  # m
SMALLEST_AREA = 1e-9  # m^2, below which three discs meet in a point


@dataclass(frozen=True, slots=True)
class Void:
    """One void at one depth."""

    columns: tuple[int, ...]  # around it
    area: float  # m^2
    place: tuple[float, float]  # of its deepest point
    radius: float  # m, of the largest circle around ``place`` that no column touches


@dataclass(frozen=True, slots=True)
class Arc:
    """Part of a circle on the boundary: from an angle counter-clockwise to another (rad), and the disc that ends it."""

    disc: int
    begin: float
    end: float
    next_disc: int


def find_voids(centres: Array, radii: Array) -> list[Void]:
    """Voids between discs (n, 2) of radii (n,); discs without a centre (nan) are not there."""
    present = np.flatnonzero(np.isfinite(centres[:, 0]) & (radii > 0.0))
    arcs = [arc for disc in present.tolist() for arc in _exposed(disc, present, centres, radii)]
    loops = _loops(arcs, centres, radii)
    areas = [sum(_area(arc, centres, radii) for arc in loop) for loop in loops]
    holes = [(-area, loop) for area, loop in zip(areas, loops, strict=True) if area < -SMALLEST_AREA]
    taken = [0.0] * len(holes)
    for area, loop in zip(areas, loops, strict=True):
        point = _point(loop[0].disc, loop[0].begin, centres, radii)
        inside = [k for k, (_, hole) in enumerate(holes) if area > 0.0 and _is_around(hole, point, centres, radii)]
        if inside:  # of holes inside each other's islands the innermost
            taken[min(inside, key=lambda k: holes[k][0])] += area
    found = []
    for (area, loop), islands in zip(holes, taken, strict=True):
        around = tuple(sorted({arc.disc for arc in loop}))
        place, free = _deepest(around, loop, present, centres, radii)
        found.append(Void(around, area - islands, place, free))
    return found


def _exposed(disc: int, present: npt.NDArray[np.intp], centres: Array, radii: Array) -> list[Arc]:
    """Arcs of one circle that no other disc covers."""
    others = present[present != disc]
    away = centres[others] - centres[disc]
    distance, r = np.hypot(away[:, 0], away[:, 1]), radii[disc]
    if np.any((distance + r <= radii[others]) & ((radii[others] > r) | (others < disc))):
        return []  # inside another one
    meets = (distance < r + radii[others]) & (distance > np.abs(r - radii[others]))
    covered = []
    for k in np.flatnonzero(meets):
        towards = math.atan2(away[k, 1], away[k, 0])
        cosine = (distance[k] ** 2 + r**2 - radii[others[k]] ** 2) / (2.0 * distance[k] * r)
        half = math.acos(min(1.0, max(-1.0, cosine)))
        covered.append(((towards - half) % math.tau, 2.0 * half, int(others[k])))
    if not covered:
        return [Arc(disc, 0.0, math.tau, disc)]
    covered.sort()
    return _between(disc, covered)


def _between(disc: int, covered: list[tuple[float, float, int]]) -> list[Arc]:
    """Arcs of a circle left free by intervals (begin, length, disc) in order of their begin."""
    reach = max(begin + length - math.tau for begin, length, _ in covered)
    arcs = []
    for begin, length, other in covered:
        if begin > reach:
            arcs.append(Arc(disc, reach, begin, other))
        reach = max(reach, begin + length)
    return arcs


def _loops(arcs: list[Arc], centres: Array, radii: Array) -> list[list[Arc]]:
    """Arcs joined end to begin: where one ends, the next disc's boundary begins."""
    by_disc: dict[int, list[Arc]] = {}
    for arc in arcs:
        by_disc.setdefault(arc.disc, []).append(arc)
    left = {id(arc) for arc in arcs}
    loops = []
    for first in arcs:
        loop, following = [], first if id(first) in left else None
        while following is not None:
            left.discard(id(following))
            loop.append(following)
            following = _next(
                following, [a for a in by_disc.get(following.next_disc, ()) if id(a) in left], centres, radii
            )
        if loop:
            loops.append(loop)
    return loops


def _next(arc: Arc, candidates: list[Arc], centres: Array, radii: Array) -> Arc | None:
    """The arc that begins where one ends; None where the loop is closed."""
    end = _point(arc.disc, arc.end, centres, radii)
    for other in candidates:
        if math.dist(_point(other.disc, other.begin, centres, radii), end) < SAME_POINT:
            return other
    return None


def _point(disc: int, angle: float, centres: Array, radii: Array) -> tuple[float, float]:
    x, y = centres[disc]
    return float(x + radii[disc] * math.cos(angle)), float(y + radii[disc] * math.sin(angle))


def _is_around(loop: list[Arc], point: tuple[float, float], centres: Array, radii: Array) -> bool:
    """Whether a loop goes around a point outside its discs: seen from there no arc turns by more than half a turn."""
    turned = 0.0
    for arc in loop:
        x, y = centres[arc.disc] - point
        for angle, sign in ((arc.end, 1.0), (arc.begin, -1.0)):
            dx, dy = x + radii[arc.disc] * math.cos(angle), y + radii[arc.disc] * math.sin(angle)
            turned += sign * math.atan2(x * dy - y * dx, x * dx + y * dy)
    return abs(turned) > math.pi


def _area(arc: Arc, centres: Array, radii: Array) -> float:
    """Contribution of an arc to the area its loop encloses: half the integral of x dy - y dx."""
    (x, y), r = centres[arc.disc] - centres[0], radii[arc.disc]
    if not np.isfinite(x):
        (x, y) = centres[arc.disc]
    sines, cosines = math.sin(arc.end) - math.sin(arc.begin), math.cos(arc.end) - math.cos(arc.begin)
    return 0.5 * float(r * (arc.end - arc.begin) * r + r * (x * sines - y * cosines))


def _deepest(
    around: tuple[int, ...], loop: list[Arc], present: npt.NDArray[np.intp], centres: Array, radii: Array
) -> tuple[tuple[float, float], float]:
    """Point of a void furthest from the columns around it, and how far (m) that is; else the middle of its corners."""
    corners = np.array([_point(arc.disc, arc.begin, centres, radii) for arc in loop])
    low, high = corners.min(axis=0) - 1e-9, corners.max(axis=0) + 1e-9
    best, free = corners.mean(axis=0), -math.inf
    for triple in combinations(around[:8], 3):
        meeting = power_centre(centres[list(triple)][None], radii[list(triple)][None])[0]
        if np.all(np.isfinite(meeting)) and np.all((low <= meeting) & (meeting <= high)):
            clear = _clearance(meeting, present, centres, radii)
            if clear > free:
                best, free = meeting, clear
    if free < 0.0:
        free = max(_clearance(best, present, centres, radii), 0.0)
    return (float(best[0]), float(best[1])), free


def _clearance(point: Array, present: npt.NDArray[np.intp], centres: Array, radii: Array) -> float:
    away = centres[present] - point
    return float(np.min(np.hypot(away[:, 0], away[:, 1]) - radii[present]))


def power_centre(centres: Array, radii: Array) -> Array:
    """Point (n, 2) of equal power to three discs (n, 3, 2) of radii (n, 3): the circumcentre where they are alike.

    nan or far away where the three centres lie on a line.
    """
    edges = 2.0 * (centres[:, 1:] - centres[:, :1])
    square = np.sum(centres**2, axis=-1) - radii**2
    right = square[:, 1:] - square[:, :1]
    det = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        x = (right[:, 0] * edges[:, 1, 1] - right[:, 1] * edges[:, 0, 1]) / det
        y = (edges[:, 0, 0] * right[:, 1] - edges[:, 1, 0] * right[:, 0]) / det
    return np.stack([x, y], axis=-1)


def triples_of(heads: Array, reach: float) -> npt.NDArray[np.intp]:
    """Triples (t, 3) of columns whose heads are all within ``reach`` (m) of each other: where a void may open."""
    from scipy.spatial import cKDTree

    near = [set(found) for found in cKDTree(heads).query_ball_point(heads, reach)]
    triples = []
    for a in range(len(heads)):
        later = sorted(k for k in near[a] if k > a)
        triples += [(a, b, c) for b, c in combinations(later, 2) if c in near[b]]
    return np.array(triples, np.intp).reshape(-1, 3)
