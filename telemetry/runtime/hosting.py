"""What every process shares when it is started, by its command or by a launcher: name, signals, bus, errors."""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import json
import multiprocessing
import multiprocessing.connection
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import setproctitle

from telemetry.errors import MediumError
from telemetry.media.credentials import TLS, credentials_for, file_name
from telemetry.media.neighbours import own_ports, stepped_ports, stepped_ports_on
from telemetry.media.zenoh_bus import ZenohBus, open_client, use_few_threads
from telemetry.media.zenoh_port import CONNECT_TIMEOUT, WITH_KEYS, ZenohMedium
from telemetry.messages import Side, address_name
from telemetry.runtime.command_line import EnvironmentFault, InputFault, fault_of
from telemetry.runtime.event_loop import run_event_loop, stop_on_signals
from telemetry.runtime.own_clock import OwnClock, OwnClockLoop
from telemetry.runtime.process_interface import Process
from telemetry.runtime.step_client import StepClient, serve_steps
from telemetry.runtime.step_stream import StepStream, join_steps
from telemetry.runtime.timing import CycleTiming

if TYPE_CHECKING:
    from telemetry.application.seals import Seals

PR_SET_PDEATHSIG = 1
ORPHAN_GRACE = 3.0  # wall s that a process has to end by itself when its launcher is gone
TIMING_FILE = "timing.json"
ZENOH = "zenoh:"


@dataclass(frozen=True, slots=True)
class Place:
    """Address of a rig, for a process: its name, router, folder and keys."""

    rig: str
    endpoint: str
    folder: Path
    key_file: Path | None = None  # of the rig
    media: Mapping[Side, str] = field(default_factory=dict)  # of each end, such as can:can0; zenoh at the endpoint else
    steps: Path | None = None  # socket of the stepper; its steps come by zenoh else
    keys: Path | None = None  # file or folder of the keys of this process; without it everybody is believed

    def __post_init__(self) -> None:
        """Refuse two kinds of keys at once."""
        if self.key_file is not None and self.keys is not None:
            raise InputFault(
                "--key-file and --keys: expected one of them; --keys holds the key of parameter blocks too"
            )

    @contextlib.contextmanager
    def step_stream(self, name: str) -> Iterator[StepStream | None]:
        """Connection with the stepper, where it listens on this machine."""
        if self.steps is None:
            yield None
            return
        with contextlib.closing(join_steps(self.steps, name)) as stream:
            yield stream

    def medium_of(self, side: Side, address: int) -> str:
        """Medium of one end of a process; over TLS with the certificate of its name."""
        medium = self.media.get(side, f"{ZENOH}{self.endpoint}")
        if not medium.startswith(ZENOH + TLS):
            return medium
        if self.keys is None:
            raise MediumError(f"{medium}: expected --keys with it, where the certificates lie")
        folder = self.keys if self.keys.is_dir() else self.keys.parent
        return f"{medium}{WITH_KEYS}{folder / file_name(address)}"


@dataclass(frozen=True, slots=True)
class OwnTime:
    """Settings of a process with a clock of its own: its neighbours and its clock's offset."""

    neighbours: Mapping[Side, int | None]  # address of the process at each joined end, None: found by the medium
    offset: float = 0.0  # s, of its clock against the machine's


def chosen_media(media: Mapping[Side, str | None]) -> dict[Side, str]:
    """Media of the ends for which one was chosen."""
    return {side: medium for side, medium in media.items() if medium is not None}


def run_by_own_clock(
    name: str, place: Place, address: int, own_time: OwnTime, build: Callable[[CycleTiming], Process], period: float
) -> None:
    """Build a process and run it by its own clock, a cycle every ``period`` (s), until a signal ends it.

    What is wrong with its options, recordings or folder is found before anything is connected. ``timing.json`` says how
    the time went, at the end and on SIGUSR1.
    """
    begin_process(name)
    use_few_threads()
    with reporting_errors(name):
        run_event_loop(live_by_own_clock(name, place, address, own_time, build, period))


async def live_by_own_clock(
    name: str, place: Place, address: int, own_time: OwnTime, build: Callable[[CycleTiming], Process], period: float
) -> None:
    """``run_by_own_clock`` on the running loop."""
    timing = CycleTiming()
    make_folder(place)
    media = {side: place.medium_of(side, address) for side in own_time.neighbours}
    with (
        contextlib.closing(build(timing)) as process,
        own_ports(place.rig, address, own_time.neighbours, media) as ports,
    ):
        clock, report = OwnClock(own_time.offset), partial(write_warning, name)
        loop = OwnClockLoop(process, ports, clock, timing, period, report, at_once=True)

        def write() -> None:
            write_timing(place.folder, timing.report() | loop.losses())

        stop_on_signals(loop.stop)
        asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, write)
        try:
            await loop.run()
        finally:
            write()


def run_stepped(name: str, place: Place, address: int, build: Callable[[], Process]) -> None:
    """Build a process, join the stepper and serve it; the token of life is last, when everything listens.

    What is wrong with its options, recordings or folder is found before anything is connected.
    """
    begin_process(name)
    use_few_threads()
    with reporting_errors(name):
        make_folder(place)
        process = build()
        with (
            rig_session(place, file_name(address)) as bus,
            stepped_ports_on(place.rig, address, place.media) as chosen,
            place.step_stream(address_name(address)) as stream,
        ):
            rest = [side for side in Side if side not in place.media]
            ports = chosen | stepped_ports(ZenohMedium(bus), place.rig, address, rest)
            client = StepClient(bus, place.rig, address, ports, stream)
            on_termination(client.stop)
            serve_steps(process, client, partial(write_warning, name))


@contextlib.contextmanager
def rig_session(place: Place, name: str) -> Iterator[ZenohBus]:
    """Session of a process at its rig; a folder that cannot be made is reported before waiting for a router.

    ``name`` is that of its certificate.

    Raises
    ------
    EnvironmentFault
        When the folder cannot be made.
    MediumError
        When no router answers.
    """
    make_folder(place)
    credentials = credentials_for(place.endpoint, place.keys, name)
    with open_client(place.endpoint, CONNECT_TIMEOUT, credentials) as bus:
        yield bus


def make_folder(place: Place) -> None:
    """Create the folder of a process.

    Raises
    ------
    EnvironmentFault
        When it cannot be made.
    """
    try:
        place.folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EnvironmentFault(f"--folder {place.folder}: {error.strerror}; choose a writable place") from error


def write_timing(folder: Path, report: dict[str, Any]) -> None:
    """Write ``timing.json``; a full disk does not end the process."""
    fresh = folder / f"{TIMING_FILE}.new"
    with contextlib.suppress(OSError):
        fresh.write_text(json.dumps(report) + "\n")
        fresh.replace(folder / TIMING_FILE)


def warn_of_keys(name: str, seals: Seals | None) -> None:
    """Write the warnings on the keys of a process; it goes on."""
    for line in () if seals is None else seals.ring.warnings:
        write_warning(name, line)


def write_warning(name: str, line: str) -> None:
    """Write a warning to stderr; the process goes on."""
    sys.stderr.write(f"borechain {name}: {line}\n")
    sys.stderr.flush()


def begin_process(name: str) -> None:
    """Name the process for ``ps``, leave Ctrl-C to the launcher and end with the parent."""
    setproctitle.setproctitle(f"borechain {name}")
    if multiprocessing.parent_process() is None:
        return
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    threading.Thread(target=end_after_parent, name="parent", daemon=True).start()


def end_after_parent() -> None:
    """Wait until the launcher has ended, then end this process: by SIGTERM first, for good if that does not do it.

    The kernel's signal at a parent's death is that of the fork server, which may outlive the launcher.
    """
    parent = multiprocessing.parent_process()
    if parent is None:
        return
    multiprocessing.connection.wait([parent.sentinel])
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(ORPHAN_GRACE)
    os._exit(1)


def on_termination(stop: Callable[[], None]) -> None:
    """End the main loop on SIGTERM, and on Ctrl-C where the process was started by its own command."""
    signal.signal(signal.SIGTERM, lambda _number, _frame: stop())
    if multiprocessing.parent_process() is None:
        signal.signal(signal.SIGINT, lambda _number, _frame: stop())


@contextlib.contextmanager
def reporting_errors(name: str) -> Iterator[None]:
    """In a forked process print one line for an expected error; a command of its own reports by itself."""
    try:
        yield
    except Exception as error:
        fault = fault_of(error)
        if fault is None or multiprocessing.parent_process() is None:
            raise
        sys.stderr.write(f"borechain {name}: {fault.message}\n")
        sys.exit(1)
