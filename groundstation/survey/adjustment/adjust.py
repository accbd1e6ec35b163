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
from groundstation.survey.adjustment.equations import path_equations, string_departure, string_information
from groundstation.survey.adjustment.linear_solution import LinearSolution
from groundstation.survey.adjustment.lone_looks import LoneLooks, lone_looks
from groundstation.survey.adjustment.looks import OF_TUBE, FurtherEffects, Looks, PathPrior, StartingPoint, StringPrior
from groundstation.survey.adjustment.normal_equations import WIDE, are_many, linearise_all, solve_again, solve_equations
from groundstation.survey.adjustment.sphere import carried_bases, step_about_vertical
from groundstation.survey.adjustment.starting_point import first_start
from groundstation.survey.adjustment.variance_learning import ITERATIONS, VarianceLearning

Array = npt.NDArray[np.float64]
Truths = npt.NDArray[np.bool_]
FURTHER = 8  # steps of the unknowns alone
SETTLED = 0.03  # standard deviations, of the last step; what is left then is some tenth of it
POOR_YAW = 0.05  # rad, standard deviation, from which on a direction goes about the vertical rather than straight
NEARER = 0.5  # of the step before it, up to which such a step leads on


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
    known = string_information(string, extra) if known is None else known
    is_settled = now.is_learnt
    # what is known of each unknown beside the others is no matter then, and far too strict where stations are near
    by_decrement = is_settled or are_many(looks)
    learning, turns, step = VarianceLearning(is_done=is_settled), poor_yaws(looks, len(path.md)), math.inf
    leading: LinearSolution | None = None  # whose equations lead on, where one of before does
    alone = None if len(known) < WIDE or are_many(looks) else lone_looks(looks, string, known)
    for again in range(ITERATIONS + FURTHER):
        linear = linearise_all(looks, now, carried_bases(now.tangents), extra)
        if alone is None:
            solution = _solved(looks, string, path, extra, known, now, linear, leading)
            ended = _stepped(now, linear.bases, solution.states, solution.common, turns)
            found = Adjusted(looks, string, path, extra, ended, linear, solution, known)
        else:
            found = _step_without(alone, looks, string, path, extra, known, now, linear, turns)
        before, step = step, found.solution.decrement if by_decrement else found.solution.step
        if not np.isfinite(step):
            raise np.linalg.LinAlgError("expected a step of the unknowns, got numbers that are none")
        leading = found.solution if is_settled and are_many(looks) and step < NEARER * before else None
        now = learning.go_on(found, again, step)
        is_near = learning.is_done and step < SETTLED
        if is_near and alone is None:
            break
        if is_near or again >= ITERATIONS:
            alone = None  # the last steps are of all unknowns
    return found


def _step_without(
    alone: LoneLooks, looks: Looks, string: StringPrior, path: PathPrior, extra: FurtherEffects, known: Array,
    now: StartingPoint, linear: Linearised, turns: Truths,
) -> Adjusted:  # fmt: skip
    """A step by equations without bias and tilt of tubes that have looked once; these follow it."""
    kept, (linear, gains) = known[np.ix_(alone.kept, alone.kept)], alone.put_into_weights(linear, now.tubes)
    departure = string_departure(string, now)[alone.kept]
    solution = solve_equations(looks, linear, path_equations(path, now, linear.bases), kept, departure, extra)
    found = Adjusted(looks, string, path, extra, now, linear, solution, kept)
    common = alone.whole_step(solution.common, gains, found.left, now.tubes)
    ended = _stepped(now, linear.bases, solution.states, common, turns)
    return replace(found, now=ended)


def _solved(
    looks: Looks, string: StringPrior, path: PathPrior, extra: FurtherEffects, known: Array, now: StartingPoint,
    linear: Linearised, leading: LinearSolution | None,
) -> LinearSolution:  # fmt: skip
    """A step from where the unknowns stand, by its own equations or by those of one before that lead on."""
    of_path, departure = path_equations(path, now, linear.bases), string_departure(string, now)
    if leading is None:
        return solve_equations(looks, linear, of_path, known, departure, extra)
    return solve_again(leading, looks, linear, of_path[2], -known @ departure, extra)


def poor_yaws(looks: Looks, count: int) -> Truths:
    """Which of the stations (count,) have looks, and of no look there a yaw that is known well."""
    is_seen, is_well = np.zeros((2, count), bool)
    is_seen[looks.station] = True
    is_well[looks.station[looks.yaw_var <= POOR_YAW**2]] = True
    return np.asarray(is_seen & ~is_well)


def _stepped(now: StartingPoint, bases: Array, states: Array, common: Array, turns: Truths) -> StartingPoint:
    """Where the unknowns stand after a step of states (s + 1, 4) and of what they have in common (p,).

    It turns some directions about the vertical.
    """
    size = now.tubes.size
    make_ups = slice(size + 1, size + 1 + len(now.make_ups))
    return StartingPoint(
        step_about_vertical(now.tangents, bases, states[:, :2], turns),
        now.curvatures + states[:, 2:],
        now.tubes + common[:size].reshape(-1, OF_TUBE),
        now.make_ups + common[make_ups],
        now.gravity + float(common[size]),
        now.play_var,
        now.curvature_var,
        now.leg_vars,
        now.extra + common[make_ups.stop :],
    )
