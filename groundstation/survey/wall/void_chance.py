"""Probability of a void between the columns of a grid, at every depth.

A void's deepest point lies where the power lines of three columns meet, so every three neighbours are asked whether
that point lies between them and outside of all columns. Samples are drawn around the likeliest points at which it does
and weighted back, as in ``wall_system``; a depth at which a column is missing is open for certain. m.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.wall.as_built import Columns
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.voids import power_centre
from groundstation.survey.wall.wall_errors import (
    FURTHEST,
    Mixture,
    MostProbablePoint,
    WallErrors,
    add_radius,
    batch_groups,
)

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
VOID_DEPTHS = 6  # of a layer, among which the likeliest point of a void is looked for
ACROSS = 0.05  # of a triangle, by which the point between three columns may lie beyond its side
NEGLIGIBLE = 1e-9  # probability of a void between three columns below which they are not drawn
SAMPLES = 8192
FEWEST = 1024
BUDGET = 1e8  # columns around voids times depths times samples
SEED = 20_260_102  # the same grid gives the same probability


@dataclass(frozen=True, slots=True)
class VoidChance:
    """Probability of any void at every depth (depths,), its standard error, and the likeliest three columns."""

    probability: Array
    standard_error: Array
    columns: list[tuple[int, int, int] | None]  # None where nothing is likely
    places: Array  # (depths, 2) of the deepest point between them as surveyed; nan where there are none


def void_chance(columns: Columns, triples: npt.NDArray[np.intp], samples: int = SAMPLES) -> VoidChance:
    """P(any void) at every depth; ``triples`` (t, 3) are the columns between which one may open."""
    errors = WallErrors.of(columns)
    layer = columns.depth_layers()
    points: list[MostProbablePoint] = []
    kept: list[tuple[list[int], list[int]]] = []
    for triple in triples:
        near = near_triple(columns, triple)
        found = [
            void_point(
                errors, triple, near, depths[np.unique(np.linspace(0, len(depths) - 1, VOID_DEPTHS).astype(int))]
            )
            for depths in (np.flatnonzero(layer == k) for k in range(errors.layers))
            if len(depths)
        ]
        likely = [point for point in found if point is not None and point.chance > NEGLIGIBLE]
        points += likely
        if likely or np.any(_as_surveyed(columns, triple.tolist(), near)):
            kept.append((triple.tolist(), near))
    depths_count = len(columns.depths)
    total, square, each = np.zeros(depths_count), np.zeros(depths_count), np.zeros((len(kept), depths_count))
    if not points:  # nothing moves: what is open is so for certain
        for n, (three, near) in enumerate(kept):
            each[n] = _as_surveyed(columns, three, near)
        total = np.max(each, axis=0, initial=0.0)
        return _answer(columns, total, np.zeros(depths_count), each, [three for three, _ in kept])
    mixture = Mixture(points, errors.size)
    cost = sum(2 + len(near) for _, near in kept) + len(columns.names)
    samples = int(np.clip(BUDGET / (cost * depths_count), FEWEST, samples))
    parts = list(batch_groups([[*three, *near] for three, near in kept], mixture.at_once(samples), depths_count))
    for x, weight in mixture.batches(samples, np.random.default_rng(SEED)):
        any_open = np.zeros((len(x), depths_count), bool)
        for some, which in parts:
            centres, radii = errors.drawn(x, which)
            place = errors.places(which)
            for n in some:
                triple, others = (place[group] for group in kept[n])
                opened = void_open(centres, radii, triple, others)
                each[n] += weight @ opened
                any_open |= opened
        total, square = total + weight @ any_open, square + weight**2 @ any_open
    mean = total / samples
    error = np.sqrt(np.maximum(square / samples - mean**2, 0.0) / samples)
    return _answer(columns, mean, error, each, [three for three, _ in kept])


def _answer(columns: Columns, probability: Array, error: Array, each: Array, kept: list[list[int]]) -> VoidChance:
    missing = np.any(columns.states == ColumnState.MISSING, axis=0)
    likeliest: list[tuple[int, int, int] | None] = [None] * len(columns.depths)
    places = np.full((len(columns.depths), 2), np.nan)
    for z in range(len(columns.depths)):
        n = int(np.argmax(each[:, z])) if len(each) else 0
        if len(each) and each[n, z] > 0.0:
            a, b, c = kept[n]
            likeliest[z] = (a, b, c)
            places[z] = power_centre(columns.centres[[a, b, c], z][None], columns.radii[[a, b, c], z][None])[0]
    sure = np.where(missing, 1.0, np.clip(probability, 0.0, 1.0))
    return VoidChance(sure, np.where(missing, 0.0, error), likeliest, places)


def _as_surveyed(columns: Columns, three: list[int], near: list[int]) -> npt.NDArray[np.bool_]:
    """Whether there is a void between three columns as surveyed: (depths,)."""
    return np.asarray(void_open(columns.centres[:, None], columns.radii[:, None], three, near)[0])


def void_point(
    errors: WallErrors, triple: npt.NDArray[np.intp], near: list[int], depths: npt.NDArray[np.intp]
) -> MostProbablePoint | None:
    """Most probable point of a void between three columns, at the likeliest of some ``depths``; None if none."""
    c = errors.columns
    centres, radii = np.swapaxes(c.centres[triple][:, depths], 0, 1), c.radii[triple][:, depths].T
    middle = power_centre(centres, radii)
    weights = _barycentric(middle, centres)
    points = [
        _void_point_at(errors, triple, near, int(depth), middle[k], weights[k])
        for k, depth in enumerate(depths)
        if np.all(weights[k] > -ACROSS)
    ]
    return max(points, key=lambda point: point.chance, default=None)


def _void_point_at(
    errors: WallErrors, triple: npt.NDArray[np.intp], near: list[int], depth: int, middle: Array, weights: Array
) -> MostProbablePoint:
    """Nearest x at which the middle of three columns is clear of them and of every other that covers it.

    With the barycentric weights w of the middle, its distance from the three grows by the sum of w times what each of
    them moves away; the others have to move away by themselves.
    """
    covering = [k for k in near if _depth_in(errors.columns, k, depth, middle) > 0.0]
    about = [*triple.tolist(), *covering]
    few = errors.among(about)
    rows, rests = [np.zeros(few.size)], [_depth_in(few.columns, 0, depth, middle)]
    for k, weight in enumerate(weights.tolist()):
        rows[0] += weight * _away(few, k, depth, middle)
    for k in range(len(weights), len(about)):
        rows.append(_away(few, k, depth, middle))
        rests.append(_depth_in(few.columns, k, depth, middle))
    wanted, numbers = np.maximum(rests, 0.0), errors.numbers(about)
    shift = -np.linalg.pinv(np.array(rows), rcond=1e-9) @ wanted
    if np.any(-np.array(rows) @ shift < 0.5 * wanted):  # columns that cannot move
        return MostProbablePoint(numbers, np.zeros(few.size), 0.0)
    size = float(np.linalg.norm(shift))
    return MostProbablePoint(
        numbers, shift * min(1.0, FURTHEST / max(size, 1e-12)), 0.5 * math.erfc(size / math.sqrt(2.0))
    )


def _away(errors: WallErrors, column: int, depth: int, middle: Array) -> Array:
    """Change of a column's cover of a point for one standard deviation of each number: it nears, or is wider."""
    c = errors.columns
    away = middle - c.centres[column, depth]
    unit = away / max(float(np.hypot(*away)), 1e-9)
    out = np.zeros(errors.size)
    out[: errors.shared] = unit @ c.shared.at([column])[0, depth]
    out[errors.own_slice(column)] = unit @ c.own.at([column])[0, depth]
    add_radius(errors, out, column, depth, 1.0)
    return out


def _depth_in(columns: Columns, column: int, depth: int, point: Array) -> float:
    """Depth (m) of a point inside a column; negative outside."""
    away = point - columns.centres[column, depth]
    return float(columns.radii[column, depth] - np.hypot(away[0], away[1]))


def _barycentric(point: Array, three: Array) -> Array:
    """Weights (n, 3) of points (n, 2) in triangles (n, 3, 2); nan in flat ones."""
    u, v, w = three[:, 1] - three[:, 0], three[:, 2] - three[:, 0], point - three[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        det = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        second = (w[:, 0] * v[:, 1] - w[:, 1] * v[:, 0]) / det
        third = (u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0]) / det
    return np.stack([1.0 - second - third, second, third], axis=-1)


def near_triple(columns: Columns, triple: npt.NDArray[np.intp]) -> list[int]:
    """Columns beside three that may cover the point between them."""
    apart = np.hypot(*np.moveaxis(columns.designs - columns.designs[triple].mean(axis=0), -1, 0))
    reach = 2.0 * float(np.max(columns.radii)) + float(np.max(apart[triple]))
    return [k for k in np.flatnonzero(apart < reach).tolist() if k not in triple.tolist()]


def void_open(
    centres: Array, radii: Array, triple: Sequence[int] | Indices, near: Sequence[int] | Indices
) -> npt.NDArray[np.bool_]:
    """Whether the plane is open between three columns: (n, depths).

    Of centres (columns, n, depths, 2) and radii (columns, n, depths), m.
    """
    from groundstation.survey.wall.kernels.void_openings import (
        mark_open,  # the compiler is loaded where there is a grid
    )

    found = np.zeros(radii.shape[1:], bool)
    mark_open(centres, radii, np.asarray(triple, np.intp), np.asarray(near, np.intp), found)
    return found
