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

from groundstation.calibration.mwd_model import (
    Triad,
    gravity_inclination,
    nominal_triad,
    tool_readings,
    vectors_of_volts,
)
from groundstation.calibration.mwd_newton import free_parameter_matrix, minimise_cost
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
    MwdTool,
    control_design,
    draw_tool,
    fresh_design,
    make_design,
    measure_tool,
)
from sim.studies.pool import Step
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
FRESH = 10**6  # added to a tool's seed for the attitudes that its calibration has not seen
HEATINGS = (Heating.ROOM, Heating.SOAK, Heating.SHUFFLED, Heating.ALTERNATING, Heating.SINGLE_RAMP)
REACH = {  # size in g, tilt in deg, iterations
    12: {"size": 2e-4, "tilt_deg": 0.01, "iterations": 5},
    30: {"size": 6e-4, "tilt_deg": 0.03, "iterations": 8},
}


@dataclass(frozen=True, slots=True)
class ToolOutcome:
    """One tool at one design; errors are the largest of 400 fresh attitudes, g and deg, before and after."""

    accelerometers: MwdFit
    magnetometers: MwdFit
    before: tuple[float, float]
    after: tuple[float, float]
    passed_before: bool
    passed_after: bool


def calibrate_tool(tool: MwdTool, heating: Heating, seed: int) -> ToolOutcome:
    """Calibrate a tool in its jig and try it elsewhere."""
    parameters = 12 if heating is Heating.ROOM else 30
    design = make_design(heating, seed)
    record = measure_tool(tool, design, seed)
    fit = solve_accelerometers(record.gravity_volts, record.temperature, design.tilt, parameters)
    gravity = vectors_of_volts(fit.triad, record.gravity_volts, record.temperature)
    field = solve_magnetometers(record.field_volts, record.temperature, gravity, FIELD, DIP, parameters)
    fresh = measure_tool(tool, fresh_design(seed, parameters == 30), seed + FRESH, noise=0.0, jig_std=0.0)
    control = measure_tool(tool, control_design(), seed + CONTROL)
    raw = nominal_triad("ABC", VOLTS_PER_G), nominal_triad("XYZ", VOLTS_PER_MICROTESLA)
    return ToolOutcome(
        fit,
        field,
        largest_errors(raw[0], fresh),
        largest_errors(fit.triad, fresh),
        passes_quality_control(*raw, control),
        passes_quality_control(fit.triad, field.triad, control),
    )


def passes_quality_control(accelerometers: Triad, magnetometers: Triad, record: JigRecord) -> bool:
    """Quality control of a tool with these coefficients."""
    seen = tool_readings(accelerometers, magnetometers, record.gravity_volts, record.field_volts, record.temperature)
    return judge_readings(seen).passed


def largest_errors(triad: Triad, record: JigRecord) -> tuple[float, float]:
    """Largest error of |G| (g) and of the tilt (deg) over a record without noise."""
    gravity = vectors_of_volts(triad, record.gravity_volts, record.temperature)
    size = np.abs(np.linalg.norm(gravity, axis=1) - 1.0)
    return float(size.max()), math.degrees(float(np.abs(gravity_inclination(gravity) - record.design.tilt).max()))


@dataclass(frozen=True, slots=True)
class Duel:
    """Two solvers on the same residuals: costs, and wall seconds of ours, of theirs with our Jacobian and alone."""

    cost: float
    other_cost: float
    seconds: float
    other_seconds: float
    other_seconds_alone: float


def compare_solvers(tool: MwdTool, heating: Heating, seed: int) -> Duel:
    """Ours against scipy's Levenberg-Marquardt from the same start."""
    from scipy.optimize import least_squares

    parameters = 12 if heating is Heating.ROOM else 30
    record = measure_tool(tool, make_design(heating, seed), seed)
    problem = accelerometer_record(record.gravity_volts, record.temperature, record.design.tilt).problem(parameters)
    free = free_parameter_matrix(parameters, "ABC")
    start = np.zeros(free.shape[1])

    def residuals(y: Array) -> Array:
        return problem.residuals(free @ y)

    def jacobian(y: Array) -> Array:
        return problem.residual_jacobian(free @ y) @ free

    clock = [time.perf_counter()]
    cost = problem.value(minimise_cost(problem, free)[0])
    clock.append(time.perf_counter())
    other = least_squares(residuals, start, jacobian, method="lm")
    clock.append(time.perf_counter())
    least_squares(residuals, start, method="lm")
    clock.append(time.perf_counter())
    return Duel(cost, 2.0 * float(other.cost), *np.diff(clock).tolist())


def count_steps(tools: int) -> int:
    """Tools of every design."""
    return len(HEATINGS) * tools


def run_study(tools: int, step: Step) -> dict[str, Any]:
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
                outcomes.append(calibrate_tool(tool, heating, seed))
            except CalibrationError:
                refused += 1
            duels.append(compare_solvers(tool, heating, seed))
            step()
        cases.append(design_row(heating, outcomes, duels, refused))
    return {"experiment": "mwd", "tools": tools, "cases": cases, "reach": REACH}


def design_row(heating: Heating, outcomes: list[ToolOutcome], duels: list[Duel], refused: int) -> dict[str, Any]:
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
