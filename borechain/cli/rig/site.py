"""The holes of a site, drilled one after the other: each ground station is told the wall that was drilled before."""

from __future__ import annotations

import csv
import warnings
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borechain.cli.rig.rig_command import RigJob, drill_job, page_with_password

if TYPE_CHECKING:
    from borechain.crew.log import RunLog
    from groundstation.gateway.page.page_settings import PageSettings
    from sim.world.scenario import Scenario
    from telemetry.media.zenoh_bus import ZenohBus

WALL_FILE, HEADS_FILE, STATIONS_FILE = "wall.toml", "heads.csv", "stations.csv"
Row = tuple[str, float, float, float]  # hole, measured depth (m), inclination and azimuth (deg)


def has_site(job: RigJob) -> bool:
    """Whether the scenario has holes of a wall; errors as ``load_scenario``."""
    return scenario_of(job).file.site is not None


def scenario_of(job: RigJob) -> Scenario:
    """Scenario of a job; what is odd about it is told when a hole of it is drilled."""
    from sim.world.scenario import load_scenario

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return load_scenario(job.scenario, job.faults)


def drill_site(
    job: RigJob, bus: ZenohBus | None, out: Path | None, page: PageSettings | None, log: RunLog | None, *, quiet: bool
) -> tuple[dict[str, Any], Path]:
    """Drill every hole, each in a folder of its own and with a seed of its own; result of the last and folder of all.

    The result has ``holes`` in the order of drilling: name, digest, and the wall as its ground station saw it last.

    Raises
    ------
    EnvironmentFault, RigError
        As ``drill_job``.
    """
    from sim.rig.launcher import next_run_folder, prepare_folder

    scenario = scenario_of(job)
    folder = out if out is not None else next_run_folder(Path("out") / job.scenario.stem)
    prepare_folder(folder)
    page = None if page is None else page_with_password(page)
    wall, surveyed = write_wall(folder, scenario), list[Row]()
    holes: list[dict[str, Any]] = []
    result: dict[str, Any] = {}
    for number, hole in enumerate(scenario.file.site.holes if scenario.file.site is not None else ()):
        if log is not None:
            log.on_hole(hole.name)
        write_stations(folder, surveyed)
        own = replace(job, seed=job.seed + number, wall=wall, hole=hole.name)
        result, _ = drill_job(own, bus, folder / hole.name, page, log, quiet=quiet)
        surveyed += rows_of(hole.name, result)
        holes.append({"hole": hole.name, "digest": result["digest"], "wall": result["wall"]})
    write_stations(folder, surveyed)
    return result | {"holes": holes}, folder


def write_wall(folder: Path, scenario: Scenario) -> Path:
    """Write the wall file of a site and the heads of its columns."""
    site, rig, design = scenario.file.site, scenario.file.rig, scenario.file.design
    if site is None:
        raise ValueError("expected a scenario with a site")
    length = design.length_m or rig.tubes * rig.tube_length_m
    path = folder / WALL_FILE
    path.write_text(
        f'name = "{site.name}"\nradius_m = {site.radius_m}\nthickness_m = {site.thickness_m}\nlength_m = {length}\n'
        f'heads = "{HEADS_FILE}"\nstations = "{STATIONS_FILE}"\n'
    )
    with (folder / HEADS_FILE).open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["column", "north_m", "east_m"])
        writer.writerows((hole.name, hole.north_m, hole.east_m) for hole in site.holes)
    return path


def write_stations(folder: Path, rows: list[Row]) -> None:
    """Write the surveys of the holes that are finished."""
    with (folder / STATIONS_FILE).open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["column", "md_m", "inclination_deg", "azimuth_deg"])
        writer.writerows(rows)


def rows_of(hole: str, result: dict[str, Any]) -> list[Row]:
    """Surveys of a finished hole from its vertical head down."""
    below = [(hole, s["md_m"], s["inclination_deg"], s["azimuth_deg"]) for s in result["stations"] if s["md_m"] > 0.0]
    return [(hole, 0.0, 0.0, 0.0), *below]
