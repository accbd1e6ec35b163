"""Consistency of a string of fifty under everything at once: NEES of every scheme at hops 1, 2, 5, 10, 25 and 50.

Joints and mounts err by their stated sigma, every joint adds 5 ms to the error of the clocks, 30 % of the aiding is
lost on its way to hop 50, and the encoder is heard for 20 s and then not for 30 s. A cell is one hop at one fixed
epoch, 10 s before the end of a turning or of a rest, with or without the constant errors: the filter's own variance
against its own error, and both with the systematic part. Honest is a mean NEES of 1. Source: node chapter 6.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from node.firmware.tube_settings import Kernel
from node.kernels.record.filter_record import Scheme
from sim.studies.epochs import EpochRun, resting_string, run_seed
from sim.studies.pool import Step, over_cores, seed_jobs
from sim.studies.scenarios import Tables, change_sections, on_off

HOPS = 50
SHOWN = (1, 2, 5, 10, 25, 50)
LOSS = 1.0 - 0.7 ** (1.0 / HOPS)  # each hop, so that 30 % is lost on the way to the last
USUAL = (0.88, 1.13)  # of a cell
EVERY = (0.8, 1.25)  # of all cells
OUTSIDE = 0.05  # share of cells that may lie outside the usual bounds
STUDIED = {1: 1.0, 2: 2.6, 5: 10.0, 10: 27.0, 25: 83.0, 50: 178.0}  # NEES of ``estimate`` at rest, in another study


def setup_of(scheme: Scheme, hops: int = HOPS, kernel: Kernel = "float64") -> Tables:
    """The string of one scheme; shorter ones lose as much a hop."""
    string = resting_string(hops, scheme, kernel, blocks=2, loss=LOSS)
    return change_sections(string, clocks={"joint_std_ms": 5.0}, aiding=on_off(20.0, 30.0))


def schemes_of(kernel: Kernel) -> tuple[Scheme, ...]:
    """Schemes that are judged; of another kernel than the reference the one that is used."""
    return tuple(Scheme) if kernel == "float64" else (Scheme.FORWARD,)


def count_steps(seeds: int, control_seeds: int | None, kernel: Kernel) -> int:
    """Runs of one seed."""
    return seeds + (len(schemes_of(kernel)) - 1) * (control_seeds or seeds)


def run_study(
    seeds: int, control_seeds: int | None, step: Step, hops: int = HOPS, kernel: Kernel = "float64"
) -> dict[str, Any]:
    """Table of every scheme; ``step`` is called after each seed of each scheme.

    Parameters
    ----------
    seeds : of ``forward``
    control_seeds : of the other schemes; None for as many

    Returns
    -------
    dict
        ``cases``: rows of scheme, epoch and hop; ``schemes``: by scheme the ``outside`` share of its cells, the
        ``worst`` NEES, whether it is ``consistent``, its ``seeds`` and the ``standard_error`` of a cell.
    """
    cases: list[dict[str, Any]] = []
    schemes: dict[str, dict[str, Any]] = {}
    with over_cores(seeds, step) as run_all:
        for scheme in schemes_of(kernel):
            count = seeds if scheme is Scheme.FORWARD else control_seeds or seeds
            rows = epoch_rows(scheme, run_all(run_seed, seed_jobs(setup_of(scheme, hops, kernel), count)))
            cases += rows
            judged = judge_cells([row[name] for row in rows for name in ("nees", "nees_total")])
            schemes[scheme.name.lower()] = {**judged, "seeds": count, "standard_error": math.sqrt(2.0 / count)}
    name = "consistency" if kernel == "float64" else f"consistency-{kernel}"
    return {"experiment": name, "kernel": kernel, "seeds": seeds, "cases": cases, "schemes": schemes}


def epoch_rows(scheme: Scheme, runs: Sequence[EpochRun]) -> list[dict[str, Any]]:
    """One row an epoch and hop."""
    error, var = np.array([r.error for r in runs]), np.array([r.var for r in runs])
    total = np.array([r.total_error for r in runs]) ** 2 / np.array([r.total_var for r in runs])
    rows = []
    for epoch, turning in enumerate(runs[0].turning):
        state = "turning" if turning else "at rest"
        for hop in (h for h in SHOWN if h <= error.shape[2]):
            k = hop - 1
            nees = error[:, epoch, k] ** 2 / var[:, epoch, k]
            rows.append(
                {
                    "case": f"{scheme.name.lower()}, {state} {epoch // 2 + 1}, hop {hop}",
                    "scheme": scheme.name.lower(),
                    "state": state,
                    "hop": hop,
                    "yaw_rms_deg": math.degrees(math.sqrt(float(np.mean(error[:, epoch, k] ** 2)))),
                    "yaw_sigma_deg": math.degrees(math.sqrt(float(np.mean(var[:, epoch, k])))),
                    "nees": float(nees.mean()),
                    "nees_total": float(total[:, epoch, k].mean()),
                    "published": STUDIED.get(hop) if scheme is Scheme.ESTIMATE and not turning else None,
                    "ours": float(nees.mean()),
                    "unit": "NEES",
                }
            )
    return rows


def judge_cells(cells: Sequence[float]) -> dict[str, Any]:
    """Whether the cells of a scheme are those of an honest filter."""
    outside = sum(not USUAL[0] <= cell <= USUAL[1] for cell in cells) / len(cells)
    worst = max(cells, key=lambda cell: abs(math.log(cell)))
    return {
        "outside": outside,
        "worst": worst,
        "consistent": outside <= OUTSIDE and EVERY[0] <= worst <= EVERY[1],
    }


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """One line a scheme."""
    lines = []
    for scheme, found in result["schemes"].items():
        outside = f"{found['outside']:.0%} of the cells outside {USUAL[0]:g}..{USUAL[1]:g} (allowed {OUTSIDE:.0%})"
        worst = f"worst {found['worst']:.3g} (allowed {EVERY[0]:g}..{EVERY[1]:g})"
        word = "consistent" if found["consistent"] else "not consistent"
        seen = f"{found['seeds']} seeds, standard error {found['standard_error']:.2f}"
        lines.append(f"{scheme}: {outside}, {worst}: {word}; {seen}")
    return lines
