"""NEES and coverage to hop 50 over thousands of strings, by a campaign: the string of the consistency study.

Joints and mounts err by their stated sigma, every joint adds 5 ms to the error of the clocks, 30 % of the aiding is
lost on its way to hop 50, and the encoder is heard for 20 s and then not for 30 s. Where the other studies give a few
hundred strings and know a NEES within a tenth, this knows it within a fiftieth.

The rough world is that of the study ``worlds``: `scenarios/rough.toml` without untold twist, upon the same strings.
What a node doubts there it states with the errors of joints and mounts, so the NEES of the random part alone says
nothing of its honesty, and only the other is told.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from node.kernels.record.filter_record import Scheme
from sim.campaign.campaign_run import run_campaign
from sim.studies.consistency.run import EVERY, SHOWN, setup_of
from sim.studies.pool import Step
from sim.studies.worlds.run import WORLDS
from sim.world.scenario import scenario_of


def count_steps(runs: int, hops: int, world: str) -> int:
    """Strings."""
    del hops, world
    return runs


def run_study(runs: int, hops: int, world: str, step: Step) -> dict[str, Any]:
    """Table of an honest relay; ``step`` is called after each string.

    Parameters
    ----------
    runs : strings, each a seed
    hops : nodes of each
    world : ``assumed`` or ``rough``

    Returns
    -------
    dict
        ``cases``: a row of state and hop, as ``sim.campaign.summary.honesty_rows`` has it, of the hops that are shown;
        ``traces``: the rows of all hops.
    """
    scenario = scenario_of(dict(WORLDS[world](setup_of(Scheme.FORWARD, hops))))
    with tempfile.TemporaryDirectory(prefix="borechain-") as folder:
        rows = run_campaign(scenario, "honesty", Path(folder, "runs"), 1, runs, "local", None, step)["honesty"]
    cases = [{"case": f"{row['state']}, hop {row['hop']}", **row} for row in rows if row["hop"] in SHOWN]
    name = "honesty" if world == "assumed" else f"honesty-{world}"
    return {"experiment": name, "world": world, "runs": runs, "hops": hops, "cases": cases, "traces": rows}


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """Whether the NEES are those of honest nodes, and what share of errors lies inside what is stated for 95 %."""
    lines = assumed_world_lines(result) if result["world"] == "assumed" else rough_world_lines(result)
    least, most = column_range(result, "inside_95_percent")
    return [*lines, f"inside what is stated for 95 %: {least:.1f} to {most:.1f} %"]


def assumed_world_lines(result: dict[str, Any]) -> list[str]:
    """Lines for the world that the filter assumes: whether either NEES is 1 within the other studies' limits."""
    low, high = EVERY
    lines = []
    for of, words in (("nees", "NEES"), ("nees_total", "NEES with joints and mounts")):
        least, most = column_range(result, of)
        word = "honest" if low <= least and most <= high else "not honest"
        lines.append(f"{words}: {least:.3g} to {most:.3g} (allowed {low:g}..{high:g}): {word}")
    return lines


def rough_world_lines(result: dict[str, Any]) -> list[str]:
    """Lines for a rough world: range of the NEES of a node's stated variance, its doubts included."""
    least, most = column_range(result, "nees_total")
    return [f"NEES with joints, mounts and doubts: {least:.3g} to {most:.3g} (1: honest, less: more careful than that)"]


def column_range(result: dict[str, Any], of: str) -> tuple[float, float]:
    """Smallest and largest value of a column."""
    found = [row[of] for row in result["cases"]]
    return min(found), max(found)
