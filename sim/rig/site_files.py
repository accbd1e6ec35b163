"""Files of a site: its wall, the heads of its columns, and the surveys of the holes that are finished."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

from sim.world.scenario import Scenario

WALL_FILE, HEADS_FILE, STATIONS_FILE = "wall.toml", "heads.csv", "stations.csv"
COVARIANCE = {"cov_nn_m2": (0, 0), "cov_ne_m2": (0, 1), "cov_nd_m2": (0, 2), "cov_ee_m2": (1, 1), "cov_ed_m2": (1, 2),
              "cov_dd_m2": (2, 2)}  # fmt: skip
Row = tuple[str | float, ...]  # hole, measured depth (m), inclination and azimuth (deg), and the covariance


def write_wall(folder: Path, scenario: Scenario) -> Path:
    """Write the wall file of a site and the heads of its columns."""
    site, rig, design = scenario.file.site, scenario.file.rig, scenario.file.design
    if site is None:
        raise ValueError("expected a scenario with a site")
    length = design.length_m or rig.tubes * rig.tube_length_m
    path = folder / WALL_FILE
    path.write_text(
        f"name = {json.dumps(site.name)}\nradius_m = {site.radius_m}\n"
        f"thickness_m = {site.thickness_m}\nlength_m = {length}\n"
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
        writer.writerow(["column", "md_m", "inclination_deg", "azimuth_deg", *COVARIANCE])
        writer.writerows(rows)


def hole_rows(hole: str, result: dict[str, Any]) -> list[Row]:
    """Surveys of a finished hole from its collar down, as its ground station draws it and knows it."""
    return [
        (
            hole, point["md_m"], point["inclination_deg"], point["azimuth_deg"],
            *(point["covariance_m2"][a][b] for a, b in COVARIANCE.values()),
        )
        for point in result["trajectory"]
    ]  # fmt: skip
