"""Every figure asked of the filter in two worlds, the one that it assumes and a rough one, beside each other.

The assumed world is that of the other studies: noise, clocks, drive and encoder as the filter models them. The rough
one is `scenarios/rough.toml`, all of its disturbances at once, upon the same strings under the same aiding. Untold
twist is left out there: one that is wound up once and is smaller than what the scale factor may be off is not
observable (docs/field.md), and every row would show the same tenth of a degree. The first row has it, by itself.

NEES is of the yaw against everything that the node states, doubts and the errors of joints and mounts included.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np

from node.kernels.record.filter_record import Scheme
from sim.studies import epochs, lab
from sim.studies.consistency.run import SHOWN, setup_of
from sim.studies.lab import LAB, REST, ROTATING, LabRun
from sim.studies.modes.run import CASES, ModeCase, cases_by_setup
from sim.studies.pool import Step, over_cores, seed_jobs
from sim.studies.scenarios import Tables, change_sections, complete_string
from sim.studies.trials import rms_deg
from sim.world.parsing import read_toml
from sim.world.shipped import shipped_folder

World = Callable[[Tables], Tables]
FILE = "rough.toml"
FIRST, LONG = "update-modes", "fifty-nodes"
TWIST = ModeCase("continuous 1.9 Hz, untold twist", LAB, None, 0.013, 0.035)


def assumed_world(setup: Tables) -> Tables:
    """The world of the filter's own model."""
    return setup


def shipped_rough_world(setup: Tables) -> Tables:
    """The rough world as it is shipped."""
    shipped = read_toml(shipped_folder() / FILE)
    return change_sections(setup, rough=shipped["rough"], encoder=shipped["encoder"])


def rough_world(setup: Tables) -> Tables:
    """The rough world without untold twist."""
    tables = shipped_rough_world(setup)
    string = {key: value for key, value in tables["rough"]["string"].items() if key != "twist_deg"}
    return change_sections(tables, rough={"string": string})


WORLDS: dict[str, World] = {"assumed": assumed_world, "rough": rough_world}
ALL, CONSISTENCY = "all", "consistency"


@dataclass(frozen=True, slots=True)
class WorldsJob:
    """A string in either world, the number of its seeds, and its figures; without figures its consistency."""

    worlds: dict[str, Tables]
    seeds: int
    cases: tuple[ModeCase, ...] = ()


def jobs_of(part: str, seeds: int, string_seeds: int, strings: int, hops: int) -> list[WorldsJob]:
    """Jobs of one part of the study, or of all."""
    jobs = []
    for name in (name for name in CASES if part in (ALL, name)):
        if name == FIRST:
            jobs.append(WorldsJob({"assumed": LAB, "rough": shipped_rough_world(LAB)}, seeds, (TWIST,)))
        for setup, cases in cases_by_setup(name):
            if name == LONG:
                of_last = tuple(last_node_case(case, hops) for case in cases)
                jobs.append(
                    WorldsJob(in_both(change_sections(setup, rig=complete_string(hops))), string_seeds, of_last)
                )
            else:
                jobs.append(WorldsJob(in_both(setup), seeds, tuple(cases)))
    if part in (ALL, CONSISTENCY):
        jobs.append(WorldsJob(in_both(setup_of(Scheme.FORWARD, hops)), strings))
    return jobs


def in_both(setup: Tables) -> dict[str, Tables]:
    """A setup in either world."""
    return {world: of(setup) for world, of in WORLDS.items()}


def last_node_case(case: ModeCase, hops: int) -> ModeCase:
    """The last node of a string of so many."""
    return replace(case, name=f"node {hops} of {hops}", hop=hops - 1)


def count_steps(part: str, seeds: int, string_seeds: int, strings: int, hops: int) -> int:
    """Seeds of either world: of all strings that are run together, and of the long one."""
    jobs = jobs_of(part, seeds, string_seeds, strings, hops)
    alone = [job.seeds for job in jobs if not job.cases]
    return len(WORLDS) * sum([*(count for count, _ in group_by_seeds(jobs)), *alone])


def run_study(part: str, seeds: int, string_seeds: int, strings: int, hops: int, step: Step) -> dict[str, Any]:
    """Both tables; ``step`` is called after each seed.

    Parameters
    ----------
    part : the name of a table of modes, ``nees_by_world``, or ``all``
    seeds : of strings of one and two nodes
    string_seeds : of the long string
    strings : of the long string whose NEES is told epoch by epoch, by a campaign
    hops : that it has

    Returns
    -------
    dict
        ``cases``: a row for each figure asked; ``nees_by_world``: one for each epoch and hop.
    """
    result: dict[str, Any] = {"experiment": "worlds", "seeds": seeds, "string_seeds": string_seeds, "hops": hops}
    result["strings"], result["cases"], result[CONSISTENCY] = strings, [], []
    jobs = jobs_of(part, seeds, string_seeds, strings, hops)
    with over_cores(max(seeds, string_seeds, strings), step) as run_all:
        for count, some in group_by_seeds(jobs):
            runs: dict[str, list[list[LabRun]]] = {}
            for world in WORLDS:
                runs[world] = run_all(lab.run_seed_of_each, seed_jobs([job.worlds[world] for job in some], count))
            for place, job in enumerate(some):
                of_job = {world: [of_seed[place] for of_seed in found] for world, found in runs.items()}
                result["cases"] += [row for case in job.cases for row in rows_of(case, of_job)]
        for job in (job for job in jobs if not job.cases):
            result[CONSISTENCY] += nees_by_world(
                {
                    world: run_all(epochs.run_campaign_seed, seed_jobs(setup, job.seeds))
                    for world, setup in job.worlds.items()
                }
            )
    return result


def group_by_seeds(jobs: Sequence[WorldsJob]) -> Iterator[tuple[int, list[WorldsJob]]]:
    """Strings that stand one after the other and have as many seeds: they are run seed by seed, with their seeds."""
    for count, some in groupby((job for job in jobs if job.cases), key=lambda job: job.seeds):
        yield count, list(some)


def rows_of(case: ModeCase, runs: dict[str, list[LabRun]]) -> list[dict[str, Any]]:
    """Figures of one case in either world."""
    hop = case.hop
    told: list[tuple[str, float | None, Callable[[LabRun], Any], Any]] = [
        ("yaw", case.yaw, lambda one: one.error[REST, hop], REST),
        ("azimuth", case.azimuth, lambda one: one.azimuth_error[hop : hop + 1], None),
        ("yaw, rotating", case.rotating, lambda one: one.error[ROTATING, hop], ROTATING),
    ]
    rows = []
    for quantity, to_reach, error, when in told:
        row: dict[str, Any] = {"case": case.name, "quantity": quantity, "to_reach": to_reach}
        row["published"] = case.published if quantity == "azimuth" else None
        for world, found in runs.items():
            row[world], row[f"{world}_low"], row[f"{world}_high"] = rms_deg([error(one) for one in found])
            row[f"{world}_nees"] = None if when is None else nees_of(found, when, hop)
        rows.append(row)
    return rows


def nees_of(runs: Sequence[LabRun], when: lab.Mask, hop: int) -> float:
    """Mean of error^2 over the variance stated with its systematic part."""
    return float(np.mean([one.error[when, hop] ** 2 / one.total_var[when, hop] for one in runs]))


def nees_by_world(found: dict[str, list[epochs.EpochRun]]) -> list[dict[str, Any]]:
    """NEES at fixed epochs with the errors of joints and mounts, in either world: one row an epoch and hop."""
    turning = next(iter(found.values()))[0].turning
    rows = []
    for epoch, turns in enumerate(turning):
        state = "turning" if turns else "at rest"
        for hop in (h for h in SHOWN if h <= next(iter(found.values()))[0].error.shape[1]):
            row: dict[str, Any] = {"case": f"{state} {epoch // 2 + 1}, hop {hop}"}
            for world, runs in found.items():
                error = np.array([one.total_error[epoch, hop - 1] for one in runs])
                var = np.array([one.total_var[epoch, hop - 1] for one in runs])
                row[f"{world}_deg"] = math.degrees(math.sqrt(float(np.mean(error**2))))
                row[f"{world}_nees"] = float(np.mean(error**2 / var))
            rows.append(row)
    return rows


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """In each world: how many figures are reached, and how far from 1 the NEES is."""
    lines = []
    asked = [row for row in result["cases"] if row["to_reach"] is not None]
    for world in WORLDS:
        reached = sum(row[world] <= row["to_reach"] for row in asked)
        words = [f"{reached} of {len(asked)} figures reached"] if asked else []
        for rows, of in ((result["cases"], "NEES"), (result[CONSISTENCY], "NEES along the string")):
            stated = [row[f"{world}_nees"] for row in rows if row[f"{world}_nees"] is not None]
            words += [f"{of} {min(stated):.2g} to {max(stated):.2g}"] if stated else []
        lines.append(f"{world}: {', '.join(words)}")
    return lines
