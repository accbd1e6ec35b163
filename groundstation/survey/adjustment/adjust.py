"""One adjustment of the whole hole: every look at every station, by least squares on the sphere.

The unknowns are the direction and the curvature of the hole at collar and stations, and for each tube the bias of its
accelerometer, the tilt of its mount and the turn of its chain; gravity, and what blunders were found. All have priors.
How far a tube lies askew in the hole at each stop (play and bend) is learnt from what the looks leave, and so is how
sharply the hole bends.
Source: Gauss-Newton; variance components after Foerstner, "Ein Verfahren zur Schaetzung von Varianz- und
Kovarianzkomponenten", AVN 86 (1979).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted, Linearised
from groundstation.survey.adjustment.curvature_size import learnt_curvature
from groundstation.survey.adjustment.equations import (
    Equations,
    path_equations,
    string_departure,
    string_information,
)
from groundstation.survey.adjustment.kernels.observations import (
    add_looks,
    add_right_sides,
    linearise_looks,
    weigh_down,
)
from groundstation.survey.adjustment.kernels.path_elimination import (
    eliminate_few,
    eliminate_path,
    reduce_right,
    substitute_path,
)
from groundstation.survey.adjustment.linear_solution import InCommon, LinearSolution
from groundstation.survey.adjustment.looks import OF_TUBE, FurtherEffects, Looks, PathPrior, StartingPoint, StringPrior
from groundstation.survey.adjustment.play import PLAY_KNOWN_AS, faster_play, learnt_play
from groundstation.survey.adjustment.sphere import carried_bases, step_about_vertical
from groundstation.survey.adjustment.starting_point import first_start

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
Truths = npt.NDArray[np.bool_]
ITERATIONS = 12  # in which play and bends are learnt; they are left as they stand then
FURTHER = 8  # of the unknowns alone
SETTLED = 0.03  # standard deviations, of the last step; what is left then is some tenth of it
NEAR = 3.0  # standard deviations, of a step from which on the play is not that of unknowns still on their way
PLAY_SETTLED = 0.02  # of its variance
LEGS_SETTLED = 0.2  # of the logarithm of the variance of each leg
POOR_YAW = 0.05  # rad, standard deviation, from which on a direction goes about the vertical rather than straight
PART = 0.75  # of the way that variances of legs go at once
TURNED_BACK = 0.5  # of that, whenever they turn back by more than half of what they were to go
MANY = 1500  # looks, from which on later steps go by the equations of the first, whose right sides alone are made anew
TOGETHER = 64  # stations whose squares are summed at once
NEARER = 0.5  # of the step before it, up to which such a step leads on
GROSS = 16.27  # chi-square of three beyond which a look counts less: one in a thousand


class Swing:
    """Variances on their way to others, by their logarithms; most of the way, for a whole step goes too far."""

    def __init__(self) -> None:
        self._part, self._last = PART, np.zeros(1)

    def part_of_way(self, before: Array, after: Array) -> Array:
        """Variances to go on with; a part of the way that gets less whenever they turn back by nearly as much."""
        change = np.log(after / before)
        if np.sum(change * self._last) < -0.5 * np.sum(self._last**2):
            self._part *= TURNED_BACK
        self._last = change
        return np.asarray(before * (after / before) ** self._part)


def adjust_hole(
    looks: Looks,
    string: StringPrior,
    path: PathPrior,
    extra: FurtherEffects | None = None,
    start: StartingPoint | None = None,
    known: Array | None = None,
) -> Adjusted:
    """Adjust a hole.

    Parameters
    ----------
    looks : at its stations
    string, path : what was known before
    extra : further effects, such as blunders that were found
    start : where to begin; by default from the looks alone
    known : (p, p), of an adjustment of the same string before; by default it is worked out

    Raises
    ------
    numpy.linalg.LinAlgError
        When the equations have no solution, as where a prior is not a covariance.
    """
    extra = extra or FurtherEffects(np.zeros((len(looks), 3, 0)), np.zeros(0))
    now = start or first_start(looks, string, path)
    if len(now.extra) != len(extra.std):
        now = replace(now, extra=np.zeros(len(extra.std)))
    known, is_learnt = string_information(string, extra) if known is None else known, now.is_learnt
    is_settled = is_learnt  # where it begins: so what is known of each unknown beside the others is no matter
    turns = poor_yaws(looks, len(path.md))
    is_many, is_near, step = len(looks) >= MANY, False, math.inf  # near: the equations of before lead on
    solution: LinearSolution | None = None
    is_bent, tried, swing = is_learnt, list[tuple[float, float]](), Swing()
    for again in range(ITERATIONS + FURTHER):
        bases = carried_bases(now.tangents)
        linear = linearise_all(looks, now, bases, extra)
        departure = string_departure(string, now)
        if is_near and solution is not None:
            right_sides = path_equations(path, now, bases)[2]
            solution = solve_again(solution, looks, linear, right_sides, -known @ departure, extra)
        else:
            solution = solve_equations(looks, linear, path_equations(path, now, bases), known, departure, extra)
        before, step = step, solution.decrement if is_settled else solution.step
        if not np.isfinite(step):
            raise np.linalg.LinAlgError("expected a step of the unknowns, got numbers that are none")
        now = _stepped(now, bases, solution, turns)
        found = Adjusted(looks, string, path, extra, now, linear, solution, known)
        is_near = is_settled and is_many and step < NEARER * before
        if not is_learnt:
            play = learnt_play(found, string.play_std**2, PLAY_KNOWN_AS)
            if again and not is_bent:  # the first step was not along the sphere
                whole, legs = learnt_curvature(found)
                is_bent = bool(np.all(np.abs(np.log(legs / now.leg_vars)) <= LEGS_SETTLED))
            is_learnt = step < NEAR and abs(play - now.play_var) <= PLAY_SETTLED * now.play_var and is_bent
        is_learnt |= again >= ITERATIONS
        if is_learnt and step < SETTLED:
            break
        if not is_learnt:
            tried = [*tried, (now.play_var, play)] if step < NEAR else []
            now = replace(now, play_var=faster_play(tried) if tried else play)
        if again and not is_learnt and not is_bent:
            between = swing.part_of_way(np.append(now.leg_vars, now.curvature_var), np.append(legs, whole))
            now = replace(now, curvature_var=float(between[-1]), leg_vars=between[:-1])
    return found


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
    return Linearised(bases, jacobians, weights, residuals, squares, now.tubes.size)


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
    whole = in_common[:size, :size].copy()
    if len(looks) < MANY:
        eliminate_path(diagonal, tied, coupled)
        wide = coupled.reshape(-1, coupled.shape[2])
        in_common -= wide.T @ wide
    else:
        ends = tube_columns(looks, len(diagonal))
        eliminate_few(diagonal, tied, coupled, ends, linear.gravity_at)
        take_squares(coupled, ends, linear.gravity_at, in_common)
    left = InCommon(in_common[:size, :size], in_common[:size, size])
    states = (own - coupled[:, :, :size] @ left.step)[:, :, None].copy()
    substitute_path(diagonal, tied, states)
    gain = float(np.sum(own * own))
    return LinearSolution(
        diagonal, tied, coupled[:, :, :size], left, states[:, :, 0], gain, equations.at_station, whole
    )


def tube_columns(looks: Looks, count: int) -> Places:
    """Columns (count,) of tubes from each on are zero at each station and below: no such tube has come there."""
    tubes = int(looks.tube.max(initial=-1)) + 1
    is_there = np.zeros((count, tubes + 1), bool)  # from the highest tube down, and none
    is_there[:, tubes] = is_there[looks.station, tubes - 1 - looks.tube] = True
    highest = tubes - 1 - is_there.argmax(axis=1)
    return np.asarray(OF_TUBE * (1 + np.maximum.accumulate(highest[::-1])[::-1]), np.intp)


def take_squares(coupled: Array, ends: Places, tail: int, in_common: Array) -> None:
    """Take C^T C, of what is coupled (s + 1, 4, r), from ``in_common`` (r, r), without the columns that are zero.

    Parameters
    ----------
    ends, tail : see ``eliminate_few``
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
        linear.gravity_at, at_station, coupled, in_common,
    )  # fmt: skip
    diagonal[:, :2, :2] += at_station
    coupled[:, :, size] += right
    return Equations(diagonal, tied, coupled, in_common, at_station)


def poor_yaws(looks: Looks, count: int) -> Truths:
    """Which of the stations (count,) have looks, and of no look there a yaw that is known well."""
    is_seen, is_well = np.zeros((2, count), bool)
    is_seen[looks.station] = True
    is_well[looks.station[looks.yaw_var <= POOR_YAW**2]] = True
    return np.asarray(is_seen & ~is_well)


def _stepped(now: StartingPoint, bases: Array, solution: LinearSolution, turns: Truths) -> StartingPoint:
    """Where the unknowns stand after a step, which turns some directions about the vertical."""
    size = now.tubes.size
    make_ups = slice(size + 1, size + 1 + len(now.make_ups))
    return StartingPoint(
        step_about_vertical(now.tangents, bases, solution.states[:, :2], turns),
        now.curvatures + solution.states[:, 2:],
        now.tubes + solution.common[:size].reshape(-1, OF_TUBE),
        now.make_ups + solution.common[make_ups],
        now.gravity + float(solution.common[size]),
        now.play_var,
        now.curvature_var,
        now.leg_vars,
        now.extra + solution.common[make_ups.stop :],
    )
