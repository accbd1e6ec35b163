"""The holes of a site, drilled one after the other: each ground station is told the wall that was drilled before."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

from borechain.drilling.drill_hole import drill_hole, page_with_password, run_folder
from borechain.drilling.rig_job import DrilledRig, RigJob, RigWatcher
from sim.rig.site_files import Row, hole_rows, write_stations, write_wall
from sim.world.scenario import Scenario, load_scenario
from telemetry.media.zenoh_bus import ZenohBus


def drill_scenario(job: RigJob, bus: ZenohBus | None, watcher: RigWatcher) -> DrilledRig:
    """Drill the hole of a scenario, or every hole of its site; ``bus`` and errors as ``drill_hole``."""
    scenario = read_scenario(job)
    if scenario.file.site is None:
        return drill_hole(job, bus, watcher)
    return drill_site(job, scenario, bus, watcher)


def read_scenario(job: RigJob) -> Scenario:
    """Scenario of a job; what is odd about it is told when a hole of it is drilled."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return load_scenario(job.scenario, job.faults)


def drill_site(job: RigJob, scenario: Scenario, bus: ZenohBus | None, watcher: RigWatcher) -> DrilledRig:
    """Drill every hole, each in a folder of its own and with a seed of its own; result of the last and folder of all.

    The result has ``holes`` in the order of drilling: name, digest, and the wall as its ground station saw it last.
    Errors as ``drill_hole``.
    """
    folder = run_folder(job)
    page = None if job.served is None else page_with_password(job.served, watcher.say)
    wall, surveyed = write_wall(folder, scenario), list[Row]()
    holes: list[dict[str, Any]] = []
    result: dict[str, Any] = {}
    for number, hole in enumerate(scenario.file.site.holes if scenario.file.site is not None else ()):
        if watcher.log is not None:
            watcher.log.on_hole(hole.name)
        write_stations(folder, surveyed)
        seed, place = job.seed + number, folder / hole.name
        own = replace(job, seed=seed, out=place, served=page, wall=wall, hole=hole.name)
        result = drill_hole(own, bus, watcher).result
        surveyed += hole_rows(hole.name, result)
        holes.append({"hole": hole.name, "digest": result["digest"], "wall": result["wall"]})
    write_stations(folder, surveyed)
    return DrilledRig(result | {"holes": holes}, folder)
