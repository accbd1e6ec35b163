"""Of what the variances of all positions along a hole are made, by what its looks have in common.

For each position it is what ``error_budget`` says of that functional. All of them together follow one another down the
hole: what a position has in common with others is a running sum, and what is its own follows a Markov chain.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.budget import ErrorShare, ShareSource, shares_of_string
from groundstation.survey.adjustment.equations import known_collar, leg_steps
from groundstation.survey.adjustment.kernels.path_elimination import reduce_right, substitute_path
from groundstation.survey.adjustment.kernels.path_legs import weigh_legs
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
    by_common = _summed(found, found.by_common, halves, wholes)  # (s + 1, 3, p), of positions
    flat = by_common.reshape(-1, by_common.shape[2])
    common = flat @ found.common_cov
    collar, path = _of_path(found, flat, common, halves, wholes)
    of_path = [ErrorShare(ShareSource.COLLAR, -1, collar), ErrorShare(ShareSource.PATH, -1, path)]
    shares = [*shares_of_string(found, common.T, causes), *of_path]
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
    return np.asarray(passed + (halves - wholes)[:, None, None] * turned)


def _of_path(found: Adjusted, by_common: Array, common: Array, halves: Array, wholes: Array) -> tuple[Array, Array]:
    """Shares (3 s + 3,) of the direction at the collar and of the curvature that wanders.

    A position has the states x = a + B f, with B the change of states with what is in common and f (3 s + 3, p) what
    it has in common; with the information P of the path alone x^T P x = a^T P a + 2 f^T B^T P a + f^T B^T P B f.
    """
    solution, count = found.solution, len(found.path.md)
    own = np.empty((count, 2, 3))
    position_sums(solution.diagonal, solution.tied, solution.at_station, found.bases, halves, wholes, own)
    both, squares = _path_weighed(found)
    _solve_chain(found, both)
    crossed = _summed(found, both, halves, wholes).reshape(by_common.shape)  # a^T P B, for S a is the position
    whole = own[:, 1].reshape(-1) + np.sum(common * (2.0 * crossed + times_lower(common, as_triangle(squares))), axis=1)
    collar = _of_collar(found, common, halves, wholes)
    return collar, whole - collar


def _path_weighed(found: Adjusted) -> tuple[Array, Array]:
    """P B (s + 1, 4, p) and B^T P B (p, p), of the information P of the path alone.

    B is the change of the states with what is in common, and P the sum of the squares of what the collar and each leg
    depart by: as squares it takes half of the work of a product.
    """
    by_common, now = found.by_common, found.now
    weighed, departs = np.zeros((2, *by_common.shape))
    root = np.linalg.cholesky(known_collar(found.path, found.bases))
    departs[0, :2] = root.T @ by_common[0, :2]
    departs[0, 2:] = by_common[0, 2:] / math.sqrt(now.curvature_var)
    weighed[0, :2], weighed[0, 2:] = root @ departs[0, :2], by_common[0, 2:] / now.curvature_var
    if len(by_common) > 1:
        go, rigid = leg_steps(found.path)
        roots = np.asarray(np.linalg.cholesky(rigid / now.leg_vars[:, None, None]))
        weigh_legs(go, roots, by_common, departs, weighed)
    flat = departs.reshape(-1, by_common.shape[2])
    return weighed, flat.T @ flat


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
