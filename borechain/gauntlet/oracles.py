"""What must hold after every run, whatever the faults were."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from borechain.inline import InlineRig
from sim.gauntlet.world import TUBE_LENGTH, FaultyWorld
from sim.rig.report import wrap_deg
from telemetry.application.outbox import LIMIT
from telemetry.messages import BASE

DEPTH_TOLERANCE = 0.05  # m
SIGMAS = 5.0  # of a direction in the plane; 3 are exceeded by one good survey in ninety
TOLD = frozenset({"survey_missing", "numbers_lost", "numbers_missing", "survey_set_aside", "survey_unplaced", "disk"})


def violations(rig: InlineRig, world: FaultyWorld) -> list[str]:
    """Every oracle that does not hold, in words."""
    shown = rig.ask("alarms")
    told = {row["code"] for row in shown["rig"] + shown["rig_cleared"]}
    standing = {row["code"] for row in shown["rig"]}
    rows = rig.ask("measurements")["measurements"]
    return [
        *_each_once(rows),
        *_depths(rows),
        *_directions(rig, world),
        *_missing(rows, world, standing),
        *_health(rig.ask("status")["health"], standing),
        *_queues(rig),
        *([] if told or len(rows) == len(_expected(world)) else ["surveys are missing and no alarm was raised"]),
    ]


def _each_once(rows: list[dict[str, Any]]) -> Iterator[str]:
    seen: set[tuple[int, int]] = set()
    for row in rows:
        key = (row["tube"], row["sequence"])
        if key in seen:
            yield f"tube {row['tube']}: survey {row['sequence']} counts twice"
        seen.add(key)


def _depths(rows: list[dict[str, Any]]) -> Iterator[str]:
    """A survey is taken at rest, so at whole tubes: tube k at the stops s = k, k+1, ... at s - k + 1 lengths."""
    for row in rows:
        lengths = row["md_m"] / TUBE_LENGTH
        off = abs(lengths - round(lengths)) * TUBE_LENGTH
        if off > DEPTH_TOLERANCE or not 1 <= round(lengths) <= 3 - row["tube"]:
            yield f"tube {row['tube']}: survey {row['sequence']} is placed at {row['md_m']:.3f} m"


def _directions(rig: InlineRig, world: FaultyWorld) -> Iterator[str]:
    for station in rig.ask("stations")["stations"]:
        truth = world.truth_station(station["md_m"])
        inclination = math.radians(truth["inclination_deg"])
        along = math.radians(station["inclination_deg"] - truth["inclination_deg"])
        across = math.radians(wrap_deg(station["azimuth_deg"] - truth["azimuth_deg"])) * math.sin(inclination)
        sigma_along = math.radians(station["sigma_inclination_deg"])
        sigma_across = math.radians(station["sigma_azimuth_deg"]) * math.sin(inclination)
        size = math.hypot(along / sigma_along, across / sigma_across)
        if size > SIGMAS:
            yield f"station at {station['md_m']:.2f} m is {size:.1f} sigmas from the truth"


def _missing(rows: list[dict[str, Any]], world: FaultyWorld, standing: set[str]) -> Iterator[str]:
    have = [(row["tube"], round(row["md_m"] / TUBE_LENGTH)) for row in rows]
    lacking = [each for each in _expected(world) if each not in have]
    if lacking and not standing & TOLD:
        yield f"no survey of {lacking} (tube, station), and no alarm of it stands"


def _expected(world: FaultyWorld) -> list[tuple[int, int]]:
    stops = range(1, world.scenario.tubes + 1)
    return [(tube, stop - tube + 1) for stop in stops for tube in range(1, stop + 1)]


def _health(health: str, standing: set[str]) -> Iterator[str]:
    if health == "good" and standing & TOLD:
        yield f"health is good while {sorted(standing & TOLD)} stand"


def _queues(rig: InlineRig) -> Iterator[str]:
    for address, process in rig.stepper.processes.items():
        if process.endpoint.outbox_size > LIMIT:
            yield f"process {address}: {process.endpoint.outbox_size} messages wait"
    if BASE not in rig.stepper.processes:
        yield "the ground station is not there at the end"
