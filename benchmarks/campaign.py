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

from node.firmware.block_trial import record_of
from node.kernels.arithmetic.angles import wrap_angle
from node.kernels.arithmetic.formats import CYCLE_RATE_HZ, PERIOD
from node.kernels.filter.float64.cycle import run_cycle
from node.kernels.record.node_record import A_HOPS, A_SEQUENCE, A_SYSTEMATIC, A_VALID, A_YAW, A_YAW_VAR, READING
from node.kernels.step.address import firmware_addresses
from node.kernels.string.relay import offer_aiding
from sim.campaign.chunk import RUNS, Campaign, run_chunk
from sim.campaign.course import Course
from sim.campaign.draws import Draws, draws_of, fresh_nodes, noise_of, tubes_of
from sim.campaign.drill import CODES, STATE_OF, SURVEY, drill
from sim.campaign.sensors import Work, draw, new_work, read_sensors
from sim.rig.encoder_course import measured_of
from sim.studies.epochs import resting_string
from sim.world.scenario import Scenario, load_scenario, scenario_of
from sim.world.world import World
from telemetry.parameters import ParameterBlock

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
    is_drawn: bool,
    nodes: Any,
    crews: Any,
    course: Course,
    noise: Any,
    tubes: Any,
    draws: Draws,
    key: Any,
    work: Work,
    tape: Tape,
) -> None:
    """The filter of every node over all cycles: what it reads is drawn here, or lies on the ``tape``."""
    for cycle in range(course.ends.shape[0]):
        top = course.powered[cycle]
        start, end = course.begin + cycle * PERIOD, course.ends[cycle]
        for k in range(top):
            if is_drawn:
                draw(work.counter, key, work.words, work.drawn, cycle, k)
                is_first = cycle == 0 or course.powered[cycle - 1] <= k
                above = tubes[k - 1].hop_error if k > 0 else 0.0
                felt = course.rate, course.force, course.circle, course.shaken
                read_sensors(noise[0], tubes[k], is_first, above, *felt, work.drawn, work.readings[k], cycle, k)
                reading = work.readings[k, 0]
            else:
                reading = tape.readings[cycle, k]
                tubes[k].hop_error, tubes[k].hop_loses = tape.errors[cycle, k], tape.loses[cycle, k]
            joined = 1 if course.joined[cycle, k] != 0.0 else 0
            run_cycle(nodes[k].filter, nodes[k].config, reading[0:3], reading[3:6], start, end, joined)
        if not (course.heard[cycle] and draws.heard[cycle]):
            continue
        told = draws.measured[cycle]
        offset, systematic = 0.0, told[A_SYSTEMATIC]
        for hop in range(top):
            if tubes[hop].hop_loses:
                break
            k = top - 1 - hop
            offset = wrap_angle(offset + (crews[k].drive_angle if hop == 0 else crews[k + 1].lower_angle))
            systematic += crews[k].drive_var if hop == 0 else crews[k + 1].lower_var
            offer_aiding(
                nodes[k].filter,
                nodes[k].config,
                told[A_YAW],
                told[A_YAW_VAR],
                systematic,
                offset,
                told[A_VALID] + tubes[hop].hop_error,
                int(told[A_SEQUENCE]),
                int(told[A_HOPS]) + hop,
            )


@njit(error_model="numpy")
def record(course: Course, noise: Any, tubes: Any, key: Any, work: Work, tape: Tape) -> None:
    """Draw what ``kernels`` would, and keep it."""
    for cycle in range(course.ends.shape[0]):
        for k in range(course.powered[cycle]):
            draw(work.counter, key, work.words, work.drawn, cycle, k)
            is_first = cycle == 0 or course.powered[cycle - 1] <= k
            above = tubes[k - 1].hop_error if k > 0 else 0.0
            felt = course.rate, course.force, course.circle, course.shaken
            read_sensors(noise[0], tubes[k], is_first, above, *felt, work.drawn, work.readings[k], cycle, k)
            tape.readings[cycle, k] = work.readings[k, 0]
            tape.errors[cycle, k], tape.loses[cycle, k] = tubes[k].hop_error, tubes[k].hop_loses


class OneRun:
    """A run of wellbore 1, as the loops take it."""

    def __init__(self, scenario: Scenario) -> None:
        self.campaign = Campaign(scenario)
        self.world = World(scenario, SEED)
        self.course, self.noise = self.campaign.course, noise_of(scenario.file)
        self.draws = draws_of(self.world, measured_of(self.world))
        self.key, self.work = np.array([SEED, 0], np.uint64), new_work(scenario.tubes)
        shape = (len(self.course.ends), scenario.tubes)
        self.tape = Tape(np.zeros((*shape, READING)), np.zeros(shape), np.zeros(shape, np.int64))
        record(self.course, self.noise, self.tubes(), self.key, self.work, self.tape)

    def tubes(self) -> Any:
        """Sensors of the tubes, as new."""
        return tubes_of(self.world, self.draws.frame)

    def kernels(self, *, is_drawn: bool) -> tuple[float, bytes]:
        """Seconds of a node-cycle, and the yaws at the end."""
        nodes, crews = fresh_nodes(self.world)
        taken = self.course, self.noise, self.tubes(), self.draws, self.key, self.work, self.tape
        seconds = spent(lambda: kernels(is_drawn, nodes, crews, *taken))
        return seconds / self.campaign.node_cycles, nodes["filter"]["now_yaw"].tobytes()

    def whole(self) -> float:
        """Seconds of a node-cycle of the campaign's own loop."""
        nodes, crews = fresh_nodes(self.world)
        count, epochs = len(nodes), len(self.course.epochs)
        corrections = np.stack([np.concatenate([record_of(ParameterBlock(k + 1, 0))] * 2) for k in range(count)])
        taken = nodes, crews, corrections, self.course, self.noise, self.tubes(), self.draws, None, self.key
        kept = np.zeros(count * epochs, SURVEY), np.zeros((epochs, count), STATE_OF), np.zeros((count, CODES), np.int64)
        return spent(lambda: drill(*firmware_addresses(), *taken, self.work, *kept)) / self.campaign.node_cycles

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
    course = campaign.course
    return statistics.median(spent(lambda: campaign.run(SEED)) for _ in range(3)), len(course.ends) / CYCLE_RATE_HZ


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
