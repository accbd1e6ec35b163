"""Consistency of the relay down the string: whether a node's own variance is the truth about its error.

NEES = mean of (error^2 / variance) over seeds at fixed epochs; 1 is honest, above 1 is overconfident. The reference
column is what a study of the published scheme found at rest at hops 1, 2, 5 and 10.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from node.kernels.record.filter_record import Scheme
from sim.studies.epochs import EpochRun, resting_string, run_seed
from sim.studies.pool import Step, over_cores, seed_jobs

STUDIED_NEES_AT_REST = {1: 1.0, 2: 2.6, 5: 10.0, 10: 27.0}
CONSISTENT = (0.5, 2.0)


def count_steps(hops: int, seeds: int) -> int:
    """Runs of one seed."""
    del hops
    return len(Scheme) * seeds


def run_study(hops: int, seeds: int, step: Step) -> dict[str, Any]:
    """Table of both schemes; ``step`` is called after each seed of each scheme.

    Returns
    -------
    dict
        ``cases``: rows of scheme, hop, rms (deg) and NEES at rest and turning; ``consistent`` by scheme.
    """
    cases: list[dict[str, Any]] = []
    consistent: dict[str, bool] = {}
    with over_cores(seeds, step) as run_all:
        for scheme in Scheme:
            rows = hop_rows(scheme, run_all(run_seed, seed_jobs(resting_string(hops, scheme), seeds)))
            cases.extend(rows)
            low, high = CONSISTENT
            consistent[scheme.name.lower()] = all(
                low <= row[name] <= high for row in rows for name in ("nees_rest", "nees_turning", "nees_total")
            )
    return {"experiment": "relay", "hops": hops, "seeds": seeds, "cases": cases, "consistent": consistent}


def hop_rows(scheme: Scheme, runs: list[EpochRun]) -> list[dict[str, Any]]:
    """One row a hop."""
    error, var = np.array([r.error for r in runs]), np.array([r.var for r in runs])
    total, total_var = np.array([r.total_error for r in runs]), np.array([r.total_var for r in runs])
    turning = runs[0].turning
    rest, spin = ~turning, turning
    nees, nees_total = error**2 / var, total**2 / total_var
    rows = []
    for k in range(error.shape[2]):
        rows.append(
            {
                "case": f"{scheme.name.lower()} hop {k + 1}",
                "scheme": scheme.name.lower(),
                "hop": k + 1,
                "yaw_rms_rest_deg": rms_deg(error[:, rest, k]),
                "yaw_rms_turning_deg": rms_deg(error[:, spin, k]),
                "nees_rest": float(nees[:, rest, k].mean()),
                "nees_turning": float(nees[:, spin, k].mean()),
                "nees_total": float(nees_total[:, rest, k].mean()),
                "published": STUDIED_NEES_AT_REST.get(k + 1) if scheme is Scheme.ESTIMATE else None,
                "ours": float(nees[:, rest, k].mean()),
                "unit": "NEES at rest",
            }
        )
    return rows


def rms_deg(errors: Any) -> float:
    """Root mean square of angles in rad, in degrees."""
    return math.degrees(float(np.sqrt(np.mean(np.square(errors)))))


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """One line a scheme."""
    return [
        f"{scheme}: every NEES within [0.5, 2]: {'yes' if good else 'no'}"
        for scheme, good in result["consistent"].items()
    ]
