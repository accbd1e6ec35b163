"""Files of a site: its wall, the heads of its columns, and the surveys of the holes that are finished."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from sim.world.scenario import Scenario

WALL_FILE, HEADS_FILE, STATIONS_FILE = "wall.toml", "heads.csv", "stations.csv"
Row = tuple[str, float, float, float]  # hole, measured depth (m), inclination and azimuth (deg)


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


def hole_rows(hole: str, result: dict[str, Any]) -> list[Row]:
    """Surveys of a finished hole from its vertical head down."""
    below = [(hole, s["md_m"], s["inclination_deg"], s["azimuth_deg"]) for s in result["stations"] if s["md_m"] > 0.0]
    return [(hole, 0.0, 0.0, 0.0), *below]
