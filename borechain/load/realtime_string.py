"""A string of real node processes on their own clocks, over zenoh on loopback, and what it shows."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from node.process.drivers.timed import TimedEncoder, TimedImu
from node.process.node_host import run_encoder, run_node
from sim.rig.processes import ProcessTable, Spec
from sim.rig.realtime_run import clock_offset, run_in_realtime
from sim.world.recording import record_sensors, turning_once
from sim.world.world import World
from telemetry.messages import BASE, ENCODER, Side
from telemetry.runtime.hosting import OwnTime, Place

RIG = "realtime"
START_ALLOWANCE = 0.25  # s a node, for which the string rests longer
CLOCK_STD = 10.0  # s, of a node's clock against the encoder's
SPARE = 120.0  # s, that the recordings are longer than the run


def measure_realtime_string(nodes: int, seconds: float, endpoint: str, folder: Path, seed: int) -> dict[str, Any]:
    """Let the string live for ``seconds``: overruns, jitter, memory and yaw of each process, their worst and sums.

    Raises
    ------
    RigError
        When a process ends early or is never heard.
    """
    world, table = prepare_processes(nodes, seconds, endpoint, folder, seed)
    return run_in_realtime(world, table, RIG, endpoint, seconds, folder)


def prepare_processes(nodes: int, seconds: float, endpoint: str, folder: Path, seed: int) -> tuple[World, ProcessTable]:
    """Record the string and write the table of its processes."""
    rest = START_ALLOWANCE * nodes + 0.5 * seconds
    length = rest + seconds + SPARE
    world = turning_once(nodes, time.monotonic(), rest, 0.25 * seconds, length, seed, CLOCK_STD)
    record_sensors(world, folder)
    order = [BASE, ENCODER, *range(nodes, 0, -1)]
    specs = {}
    for place in range(1, len(order)):
        address = order[place]
        neighbours = {Side.UPPER: order[place - 1]}
        if place + 1 < len(order):
            neighbours[Side.LOWER] = order[place + 1]
        own_time = OwnTime(neighbours, clock_offset(world, address))
        name = "encoder" if address == ENCODER else str(address)
        at = Place(RIG, endpoint, folder / name)
        if address == ENCODER:
            specs[name] = Spec(run_encoder, (at, TimedEncoder(folder / "encoder.npy"), own_time))
        else:
            imu = TimedImu(folder / f"tube-{address}.npy")
            specs[name] = Spec(run_node, (at, world.tube_settings(address), [imu], own_time))
    return world, ProcessTable(specs, ["borechain.drilling.preload"])
