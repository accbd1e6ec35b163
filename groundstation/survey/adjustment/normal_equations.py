"""The normal equations of all looks at a hole, where its unknowns stand, and their solution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Linearised
from groundstation.survey.adjustment.equations import Equations
from groundstation.survey.adjustment.kernels.observations import (
    add_looks,
    add_right_sides,
    linearise_looks,
    mirror_upper,
    weigh_down,
)
from groundstation.survey.adjustment.kernels.path_elimination import (
    eliminate_path,
    reduce_right,
    substitute_path,
)
from groundstation.survey.adjustment.kernels.sparse_products import add_squares
from groundstation.survey.adjustment.linear_solution import InCommon, LinearSolution
from groundstation.survey.adjustment.looks import OF_TUBE, TURN, FurtherEffects, Looks, StartingPoint

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
MANY = 1500  # looks, from which on later steps go by the equations of the first, whose right sides alone are made anew
WIDE = 150  # unknowns in common, from which on it is worth to leave out columns of tubes that are zero
TOGETHER = 64  # stations whose squares are summed at once
SPARSE = 8  # times as many places as numbers, from which on what is zero is left out of products
TILTS = slice(5, 7)  # of the unknowns of a look
GROSS = 16.27  # chi-square of three beyond which a look counts less: one in a thousand


def are_many(looks: Looks) -> bool:
    """Whether looks are so many that an adjustment begins where one of some of them ended, and makes equations once."""
    return len(looks) >= MANY


def kept_sparse(coupled: Array, size: int) -> Array | None:
    """Copy (s + 1, 2, p) of what couples directions and what they have in common; None where little of it is zero.

    Parameters
    ----------
    coupled : (s + 1, 4, p + 1), before the path is taken out
    size : p
    """
    of_directions = coupled[:, :2, :size]
    if size < WIDE or SPARSE * np.count_nonzero(of_directions) > of_directions.size:
        return None
    return of_directions.copy()


def linearise_all(looks: Looks, now: StartingPoint, bases: Array, extra: FurtherEffects) -> Linearised:
    """Linearise all looks where the unknowns stand; a look that is far off counts less."""
    count = len(looks)
    jacobians, weights = np.empty((count, 3, 9)), np.empty((count, 3, 3))
    residuals, yaw_errors, squares = np.empty((count, 3)), np.empty(count), np.empty(count)
    linearise_looks(
        looks.station, looks.tube, looks.make_up, looks.force, looks.force_var, looks.yaw, looks.yaw_var,
        now.tangents, bases, now.tubes, now.make_ups, now.gravity, now.play_var, jacobians, weights, residuals,
        yaw_errors,
    )  # fmt: skip
    if len(now.extra):
        residuals -= extra.columns @ now.extra
    weigh_down(residuals, GROSS, weights, squares)
    places = np.arange(now.tubes.size).reshape(-1, OF_TUBE)
    return Linearised(bases, jacobians, weights, residuals, squares, jacobians[:, :, TILTS], places, now.tubes.size)


def solve_equations(
    looks: Looks,
    linear: Linearised,
    of_path: tuple[Array, Array, Array],
    known: Array,
    departure: Array,
    extra: FurtherEffects,
) -> LinearSolution:
    """Solve the normal equations of linearised looks."""
    equations = gather_equations(looks, linear, of_path, known, departure, extra)
    diagonal, tied, coupled, in_common = equations.diagonal, equations.tied, equations.coupled, equations.in_common
    size, own = len(known), coupled[:, :, -1]
    sparse = kept_sparse(coupled, size)
    whole, by_common = in_common[:size, :size].copy(), None
    if size < WIDE:
        eliminate_path(diagonal, tied, coupled, *whole_columns(coupled))
        wide = coupled.reshape(-1, coupled.shape[2])
        in_common -= wide.T @ wide
    else:
        ends = tube_columns(looks, len(diagonal), linear.places)
        eliminate_path(diagonal, tied, coupled, ends, linear.gravity_at)
        if sparse is None:
            take_squares(coupled, ends, linear.gravity_at, in_common)
        else:
            by_common = take_sparse_squares(sparse, diagonal, tied, coupled, in_common)
    left = InCommon(in_common[:size, :size], in_common[:size, size])
    states = (own - coupled[:, :, :size] @ left.step)[:, :, None].copy()
    substitute_path(diagonal, tied, states)
    gain = float(np.sum(own * own))
    return LinearSolution(
        diagonal, tied, coupled[:, :, :size], left, states[:, :, 0], gain, equations.at_station, whole, sparse,
        by_common,
    )  # fmt: skip


def whole_columns(coupled: Array) -> tuple[Places, int]:
    """All columns of what is coupled (s + 1, 4, r), as ``eliminate_path`` takes them: none of them is zero."""
    width = coupled.shape[2]
    return np.full(len(coupled), width), width


def tube_columns(looks: Looks, count: int, places: Places) -> Places:
    """Columns (count,) of tubes from each on are zero at each station and below: no such tube has come there.

    Parameters
    ----------
    places : (m, 6), columns of every tube
    """
    tubes = int(looks.tube.max(initial=-1)) + 1
    is_there = np.zeros((count, tubes + 1), bool)  # from the highest tube down, and none
    is_there[:, tubes] = is_there[looks.station, tubes - 1 - looks.tube] = True
    highest = tubes - 1 - is_there.argmax(axis=1)
    ends = np.append(places[:, TURN] + 1, 0)  # of none
    return np.asarray(ends[np.maximum.accumulate(highest[::-1])[::-1]], np.intp)


def take_squares(coupled: Array, ends: Places, tail: int, in_common: Array) -> None:
    """Take C^T C, of what is coupled (s + 1, 4, r), from ``in_common`` (r, r), without the columns that are zero.

    Parameters
    ----------
    ends, tail : see ``eliminate_path``
    """
    for begin in range(0, len(coupled), TOGETHER):
        some, end = coupled[begin : begin + TOGETHER], int(ends[begin])
        kept = np.concatenate([some[:, :, :end], some[:, :, tail:]], axis=2)
        flat = kept.reshape(-1, kept.shape[2])
        squares = flat.T @ flat
        in_common[:end, :end] -= squares[:end, :end]
        in_common[:end, tail:] -= squares[:end, end:]
        in_common[tail:, :end] -= squares[end:, :end]
        in_common[tail:, tail:] -= squares[end:, end:]


def take_sparse_squares(sparse: Array, diagonal: Array, tied: Array, coupled: Array, in_common: Array) -> Array:
    """Take C^T S^-1 C, of a C that is mostly zero, and its right side from ``in_common`` (p + 1, p + 1).

    Returns -S^-1 C (s + 1, 4, p), by which it goes.

    Parameters
    ----------
    sparse : C (s + 1, 2, p)
    diagonal, tied, coupled : as ``eliminate_path`` leaves them
    """
    size, flat = sparse.shape[2], coupled.reshape(-1, coupled.shape[2])
    by_common = -coupled[:, :, :size]
    substitute_path(diagonal, tied, by_common)
    add_squares(sparse, by_common, in_common)
    mirror_upper(in_common, size)
    in_common[:size, size] -= flat[:, :size].T @ flat[:, size]
    return by_common


def solve_again(
    known: LinearSolution, looks: Looks, linear: Linearised, of_path: Array, of_string: Array, extra: FurtherEffects
) -> LinearSolution:
    """Solve the equations of an earlier step, with right sides as the unknowns stand now.

    A step by them leads to the same place as one by equations that are made anew, for there the right sides vanish.
    Source: the simplified Newton method, Deuflhard, "Newton Methods for Nonlinear Problems", Springer (2004), 2.1.

    Parameters
    ----------
    known : from ``solve_equations``, or from here
    of_path, of_string : (s + 1, 4) and (p,), right sides of what is known before; the looks are added
    """
    right, of_common = of_path.copy(), of_string.copy()
    add_right_sides(
        looks.station, looks.tube, looks.make_up, linear.jacobians, linear.weights, linear.residuals, extra.columns,
        linear.gravity_at, right, of_common,
    )  # fmt: skip
    own = right[:, :, None]
    reduce_right(known.diagonal, known.tied, own)
    flat = known.coupled.reshape(-1, len(of_common))
    left = known.in_common.with_right(of_common - flat.T @ right.ravel())
    states = (right - known.coupled @ left.step)[:, :, None].copy()
    substitute_path(known.diagonal, known.tied, states)
    return replace(known, in_common=left, states=states[:, :, 0], of_path=float(np.sum(right * right)))


def gather_equations(
    looks: Looks,
    linear: Linearised,
    of_path: tuple[Array, Array, Array],
    known: Array,
    departure: Array,
    extra: FurtherEffects,
) -> Equations:
    """Normal equations of looks and priors."""
    diagonal, tied, right = of_path
    size, count = len(known), len(diagonal)
    coupled, in_common = np.zeros((count, 4, size + 1)), np.zeros((size + 1, size + 1))
    in_common[:size, :size] = known
    in_common[:size, size] = -known @ departure
    at_station = np.zeros((count, 2, 2))
    add_looks(
        looks.station, looks.tube, looks.make_up, linear.jacobians, linear.weights, linear.residuals, extra.columns,
        linear.places, linear.gravity_at, at_station, coupled, in_common,
    )  # fmt: skip
    diagonal[:, :2, :2] += at_station
    coupled[:, :, size] += right
    return Equations(diagonal, tied, coupled, in_common, at_station)
