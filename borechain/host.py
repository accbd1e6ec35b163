"""What each process of a rig runs, whether forked by the launcher or started by its command."""

from __future__ import annotations

import contextlib
import ctypes
import json
import multiprocessing
import queue
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgpack
import setproctitle

from groundstation.errors import GroundError
from node.errors import NodeError
from node.firmware.settings import TubeSettings
from node.firmware.torque import TorqueSettings
from node.kernels.layout import PERIOD
from node.process.drivers.source import EncoderSource, ImuSource
from node.process.encoder_process import EncoderProcess
from node.process.tube_process import TubeProcess
from sim.errors import SimError
from telemetry import keys
from telemetry.errors import TelemetryError
from telemetry.media.neighbours import neighbour_ports
from telemetry.media.zenoh_bus import ZenohBus, open_client, open_router, use_few_threads
from telemetry.messages import BASE, ENCODER, Side
from telemetry.runtime.own_clock import Inbox, OwnClock, serve_by_own_clock
from telemetry.runtime.process import Process
from telemetry.runtime.stepped import StepClient, Stepped, serve, zenoh_ports
from telemetry.runtime.timing import CycleTiming
from telemetry.transport.authentication import read_key

PR_SET_PDEATHSIG = 1
CONNECT_TIMEOUT = 30.0  # wall s
TIMING_FILE = "timing.json"


@dataclass(frozen=True, slots=True)
class Place:
    """Where a process finds its rig."""

    rig: str
    endpoint: str
    folder: Path
    key_file: Path | None = None  # of the rig


@dataclass(frozen=True, slots=True)
class OwnTime:
    """How a process with a clock of its own lives: who is at its ends, and how far its clock is off."""

    neighbours: Mapping[Side, int]  # address of the process at each end that is joined
    offset: float = 0.0  # s, of its clock against the machine's


def run_node(
    place: Place, settings: TubeSettings, imus: Sequence[ImuSource] = (), own_time: OwnTime | None = None
) -> None:
    """Node of one tube until a signal comes; ``imus`` are its own sensors."""

    def build(timing: CycleTiming | None = None) -> TubeProcess:
        key = read_key(place.key_file) if place.key_file is not None else None
        return TubeProcess(settings, place.folder, key=key, imus=imus, timing=timing)

    name = f"node {settings.tube}"
    if own_time is None:
        run_stepped(name, place, settings.tube, build)
    else:
        run_by_own_clock(name, place, settings.tube, own_time, build)


def run_encoder(
    place: Place,
    source: EncoderSource | None = None,
    own_time: OwnTime | None = None,
    torque: TorqueSettings | None = None,
) -> None:
    """Encoder node on the drive head; ``source`` is its own counter, ``torque`` that of the drive."""

    def build(timing: CycleTiming | None = None) -> EncoderProcess:
        return EncoderProcess(place.folder, source, torque, timing)

    if own_time is None:
        run_stepped("encoder", place, ENCODER, build)
    else:
        run_by_own_clock("encoder", place, ENCODER, own_time, build)


def run_by_own_clock(
    name: str, place: Place, address: int, own_time: OwnTime, build: Callable[[CycleTiming], Process]
) -> None:
    """Build a process and run it by its own clock; ``timing.json`` tells how that went, at the end and on SIGUSR1."""
    begin_process(name)
    use_few_threads()
    timing, inbox = CycleTiming(), Inbox()
    on_termination(inbox.stop)
    with reporting(name), open_client(place.endpoint, timeout=CONNECT_TIMEOUT) as bus:
        process = build(timing)
        signal.signal(signal.SIGUSR1, lambda *_: inbox.put(lambda *_: tell(place.folder, timing)))
        try:
            ports = neighbour_ports(bus, place.rig, address, own_time.neighbours)
            serve_by_own_clock(process, ports, inbox, OwnClock(own_time.offset), timing, PERIOD)
        finally:
            process.close()
            tell(place.folder, timing)


def tell(folder: Path, timing: CycleTiming) -> None:
    """Write down how the time went; a full disk ends no node that was only asked."""
    fresh = folder / f"{TIMING_FILE}.new"
    with contextlib.suppress(OSError):
        fresh.write_text(json.dumps(timing.report()) + "\n")
        fresh.replace(folder / TIMING_FILE)


def run_stepped(name: str, place: Place, address: int, build: Callable[[], Stepped]) -> None:
    """Build a process, join the stepper and serve it; the token of life is last, when everything listens."""
    begin_process(name)
    with reporting(name), open_client(place.endpoint, timeout=CONNECT_TIMEOUT) as bus:
        process = build()
        client = StepClient(bus, place.rig, address, zenoh_ports(bus, place.rig, address, Side))
        on_termination(client.stop)
        serve(process, client)


def run_ground(place: Place, settings: dict[str, Any], *, own_clock: bool = False) -> None:
    """Ground station: a stepper or its own clock drives its link, operators ask it at any time.

    ``settings`` are of ``GroundConfig``.
    """
    from groundstation.config import GroundConfig
    from groundstation.service.process import GroundProcess

    begin_process("ground")
    with reporting("ground"), open_client(place.endpoint, timeout=CONNECT_TIMEOUT) as bus:
        config = GroundConfig(rig=place.rig, folder=place.folder, key_file=place.key_file, **settings)
        process = GroundProcess(config)
        with process.serving(bus):
            if own_clock:
                serve_ground(process, bus, place.rig)
                return
            ports = zenoh_ports(bus, place.rig, BASE, [Side.LOWER])
            client = StepClient(bus, place.rig, BASE, ports, hears_depth=True)
            on_termination(client.stop)
            serve(process, client)


def serve_ground(process: Process, bus: ZenohBus, rig: str) -> None:
    """Run the ground station by its own clock, below it the encoder."""
    inbox = Inbox()
    on_termination(inbox.stop)

    def hear_depth(_key: str, payload: bytes) -> None:
        with contextlib.suppress(ValueError, TypeError, msgpack.UnpackException):  # what is no depth is not heard
            rig_time, md = map(float, msgpack.unpackb(payload))
            inbox.put(lambda listener, _now: listener.on_depth(rig_time, md))

    bus.subscribe(keys.DEPTH.format(rig=rig), hear_depth)
    ports = neighbour_ports(bus, rig, BASE, {Side.LOWER: ENCODER})
    serve_by_own_clock(process, ports, inbox, OwnClock(), CycleTiming(), PERIOD)


def run_medium(
    place: Place, scenario: Path, seed: int, speed: float, faults: tuple[str, ...], router: bool, cued: bool = False
) -> None:
    """World, joints and clock; in a rig without an outside router its session is the router.

    ``cued`` says that somebody plays the operator.
    """
    from sim.rig.bus_stepper import BusStepper
    from sim.rig.scheduler import Progress, Scheduler
    from sim.world.scenario import load_scenario
    from sim.world.world import World

    begin_process("medium")
    with reporting("medium"):
        world = World(load_scenario(scenario, faults), seed)
        session = open_router(place.endpoint) if router else open_client(place.endpoint, timeout=CONNECT_TIMEOUT)
        with session as bus:
            wanted = bus.publisher(keys.WANTED.format(rig=place.rig))
            stepper = BusStepper(bus, place.rig)

            def tell(progress: Progress) -> None:
                wanted.put(pack_progress(progress))

            scheduler = Scheduler(world, stepper, tell, speed, cued=cued)
            on_termination(scheduler.stop)
            if scheduler.run():
                scheduler.linger()


def run_router(endpoint: str) -> None:
    """Be the router that the processes of a rig meet at, until a signal comes."""
    stopped: queue.SimpleQueue[None] = queue.SimpleQueue()
    begin_process("router")
    with open_router(endpoint):
        on_termination(lambda: stopped.put(None))
        stopped.get()


def pack_progress(progress: object) -> bytes:
    """Wire form of the medium's progress, read by the launcher's ``Tick``."""
    from sim.rig.scheduler import Progress

    if not isinstance(progress, Progress):
        raise TypeError(f"expected Progress, got {type(progress).__name__}")
    p = progress
    return bytes(msgpack.packb([p.phase, p.rig_time, p.begin, p.end, p.wanted, p.kill, p.finished, p.cue]))


def begin_process(name: str) -> None:
    """Name the process for ``ps``, leave Ctrl-C to the launcher and end with the parent."""
    setproctitle.setproctitle(f"borechain {name}")
    if multiprocessing.parent_process() is None:
        return
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def on_termination(stop: Callable[[], None]) -> None:
    """End the main loop on SIGTERM, and on Ctrl-C where the process was started by its own command."""
    signal.signal(signal.SIGTERM, lambda _number, _frame: stop())
    if multiprocessing.parent_process() is None:
        signal.signal(signal.SIGINT, lambda _number, _frame: stop())


@contextlib.contextmanager
def reporting(name: str) -> Iterator[None]:
    """In a forked process print one line for an expected error; a command of its own reports by itself."""
    try:
        yield
    except (SimError, NodeError, TelemetryError, GroundError, OSError) as error:
        if multiprocessing.parent_process() is None:
            raise
        sys.stderr.write(f"borechain {name}: {error}\n")
        sys.exit(1)
