"""How well each hypothesis explains what the looks leave, all at once.

What the looks leave, weighed, has the covariance P = W - W A Q A^T W. A hypothesis with the columns H has the score
t = H^T W v and the information N = H^T P H that is free to tell it; T = t^T N^-1 t is chi-square of its q columns in
an honest hole, and the blunder that fits best is N^-1 t. Source: Baarda 1968; Kok, NOAA Report NOS 92 (1984).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.hypotheses import OF_BEFORE, WIDTHS, Hypothesis, effects_of
from groundstation.survey.adjustment.kernels.path_elimination import reduce_right
from groundstation.survey.adjustment.looks import Looks
from groundstation.survey.adjustment.run_of_stops import RunOfStops

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
UNTOLD = 1e-6  # part of its information that must be free, or a hypothesis cannot be told from what is unknown anyway
MOST_AT_ONCE = 2_000_000  # numbers of columns held at once
LEAST_SCALE = 0.05


@dataclass(frozen=True, slots=True)
class Score:
    """How well hypotheses of one width explain what is left.

    Parameters
    ----------
    hypotheses : (h,)
    sizes : (h, q), the blunders that fit best
    free : (h, q, q), information N that tells them
    told : (h,) how many of the q columns can be told at all
    squares : (h,) T
    """

    hypotheses: tuple[Hypothesis, ...]
    sizes: Array
    free: Array
    told: Places
    squares: Array


def score_hypotheses(found: Adjusted, run: RunOfStops, hypotheses: Iterable[Hypothesis]) -> list[Score]:
    """Score hypotheses, those of one width together."""
    by_width = sorted(hypotheses, key=lambda one: WIDTHS[one.kind])
    scores = []
    for width, same in itertools.groupby(by_width, key=lambda one: WIDTHS[one.kind]):
        every = max(1, MOST_AT_ONCE // (9 * width * max(1, len(found.looks))))
        one_width = list(same)
        scores += [_score_part(found, run, one_width[at : at + every]) for at in range(0, len(one_width), every)]
    return scores


def _score_part(found: Adjusted, run: RunOfStops, part: Sequence[Hypothesis]) -> Score:
    rows, columns = columns_together(found, run, part)
    pulled = np.einsum("kab,kb->ka", found.linear.weights[rows], found.left[rows])
    scores = np.einsum("kahq,ka->hq", columns, pulled)
    whole, free = free_information(found, rows, columns)
    return Score(tuple(part), *best_sizes(scores, whole, free))


def columns_together(found: Adjusted, run: RunOfStops, part: Sequence[Hypothesis]) -> tuple[Places, Array]:
    """Looks (r,) that hypotheses of one width q change, and the change (r, 3, h, q) of their force by each."""
    late = rows_since(found.looks, part)
    looks, linear = found.looks.part(late), replace(found.linear, jacobians=found.linear.jacobians[late])
    columns = np.zeros((len(late), 3, len(part), WIDTHS[part[0].kind]))
    by_kind: dict[BlunderKind, list[int]] = {}
    for place, one in enumerate(part):
        by_kind.setdefault(one.kind, []).append(place)
    for places in by_kind.values():
        columns[:, :, places] = effects_of([part[place] for place in places], looks, run, found.now, linear)
    touched = columns.any(axis=(1, 2, 3))
    return late[touched], columns[touched]


def rows_since(looks: Looks, part: Sequence[Hypothesis]) -> Places:
    """Looks that hypotheses may change: those since the first of them begins, where none is of what was before."""
    if any(one.kind in OF_BEFORE for one in part):
        return np.arange(len(looks))
    return np.flatnonzero(looks.stop >= min(one.stop for one in part))


def free_information(found: Adjusted, rows: Places, columns: Array) -> tuple[Array, Array]:
    """Information H^T W H and the part H^T P H of it that is free, both (h, q, q), of columns (r, 3, h, q) of looks."""
    count, width = columns.shape[2:]
    flat = columns.reshape(len(rows), 3, count * width)
    weighed = found.linear.weights[rows] @ flat
    whole = np.einsum("kahq,kahr->hqr", columns, weighed.reshape(columns.shape))
    of_path, in_common = whitened_effects(found, rows, weighed)
    taken = np.zeros_like(whole)
    for part in (of_path, in_common):
        by_one = part.reshape(-1, count, width)
        taken += np.einsum("dhq,dhr->hqr", by_one, by_one)
    return whole, whole - taken


def whitened_effects(found: Adjusted, rows: Places, weighed: Array) -> tuple[Array, Array]:
    """Columns z, (4 s + 4, r) and (p, r), of weighed columns W H (k, 3, r): H^T W A Q A^T W H = z^T z."""
    diagonal, tied, coupled = found.solution.diagonal, found.solution.tied, found.solution.coupled
    of_path, in_common = pulled_unknowns(found, rows, weighed)
    right = np.zeros((len(diagonal), 4, weighed.shape[2]))
    right[:, :2] = of_path
    reduce_right(diagonal, tied, right)
    flat = right.reshape(-1, right.shape[2])
    left = in_common - coupled.reshape(len(flat), -1).T @ flat
    return flat, np.asarray(found.common_root.T @ left)


def pulled_unknowns(found: Adjusted, rows: Places, weighed: Array) -> tuple[Array, Array]:
    """A^T W H of weighed columns (k, 3, r): for directions (s + 1, 2, r) and what is in common (p, r)."""
    looks, width = found.looks, weighed.shape[2]
    pulled = np.swapaxes(found.linear.jacobians[rows], 1, 2) @ weighed
    of_path = sums_by(looks.station[rows], pulled[:, :2], len(found.path.md))
    tubes = sums_by(looks.tube[rows], pulled[:, 2:8], found.string.count)
    make_ups = sums_by(looks.make_up[rows], pulled[:, 7], len(found.now.make_ups))
    further = np.einsum("kae,kar->er", found.extra.columns[rows], weighed)
    return of_path, np.concatenate([tubes.reshape(-1, width), pulled[:, 8].sum(axis=0)[None], make_ups, further])


def sums_by(places: Places, parts: Array, count: int) -> Array:
    """Sums (count, ...) of parts (k, ...) at each of their places (k,)."""
    sums = np.zeros((count, *parts.shape[1:]))
    if len(places):
        order = np.argsort(places, kind="stable")
        different, starts = np.unique(places[order], return_index=True)
        sums[different] = np.add.reduceat(parts[order], starts, axis=0)
    return sums


def best_sizes(scores: Array, whole: Array, free: Array) -> tuple[Array, Array, Places, Array]:
    """Sizes that fit best, free information, columns that can be told, and T; what cannot be told counts nothing."""
    scale = np.sqrt(np.maximum(np.einsum("hqq->hq", whole), 1e-300))
    scaled = free / (scale[:, :, None] * scale[:, None, :])
    values, vectors = np.linalg.eigh(0.5 * (scaled + np.swapaxes(scaled, 1, 2)))
    is_told = values > UNTOLD
    along = np.einsum("hqe,hq->he", vectors, scores / scale)
    solved = np.where(is_told, along / np.where(is_told, values, 1.0), 0.0)
    sizes = np.einsum("hqe,he->hq", vectors, solved) / scale
    return sizes, free, is_told.sum(axis=1), np.einsum("he,he->h", solved, along)


def log_chances(squares: Array, told: Places, left: float, redundancy: float) -> Array:
    """Natural logarithm (h,) of the chance that an honest hole shows as much.

    It is that of F with the variance that is left without the blunder, for the variance of the looks is estimated.

    Parameters
    ----------
    squares, told : (h,), T and its degrees of freedom
    left, redundancy : weighted squares of what the looks leave, and what they are to be
    """
    free = np.maximum(redundancy - told, 1.0)
    scale = np.maximum((left - squares) / free, LEAST_SCALE)
    return log_tail(squares / scale, told, free)


def log_tail(squares: Array, told: Places, free: Array) -> Array:
    """Logarithm (h,) of the chance that F(told, free), times ``told``, exceeds ``squares``; 0 where none is told."""
    from scipy.special import betainc, betaln

    half, other = 0.5 * free, 0.5 * np.maximum(told, 1)
    squares = np.maximum(squares, 1e-12)
    within, beyond = free / (free + squares), squares / (free + squares)
    chance = betainc(half, other, within)
    leading = half * np.log(within) + (other - 1.0) * np.log(beyond) - np.log(half) - betaln(half, other)
    found = np.where(chance > 1e-280, np.log(np.maximum(chance, 1e-300)), leading)
    return np.asarray(np.where(told > 0, np.minimum(found, 0.0), 0.0))
