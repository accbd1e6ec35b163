"""A campaign from its scenario to its result: what is missing is computed, all of it is judged."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sim.campaign.campaign_folder import Folder
from sim.campaign.chunk import campaign_of, scenario_digest
from sim.campaign.engine import compute_chunks
from sim.campaign.summary import accuracy_rows, honesty_rows
from sim.world.scenario import Scenario


def run_campaign(
    scenario: Scenario,
    name: str,
    path: Path,
    first: int,
    runs: int,
    engine: str,
    scheduler: str | None,
    step: Callable[[], None],
) -> dict[str, Any]:
    """Run ``runs`` runs from ``first`` on that the folder ``path`` does not hold yet, and judge all that are asked.

    ``step`` is called once for each run, whether it was there or is done now.

    Returns
    -------
    dict
        ``honesty_rows`` and ``accuracy_rows`` (``sim.campaign.summary``), ``runs``, of them
        ``computed`` now, ``node_cycles`` of one.

    Raises
    ------
    ScenarioError
        When a campaign cannot express the scenario.
    RigError
        When the folder is another campaign's or cannot be written, or the cluster is lost.
    """
    last, pickled = first + runs - 1, pickle.dumps(scenario)
    node_cycles = campaign_of(pickled).node_cycles
    folder = Folder(path, name, scenario_digest(scenario))
    missing = folder.missing(first, last)
    computed = sum(end - begin + 1 for begin, end in missing)
    for _ in range(runs - computed):
        step()
    for (begin, end), chunk in compute_chunks(pickled, missing, engine, scheduler):
        folder.keep(begin, end, chunk)
        for _ in range(end - begin + 1):
            step()
    return {
        "scenario": name,
        "first": first,
        "runs": runs,
        "computed": computed,
        "node_cycles": node_cycles,
        "honesty": honesty_rows(folder.read("epochs", first, last)),
        "accuracy": accuracy_rows(folder.read("surveys", first, last)),
    }
