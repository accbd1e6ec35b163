"""Damped Newton-Raphson on the cost of the MWD tool, with exact derivatives and a line search.

It stops when a step changes no reduced parameter by more than eps = 1.5e-6. Source: drilling-tool paper, eqs. (21) and
(22); that (22) bounds the step and not the change of the cost is our reading.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from groundstation.calibration.mwd_cost import Problem, Terms
from groundstation.calibration.mwd_model import MAGNETOMETER_AXES
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
EPS = 1.5e-6  # stop rule (22)
LARGEST_ITERATIONS = 60
SUFFICIENT_DECREASE = 1e-4  # Armijo
SHORTEST = 1e-6  # of a step
ROUNDING = 1e-13  # of the cost, by which it may seem to rise at the minimum


def minimise_cost(problem: Problem, free: Array) -> tuple[Array, int]:
    """Damped Newton-Raphson over y in x = free y from x = 0; returns x and the number of iterations.

    Source: eqs. (21), (22).

    Raises
    ------
    CalibrationError
        When it does not end.
    """
    y = np.zeros(free.shape[1])
    for iteration in range(1, LARGEST_ITERATIONS + 1):
        terms = problem.terms(free @ y)
        step = newton_step(terms, free)
        slope = float(terms.gradient @ free @ step)
        y, length = line_search(lambda at: problem.value(free @ at), y, step, terms.value, slope)
        if float(np.max(np.abs(step))) < EPS:
            return free @ y, iteration
        if length == 0.0:
            raise CalibrationError(f"the search found no way down from E = {terms.value:.3g} in iteration {iteration}")
    raise CalibrationError(f"the search had not ended after {LARGEST_ITERATIONS} iterations, E = {terms.value:.3g}")


def newton_step(terms: Terms, free: Array) -> Array:
    """Newton's step with the Hessian made positive definite.

    Far from the minimum the second-order part of the Hessian makes it indefinite; there it is left out, and 2 J^T J
    remains, which points downhill in every direction the design determines.
    """
    gradient = free.T @ terms.gradient
    for matrix in (terms.hessian, 2.0 * terms.normal):
        try:
            factor = np.linalg.cholesky(free.T @ matrix @ free)
        except np.linalg.LinAlgError:
            continue
        return np.asarray(-np.linalg.solve(factor.T, np.linalg.solve(factor, gradient)))
    raise CalibrationError("the design leaves a coefficient open; it needs more tilts, tool faces or temperatures")


def line_search(value: Callable[[Array], float], y: Array, step: Array, e: float, slope: float) -> tuple[Array, float]:
    """Halve the step until the cost falls enough; returns the point and the length taken (0 where nothing falls)."""
    length = 1.0
    while length > SHORTEST:
        at = y + length * step
        if value(at) <= e + SUFFICIENT_DECREASE * length * slope + ROUNDING * e:
            return at, length
        length *= 0.5
    return y, 0.0


def free_parameter_matrix(parameters: int, axes: str) -> Array:
    """(k, free) map x = hold y: m_AB and m_BA share one column for the accelerometers."""
    all_free = np.eye(parameters)
    if axes == MAGNETOMETER_AXES:
        return all_free
    ab, ba = parameters - 6, parameters - 4
    all_free[ba, ab] = 1.0
    return np.delete(all_free, ba, axis=1)
