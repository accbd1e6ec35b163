"""How near a node comes to the best that its data hold: at rest, at its surveys, and when it says them again.

Aiding comes at a random phase of the node's cycle, and the gyroscope tells the eighths of its cycles. *At rest* is
every cycle of a rest from 20 s after the stop on; *at the survey* is the yaw as it is said first, *revised* what is
known of it when the rest ends, and *smoothed* when the string has turned on. The bound beside each is that of the best
filter, or the best smoother, on the same data (`bound`). The last rest has no turning after it and is not judged.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sim.string.direct_string import DirectString
from sim.string.result import StringRun, StringSurvey
from sim.studies.epochs import BLOCKS, RESTING
from sim.studies.limits.bound import Bound, bound_of, model_of, node_timeline
from sim.studies.pool import Step, over_cores, seed_jobs
from sim.studies.scenarios import Tables, change_sections, complete_string, on_off
from sim.studies.trials import interval_row, rms_deg
from sim.world.scenario import scenario_of
from sim.world.world import World

Array = npt.NDArray[np.float64]
SETTLED = 20.0  # s after a stop
KINDS = ("at rest", "at the survey", "revised", "smoothed")
RATIO = 1.2  # of ours to the bound, at most
BASE: Tables = change_sections(
    RESTING,
    encoder={"phase": "random"},
    gyroscope={"increments": True},
    joints={"reading_std_deg": 0.0, "mount_std_deg": 0.0},
    medium={"loss": 0.0},
)


@dataclass(frozen=True, slots=True)
class LimitCase:
    """A string and its aiding; ``reach`` is in deg, at rest, at the survey (revised) and smoothed."""

    name: str
    setup: Tables
    hops: int
    reach: tuple[float, float | None, float]


CASES = (
    LimitCase("continuous", BASE, 1, (0.0052, None, 0.010)),
    LimitCase("20 s on / 30 s off", change_sections(BASE, aiding=on_off(20.0, 30.0)), 1, (0.013, None, 0.010)),
    LimitCase("20 s on / 60 s off", change_sections(BASE, aiding=on_off(20.0, 60.0)), 1, (0.036, 0.05, 0.010)),
    LimitCase(
        "hop 50, 20 s on / 30 s off",
        change_sections(BASE, rig=complete_string(50), aiding=on_off(20.0, 30.0), clocks={"joint_std_ms": 5.0}),
        50,
        (0.026, 0.05, 0.010),
    ),
)


@dataclass(frozen=True, slots=True)
class LimitRun:
    """One seed of the lowest node: errors (rad) of each kind, and the variances (rad^2) stated and best."""

    errors: dict[str, Array]
    stated: dict[str, Array]
    best: dict[str, Array]


def count_steps(seeds: int) -> int:
    """Runs of all seeds."""
    return seeds * len(CASES)


def run_study(seeds: int, step: Step) -> dict[str, Any]:
    """A row for every kind of figure of every case."""
    cases: list[dict[str, Any]] = []
    with over_cores(seeds, step) as run_all:
        for case in CASES:
            cases += rows_of(case, run_all(run_seed, seed_jobs(case.setup, seeds)))
    return {"experiment": "limits", "seeds": seeds, "cases": cases}


def run_seed(job: tuple[Tables, int]) -> LimitRun:
    """One seed of one case, for a pool of processes."""
    tables, seed = job
    world = World(scenario_of(dict(tables)), seed)
    hops = world.scenario.tubes
    return compare_with_bound(
        world, DirectString(world).drill(), bound_of(model_of(world, hops), node_timeline(world), world.begin)
    )


def compare_with_bound(world: World, run: StringRun, bound: Bound) -> LimitRun:
    """The lowest node, tube 1, in every rest but the last."""
    rests = [phase for phase in world.phases if phase.kind == "stop"][: BLOCKS - 1]
    turns = [phase for phase in world.phases if phase.kind == "drill"][1:]
    settled = np.zeros(world.cycles, np.bool_)
    for rest in rests:
        settled |= (world.ends >= rest.start + SETTLED) & (world.ends <= rest.end)
    surveys = [survey for survey in run.surveys if survey.tube == 1][: len(rests)]
    said = {
        "at the survey": surveys,
        "revised": [last_word(run, one, world.ends, turn.start) for one, turn in zip(surveys, turns, strict=True)],
        "smoothed": [last_word(run, one, world.ends, math.inf) for one in surveys],
    }
    at = np.searchsorted(bound.times, [world.ends[one.cycle] for one in surveys])
    end = np.searchsorted(bound.times, [turn.start for turn in turns]) - 1
    errors = {kind: np.array([one.error for one in found]) for kind, found in said.items()}
    stated = {kind: np.array([one.measurement.yaw_var for one in found]) for kind, found in said.items()}
    best = {"at the survey": bound.filtered[at], "revised": bound.filtered[end], "smoothed": bound.smoothed[at]}
    errors["at rest"], stated["at rest"] = run.error[settled, 0], run.var[settled, 0]
    best["at rest"] = bound.filtered[np.searchsorted(bound.times, world.ends[settled])]
    return LimitRun(errors, stated, best)


def last_word(run: StringRun, first: StringSurvey, ends: Array, before: float) -> StringSurvey:
    """Last revision of a survey that was sent before rig time ``before`` (s)."""
    again = [one for one in run.revisions if (one.cycle, one.tube) == (first.cycle, first.tube)]
    return next((one for one in reversed(again) if ends[one.said] < before), first)


def rows_of(case: LimitCase, runs: Sequence[LimitRun]) -> list[dict[str, Any]]:
    """Figures of one case; joints and mounts are exact."""
    reach = dict(zip(("at rest", "revised", "smoothed"), case.reach, strict=True))
    rows = []
    for kind in KINDS:
        figure = rms_deg([one.errors[kind] for one in runs])
        best = math.degrees(math.sqrt(float(np.mean([np.mean(one.best[kind]) for one in runs]))))
        nees = float(np.mean([np.mean(one.errors[kind] ** 2 / one.stated[kind]) for one in runs]))
        told = interval_row(case.name, f"yaw {kind}", figure, to_reach=reach.get(kind))
        rows.append(told | {"bound": best, "ratio": figure[0] / best, "nees": nees})
    return rows


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """Line on the figures that are too far from the bound."""
    far = [f"{one['case']}, {one['quantity']}: {one['ratio']:.2f}" for one in result["cases"] if one["ratio"] > RATIO]
    return [f"more than {RATIO:g} times the bound: {'; '.join(far)}" if far else f"within {RATIO:g} times the bound"]
