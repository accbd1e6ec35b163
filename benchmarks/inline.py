"""The rig in one process beside the rig of real processes, and what a tube more costs in either.

Run it as ``borechain bench inline``. Wellbore 1 is drilled both ways, with equal digests. Strings of 3 to 100 tubes
that hang complete are drilled a little and surveyed, in lockstep as fast as they can; what they cost is read while
they drill, so that no start of a process is in it. Of a string of a hundred the last tube knows the time and its yaw
after a minute and a half, and every joint carries what the others say meanwhile: what a node-cycle costs is read from
then on, and once more with what went before. ``ours_to_peer`` is beside ``at_most``, which is asked of it, and
``at_least`` is asked of ``ratio``.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import math
import os
import resource
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from borechain.drilling.drill_hole import read_world
from borechain.drilling.inline import InlineRig
from borechain.drilling.rig_host import opened_router
from borechain.drilling.rig_job import RigJob
from borechain.drilling.rig_processes import drill_in_processes, process_table, settings_of
from borechain.load.hour import scenario_text
from sim.rig.in_process import InProcessStepper, carry_unwritten
from sim.rig.launcher import Tick
from sim.rig.processes import ProcessTable
from sim.rig.realtime_run import cpu_seconds, memory_footprint, running_pids
from sim.rig.rig_progress import RigProgress
from sim.rig.stepper import Answer, FrameEvent
from telemetry.messages import BASE, ENCODER
from telemetry.runtime.stepped import Due

PR_SET_CHILD_SUBREAPER = 36
SCENARIO = Path(__file__).parents[1] / "scenarios" / "wellbore-1.toml"
TUBES = (3, 10, 25, 50, 100)
RIG_S = 360.0  # of a string
RUN_IN = 20.0  # s of rig time before anything is read
SETTLED = 120.0  # s, by when the last of a hundred tubes knows the time and its yaw
BEFORE_END = 10.0  # s


def run() -> dict[str, Any]:
    """Drill wellbore 1, seed 1, and the strings, inline and with processes.

    Returns
    -------
    dict
        ``ratios``: CPU seconds inline (ours) and of all processes together (peer), then what is asked of the strings;
        ``digests`` of wellbore 1 both ways; ``strings``: by the number of tubes, see ``cost``.

    Raises
    ------
    RuntimeError
        When the digests differ.
    """
    # a fork server outlives its launcher for a moment: as its reaper we are told the CPU time of all it forked
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1)
    inline_s, inline = drilled("--inline")
    processes_s, processes = drilled("--endpoint", free_endpoint())
    if inline != processes:
        raise RuntimeError(f"digests differ: inline {inline}, processes {processes}")
    strings = {tubes: cost(tubes) for tubes in TUBES}
    ten, hundred = strings[10], strings[100]
    return {
        "bench": "inline",
        "ratios": {
            "wellbore-1, CPU": beside(inline_s, processes_s),
            "CPU of a node-cycle over processes, 100 tubes beside 10": beside(
                hundred["cpu_s"], ten["cpu_s"], at_most=1.3
            ),
            "the same, with the time until all know the time and their yaw": beside(
                hundred["with_start_cpu_s"], ten["with_start_cpu_s"]
            ),
            "CPU of a node-cycle inline, 100 tubes beside 10": beside(hundred["inline_s"], ten["inline_s"]),
            "100 tubes over processes, wall beside rig time": beside(hundred["wall_s"], 1.0, at_least=2.0),
            "100 tubes inline, CPU beside rig time": beside(hundred["inline_wall_s"], 1.0, at_least=20.0),
        },
        "digests": [inline, processes],
        "strings": strings,
    }


def beside(ours: float, peer: float, **asked: float) -> dict[str, float]:
    """A row: how many times faster ours is, and what is asked of it."""
    return {"ours": ours, "peer": peer, "ratio": peer / ours, "ours_to_peer": ours / peer, **asked}


class Mark(NamedTuple):
    """What was spent until a moment, s."""

    rig: float
    wall: float
    cpu: float


class Meter:
    """Reads what a rig spends between its run-in, or the time when all of it has settled, and its end.

    Parameters
    ----------
    spent : CPU seconds of all its processes so far
    at_end : called once, when the last mark is read
    """

    def __init__(self, spent: Callable[[], float], at_end: Callable[[], None] = lambda: None) -> None:
        self._spent, self._at_end = spent, at_end
        self.marks: list[Mark] = []
        self.told = 0
        self.length = math.nan  # s of rig time

    def follow(self, tick: Tick | RigProgress) -> None:
        """The rig has told how far it is."""
        self.told += 1
        self.length = tick.end - tick.begin
        due = (tick.begin + RUN_IN, tick.begin + SETTLED, tick.end - BEFORE_END, math.inf)[len(self.marks)]
        if tick.rig_time >= due:
            self.marks.append(Mark(tick.rig_time, time.perf_counter(), self._spent()))
            if len(self.marks) == len(("run in", "settled", "before the end")):
                self._at_end()

    def per_second(self, *, with_start: bool = False) -> tuple[float, float]:
        """CPU and wall seconds of a second of rig time."""
        run_in, settled, last = self.marks
        first = run_in if with_start else settled
        rig = last.rig - first.rig
        return (last.cpu - first.cpu) / rig, (last.wall - first.wall) / rig


class Counting(InProcessStepper):
    """Counts cycles of tubes, and what the same steps put on the bus between real processes."""

    node_cycles = 0
    puts = 0

    def round(self, steps: Mapping[int, list[FrameEvent]]) -> dict[int, Answer]:
        """Step each process in turn."""
        answers = super().round(steps)
        for address, events in steps.items():
            kinds = [event.kind for event, _ in events]
            self.node_cycles += kinds.count(Due.CYCLE) if address not in (BASE, ENCODER) else 0
            self.puts += sum(kind in (Due.UPPER_FRAME, Due.LOWER_FRAME, Due.DEPTH) for kind in kinds)
        self.puts += sum(len(answer.frames) for answer in answers.values())
        return answers


def cost(tubes: int) -> dict[str, float]:
    """What a string costs.

    Returns
    -------
    dict
        ``cpu_s`` and ``inline_s`` of a node-cycle, over processes and inline, and ``with_start_cpu_s``, over processes
        from the run-in on; ``wall_s`` and ``inline_wall_s`` of a second of rig time, the second of them CPU of one
        core; ``messages`` on the bus by node-cycle of the whole run; ``memory_mb`` by tube, of all processes together,
        and of it ``medium_mb``.
    """
    with tempfile.TemporaryDirectory(prefix="borechain-") as place:
        scenario = Path(place, "string.toml")
        scenario.write_text(scenario_text(tubes, RIG_S))
        inline, stepper = drilled_inline(scenario, Path(place, "inline"))
        meter, memory = drilled_by_processes(scenario, Path(place, "processes"))
    cpu, wall = meter.per_second()
    with_start, _ = meter.per_second(with_start=True)
    inline_cpu, _ = inline.per_second()
    node_cycles = stepper.node_cycles / inline.length  # a second of rig time
    return {
        "cpu_s": cpu / node_cycles,
        "with_start_cpu_s": with_start / node_cycles,
        "inline_s": inline_cpu / node_cycles,
        "wall_s": wall,
        "inline_wall_s": inline_cpu,
        "messages": (stepper.puts + inline.told) / stepper.node_cycles,
        "memory_mb": sum(memory.values()) / tubes,
        "medium_mb": memory["medium"] / tubes,
    }


def drilled_inline(scenario: Path, folder: Path) -> tuple[Meter, Counting]:
    """Drill with objects in this process."""
    folder.mkdir()
    job = RigJob(scenario, 1, math.inf)
    world = read_world(job)
    rig = InlineRig(world, settings_of(world, job), job.rig_name, folder)
    rig.stepper = counting = Counting(rig.stepper.builders, carry=carry_unwritten)
    meter = Meter(time.process_time)
    rig.run(meter.follow)
    rig.close()
    return meter, counting


def drilled_by_processes(scenario: Path, folder: Path) -> tuple[Meter, dict[str, float]]:
    """Drill with a process a tube; memory of each (MB), what is shared by those who share it."""
    folder.mkdir()
    job = RigJob(scenario, 1, math.inf, endpoint=free_endpoint())
    world = read_world(job)
    tables: list[ProcessTable] = []
    memory: dict[str, float] = {}

    def table_of(*place: Any) -> ProcessTable:
        tables.append(process_table(world, job, folder, None, *place))
        return tables[0]

    def spent() -> float:
        return time.process_time() + sum(cpu_seconds(pid) for pid in running_pids(tables[0]).values())

    def weigh() -> None:
        memory.update({name: memory_footprint(pid)["pss_mb"] for name, pid in running_pids(tables[0]).items()})

    meter = Meter(spent, weigh)
    with opened_router(job.endpoint) as bus:
        drill_in_processes(world, job, bus, meter.follow, None, table_of)
    return meter, memory


def drilled(*options: str) -> tuple[float, str]:
    """CPU seconds of a rig with all its processes, and its digest."""
    before = children_s()
    with tempfile.TemporaryDirectory(prefix="borechain-") as place:
        words = ["rig", str(SCENARIO), "--seed", "1", "--json", "--out", f"{place}/run", *options]
        done = subprocess.run([sys.executable, "-m", "borechain", *words], capture_output=True, text=True, check=True)
        with contextlib.suppress(ChildProcessError):
            while True:
                os.wait()
    return children_s() - before, str(json.loads(done.stdout.splitlines()[-1])["digest"])


def children_s() -> float:
    """CPU time of every child that has ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def free_endpoint() -> str:
    """Return an endpoint on loopback with a free TCP port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


if __name__ == "__main__":
    print(json.dumps(run(), indent=1))
