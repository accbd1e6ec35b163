"""The result of a rig beside the truth: station table, figures of merit and digest."""

from __future__ import annotations

import csv
import hashlib
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sim.world.motion import SchedulePhase
from sim.world.world import World

STATION_KEYS = (
    "station",
    "md_m",
    "inclination_deg",
    "azimuth_deg",
    "north_m",
    "east_m",
    "tvd_m",
    "sigma_north_m",
    "sigma_east_m",
    "sigma_tvd_m",
    "measurements",
    "sigma_yaw_deg",
    "sigma_systematic_deg",
    "sigma_force_mps2",
)
TRUTH_KEYS = ("md_m", "inclination_deg", "azimuth_deg", "north_m", "east_m", "tvd_m")
AZIMUTH_FROM_INCLINATION_DEG = 1.0  # below, the azimuth of a lean says nothing


def wrap_deg(angle_deg: float) -> float:
    """Angle in (-180, 180]."""
    return 180.0 - (180.0 - angle_deg) % 360.0


def root_mean_square(values: Sequence[float]) -> float | None:
    """Root mean square, None of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else None


def station_table(stations: Sequence[dict[str, Any]], world: World) -> list[dict[str, Any]]:
    """Stations as the ground station served them, each with the truth at its depth."""
    rows = []
    for station in stations:
        row = {key: station[key] for key in STATION_KEYS}
        truth = world.truth_station(station["md_m"])
        row["truth"] = {key: truth[key] for key in TRUTH_KEYS}
        rows.append(row)
    return rows


def yaw_errors(measurements: Sequence[dict[str, Any]], world: World) -> list[tuple[int, float, float]]:
    """Hop, random yaw error (rad) and total normalised error squared of each survey, all at rest."""
    rows = []
    for m in measurements:
        tube, at = int(m["tube"]), float(m["station_at_s"])
        total = math.radians(wrap_deg(m["yaw_deg"] - math.degrees(world.yaw_truth(tube, at))))
        random = total - world.systematic_error(tube, at)
        variance = math.radians(m["sigma_yaw_deg"]) ** 2 + math.radians(m["sigma_systematic_deg"]) ** 2
        rows.append((int(m["hops"]), random, total * total / variance))
    return rows


def missing_surveys(measurements: Sequence[dict[str, Any]], world: World) -> list[dict[str, Any]]:
    """Tube and depth of the bit of every survey that a stop of the schedule asks for and that is missing."""
    taken = [(int(m["tube"]), float(m["station_at_s"])) for m in measurements]
    missing = []
    for stop, until in stops_of(world):
        for tube in range(1, stop.tube + 1):
            if not any(t == tube and stop.start <= at <= until for t, at in taken):
                missing.append({"tube": tube, "bit_md_m": round(world.bit_depth(stop.end), 6)})
    return missing


def stops_of(world: World) -> list[tuple[SchedulePhase, float]]:
    """Stops of the schedule, each with the rig time (s) until which the string stands."""
    drills = [phase.start for phase in world.phases if phase.kind == "drill"]
    stops = [phase for phase in world.phases if phase.kind == "stop"]
    return [(stop, min((at for at in drills if at >= stop.end), default=world.end)) for stop in stops]


def figures_of_merit(
    stations: Sequence[dict[str, Any]], measurements: Sequence[dict[str, Any]], world: World
) -> dict[str, Any]:
    """Figures of merit of one run; degrees and metres."""
    leaning = [s for s in stations if s["truth"]["inclination_deg"] > AZIMUTH_FROM_INCLINATION_DEG]
    errors = yaw_errors(measurements, world)
    hops = sorted({row[0] for row in errors})
    toe = stations[-1] if stations else None
    return {
        "azimuth_rms_deg": root_mean_square([wrap_deg(s["azimuth_deg"] - s["truth"]["azimuth_deg"]) for s in leaning]),
        "inclination_rms_deg": root_mean_square(
            [s["inclination_deg"] - s["truth"]["inclination_deg"] for s in stations]
        ),
        "toe_error_m": None if toe is None else math.dist(station_position(toe), station_position(toe["truth"])),
        "yaw_rms_deg_by_hop": [
            root_mean_square([math.degrees(row[1]) for row in errors if row[0] == hop]) for hop in hops
        ],
        "nees_by_hop": [float(np.mean([row[2] for row in errors if row[0] == hop])) for hop in hops],
    }


def station_position(station: dict[str, Any]) -> tuple[float, float, float]:
    """North, east and true vertical depth, m."""
    return station["north_m"], station["east_m"], station["tvd_m"]


def station_digest(stations: Sequence[dict[str, Any]]) -> str:
    """SHA-256 of the station table as measured, every bit of every number."""
    exact = [[float(s[key]).hex() for key in STATION_KEYS] for s in stations]
    return hashlib.sha256(json.dumps(exact).encode()).hexdigest()


def write_files(folder: Path, result: dict[str, Any]) -> None:
    """Station table as CSV and the whole result as JSON, each landing whole."""
    table = folder / "stations.csv.new"
    with table.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*STATION_KEYS, *(f"truth_{key}" for key in TRUTH_KEYS)])
        for s in result["stations"]:
            writer.writerow([*(s[key] for key in STATION_KEYS), *(s["truth"][key] for key in TRUTH_KEYS)])
    table.replace(folder / "stations.csv")
    report = folder / "result.json.new"
    report.write_text(json.dumps(result, indent=2) + "\n")
    report.replace(folder / "result.json")
