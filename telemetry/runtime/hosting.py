"""What every process shares when it is started, by its command or by a launcher: name, signals, bus, errors."""

from __future__ import annotations

import contextlib
import ctypes
import json
import multiprocessing
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import setproctitle

from telemetry.media.neighbours import neighbour_ports
from telemetry.media.zenoh_bus import ZenohBus, open_client, use_few_threads
from telemetry.messages import Side
from telemetry.runtime.command_line import EnvironmentFault, fault_of
from telemetry.runtime.own_clock import Inbox, OwnClock, serve_by_own_clock
from telemetry.runtime.process import Process
from telemetry.runtime.stepped import StepClient, Stepped, serve, zenoh_ports
from telemetry.runtime.timing import CycleTiming

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


def run_by_own_clock(
    name: str, place: Place, address: int, own_time: OwnTime, build: Callable[[CycleTiming], Process], period: float
) -> None:
    """Build a process and run it by its own clock, a cycle every ``period`` (s).

    ``timing.json`` says how that went, at the end and on SIGUSR1.
    """
    begin_process(name)
    use_few_threads()
    timing, inbox = CycleTiming(), Inbox()
    on_termination(inbox.stop)
    with reporting(name), joined(place) as bus:
        process = build(timing)
        signal.signal(signal.SIGUSR1, lambda *_: inbox.put(lambda *_: tell(place.folder, timing)))
        try:
            ports = neighbour_ports(bus, place.rig, address, own_time.neighbours)
            serve_by_own_clock(process, ports, inbox, OwnClock(own_time.offset), timing, period)
        finally:
            process.close()
            tell(place.folder, timing)


@contextlib.contextmanager
def joined(place: Place) -> Iterator[ZenohBus]:
    """Session of a process at its rig; what can be wrong with its folder is said before a router is waited for.

    Raises
    ------
    EnvironmentFault
        When the folder cannot be made.
    MediumError
        When no router answers.
    """
    try:
        place.folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EnvironmentFault(f"--folder {place.folder}: {error.strerror}; choose a writable place") from error
    with open_client(place.endpoint, timeout=CONNECT_TIMEOUT) as bus:
        yield bus


def tell(folder: Path, timing: CycleTiming) -> None:
    """Write down how the time went; a full disk ends no node that was only asked."""
    fresh = folder / f"{TIMING_FILE}.new"
    with contextlib.suppress(OSError):
        fresh.write_text(json.dumps(timing.report()) + "\n")
        fresh.replace(folder / TIMING_FILE)


def run_stepped(name: str, place: Place, address: int, build: Callable[[], Stepped]) -> None:
    """Build a process, join the stepper and serve it; the token of life is last, when everything listens."""
    begin_process(name)
    with reporting(name), joined(place) as bus:
        process = build()
        client = StepClient(bus, place.rig, address, zenoh_ports(bus, place.rig, address, Side))
        on_termination(client.stop)
        serve(process, client)


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
    except Exception as error:
        fault = fault_of(error)
        if fault is None or multiprocessing.parent_process() is None:
            raise
        sys.stderr.write(f"borechain {name}: {fault.message}\n")
        sys.exit(1)
