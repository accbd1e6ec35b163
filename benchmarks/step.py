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

from node.firmware.inputs import ImuReading, RigContext
from node.firmware.tube import Tube
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import (
    AIDING,
    new_node,
)
from node.kernels.record.sensor_record import PARAMETERS
from sim.string.drill import drill_string, new_memory
from sim.string.hops import HOP
from sim.string.nodes import StringNodes, loop_of
from sim.string.reading_suppliers import RecordedReadings, record_readings
from sim.string.schedule import StringSchedule
from sim.studies.epochs import resting_string
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import Aiding

TUBES = 10
BLOCKS = 7
CLOCK_STD = 1e-3  # s
NEVER = 10**9  # cycles


class Inputs(NamedTuple):
    """What the nodes of a complete string take in: readings, times of cycles, what the encoder measures."""

    recorded: RecordedReadings
    schedule: StringSchedule


def inputs_of(world: World) -> Inputs:
    """Readings of every tube, the times of its cycles, and an exact measurement of the drive head after each."""
    cycles, tubes, none = world.cycles, world.scenario.tubes, np.zeros(world.scenario.tubes)
    aidings = np.zeros((cycles, AIDING))
    angle, rate, _ = world.motion.drive(world.ends)
    aidings[:, 0], aidings[:, 1], aidings[:, 4] = angle % (2.0 * np.pi), 2.7e-9, rate
    aidings[:, 5], aidings[:, 6] = world.ends, np.arange(cycles)
    schedule = StringSchedule(
        begins=world.ends - (world.ends[1] - world.ends[0]),
        ends=world.ends,
        later=none,
        powered=np.full(cycles, tubes),
        joined=np.ones((cycles, tubes)),
        clock_var=CLOCK_STD**2 * np.arange(1.0, tubes + 1.0),
        measured=aidings,
        is_sent=np.ones(cycles, np.bool_),
        is_run=np.ones(cycles, np.bool_),
        dated_late=none,
        locked=True,
    )
    nothing = np.zeros((cycles, tubes))
    return Inputs(record_readings(world)._replace(errors=nothing, losses=nothing > 0.0), schedule)


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
        records = np.concatenate([tube.settings_record for tube in self.tubes])
        self.arrays = StringNodes(self.nodes, records, self.corrections)


def node_by_node(string: String, inputs: Inputs) -> Callable[[], None]:
    """Every node by its own object, from Python, as a process calls it."""
    schedule, cycles, tubes = inputs.schedule, len(inputs.schedule.ends), len(string.tubes)
    spans = list(zip(schedule.begins.tolist(), schedule.ends.tolist(), strict=True))
    readings = [
        [
            ImuReading(*span, tuple(row[0, :3].tolist()), tuple(row[0, 3:6].tolist()))
            for row in inputs.recorded.readings[k]
        ]
        for k, span in enumerate(spans)
    ]
    around = [RigContext(True, tubes - k, 0.0, CLOCK_STD**2 * (tubes - k), True) for k in range(tubes)]
    heard = [
        Aiding(a[0], a[1], a[2], a[3], a[4], a[5], int(a[6]), int(a[7]))
        for a in map(np.ndarray.tolist, schedule.measured)
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
    """A cycle of the whole string in one call from Python, as a study calls it that acts between two."""
    drilled = drilling(string, inputs)

    def run() -> None:
        for k in range(len(inputs.schedule.ends)):
            drilled(k, k + 1)

    return run


def compiled(string: String, inputs: Inputs) -> Callable[[], object]:
    """All cycles in one call."""
    drilled = drilling(string, inputs)
    return lambda: drilled(0, len(inputs.schedule.ends))


def drilling(string: String, inputs: Inputs) -> Callable[[int, int], object]:
    """The kernel of a string, from a cycle to another."""
    count, memory = len(string.tubes), new_memory()
    hops, shifts = np.zeros(count, HOP), np.zeros(count)
    given = *loop_of("float64", count), string.arrays, inputs.schedule, hops, shifts, memory
    return lambda first, last: drill_string(*given, first, last, inputs.recorded)


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
            spent = (time.thread_time() - begin) / (len(inputs.schedule.ends) * TUBES)
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
