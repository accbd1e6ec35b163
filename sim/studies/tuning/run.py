"""Tuning factors A and B of thesis eqs. 4.14 and 4.15: how soon the bias is found after the stop.

The bias of the boot is 0.02 deg/s off from the first turn on, and aiding is continuous. Convergence is the first moment
after the stop at which the error of the z bias (mean over seeds, of 2 s) has gone nine tenths of the way from 0.02
deg/s to its settled level, the mean over the last 100 s of rest. A bias that settles more than half way up never
converges. B weights the noise of the bias, A that of the rates, also in the zero-rate update.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from sim.studies.lab import END, ENDS, LAB, REST, STOP, LabRun
from sim.studies.pool import Step
from sim.studies.scenarios import Tables, change_sections
from sim.studies.trials import over_seeds, rms_deg

Array = npt.NDArray[np.float64]
RESIDUAL_DPS = -0.02
WAY = 0.9
SETTLED_FOR = 100.0  # s
SMOOTHED = 4  # cycles
PUBLISHED_S = {"A = B = 1": 178.0, "B = 5": 83.0}  # of thesis 4.2, the slower taken for the smaller factor
SLOWEST = 46.0  # s, to reach with B = 5
FACTORS: tuple[tuple[str, str, float], ...] = (
    ("A = B = 1", "bias_factor", 1.0),
    ("B = 5", "bias_factor", 5.0),
    ("B = 20", "bias_factor", 20.0),
    ("A = 0.2", "attitude_factor", 0.2),
    ("A = 5", "attitude_factor", 5.0),
    ("A = 20", "attitude_factor", 20.0),
)


def setup_of(factor: str, value: float) -> Tables:
    """The laboratory string under one factor of the firmware's configuration."""
    return change_sections(LAB, gyroscope={"bias_step_dps": RESIDUAL_DPS}, node={"tuning": {factor: value}})


def count_steps(seeds: int) -> int:
    """Runs of one seed."""
    return seeds * len(FACTORS)


def run_study(seeds: int, step: Step) -> dict[str, Any]:
    """Rows of every factor and ``traces`` of the bias error (deg/s), mean over seeds."""
    cases, traces = [], {}
    with over_seeds(seeds, step) as run_all:
        for name, factor, value in FACTORS:
            runs = run_all(setup_of(factor, value))
            error = mean_error_dps(runs)
            traces[name] = {"t": ENDS - STOP, "bias": error}
            cases.append(_row(name, runs, error))
    by_name = {case["case"]: case for case in cases}
    _compare(by_name["A = B = 1"], by_name["B = 5"], by_name["B = 20"])
    return {"experiment": "tuning", "seeds": seeds, "cases": cases, "traces": traces}


def mean_error_dps(runs: list[LabRun]) -> Array:
    """Error of the z bias (cycles,) deg/s, mean over seeds and the last ``SMOOTHED`` cycles."""
    mean = np.degrees(np.mean([r.bias_error[:, 0] for r in runs], axis=0))
    return np.asarray(np.convolve(mean, np.ones(SMOOTHED) / SMOOTHED)[: len(mean)])


def settled_dps(error: Array) -> float:
    """Level at the end of the rest, deg/s."""
    return float(np.mean(np.abs(error[(ENDS > END - SETTLED_FOR) & (ENDS <= END)])))


def convergence_time(error: Array) -> float | None:
    """Time from the stop to convergence, s; None if it does not converge."""
    settled, start = settled_dps(error), abs(RESIDUAL_DPS)
    if settled > 0.5 * start:
        return None
    near = np.flatnonzero(REST & (np.abs(error) <= start + WAY * (settled - start)))
    return float(ENDS[near[0]] - STOP) if len(near) else None


def _row(name: str, runs: list[LabRun], error: Array) -> dict[str, Any]:
    settled = ENDS > END - SETTLED_FOR
    scatter = np.std([r.bias_error[settled, 0] for r in runs], axis=0).mean()
    return {
        "case": name,
        "published": PUBLISHED_S.get(name),
        "ours": convergence_time(error),
        "unit": "s after the stop",
        "to_reach": None,
        "reached": None,
        "left_dps": settled_dps(error),
        "scatter_dps": math.degrees(float(scatter)),
        "yaw_rms_deg": rms_deg([r.error[REST, 0] for r in runs])[0],
    }


def _compare(one: dict[str, Any], five: dict[str, Any], twenty: dict[str, Any]) -> None:
    """B = 5 in time, a larger B not slower, B = 1 slower: what thesis 4.2 found."""
    slow, middle, fast = (math.inf if r["ours"] is None else r["ours"] for r in (one, five, twenty))
    one.update(to_reach="slower than B = 5", reached=slow > middle)
    five.update(to_reach=SLOWEST, reached=middle <= SLOWEST)
    twenty.update(to_reach="not slower than B = 5", reached=fast <= middle)
