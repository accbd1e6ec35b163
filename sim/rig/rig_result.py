"""What came of a run: the answers of its ground station beside the truth, as one object for JSON."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sim.rig.calibration_report import calibration_result
from sim.rig.report import figures_of_merit, missing_surveys, station_digest, station_table
from sim.world.world import World

NAMED = 5  # surveys named that are missing


def rig_result(answers: dict[str, Any], world: World) -> dict[str, Any]:
    """The object that ``borechain rig --json`` prints, from what the ground station ``answers`` by path."""
    stations = station_table(answers["stations"]["stations"], world)
    measurements = answers["measurements"]["measurements"]
    result: dict[str, Any] = {
        "stations": stations,
        "figures": figures_of_merit(stations, measurements, world),
        "measurements": len(measurements),
        "column": {key: answers["column"][key] for key in ("worst", "projection", "ahead", "dominant")},
        "missing": missing_surveys(measurements, world),
        "alarms": answers["alarms"]["active"],
        "rig_alarms": answers["alarms"]["rig"],
        "rig_s": round(world.end - world.begin, 3),
        "digest": station_digest(stations),
    }
    if "wall" in answers:
        result["wall"] = answers["wall"]["wall"]
        if result["wall"] is not None:  # into whose file the hole goes
            result["trajectory"] = answers["trajectory"]["points"]
    if world.rack is not None:
        result["calibration"] = calibration_result(answers["recalibration"], measurements, world)
    return result


def missing_surveys_line(missing: list[dict[str, Any]], measured: int, folder: Path) -> str:
    """Line about surveys that the stops of a run asked for and that were not taken."""
    named = ", ".join(f"tube {row['tube']} at {row['bit_md_m']:g} m of the bit" for row in missing[:NAMED])
    more = f" and {len(missing) - NAMED} more" if len(missing) > NAMED else ""
    return f"expected {measured + len(missing)} surveys, {len(missing)} are missing: {named}{more}; files in {folder}"
