"""A whole string of node processes on their own clocks: what it costs, whether it keeps time, and whether it works."""

from __future__ import annotations

import contextlib
import json
import math
import os
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from node.kernels.arithmetic.formats import PERIOD
from sim.errors import RigError
from sim.rig.processes import ProcessTable
from sim.world.recording import fastest_at, yaw_error
from sim.world.world import World
from telemetry.application.endpoint import Endpoint
from telemetry.media.neighbours import neighbour_ports
from telemetry.media.port import Medium
from telemetry.media.zenoh_bus import open_router
from telemetry.media.zenoh_port import ZenohMedium
from telemetry.messages import BASE, ENCODER, NodeFlag, NodeState, Side, address_name
from telemetry.runtime.event_loop import run_event_loop as run_loop
from telemetry.runtime.event_loop import stop_on_signals
from telemetry.runtime.own_clock import OwnClock, OwnClockLoop
from telemetry.runtime.process_interface import Process
from telemetry.runtime.timing import CycleTiming
from telemetry.unwritten import Content

TICKS = os.sysconf("SC_CLK_TCK")  # a second, of the CPU time in /proc
COME_LIMIT = 60.0  # s, until every node was heard
PHASES = ("rest", "turning")
KIB, MIB = 1024.0, 1024.0**2


@dataclass(slots=True)
class HeardYaw:
    """What the surface has heard of one node's yaw: pairs of its error and the variance it stated, rad and rad^2."""

    states: int = 0
    known: bool = False
    resting: list[tuple[float, float]] = field(default_factory=list)
    turning: list[tuple[float, float]] = field(default_factory=list)

    def on_state(self, state: NodeState, error: float, rate: float) -> None:
        """Take a state, the error of its yaw (rad) and the rate of the string (rad/s) by which a wrong clock errs."""
        self.states += 1
        self.known = not state.flags & NodeFlag.YAW_UNTRUSTED
        if self.known:
            stated = state.yaw_var + rate * rate * state.clock_var
            (self.turning if rate > 0.0 else self.resting).append((error, stated))


class Surface(Process):
    """The base station's end of the string: hears every node through all above it, and ends the run."""

    def __init__(self, world: World, seconds: float, table: ProcessTable) -> None:
        self.endpoint = Endpoint(BASE, frozenset({Side.LOWER}), boot_count=1)
        self.heard = {tube: HeardYaw() for tube in range(1, world.scenario.tubes + 1)}
        self.interrupted = False
        self.begun_at: float | None = None  # s, when the last node was heard first
        self.cpu_before: dict[str, float] = {}
        self._world, self._seconds, self._table = world, seconds, table
        self._loop: OwnClockLoop | None = None
        self._until = math.inf

    async def live(self, medium: Medium, rig: str) -> None:
        """Listen until the time is over."""
        ports = neighbour_ports(medium, rig, BASE, {Side.LOWER: ENCODER})
        self._loop = OwnClockLoop(self, ports, OwnClock(), CycleTiming(), PERIOD)
        self._until = time.monotonic() + COME_LIMIT
        stop_on_signals(self.interrupt)
        if not self.interrupted:
            await self._loop.run()

    def on_frame(self, side: Side, frame: Content, now: float, margin: float = math.inf) -> None:
        """A frame arrived from the encoder."""
        for received in self.endpoint.receive(side, frame, now, margin):
            state = received.message
            if isinstance(state, NodeState) and state.tube in self.heard:
                error = yaw_error(self._world, state.tube, state.yaw, state.at)
                self.heard[state.tube].on_state(state, error, fastest_at(self._world, state.at))

    def on_cycle(self, data: Any, now: float) -> None:
        """See that every process lives, until the time is over."""
        ended = [name for name, process in self._table.running.items() if process.exitcode is not None]
        if ended:
            raise RigError(f"process {ended[0]} ended before the run did; its message stands above")
        if self.begun_at is None and all(heard.states for heard in self.heard.values()):
            self.begun_at, self._until = now, now + self._seconds
            self.cpu_before = {name: cpu_seconds(pid) for name, pid in running_pids(self._table).items()}
        if now >= self._until and self._loop is not None:
            self._loop.stop()

    def interrupt(self) -> None:
        """End at once."""
        self.interrupted = True
        if self._loop is not None:
            self._loop.stop()


def run_in_realtime(
    world: World, table: ProcessTable, rig: str, endpoint: str, seconds: float, folder: Path
) -> dict[str, Any]:
    """Start every process of ``table``, let the string live for ``seconds`` once all are heard, and judge it.

    ``folder`` is where each process keeps ``NAME/timing.json``.

    Raises
    ------
    RigError
        When a process ends early or is never heard.
    KeyboardInterrupt
        On Ctrl-C; every process has ended by then.
    """
    surface = Surface(world, seconds, table)
    begun: dict[str, float] = {}
    try:
        table.warm()
        with open_router(endpoint) as bus, handle_interrupts(surface.interrupt):
            for name in table.specs:
                begun[name] = time.monotonic()
                table.start(name)
            run_loop(surface.live(ZenohMedium(bus), rig))
            if surface.interrupted:
                raise KeyboardInterrupt
            if surface.begun_at is None:
                silent = [address_name(tube) for tube, heard in surface.heard.items() if not heard.states]
                raise RigError(f"tube {', '.join(silent)}: nothing heard within {COME_LIMIT:.0f} s")
            span = time.monotonic() - surface.begun_at
            costs = {
                name: {
                    "cpu_percent": 100.0 * (cpu_seconds(pid) - surface.cpu_before[name]) / span,
                    **memory_footprint(pid),
                }
                for name, pid in running_pids(table).items()
            }
            own = 100.0 * time.process_time() / (time.monotonic() - begun[next(iter(begun))])
            table.stop()
    finally:
        table.stop()
    rows = []
    for name, cost in costs.items():
        tube = ENCODER if name == "encoder" else int(name)
        report = json.loads((folder / name / "timing.json").read_text())
        first = report["first_cycle_at_s"] - clock_offset(world, tube) - begun[name]
        rows.append(
            timing_row(name, tube, world.scenario.tubes, report, first) | cost | yaw_figures(surface.heard.get(tube))
        )
    return {
        "cases": rows,
        "worst": worst_figures(rows),
        "total": total_figures(rows),
        "router_and_base_cpu_percent": own,
    }


def clock_offset(world: World, address: int) -> float:
    """Clock of a process minus that of the encoder, s; in a string in real time none drifts."""
    return world.local_clock(address, world.begin) - world.begin


def timing_row(name: str, tube: int, tubes: int, report: dict[str, Any], first: float) -> dict[str, Any]:
    """Times of one process, ms but for the first cycle."""
    start, cycle = report["stages_ms"]["start"], report["stages_ms"]["cycle"]
    return {
        "process": name,
        "hop": 0 if tube == ENCODER else tubes - tube + 1,
        "cycles": report["cycles"],
        "overruns": report["overruns"],
        **{f"start_{figure}_ms": start[figure] for figure in ("median", "p99", "max")},
        **{f"cycle_{figure}_ms": cycle[figure] for figure in ("median", "p99", "max")},
        "first_cycle_s": first,
    }


def yaw_figures(heard: HeardYaw | None) -> dict[str, Any]:
    """Whether the yaw is known at last, its rms error (deg) and how that compares with what the node stated of it.

    Nothing of the encoder.
    """
    if heard is None:
        return dict.fromkeys(("yaw_known", *(f"yaw_{when}_{what}" for when in PHASES for what in ("deg", "nees"))))
    figures: dict[str, Any] = {"yaw_known": heard.known}
    for when in PHASES:
        pairs = heard.resting if when == "rest" else heard.turning
        figures |= {f"yaw_{when}_deg": rms_deg(pairs), f"yaw_{when}_nees": nees_of_pairs(pairs)}
    return figures


def worst_figures(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The largest of every figure, the smallest of what is to be many."""
    found: dict[str, Any] = {}
    for key in rows[0]:
        values = [r[key] for r in rows if r[key] is not None]
        if key not in ("process", "hop"):
            found[key] = None if not values else min(values) if key in ("cycles", "yaw_known") else max(values)
    return found


def total_figures(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Sums of what adds up."""
    return {key: sum(r[key] for r in rows) for key in ("cycles", "overruns", "cpu_percent", "private_mb", "pss_mb")}


def rms_deg(pairs: list[tuple[float, float]]) -> float | None:
    """Root mean square of the errors, deg; None of none."""
    return math.degrees(math.sqrt(sum(e * e for e, _ in pairs) / len(pairs))) if pairs else None


def nees_of_pairs(pairs: list[tuple[float, float]]) -> float | None:
    """Mean of the squared errors over the variances stated of them; None of none."""
    return sum(e * e / stated for e, stated in pairs) / len(pairs) if pairs else None


def running_pids(table: ProcessTable) -> dict[str, int]:
    """Pid of every running process."""
    return {name: process.pid for name, process in table.running.items() if process.pid is not None}


def cpu_seconds(pid: int) -> float:
    """CPU time of a process so far, in user and system, s."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def memory_footprint(pid: int) -> dict[str, float]:
    """Memory of a process: what it alone holds, and its share of what it holds with others; MB."""
    kib: dict[str, int] = {}
    for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()[1:]:
        name, value, *_ = line.split()
        kib[name.rstrip(":")] = int(value)
    private = kib["Private_Clean"] + kib["Private_Dirty"]
    return {"private_mb": private * KIB / MIB, "pss_mb": kib["Pss"] * KIB / MIB}


@contextlib.contextmanager
def handle_interrupts(act: Callable[[], None]) -> Iterator[None]:
    """Have Ctrl-C and a termination request call ``act``."""
    before = {number: signal.signal(number, lambda _n, _f: act()) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
