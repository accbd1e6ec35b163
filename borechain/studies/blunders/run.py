"""What becomes of a blunder: it is named rightly, told as a doubt, too small to matter, or in no reading at all.

Rigs are those of the study ``set-up``, each with one blunder of a kind and a size beside what is drawn. The worst
error of a station, direction or position, is counted in what is stated of it. Beyond three standard deviations a hole
may not be ON TARGET without a word: that is ``missed``. What the last look alone may hide is told beside the sigma, and
counts there; so does what an encoder that slips at every stop may do unfound, in a rig whose encoder does.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from borechain.studies.blunders.answer_given import AnswerGiven, answer_of
from borechain.studies.blunders.kinds import KINDS, PlantedBlunder
from borechain.studies.drawn_rigs import KnownSetUp, RigDraw, drawn_rigs, tables_of
from borechain.studies.heard_ground import IN_ONE, heard_ground
from borechain.studies.judged_hole import judge_hole_of
from sim.studies.pool import Step, over_cores
from sim.studies.scenarios import Tables
from sim.world.scenario import scenario_of
from sim.world.world import World

USUAL: Final = KnownSetUp()
BEYOND: Final = 3.0  # standard deviations
FALSELY_BLAMED: Final = 0.001  # of honest holes, at most
ENOUGH: Final = 3000  # honest holes: that none of them is blamed tells that with 95 %
HONEST: Final = "honest"


@dataclass(frozen=True, slots=True)
class BlunderJob:
    """One rig with a blunder, by its place in the table and the place of its size; or an honest one."""

    draw: RigDraw
    kind: int | None = None
    size: int = 0


@dataclass(frozen=True, slots=True)
class BlunderRun:
    """One rig: worst error of all and of a direction, in standard deviations stated; the toe's in mm; the answer."""

    worst: float
    direction: float
    toe_mm: float
    answer: AnswerGiven


def count_steps(seeds: int, honest: int, first: int) -> int:
    """Rigs of all kinds and sizes, and honest ones."""
    del first
    return honest + seeds * sum(len(kind.sizes) for kind in KINDS)


def run_study(seeds: int, honest: int, first: int, step: Step) -> dict[str, Any]:
    """A row for each kind and size, and one of honest rigs, drawn from a first number on; ``step`` after each rig."""
    places = [(kind, size) for kind in range(len(KINDS)) for size in range(len(KINDS[kind].sizes))]
    with over_cores(max(seeds, honest), step) as run_all:
        of_honest = run_all(run_rig, [BlunderJob(draw) for draw in drawn_rigs(USUAL, honest, first)])
        rows = []
        for kind, size in places:
            runs = run_all(run_rig, [BlunderJob(draw, kind, size) for draw in drawn_rigs(USUAL, seeds, first)])
            rows.append(blunder_row(KINDS[kind], size, runs))
    blamed = sum(bool(run.answer.causes) for run in of_honest)
    return {
        "experiment": "blunders",
        "seeds": seeds,
        "honest": honest,
        "first": first,
        "blamed": blamed,
        "cases": [honest_row(of_honest), *rows],
    }


def tables_with(job: BlunderJob) -> Tables:
    """Scenario of a rig with its blunder."""
    tables = tables_of(job.draw)
    return tables if job.kind is None else KINDS[job.kind].change(tables, KINDS[job.kind].sizes[job.size])


def run_rig(job: BlunderJob) -> BlunderRun:
    """One rig, for a pool of processes."""
    world = World(scenario_of(dict(tables_with(job))), job.draw.seed)
    with heard_ground(world, IN_ONE) as ground:
        judged = judge_hole_of(world, ground.model.hole)
        is_drift = job.kind is not None and KINDS[job.kind].is_drift
        direction, worst = (judged.without_drift() if is_drift else judged).worst_sigmas()
        toe = 1e3 * float(np.linalg.norm(judged.error[-1, :2])) if len(judged.md) else math.nan
        return BlunderRun(worst, direction, toe, answer_of(ground))


def outcome_of(run: BlunderRun, named: Sequence[str], seen_by: str = "") -> str:
    """What became of a blunder; ``seen_by`` is the check that alone sees one that is in no reading."""
    if any(cause in named for cause in run.answer.causes):
        return "named"
    if run.answer.is_doubted:
        return "doubted"
    if run.worst <= BEYOND:
        return "below"
    return "unseen" if seen_by else "missed"


def blunder_row(kind: PlantedBlunder, size: int, runs: Sequence[BlunderRun]) -> dict[str, Any]:
    """Row of one kind and size."""
    counts = Counter(outcome_of(run, kind.named, kind.seen_by) for run in runs)
    beyond = [run for run in runs if run.worst > BEYOND]
    on_target = sum(run.answer.word == "on_target" for run in beyond)
    return {
        "case": kind.name,
        "size": f"{kind.sizes[size]:g} {kind.unit}".strip() if len(kind.sizes) > 1 else "",
        "rigs": len(runs),
        **{name: counts[name] for name in ("named", "doubted", "below", "unseen", "missed")},
        "beyond_on_target": on_target,
        "worst_sigmas": float(np.median([run.worst for run in runs])),
        "direction_sigmas": float(np.median([run.direction for run in runs])),
        "toe_mm": median_toe(runs),
        "causes": most_common_causes(runs),
        "seen_by": kind.seen_by,
    }


def honest_row(runs: Sequence[BlunderRun]) -> dict[str, Any]:
    """Row of rigs without a blunder: what is blamed there is blamed falsely."""
    beyond = [run for run in runs if run.worst > BEYOND]
    return {
        "case": HONEST,
        "size": "",
        "rigs": len(runs),
        "named": sum(bool(run.answer.causes) for run in runs),
        "doubted": sum(run.answer.is_doubted for run in runs),
        "below": sum(run.worst <= BEYOND for run in runs),
        "unseen": 0,
        "missed": sum(not run.answer.is_doubted for run in beyond),
        "beyond_on_target": sum(run.answer.word == "on_target" for run in beyond),
        "worst_sigmas": float(np.median([run.worst for run in runs])),
        "direction_sigmas": float(np.median([run.direction for run in runs])),
        "toe_mm": median_toe(runs),
        "causes": most_common_causes(runs),
        "seen_by": "",
    }


def median_toe(runs: Sequence[BlunderRun]) -> float | None:
    """Median error of the toe, mm; None where no hole was surveyed."""
    found = [run.toe_mm for run in runs if math.isfinite(run.toe_mm)]
    return float(np.median(found)) if found else None


def most_common_causes(runs: Sequence[BlunderRun]) -> str:
    """Causes that were named, the most frequent first, with their numbers."""
    counts = Counter(cause for run in runs for cause in run.answer.causes)
    return ", ".join(f"{cause} {count}" for cause, count in counts.most_common(3))


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """What may never be, and how often honest holes are blamed."""
    rows = [row for row in result["cases"] if row["case"] != HONEST]
    missed = sum(row["missed"] for row in rows)
    wrong = sum(row["beyond_on_target"] for row in rows if not row["seen_by"])
    unseen = sum(row["unseen"] for row in rows)
    checks = sorted({row["seen_by"] for row in rows if row["unseen"]})
    share = result["blamed"] / result["honest"]
    word = "holds" if share <= FALSELY_BLAMED else "is missed"
    if share <= FALSELY_BLAMED and result["honest"] < ENOUGH:
        word = f"takes {ENOUGH} to tell"
    return [
        f"{len({row['case'] for row in rows})} kinds: {missed} of {sum(row['rigs'] for row in rows)} rigs beyond "
        f"{BEYOND:g} standard deviations without a word, {wrong} of them or others ON TARGET; 0 expected",
        f"{unseen} more are in no reading, and are seen by {', '.join(checks) or 'nothing else'}",
        f"honest holes: {result['blamed']} of {result['honest']} blamed; one in a thousand {word}",
    ]
