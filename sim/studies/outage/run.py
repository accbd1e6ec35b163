"""Consistency of a lossy string of five: NEES at fixed epochs over the length of outages and the loss of every hop.

The strings are those of `epochs`, with joint and mount errors drawn from their stated sigma; aiding leaves the encoder
for 20 s and then not for the length of the outage. Epochs are 10 s before the end of each turning and of each rest, a
cell is a hop at rest or turning. Honest is a mean NEES of 1.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sim.studies.epochs import BLOCKS, EpochRun, resting_string, run_seed
from sim.studies.pool import Step, over_cores, seed_jobs
from sim.studies.scenarios import change_sections, on_off

HOPS = 5
OUTAGES_S = (0.0, 20.0, 60.0)
LOSSES = (0.0, 0.1, 0.3)
USUAL = (0.88, 1.13)  # of a cell
EVERY = (0.8, 1.25)  # of all cells
OUTSIDE = 0.05  # share of cells that may lie outside the usual bounds
STATES = ("at rest", "turning", "at rest, with joints")


def count_steps(seeds: int) -> int:
    """Runs of one seed."""
    return seeds * len(OUTAGES_S) * len(LOSSES)


def run_study(seeds: int, step: Step) -> dict[str, Any]:
    """Rows of every outage and loss; ``outside`` is the share of cells outside the usual bounds."""
    cases = []
    with over_cores(seeds, step) as run_all:
        for off in OUTAGES_S:
            for loss in LOSSES:
                setup = change_sections(resting_string(HOPS, loss=loss), aiding=on_off(20.0, off))
                cases += outage_rows(off, loss, run_all(run_seed, seed_jobs(setup, seeds)))
    cells = np.array([[r[f"hop_{k + 1}"] for k in range(HOPS)] for r in cases])
    outside = float(np.mean((cells < USUAL[0]) | (cells > USUAL[1])))
    # of the mean of squares of normal errors; a joint is drawn once a seed, a filter's error once an epoch
    errors = {"epochs": math.sqrt(2.0 / (seeds * BLOCKS)), "joints": math.sqrt(2.0 / seeds)}
    return {"experiment": "outage", "seeds": seeds, "cases": cases, "outside": outside, "standard_errors": errors}


def outage_rows(off: float, loss: float, runs: list[EpochRun]) -> list[dict[str, Any]]:
    """Rows of one string: at rest, turning, and at rest with the errors of joints and mounts."""
    turning = runs[0].turning
    nees = np.array([r.error**2 / r.var for r in runs])
    total = np.array([r.total_error**2 / r.total_var for r in runs])
    found = (nees[:, ~turning], nees[:, turning], total[:, ~turning])
    return [_row(off, loss, state, values.mean(axis=(0, 1))) for state, values in zip(STATES, found, strict=True)]


def _row(off: float, loss: float, state: str, nees: np.ndarray[Any, np.dtype[np.float64]]) -> dict[str, Any]:
    worst = float(max(nees, key=lambda value: abs(math.log(value))))
    return {
        "case": f"outage {off:g} s, loss {100.0 * loss:g} %, {state}",
        "outage_s": off,
        "loss": loss,
        "state": state,
        **{f"hop_{k + 1}": float(value) for k, value in enumerate(nees)},
        "published": None,
        "ours": worst,
        "unit": "NEES, hop farthest from 1",
        "to_reach": f"{EVERY[0]:g}..{EVERY[1]:g}",
        "reached": EVERY[0] <= worst <= EVERY[1],
    }


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """Share of the cells outside, and how well a cell is known."""
    low, high = USUAL
    errors = result["standard_errors"]
    return [
        f"{result['outside']:.0%} of the cells outside {low:g}..{high:g}, allowed {OUTSIDE:.0%}",
        f"standard error of a cell {errors['epochs']:.2f}, with joints {errors['joints']:.2f}",
    ]
