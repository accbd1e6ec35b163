"""Calibration of synthetic MWD tools: iterations, errors before and after, agreement and speed beside another solver.

The reference column is what the method reaches with 0.1 mG noise and a 0.01 deg jig on 400 fresh attitudes.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.calibration.errors import CalibrationError
from groundstation.calibration.mwd_model import Triad, evaluate, nominal, tilt, vectors
from groundstation.calibration.mwd_newton import hold, minimise
from groundstation.calibration.mwd_record import accelerometer_record
from groundstation.calibration.mwd_solve import MwdFit, solve_accelerometers, solve_magnetometers
from groundstation.calibration.quality import judge_readings
from sim.instruments.mwd_jig import (
    CONTROL,
    DIP,
    FIELD,
    VOLTS_PER_G,
    VOLTS_PER_MICROTESLA,
    Heating,
    JigRecord,
    Tool,
    control_design,
    draw_tool,
    fresh_design,
    make_design,
    measure,
)
from sim.studies.pool import Step

Array = npt.NDArray[np.float64]
FRESH = 10**6  # added to a tool's seed for the attitudes that its calibration has not seen
HEATINGS = (Heating.ROOM, Heating.SOAK, Heating.SHUFFLED, Heating.ALTERNATING, Heating.SINGLE_RAMP)
REACH = {  # size in g, tilt in deg, iterations
    12: {"size": 2e-4, "tilt_deg": 0.01, "iterations": 5},
    30: {"size": 6e-4, "tilt_deg": 0.03, "iterations": 8},
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """One tool at one design; errors are the largest of 400 fresh attitudes, g and deg, before and after."""

    accelerometers: MwdFit
    magnetometers: MwdFit
    before: tuple[float, float]
    after: tuple[float, float]
    passed_before: bool
    passed_after: bool


def calibrate(tool: Tool, heating: Heating, seed: int) -> Outcome:
    """Calibrate a tool in its jig and try it elsewhere."""
    parameters = 12 if heating is Heating.ROOM else 30
    design = make_design(heating, seed)
    record = measure(tool, design, seed)
    fit = solve_accelerometers(record.gravity_volts, record.temperature, design.tilt, parameters)
    gravity = vectors(fit.triad, record.gravity_volts, record.temperature)
    field = solve_magnetometers(record.field_volts, record.temperature, gravity, FIELD, DIP, parameters)
    fresh = measure(tool, fresh_design(seed, parameters == 30), seed + FRESH, noise=0.0, jig_std=0.0)
    control = measure(tool, control_design(), seed + CONTROL)
    raw = nominal("ABC", VOLTS_PER_G), nominal("XYZ", VOLTS_PER_MICROTESLA)
    return Outcome(
        fit,
        field,
        worst(raw[0], fresh),
        worst(fit.triad, fresh),
        passes(*raw, control),
        passes(fit.triad, field.triad, control),
    )


def passes(accelerometers: Triad, magnetometers: Triad, record: JigRecord) -> bool:
    """Quality control of a tool with these coefficients."""
    seen = evaluate(accelerometers, magnetometers, record.gravity_volts, record.field_volts, record.temperature)
    return judge_readings(seen).passed


def worst(triad: Triad, record: JigRecord) -> tuple[float, float]:
    """Largest error of |G| (g) and of the tilt (deg) over a record without noise."""
    gravity = vectors(triad, record.gravity_volts, record.temperature)
    size = np.abs(np.linalg.norm(gravity, axis=1) - 1.0)
    return float(size.max()), math.degrees(float(np.abs(tilt(gravity) - record.design.tilt).max()))


@dataclass(frozen=True, slots=True)
class Duel:
    """Two solvers on the same residuals: costs, and wall seconds of ours, of theirs with our Jacobian and alone."""

    cost: float
    other_cost: float
    seconds: float
    other_seconds: float
    other_seconds_alone: float


def duel(tool: Tool, heating: Heating, seed: int) -> Duel:
    """Ours against scipy's Levenberg-Marquardt from the same start."""
    from scipy.optimize import least_squares

    parameters = 12 if heating is Heating.ROOM else 30
    record = measure(tool, make_design(heating, seed), seed)
    problem = accelerometer_record(record.gravity_volts, record.temperature, record.design.tilt).problem(parameters)
    free = hold(parameters, "ABC")
    start = np.zeros(free.shape[1])

    def residuals(y: Array) -> Array:
        return problem.residuals(free @ y)

    def jacobian(y: Array) -> Array:
        return problem.residual_jacobian(free @ y) @ free

    clock = [time.perf_counter()]
    cost = problem.value(minimise(problem, free)[0])
    clock.append(time.perf_counter())
    other = least_squares(residuals, start, jacobian, method="lm")
    clock.append(time.perf_counter())
    least_squares(residuals, start, method="lm")
    clock.append(time.perf_counter())
    return Duel(cost, 2.0 * float(other.cost), *np.diff(clock).tolist())


def steps(tools: int) -> int:
    """Tools of every design."""
    return len(HEATINGS) * tools


def run(tools: int, step: Step) -> dict[str, Any]:
    """Table of the designs over ``tools`` synthetic tools; ``step`` is called after each tool of each design.

    Returns
    -------
    dict
        ``cases``: one row a design; ``reach``: what the method is known to reach.
    """
    cases = []
    for heating in HEATINGS:
        outcomes, duels, refused = [], [], 0
        for seed in range(1, tools + 1):
            tool = draw_tool(seed)
            try:
                outcomes.append(calibrate(tool, heating, seed))
            except CalibrationError:
                refused += 1
            duels.append(duel(tool, heating, seed))
            step()
        cases.append(row(heating, outcomes, duels, refused))
    return {"experiment": "mwd", "tools": tools, "cases": cases, "reach": REACH}


def row(heating: Heating, outcomes: list[Outcome], duels: list[Duel], refused: int) -> dict[str, Any]:
    """One line of the table: medians, worst tools and shares."""
    iterations = np.array([o.accelerometers.iterations for o in outcomes])
    before, after = np.array([o.before for o in outcomes]), np.array([o.after for o in outcomes])
    parameters = outcomes[0].accelerometers.parameters
    reach = REACH[parameters]
    cost, other = np.array([(d.cost, d.other_cost) for d in duels]).T
    ours, theirs, alone = np.array([(d.seconds, d.other_seconds, d.other_seconds_alone) for d in duels]).sum(axis=0)
    return {
        "case": f"{heating.value}, {parameters} parameters",
        "published": reach["size"],
        "ours": float(after[:, 0].max()),
        "unit": "g, largest error of G_L",
        "design": heating.value,
        "parameters": parameters,
        "converged": len(outcomes) / (len(outcomes) + refused),
        "iterations_median": float(np.median(iterations)),
        "iterations_max": int(iterations.max()),
        "iterations_within_10": float(np.mean(iterations <= 10)),
        "magnetometer_iterations_max": max(o.magnetometers.iterations for o in outcomes),
        "size_before_median": float(np.median(before[:, 0])),
        "tilt_before_median_deg": float(np.median(before[:, 1])),
        "size_after_median": float(np.median(after[:, 0])),
        "size_after_max": float(after[:, 0].max()),
        "tilt_after_median_deg": float(np.median(after[:, 1])),
        "tilt_after_max_deg": float(after[:, 1].max()),
        "within_reach": float(np.mean(np.all(after <= [reach["size"], reach["tilt_deg"]], axis=1))),
        "warned": float(np.mean([bool(o.accelerometers.warnings) for o in outcomes])),
        "control_passed_before": float(np.mean([o.passed_before for o in outcomes])),
        "control_passed_after": float(np.mean([o.passed_after for o in outcomes])),
        "cost_difference_max": float(np.max(np.abs(cost / other - 1.0))),
        "time_over_other": float(ours / theirs),
        "time_over_other_alone": float(ours / alone),
        "milliseconds": 1e3 * float(ours) / len(duels),
    }
