"""A rig of real processes that is weighed while it drills."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from borechain.drilling.drill_hole import read_world
from borechain.drilling.rig_host import opened_router
from borechain.drilling.rig_job import RigJob
from borechain.drilling.rig_processes import drill_in_processes, process_table
from borechain.load.hour import Scales, Weight, scenario_text
from sim.rig.processes import ProcessTable
from sim.rig.rig_result import rig_result

SAMPLES = 60


def weigh_rig(
    tubes: int, seconds: float, speed: float, endpoint: str, folder: Path
) -> tuple[list[Weight], dict[str, Any]]:
    """Drill for ``seconds`` of wall time; what the processes weighed, and what came of it."""
    scenario, home = folder / "hour.toml", folder / "run"
    scenario.write_text(scenario_text(tubes, seconds * speed))
    home.mkdir()
    job = RigJob(scenario, 1, speed, endpoint=endpoint)
    world = read_world(job)
    scales: list[Scales] = []

    def table_of(*place: Any) -> ProcessTable:
        table = process_table(world, job, home, None, *place)
        scales.append(Scales(table, home / "state" / "ground" / "ground.sqlite", seconds / SAMPLES))
        return table

    with opened_router(endpoint) as bus:
        run = drill_in_processes(world, job, bus, lambda _tick: scales[0].on_tick(), None, table_of)
    found = rig_result(run.answers, world)
    figures = {"surveys": found["measurements"], "missing": len(found["missing"]), "restarts": run.restarts}
    return scales[0].weights, {"bench": "hour", "tubes": tubes, "seconds": seconds, "speed": speed} | figures
