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
from groundstation.survey.adjustment.scores import MOST_AT_ONCE, UNTOLD, columns_together, free_information
from groundstation.survey.adjustment.toe_weights import moved_looks

Array = npt.NDArray[np.float64]
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
    moved = moved_by_functional(found, weights)
    told: dict[Hypothesis, Reliability] = {}
    for width, same in itertools.groupby(sorted(hypotheses, key=_width_of), key=_width_of):
        needed = least_noncentrality(width, chance, power)
        part = list(dict.fromkeys(same))
        every = max(1, MOST_AT_ONCE // (9 * width * max(1, len(found.looks))))
        for at in range(0, len(part), every):
            some = part[at : at + every]
            told |= zip(some, _of_alike(found, run, some, moved, sizes, needed), strict=True)
    return [told[one] for one in hypotheses]


def _width_of(one: Hypothesis) -> int:
    return WIDTHS[one.kind]


def moved_by_functional(found: Adjusted, weights: Array) -> Array:
    """W A Q w (n, 3, r): how much a unit of force in each look moves each functional."""
    states, common = found.cofactor(weights, np.zeros((len(found.common_cov), weights.shape[2])))
    return np.asarray(found.linear.weights @ moved_looks(found, states, common))


def _of_alike(
    found: Adjusted,
    run: RunOfStops,
    part: Sequence[Hypothesis],
    moved: Array,
    sizes: Mapping[BlunderKind, float],
    needed: float,
) -> Iterator[Reliability]:
    """Reliability of blunders of one width q, which are found from a non-centrality on."""
    rows, columns = columns_together(found, run, part)
    whole, free = free_information(found, rows, columns)
    flat = columns.reshape(3 * len(rows), -1)
    effects = (flat.T @ moved[rows].reshape(len(flat), -1)).reshape(*columns.shape[2:], -1)
    for one, effect, its_whole, its_free in zip(part, effects, whole, free, strict=True):
        yield _of_one(one, effect, its_whole, its_free, sizes, needed)


def _of_one(
    one: Hypothesis, effect: Array, whole: Array, free: Array, sizes: Mapping[BlunderKind, float], needed: float
) -> Reliability:
    """Reliability of a blunder by what one unit of it does to each functional (q, r), and its information (q, q)."""
    size = 1.0 if one.kind in KNOWN_SIZE else sizes.get(one.kind, np.inf)
    by_size = np.linalg.norm(effect, axis=0)
    by_size = np.where(by_size > 0.0, by_size * size, 0.0) if np.isfinite(size) else np.full(len(by_size), np.inf)
    values, vectors = np.linalg.eigh(free)
    if values[0] <= UNTOLD * max(float(np.trace(whole)), 1e-300):
        return Reliability(one, np.inf, np.full(effect.shape[1], np.inf), by_size)
    at_toe = np.sqrt(needed * np.sum((vectors.T @ effect) ** 2 / values[:, None], axis=0))
    return Reliability(one, float(np.sqrt(needed / values[0])), at_toe, by_size)
