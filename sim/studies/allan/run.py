"""Allan analysis against known noise: synthetic records with the parameters measured on the node's own sensor.

Asked is that the fit returns N and F as closely as the published analysis claims of the real records. Beside the fit
stand the two raw readings that it replaces, and how often its 95 % intervals hold the truth: over 300 records 96 % for
N and F. A fit that takes the points for independent, each with 1 / sqrt(2 (N/n - 1)), held 92 % and 82 % of 300 axes.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from groundstation.calibration.allan_analysis import AllanResult, analyse_allan_deviation
from groundstation.calibration.allan_fit import Estimate
from sim.instruments.static_records import BIAS_INSTABILITY, RANDOM_WALK, RATE, mpu6500_noise, static_record
from sim.studies.pool import Step

DURATION = 7200.0  # s
ASKED = {"random_walk": 0.77, "bias_instability": 4.2}  # %
UNITS = {"random_walk": "deg/s/sqrt(Hz)", "bias_instability": "deg/s"}
COVERAGE = 0.95


def count_steps(records: int) -> int:
    """Records."""
    return records


def run_study(records: int, step: Step) -> dict[str, Any]:
    """Fit ``records`` synthetic records of three axes; ``step`` is called after each.

    Returns
    -------
    dict
        ``cases``: rows of axis and quantity with truth, mean estimate, median, 95th percentile of |error| (%), the raw
        reading's mean error (%) and coverage; ``quantities``: the same over the axes, with what is asked; ``walks``:
        axes in which a rate random walk was seen that is not there.
    """
    fits: list[list[AllanResult]] = []
    for seed in range(1, records + 1):
        fits.append(analyse_allan_deviation(static_record(mpu6500_noise(), round(DURATION * RATE), RATE, seed), RATE))
        step()
    cases: list[dict[str, Any]] = []
    quantities: dict[str, dict[str, Any]] = {}
    for name, truths in (("random_walk", RANDOM_WALK), ("bias_instability", BIAS_INSTABILITY)):
        tables = [_table([axes[k] for axes in fits], name, truth) for k, truth in enumerate(truths)]
        for axis, truth, table in zip("xyz", truths, tables, strict=True):
            ours = truth * (1.0 + float(table[0].mean()))
            row = {"case": f"{axis} {name}", "published": truth, "ours": ours, "unit": UNITS[name]}
            row |= {"axis": axis, "quantity": name, "truth": truth, "mean_estimate": ours}
            cases.append({**row, **_summary(table)})
        overall = _summary(np.concatenate(tables, axis=1))
        chance = 3.0 * math.sqrt(COVERAGE * (1.0 - COVERAGE) / (3 * records))  # of so few intervals
        good = overall["median_error_percent"] <= ASKED[name] and overall["coverage_95"] >= COVERAGE - chance
        quantities[name] = {**overall, "asked_error_percent": ASKED[name], "reached": good}
    walks = sum(axis.fit.rate_walk is not None for axes in fits for axis in axes)
    return {"experiment": "allan", "records": records, "cases": cases, "quantities": quantities, "walks": walks}


def _table(results: list[AllanResult], name: str, truth: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Rows: relative error of the fit, of the raw reading, and whether the interval holds the truth; (3, records)."""
    estimates: list[Estimate] = [r.random_walk if name == "random_walk" else r.floor for r in results]
    raw = [(r.raw_at_1s if name == "random_walk" else r.raw_minimum).deviation for r in results]
    held = [float(e.low <= truth <= e.high) for e in estimates]
    return np.array([[e.value / truth - 1.0 for e in estimates], [r / truth - 1.0 for r in raw], held])


def _summary(table: np.ndarray[Any, np.dtype[np.float64]]) -> dict[str, float]:
    error, raw, held = table
    return {
        "median_error_percent": 100.0 * float(np.median(np.abs(error))),
        "error_95_percent": 100.0 * float(np.quantile(np.abs(error), 0.95)),
        "raw_error_percent": 100.0 * float(raw.mean()),
        "coverage_95": float(held.mean()),
    }


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """One line for N and one for F: its error and whether its intervals hold."""
    lines = []
    for name, q in result["quantities"].items():
        asked = f"median error {q['median_error_percent']:.2f} %, asked {q['asked_error_percent']} %"
        word = "yes" if q["reached"] else "no"
        lines.append(f"{name}: {asked}, 95 % intervals hold {q['coverage_95']:.1%}: {word}")
    return lines
