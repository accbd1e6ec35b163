"""A campaign's node-cycle against the bare kernel on the same readings, its second core, and a string of a hundred.

Run it as ``borechain bench campaign``. The runs are wellbore 1. The bare kernel is the filter's cycle and what hands it
an aiding, over readings that were drawn before; then the loop draws them itself, and then the nodes are whole. All
three are compiled loops over cycles and tubes. A figure is the processor's time of this thread for one node-cycle, the
median over blocks that alternate; ``ours_to_peer`` is beside ``at_most``, which is asked of it, and ``at_least`` is
asked of ``ratio``.
"""

from __future__ import annotations

import json
import multiprocessing
import pickle
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from node.kernels.arithmetic.angles import wrap_angle
from node.kernels.arithmetic.formats import CYCLE_RATE_HZ
from node.kernels.filter.float64.cycle import run_cycle
from node.kernels.record.node_record import A_HOPS, A_SEQUENCE, A_SYSTEMATIC, A_VALID, A_YAW, A_YAW_VAR, READING
from node.kernels.string.relay import offer_aiding
from sim.campaign.chunk import RUNS, Campaign, run_chunk
from sim.string.drill import drill_string, new_memory
from sim.string.head_measurements import measure_head
from sim.string.hops import draw_hops
from sim.string.nodes import loop_of, new_nodes
from sim.string.reading_suppliers import DrawnReadings, draw_readings
from sim.string.schedule import StringSchedule, redraw_schedule
from sim.studies.epochs import resting_string
from sim.world.scenario import Scenario, load_scenario, scenario_of
from sim.world.world import World

ROOT = Path(__file__).parents[1]
SEED = 1
BLOCKS = 11
LONG = 100  # tubes
CHUNKS = 4  # that one core and two are given
FEW, MANY = 2 * RUNS, 1000  # runs whose memory is compared
NODE_CYCLE, MINUTE = 2.5e-6, 60.0  # s, that are asked for
MIB = 1024.0  # kB, as the operating system counts


class Tape(NamedTuple):
    """What a run's nodes read and hear, drawn before: (cycles, tubes, READING), then (cycles, tubes) of the hops."""

    readings: Any
    errors: Any  # s, of rig time below the joint
    loses: Any


@njit(error_model="numpy")
def kernels(
    is_drawn: bool, nodes: Any, settings: Any, schedule: StringSchedule, drawn: DrawnReadings, hops: Any, tape: Tape
) -> None:
    """The filter of every node over all cycles: what it reads is drawn here, or lies on the ``tape``."""
    for cycle in range(schedule.ends.shape[0]):
        top, start, end = schedule.powered[cycle], schedule.begins[cycle], schedule.ends[cycle]
        if is_drawn:
            draw_readings(drawn, None, schedule, hops, cycle)
        for k in range(top):
            if is_drawn:
                reading = drawn.readings[k, 0]
            else:
                reading = tape.readings[cycle, k]
                hops[k].error, hops[k].loses = tape.errors[cycle, k], tape.loses[cycle, k]
            joined = 1 if schedule.joined[cycle, k] != 0.0 else 0
            run_cycle(nodes[k].filter, nodes[k].config, reading[0:3], reading[3:6], start, end, joined)
        if not schedule.is_sent[cycle]:
            continue
        told = schedule.measured[cycle]
        offset, systematic = 0.0, told[A_SYSTEMATIC]
        for hop in range(top):
            if hops[hop].loses:
                break
            k = top - 1 - hop
            offset = wrap_angle(offset + (settings[k].drive_angle if hop == 0 else settings[k + 1].lower_angle))
            systematic += settings[k].drive_var if hop == 0 else settings[k + 1].lower_var
            offer_aiding(
                nodes[k].filter,
                nodes[k].config,
                told[A_YAW],
                told[A_YAW_VAR],
                systematic,
                offset,
                told[A_VALID] + hops[hop].error,
                int(told[A_SEQUENCE]),
                int(told[A_HOPS]) + hop,
            )


@njit(error_model="numpy")
def record(schedule: StringSchedule, drawn: DrawnReadings, hops: Any, tape: Tape) -> None:
    """Draw what ``kernels`` would, and keep it."""
    for cycle in range(schedule.ends.shape[0]):
        draw_readings(drawn, None, schedule, hops, cycle)
        for k in range(schedule.powered[cycle]):
            tape.readings[cycle, k] = drawn.readings[k, 0]
            tape.errors[cycle, k], tape.loses[cycle, k] = hops[k].error, hops[k].loses


class OneRun:
    """A run of wellbore 1, as the loops take it."""

    def __init__(self, scenario: Scenario) -> None:
        self.campaign = Campaign(scenario)
        self.world = World(scenario, SEED)
        self.schedule = redraw_schedule(self.campaign.string.schedule, self.world, measure_head(self.world))
        shape = (self.world.cycles, scenario.tubes)
        self.tape = Tape(np.zeros((*shape, READING)), np.zeros(shape), np.zeros(shape, np.int64))
        record(self.schedule, *self.drawn(), self.tape)

    def drawn(self) -> tuple[DrawnReadings, Any]:
        """What readings are drawn from, and the hops, as new."""
        string = self.campaign.string
        return string.new_readings(self.world), draw_hops(self.world)

    def kernels(self, *, is_drawn: bool) -> tuple[float, bytes]:
        """Seconds of a node-cycle, and the yaws at the end."""
        nodes, settings, _ = new_nodes(self.world)
        taken = self.schedule, *self.drawn(), self.tape
        seconds = spent(lambda: kernels(is_drawn, nodes, settings, *taken))
        return seconds / self.campaign.node_cycles, nodes["filter"]["now_yaw"].tobytes()

    def whole(self) -> float:
        """Seconds of a node-cycle of the campaign's own loop."""
        (drawn, hops), log = self.drawn(), self.campaign.string.new_log()
        loop, nodes = loop_of("float64", len(hops)), new_nodes(self.world)
        shifts, memory, cycles = np.zeros(len(hops)), new_memory(), self.world.cycles
        given = *loop, nodes, self.schedule, hops, shifts, memory, 0, cycles
        return spent(lambda: drill_string(*given, drawn=drawn, log=log)) / self.campaign.node_cycles

    def with_columns(self) -> float:
        """Seconds of a node-cycle of a run from its draws to its columns."""
        return spent(lambda: self.campaign.run(SEED)) / self.campaign.node_cycles


def spent(work: Callable[[], Any]) -> float:
    """Seconds of this thread's processor that a call takes."""
    begin = time.thread_time()
    work()
    return time.thread_time() - begin


def node_cycles(one: OneRun) -> dict[str, float]:
    """Median seconds of a node-cycle by what is in it.

    Raises
    ------
    RuntimeError
        When the filters end with another yaw over readings drawn before than over the same drawn in the loop.
    """
    times: dict[str, list[float]] = {"bare": [], "drawn": [], "whole": [], "columns": []}
    for block in range(BLOCKS + 1):
        bare, on_tape = one.kernels(is_drawn=False)
        drawn, in_loop = one.kernels(is_drawn=True)
        if on_tape != in_loop:
            raise RuntimeError("the filters end with another yaw over readings drawn before")
        if block:  # the first compiles or loads
            for name, value in zip(times, (bare, drawn, one.whole(), one.with_columns()), strict=True):
                times[name].append(value)
        else:
            one.whole()
            one.with_columns()
    return {name: statistics.median(values) for name, values in times.items()}


def pool_time(scenario: bytes, processes: int) -> float:
    """Wall seconds in which a pool that is warm does the chunks."""
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        pool.starmap(run_chunk, [(scenario, 1, 1)] * 4 * processes, chunksize=1)  # loads the kernels in each
        begin = time.perf_counter()
        pool.starmap(run_chunk, [(scenario, 1 + k * RUNS, (k + 1) * RUNS) for k in range(CHUNKS)], chunksize=1)
        return time.perf_counter() - begin


def command_time(runs: int) -> tuple[float, float]:
    """Wall seconds of ``borechain campaign``, and the memory (MB) of the largest of its processes."""
    measure = (
        "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL);"
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    with tempfile.TemporaryDirectory(prefix="borechain-") as place:
        words = ["-m", "borechain", "campaign", "wellbore-1", "--runs", str(runs), "--json", "--out", f"{place}/runs"]
        begin = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-c", measure, sys.executable, *words], capture_output=True, text=True, check=True
        )
        return time.perf_counter() - begin, float(done.stdout) / MIB


def long_string() -> tuple[float, float]:
    """Processor's seconds of one run of a string of ``LONG`` tubes, and the rig's seconds in it."""
    campaign = Campaign(scenario_of(dict(resting_string(LONG))))
    campaign.run(SEED)
    cycles = len(campaign.string.schedule.ends)
    return statistics.median(spent(lambda: campaign.run(SEED)) for _ in range(3)), cycles / CYCLE_RATE_HZ


def beside(ours: float, peer: float, **asked: float) -> dict[str, float]:
    """A row: how many times faster ours is, and what is asked of it."""
    return {"ours": ours, "peer": peer, "ratio": peer / ours, "ours_to_peer": ours / peer, **asked}


def run() -> dict[str, Any]:
    """All figures.

    Returns
    -------
    dict
        ``ratios``: by what is compared, ``ours``, ``peer`` and ``ratio``, peer over ours; ``memory_mb`` of the largest
        process of the command, by the number of runs.

    Raises
    ------
    RuntimeError
        See ``node_cycles``.
    """
    scenario = load_scenario(ROOT / "scenarios" / "wellbore-1.toml")
    found = node_cycles(OneRun(scenario))
    one, two = (pool_time(pickle.dumps(scenario), processes) for processes in (1, 2))
    spent_s, rig_s = long_string()
    few, many = command_time(FEW), command_time(MANY)
    return {
        "bench": "campaign",
        "ratios": {
            "kernel, noise and truth, against the bare kernel": beside(found["drawn"], found["bare"], at_most=1.6),
            "whole step, noise and truth, against the bare kernel": beside(found["whole"], found["bare"], at_most=3.0),
            "a node-cycle from draws to columns, against 2.5 us": beside(found["columns"], NODE_CYCLE, at_least=1.0),
            f"{CHUNKS} chunks by two processes, against one": beside(two, one, at_least=1.8),
            f"{LONG} tubes, CPU, against rig time": beside(spent_s, rig_s, at_least=2000.0),
            f"{MANY} runs of wellbore 1 by the command, against 60 s": beside(many[0], MINUTE, at_least=1.0),
        },
        "memory_mb": {str(FEW): few[1], str(MANY): many[1]},
    }


if __name__ == "__main__":
    print(json.dumps(run(), indent=1))
