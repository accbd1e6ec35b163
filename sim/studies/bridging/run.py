"""What the gyroscopes of a string could gain if they bridged outages together, and what a string takes from that.

Beside the bound of one node stands that of a node whose gyroscope has the errors of the mean of ten: as if the ten
heard each other in every cycle, without loss, delay or quantisation, and turned exactly alike. No scheme of messages
does better. What a yaw is for is the azimuth of a survey, whose force is known no better by it. A string with play
does not turn alike: at a stop each of its tubes runs on by a part of it, and from ``play_deg`` on that is as much as
the ten gain. Source: the filter and smoother of `sim.studies.limits.bound`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from sim.studies.epochs import BLOCKS
from sim.studies.limits.bound import Bound, Model, bound_of, model_of, node_timeline
from sim.studies.limits.run import CASES, SETTLED
from sim.studies.pool import Step, over_cores, seed_jobs
from sim.studies.scenarios import Tables
from sim.world.scenario import scenario_of
from sim.world.world import World

Array = npt.NDArray[np.float64]
TOGETHER = 10  # gyroscopes
POINTS = 32  # of a survey's mean force
KINDS = ("turning", "at rest", "at the survey", "revised", "smoothed")


def count_steps(seeds: int) -> int:
    """Runs of all seeds."""
    return seeds * len(CASES)


def run_study(seeds: int, step: Step) -> dict[str, Any]:
    """A row for every kind of figure of every case of the limits; ``step`` is called after each seed of each."""
    cases: list[dict[str, Any]] = []
    with over_cores(seeds, step) as run_all:
        for case in CASES:
            jobs = [((setup, case.hops), seed) for setup, seed in seed_jobs(case.setup, seeds)]
            cases += rows_of(case.name, case.setup, run_all(run_seed, jobs))
    return {"experiment": "bridging", "seeds": seeds, "together": TOGETHER, "cases": cases}


def run_seed(job: tuple[tuple[Tables, int], int]) -> Array:
    """Variances (2, kinds) rad^2 of one node and of one of ten, for a pool of processes."""
    (tables, hops), seed = job
    world = World(scenario_of(dict(tables)), seed)
    model, course = model_of(world, hops), node_timeline(world)
    return np.stack(
        [mean_variances(world, bound_of(one, course, world.begin)) for one in (model, mean_of(model, TOGETHER))]
    )


def mean_of(model: Model, count: int) -> Model:
    """Errors of the mean of ``count`` gyroscopes; those of the time stamps are of the aiding, common to all."""
    part = 1.0 / math.sqrt(count)
    return replace(model, noise=part * model.noise, bias_std=part * model.bias_std, scale_std=part * model.scale_std)


def mean_variances(world: World, bound: Bound) -> Array:
    """Mean variances (kinds,) rad^2: ``SETTLED`` after a start or a stop, and at surveys; the last rest is left out."""
    rests = [phase for phase in world.phases if phase.kind == "stop"][: BLOCKS - 1]
    turns = [phase for phase in world.phases if phase.kind == "drill"]
    settled = [within_phase(bound.times, phase.start + SETTLED, phase.end) for phase in (*turns, *rests)]
    turning, resting = np.any(settled[: len(turns)], axis=0), np.any(settled[len(turns) :], axis=0)
    said = np.searchsorted(bound.times, [rest.start + SETTLED for rest in rests])
    ended = np.searchsorted(bound.times, [turn.start for turn in turns[1:]]) - 1
    variances = (
        bound.filtered[turning],
        bound.filtered[resting],
        bound.filtered[said],
        bound.filtered[ended],
        bound.smoothed[said],
    )
    return np.array([one.mean() for one in variances])


def within_phase(times: Array, begin: float, end: float) -> npt.NDArray[np.bool_]:
    """Mask (n,) of the ``times`` that lie in a phase; s."""
    return (times >= begin) & (times <= end)


def rows_of(name: str, setup: Tables, runs: Sequence[Array]) -> list[dict[str, Any]]:
    """Figures of one case, deg; no azimuth of a string that turns."""
    file = scenario_of(dict(setup)).file
    lean = math.radians(setup["path"]["straight"]["inclination_deg"])
    force = file.accelerometer.noise_deg / math.sqrt(POINTS) / math.sin(lean)  # deg, of an azimuth
    rows = []
    for kind, (alone, ten) in zip(KINDS, np.degrees(np.sqrt(np.mean(runs, axis=0))).T.tolist(), strict=True):
        row: dict[str, Any] = {"case": name, "quantity": f"yaw {kind}", "alone_deg": alone, "together_deg": ten}
        row["play_deg"] = math.sqrt((alone**2 - ten**2) * 12.0 / (1.0 + 1.0 / TOGETHER))
        told = kind != KINDS[0]
        row["azimuth_alone_deg"] = math.hypot(alone, force) if told else None
        row["azimuth_together_deg"] = math.hypot(ten, force) if told else None
        rows.append(row)
    return rows


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """Lines on the largest gain in the azimuth of a survey, at the first survey and in the end."""
    lines = []
    for kind in KINDS[2:]:
        rows = [row for row in result["cases"] if row["quantity"] == f"yaw {kind}"]
        best = max(rows, key=lambda row: row["azimuth_alone_deg"] / row["azimuth_together_deg"])
        gained = 1.0 - best["azimuth_together_deg"] / best["azimuth_alone_deg"]
        lines.append(f"azimuth {kind}: at most {100.0 * gained:.1f} % better ({best['case']})")
    return lines
