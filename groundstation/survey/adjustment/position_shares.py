"""Of what the variances of all positions along a hole are made, by what its looks have in common.

For each position it is what ``error_budget`` says of that functional. All of them together follow one another down the
hole: what a position has in common with others is a running sum, and what is its own follows a Markov chain.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.budget import ErrorShare, ShareSource, shares_of_string
from groundstation.survey.adjustment.equations import known_collar
from groundstation.survey.adjustment.kernels.path_elimination import reduce_right, substitute_path
from groundstation.survey.adjustment.kernels.position_sums import position_sums
from groundstation.survey.adjustment.run_of_stops import TurnCauses

Array = npt.NDArray[np.float64]


def position_shares(found: Adjusted, causes: TurnCauses) -> list[ErrorShare]:
    """Shares of the variances (s + 1, 3) of collar and stations to north, east and down, m^2, but for those of looks.

    Every leg goes along the mean of the directions at its ends, as of ``toe_weights``.

    Parameters
    ----------
    found : the adjusted hole
    causes : of the turns of tubes
    """
    halves, wholes = leg_halves(found.path.md)
    rooted = _summed(found, found.direction_columns, halves, wholes)  # (s + 1, 3, p), of positions
    common = found.solution.in_common.times_root_transposed(rooted.reshape(-1, rooted.shape[2]))
    collar, path = _of_path(found, common, halves, wholes)
    of_path = [ErrorShare(ShareSource.COLLAR, -1, collar), ErrorShare(ShareSource.PATH, -1, path)]
    unknowns = np.ascontiguousarray(common.T)  # of which sums are made row by row
    shares = [*shares_of_string(found, unknowns, causes), *of_path]
    return [ErrorShare(one.source, one.subject, one.variances.reshape(-1, 3)) for one in shares]


def leg_halves(md: Array) -> tuple[Array, Array]:
    """Half of the leg above each of the depths (s + 1,), and half of both legs there, m; the last has one leg."""
    halves = 0.5 * np.diff(md, prepend=md[0])
    return halves, halves + np.append(halves[1:], 0.0)


def _summed(found: Adjusted, by_state: Array, halves: Array, wholes: Array) -> Array:
    """Change (s + 1, 3, r) of every position for changes (s + 1, 4, r) of the states."""
    turned = np.swapaxes(found.bases, 1, 2) @ by_state[:, :2]
    passed = wholes[:, None, None] * turned
    for place in range(1, len(passed)):  # row by row a sum takes a third of its time
        passed[place] += passed[place - 1]
    turned *= (halves - wholes)[:, None, None]  # megabytes, in the place of others
    passed += turned
    return np.asarray(passed)


def _of_path(found: Adjusted, common: Array, halves: Array, wholes: Array) -> tuple[Array, Array]:
    """Shares (3 s + 3,) of the direction at the collar and of the curvature that wanders.

    A position w has the states x = a + B f, with S a = w, B the change of states with what is in common and f
    (3 s + 3, p) what it has in common. Of the chain S = P + N, P is what is known of path and collar and N what looks
    tell: x^T P x = a^T P a + 2 f^T (B - S^-1 N B)^T w + f^T (B^T S B - B^T N B) f. B^T S B is what the path, taken out,
    took of the information in common.
    """
    solution, count = found.solution, len(found.path.md)
    own = np.empty((count, 2, 3))
    position_sums(solution.diagonal, solution.tied, solution.at_station, found.bases, halves, wholes, own)
    crossed = found.by_common.copy()
    seen, squares = _seen_by_looks(found)
    _solve_chain(found, seen)
    crossed -= seen
    summed = _summed(found, crossed, halves, wholes).reshape(common.shape)
    triangle = as_triangle(solution.whole - solution.in_common.information - squares)
    whole = own[:, 1].reshape(-1) + np.sum(common * (2.0 * summed + times_lower(common, triangle)), axis=1)
    collar = _of_collar(found, common, halves, wholes)
    return collar, whole - collar


def _seen_by_looks(found: Adjusted) -> tuple[Array, Array]:
    """N B (s + 1, 4, p) and B^T N B (p, p), of the information N of the looks on directions.

    As squares of a root of N the latter takes half of the work of a product.
    """
    by_direction, at_station = found.by_common[:, :2], found.solution.at_station
    root = np.zeros_like(at_station)  # lower; of a place without looks it is zero
    root[:, 0, 0] = np.sqrt(at_station[:, 0, 0])
    root[:, 1, 0] = at_station[:, 1, 0] / np.where(root[:, 0, 0] > 0.0, root[:, 0, 0], 1.0)
    root[:, 1, 1] = np.sqrt(np.maximum(at_station[:, 1, 1] - root[:, 1, 0] ** 2, 0.0))
    rooted = np.swapaxes(root, 1, 2) @ by_direction
    seen = np.zeros_like(found.by_common)
    seen[:, :2] = root @ rooted
    flat = rooted.reshape(-1, rooted.shape[2])
    return seen, flat.T @ flat


def as_triangle(symmetric: Array) -> Array:
    """Lower triangular matrix T with x^T T x = x^T S x for every x, of a symmetric S (p, p)."""
    return np.asarray(np.tril(symmetric) + np.tril(symmetric, -1))


def times_lower(rows: Array, lower: Array) -> Array:
    """Rows (r, p) times a lower triangular matrix (p, p)."""
    from scipy.linalg import blas

    return np.asarray(blas.dtrmm(1.0, lower.T, rows.T).T)  # as the library lays out its matrices


def _of_collar(found: Adjusted, common: Array, halves: Array, wholes: Array) -> Array:
    """Share (3 s + 3,) of the direction at the collar."""
    at_collar = np.zeros((len(found.path.md), 4, 2))
    at_collar[0, :2] = np.eye(2)
    _solve_chain(found, at_collar)
    states = _summed(found, at_collar, halves, wholes).reshape(-1, 2) + common @ found.by_common[0, :2].T
    return np.asarray(np.sum((states @ known_collar(found.path, found.bases)) * states, axis=1))


def _solve_chain(found: Adjusted, right: Array) -> None:
    """Put S^-1 R in the place of R (s + 1, 4, r)."""
    reduce_right(found.solution.diagonal, found.solution.tied, right)
    substitute_path(found.solution.diagonal, found.solution.tied, right)
