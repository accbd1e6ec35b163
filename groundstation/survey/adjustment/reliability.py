"""The smallest blunder that would be found, and what one that is not found does at the toe.

With the information N that is free to tell a blunder, one of the size v has the non-centrality v^T N v; a test of a
given chance of a false alarm finds it with a given power from a certain non-centrality on (17.1 for 1 in 1000 and 80 %,
one degree of freedom). Where nothing is free, nothing is found, and what may be wrong counts by the size that a sensor
of this kind may step by. Source: Baarda 1968, internal and external reliability; Teunissen, "Minimal detectable biases
of GPS data", Journal of Geodesy 72 (1998), for several degrees of freedom.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.hypotheses import KNOWN_SIZE, WIDTHS, Hypothesis
from groundstation.survey.adjustment.run_of_stops import RunOfStops
from groundstation.survey.adjustment.scores import MOST_AT_ONCE, UNTOLD, columns_together, free_information, rows_since
from groundstation.survey.adjustment.toe_weights import moved_looks

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
FOUND_WITH, FALSE_ALARM_OF_ONE = 0.8, 1e-3


@dataclass(frozen=True, slots=True)
class Reliability:
    """How well one blunder would be found.

    Parameters
    ----------
    hypothesis : the blunder
    smallest : least size found, m/s^2 (a second, of a creep), rad or m, in the direction in which it shows least; of
        what has a known size how many times that would have to be; inf where nothing can tell
    at_toe : (r,) what an unfound one does at most to each functional, m for the toe; inf where nothing can tell
    by_size : (r,) what one of the size that was given for its kind does at most, found or not; inf where none was
    """

    hypothesis: Hypothesis
    smallest: float
    at_toe: Array
    by_size: Array

    @property
    def unfound(self) -> Array:
        """What to reckon with (r,): an unfound blunder at its worst, yet none larger than its kind may be."""
        return np.minimum(self.at_toe, self.by_size)


def least_noncentrality(width: int, chance: float = FALSE_ALARM_OF_ONE, power: float = FOUND_WITH) -> float:
    """Non-centrality of a chi-square of some degrees of freedom from which on a test finds with a power."""
    from scipy.special import chdtri, chndtrinc

    return float(chndtrinc(chdtri(width, chance), width, 1.0 - power))


def measure_reliability(
    found: Adjusted,
    run: RunOfStops,
    hypotheses: Sequence[Hypothesis],
    weights: Array,
    sizes: Mapping[BlunderKind, float],
    chance: float = FALSE_ALARM_OF_ONE,
    power: float = FOUND_WITH,
) -> list[Reliability]:
    """Reliability of blunders.

    Parameters
    ----------
    found, run : the hole, adjusted
    hypotheses : the blunders
    weights : (s + 1, 2, r), functionals of the directions, such as ``toe_weights``
    sizes : size that a blunder of a kind may have, for where it would not be found
    chance, power : of a false alarm of one test; of finding. ``chance_of_one`` of ``blunders`` is that of a whole hole
    """
    spread = found.spread_of(weights)
    told: dict[Hypothesis, Reliability] = {}
    for width, same in itertools.groupby(sorted(hypotheses, key=_width_of), key=_width_of):
        needed = least_noncentrality(width, chance, power)
        part = list(dict.fromkeys(same))
        every = max(1, MOST_AT_ONCE // (9 * width * max(1, len(rows_since(found.looks, part)))))
        for at in range(0, len(part), every):
            some = part[at : at + every]
            told |= zip(some, _of_alike(found, run, some, spread, sizes, needed), strict=True)
    return [told[one] for one in hypotheses]


def _width_of(one: Hypothesis) -> int:
    return WIDTHS[one.kind]


def _of_alike(
    found: Adjusted,
    run: RunOfStops,
    part: Sequence[Hypothesis],
    spread: tuple[Array, Array],
    sizes: Mapping[BlunderKind, float],
    needed: float,
) -> Iterator[Reliability]:
    """Reliability of blunders of one width q, which are found from a non-centrality on.

    Parameters
    ----------
    spread : Q w, covariance of the functionals with the states (s + 1, 4, r) and what is in common (p, r)
    """
    rows, columns = columns_together(found, run, part)
    whole, free = _information(found, rows, columns)
    moved = found.linear.weights[rows] @ moved_looks(found, *spread, rows)  # W A Q w (k, 3, r)
    effects = np.tensordot(columns, moved, axes=((0, 1), (0, 1)))
    values, vectors = np.linalg.eigh(free)
    is_told = values[:, 0] > UNTOLD * np.maximum(np.einsum("hqq->h", whole), 1e-300)
    safe = np.where(is_told[:, None], values, 1.0)
    at_toe = np.sqrt(needed * np.sum((np.swapaxes(vectors, 1, 2) @ effects) ** 2 / safe[:, :, None], axis=1))
    at_toe, smallest = (
        np.where(is_told[:, None], at_toe, np.inf),
        np.where(is_told, np.sqrt(needed / safe[:, 0]), np.inf),
    )
    by_size = _by_size(part, np.linalg.norm(effects, axis=1), sizes)
    yield from map(Reliability, part, smallest.tolist(), at_toe, by_size)


def _by_size(part: Sequence[Hypothesis], by_one: Array, sizes: Mapping[BlunderKind, float]) -> Array:
    """What blunders of the size of their kind do to each functional (h, r), by what one unit of each does."""
    known = {kind: 1.0 if kind in KNOWN_SIZE else sizes.get(kind, np.inf) for kind in {one.kind for one in part}}
    size = np.array([known[one.kind] for one in part])[:, None]
    some = np.where(by_one > 0.0, by_one, 0.0) * np.where(np.isfinite(size), size, 1.0)
    return np.where(np.isfinite(size), some, np.inf)


def _information(found: Adjusted, rows: Places, columns: Array) -> tuple[Array, Array]:
    """Information and the part that is free, as of ``free_information``; that of a single look is told by that look."""
    is_in = np.asarray(columns.any(axis=(1, 3)))  # (r, h)
    alone = np.flatnonzero(is_in.sum(axis=0) == 1)
    others = np.setdiff1d(np.arange(columns.shape[2]), alone)
    whole, free = np.zeros((2, columns.shape[2], columns.shape[3], columns.shape[3]))
    if len(alone):
        look = is_in[:, alone].argmax(axis=0)
        effect = columns[look, :, alone]
        back = np.swapaxes(effect, 1, 2)
        whole[alone] = back @ found.linear.weights[rows[look]] @ effect
        seen, place = np.unique(rows[look], return_inverse=True)  # with many widths the same
        free[alone] = back @ found.free_parts(seen)[place] @ effect
    if len(others):
        touched = is_in[:, others].any(axis=1)
        whole[others], free[others] = free_information(found, rows[touched], columns[touched][:, :, others])
    return whole, free
