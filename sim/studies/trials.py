"""Many seeds of one laboratory string: how they are run, and their figures with 95 % confidence intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt

from sim.studies.lab import ENDS, STOP, LabRun, run_seed
from sim.studies.pool import Step, over_cores, seed_jobs
from sim.studies.scenarios import Tables

Array = npt.NDArray[np.float64]
RESAMPLES = 2000
SHOWN_SEED = 0  # index of the seed that figures show by itself
Trials = Callable[[Tables], list[LabRun]]
RunOne = Callable[[tuple[Tables, int]], LabRun]


@contextmanager
def over_seeds(seeds: int, step: Step, run_one: RunOne = run_seed) -> Iterator[Trials]:
    """Yield the function that runs the seeds 1..``seeds`` of a setup on all cores, in order, each by ``run_one``."""
    with over_cores(seeds, step) as run_all:
        yield lambda setup: run_all(run_one, seed_jobs(setup, seeds))


def rms_deg(errors: Sequence[Array]) -> tuple[float, float, float]:
    """Root mean square in degrees of one array (rad) a seed, with the ends of its interval (bootstrap over seeds)."""
    squares = np.array([float(np.mean(np.square(e))) for e in errors])
    low, high = np.sqrt(bootstrap_interval(squares))
    return math.degrees(math.sqrt(float(squares.mean()))), math.degrees(low), math.degrees(high)


def bootstrap_interval(values: Array) -> tuple[float, float]:
    """95 % interval of the mean of ``values`` (seeds,), by percentiles of resampled means."""
    random = np.random.Generator(np.random.Philox(len(values)))
    means = values[random.integers(0, len(values), (RESAMPLES, len(values)))].mean(axis=1)
    low, high = np.quantile(means, (0.025, 0.975))
    return float(low), float(high)


def interval_row(
    case: str,
    quantity: str,
    figure: tuple[float, float, float],
    *,
    unit: str = "deg",
    published: float | str | None = None,
    to_reach: float | None = None,
) -> dict[str, Any]:
    """One line of a table; ``figure`` is ours with the ends of its interval."""
    ours, low, high = figure
    return {
        "case": case,
        "quantity": quantity,
        "published": published,
        "ours": ours,
        "low": low,
        "high": high,
        "unit": unit,
        "to_reach": to_reach,
        "reached": None if to_reach is None else ours <= to_reach,
    }


def yaw_error_trace(runs: list[LabRun], hop: int) -> dict[str, Array]:
    """Yaw error over time after the stop (s): of one seed, and rms over all (deg)."""
    error = np.degrees(np.array([run.error[:, hop] for run in runs]))
    return {"t": ENDS - STOP, "one": error[SHOWN_SEED], "rms": np.sqrt(np.mean(error**2, axis=0))}
