"""A node's whole step and its aiding, by who calls it: node by node from Python, a string a call, all cycles compiled.

Run it as ``borechain bench step``. The string is ten tubes of a study that turn and rest, with its link off; readings
and measurements are worked out before the clock starts. A figure is the processor's time of this thread for one
node-cycle with its aiding, the median over blocks that alternate; ``ratio`` is how many times faster ours is than the
peer, which is the first row.
"""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from node.firmware.inputs import ImuReading, RigContext
from node.firmware.tube import Tube
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import (
    AIDING,
    CLOCK_VAR,
    END,
    HOPS,
    JOINED,
    MOMENT,
    READING,
    START,
    SYNCHRONISED,
    new_node,
)
from node.kernels.record.sensor_record import PARAMETERS
from node.kernels.step.address import firmware_addresses
from node.kernels.step.string_step import string_aiding, string_step
from sim.studies.epochs import resting_string
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import Aiding

TUBES = 10
BLOCKS = 7
CLOCK_STD = 1e-3  # s
NEVER = 10**9  # cycles


class Inputs(NamedTuple):
    """What the nodes take in, cycle by cycle: (cycles, tubes, 1, 8), (cycles, tubes, 6) and (cycles, 12)."""

    readings: Any
    moments: Any
    aidings: Any


def inputs_of(world: World) -> Inputs:
    """Readings of every tube, the times of its cycles, and an exact measurement of the drive head after each."""
    cycles, tubes = world.cycles, world.scenario.tubes
    readings = np.zeros((cycles, tubes, 1, READING))
    moments, aidings = np.zeros((cycles, tubes, MOMENT)), np.zeros((cycles, AIDING))
    angle, rate, _ = world.motion.drive(world.ends)
    for k in range(tubes):
        readings[:, k, 0, :6] = world.sensors.samples(k + 1)
        readings[:, k, 0, 6] = 25.0
        moments[:, k, START], moments[:, k, END] = world.ends - (world.ends[1] - world.ends[0]), world.ends
        moments[:, k, HOPS], moments[:, k, CLOCK_VAR] = tubes - k, CLOCK_STD**2 * (tubes - k)
    moments[:, :, JOINED] = moments[:, :, SYNCHRONISED] = 1.0
    aidings[:, 0], aidings[:, 1], aidings[:, 4] = angle % (2.0 * np.pi), 2.7e-9, rate
    aidings[:, 5], aidings[:, 6] = world.ends, np.arange(cycles)
    return Inputs(readings, moments, aidings)


class String:
    """Nodes that know nothing yet, in one array."""

    def __init__(self, world: World, kernel: str) -> None:
        tubes = world.scenario.tubes
        config = default_config()
        self.nodes = np.repeat(new_node(config), tubes)
        self.corrections = np.zeros((tubes, 2), PARAMETERS)
        settings = [world.tube_settings(k + 1) for k in range(tubes)]
        self.tubes = [
            Tube(
                replace(one, kernel=kernel, state_every=NEVER),
                config,
                self.nodes[k : k + 1],
                iter(range(NEVER)).__next__,
                restored=False,
                corrections=self.corrections[k],
            )
            for k, one in enumerate(settings)
        ]
        self.crews = np.concatenate([tube.settings_record for tube in self.tubes])
        self.places = np.arange(tubes)[::-1].copy()


def node_by_node(string: String, inputs: Inputs) -> Callable[[], None]:
    """Every node by its own object, from Python, as a process calls it."""
    cycles, tubes = inputs.aidings.shape[0], len(string.tubes)
    readings = [
        [
            ImuReading(*moment[START : END + 1].tolist(), tuple(row[0, :3].tolist()), tuple(row[0, 3:6].tolist()))
            for row, moment in zip(inputs.readings[k], inputs.moments[k], strict=True)
        ]
        for k in range(cycles)
    ]
    around = [RigContext(True, tubes - k, 0.0, CLOCK_STD**2 * (tubes - k), True) for k in range(tubes)]
    heard = [
        Aiding(a[0], a[1], a[2], a[3], a[4], a[5], int(a[6]), int(a[7])) for a in map(np.ndarray.tolist, inputs.aidings)
    ]

    def run() -> None:
        for k in range(cycles):
            for tube, reading, context in zip(string.tubes, readings[k], around, strict=True):
                tube.on_cycle(reading, context)
            aiding: Aiding | None = heard[k]
            for tube in reversed(string.tubes):
                aiding = tube.on_aiding(aiding, aiding.valid_at) if aiding is not None else None

    return run


def string_by_string(string: String, inputs: Inputs) -> Callable[[], None]:
    """A cycle of the whole string in one call from Python, as a study calls it."""
    tubes = len(string.tubes)
    mask, says = np.ones(tubes, np.bool_), np.zeros(tubes, np.int64)
    step, aid = firmware_addresses()

    def run() -> None:
        nodes, crews = string.nodes, string.crews
        for k in range(len(inputs.aidings)):
            readings, moments = inputs.readings[k], inputs.moments[k]
            string_step(step, nodes, crews, string.corrections, readings, moments, mask, says)
            valid = np.full(tubes, inputs.aidings[k, 5])
            string_aiding(aid, nodes, crews, string.places, tubes, valid, inputs.aidings[k].copy())

    return run


@njit
def all_cycles(
    step: Any,
    aid: Any,
    nodes: Any,
    crews: Any,
    corrections: Any,
    readings: Any,
    moments: Any,
    aidings: Any,
    places: Any,
    mask: Any,
    says: Any,
    valid: Any,
    work: Any,
) -> None:
    """Every cycle of the string in one compiled loop."""
    for k in range(aidings.shape[0]):
        string_step(step, nodes, crews, corrections, readings[k], moments[k], mask, says)
        for j in range(valid.shape[0]):
            valid[j] = aidings[k, 5]
        for j in range(work.shape[0]):
            work[j] = aidings[k, j]
        string_aiding(aid, nodes, crews, places, places.shape[0], valid, work)


def compiled(string: String, inputs: Inputs) -> Callable[[], None]:
    """All cycles in one call."""
    tubes = len(string.tubes)
    work = np.ones(tubes, np.bool_), np.zeros(tubes, np.int64), np.zeros(tubes), np.zeros(AIDING)

    def run() -> None:
        tables = string.nodes, string.crews, string.corrections
        all_cycles(
            *firmware_addresses(), *tables, inputs.readings, inputs.moments, inputs.aidings, string.places, *work
        )

    return run


def run() -> dict[str, Any]:
    """Time of a node-cycle with its aiding, s.

    Returns
    -------
    dict
        ``ratios``: by what is compared, ``ours``, ``peer`` and ``ratio``, peer over ours.

    Raises
    ------
    RuntimeError
        When the nodes end with another yaw by another caller.
    """
    world = World(scenario_of(dict(resting_string(TUBES))), 1)
    inputs = inputs_of(world)
    callers = {
        "node by node, from Python": (node_by_node, "float64"),
        "integers, node by node": (node_by_node, "fixed"),
        "a string a call": (string_by_string, "float64"),
        "compiled loop": (compiled, "float64"),
    }
    times: dict[str, list[float]] = {name: [] for name in callers}
    yaws: dict[str, bytes] = {}
    for block in range(BLOCKS + 1):
        for name, (caller, kernel) in callers.items():
            string = String(world, kernel)
            work = caller(string, inputs)
            begin = time.thread_time()
            work()
            spent = (time.thread_time() - begin) / (len(inputs.aidings) * TUBES)
            if block:  # the first compiles or loads
                times[name].append(spent)
            yaws[name] = string.nodes["filter"]["now_yaw"].tobytes()
    if len({yaw for name, yaw in yaws.items() if "integers" not in name}) > 1:
        raise RuntimeError("the nodes end with another yaw by another caller")
    medians = {name: statistics.median(values) for name, values in times.items()}
    peer = medians["node by node, from Python"]
    return {
        "bench": "step",
        "ratios": {name: {"ours": ours, "peer": peer, "ratio": peer / ours} for name, ours in medians.items()},
    }


if __name__ == "__main__":
    print(json.dumps(run(), indent=1))
