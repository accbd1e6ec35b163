"""Runs a whole rig: starts the processes, follows the medium's progress, asks the ground station for the result."""

from __future__ import annotations

import contextlib
import queue
import signal
import socket
import time
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgpack

from sim.errors import RigError
from sim.rig.processes import ProcessTable
from sim.rig.stepper import Acted
from telemetry import keys
from telemetry.media.zenoh_bus import ZenohBus
from telemetry.messages import address_name

SUPERVISE_EVERY = 0.2  # wall s
STALL_LIMIT = 300.0  # wall s without progress of rig time and without a process that is waited for


@dataclass(frozen=True, slots=True)
class Tick:
    """What the medium tells while it drills."""

    phase: str
    rig_time: float
    begin: float
    end: float
    wanted: tuple[str, ...]
    kill: tuple[str, ...]
    finished: bool
    cue: str

    @classmethod
    def parse(cls, payload: bytes) -> Tick:
        """Progress from its wire form, see ``borechain medium``."""
        phase, rig_time, begin, end, wanted, kill, finished, cue = msgpack.unpackb(payload)
        names = tuple(address_name(address) for address in wanted)
        return cls(phase, rig_time, begin, end, names, tuple(address_name(address) for address in kill), finished, cue)


def check_port_free(endpoint: str) -> None:
    """Refuse an endpoint that another program listens on.

    Raises
    ------
    RigError
        Naming the port and the remedy.
    """
    protocol, _, address = endpoint.partition("/")
    host, _, port = address.rpartition(":")
    if protocol not in ("tcp", "tls") or not port.isdigit():
        raise RigError(f"endpoint: expected tcp/HOST:PORT or tls/HOST:PORT, got {endpoint}")
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, int(port)))
        except OSError as error:
            raise RigError(
                f"endpoint {endpoint}: {error.strerror}; choose another with --endpoint tcp/127.0.0.1:PORT"
            ) from error


def refuse_used_folder(folder: Path) -> None:
    """Refuse an output folder with anything in it: a run must not continue another one's saved states.

    Raises
    ------
    RigError
        When it holds an earlier run, or is no folder that can be read.
    """
    try:
        if folder.exists() and any(folder.iterdir()):
            raise RigError(
                f"output folder {folder}: expected a new or empty folder, it holds an earlier run; choose another --out"
            )
    except OSError as error:
        raise folder_refusal(folder, error) from error


def prepare_folder(folder: Path) -> None:
    """Make the output folder; it must be new or empty.

    Raises
    ------
    RigError
        When it cannot be made or written, or holds an earlier run.
    """
    refuse_used_folder(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        trial = folder / ".writable"
        trial.touch()
        trial.unlink()
    except OSError as error:
        raise folder_refusal(folder, error) from error


def folder_refusal(folder: Path, error: OSError) -> RigError:
    """The refusal of an output folder that cannot be used."""
    return RigError(f"output folder {folder}: {error.strerror}; choose a writable folder with --out")


class Launcher:
    """Supervises one run from the first process to the last answer.

    Parameters
    ----------
    table : processes of the rig
    bus : router that they meet at; it is open before the first of them starts
    rig : name in key expressions
    show : called with every tick
    act : plays the operator at a cue
    stall_limit : wall s after which a rig that makes no progress is ended
    """

    def __init__(
        self,
        table: ProcessTable,
        bus: ZenohBus,
        rig: str,
        show: Callable[[Tick], None],
        act: Callable[[ZenohBus, str], Acted] = lambda _bus, _cue: Acted.DONE,
        stall_limit: float = STALL_LIMIT,
    ) -> None:
        self._bus = bus
        self._stall_limit = stall_limit
        self._table = table
        self._rig = rig
        self._show = show
        self._act = act
        self._ticks: queue.SimpleQueue[Tick | None] = queue.SimpleQueue()

    def run(self, ask: Callable[[ZenohBus], dict[str, Any]]) -> dict[str, Any]:
        """Drill to the end of the schedule, then return what ``ask`` got from the ground station.

        Raises
        ------
        RigError
            When a process fails for good.
        KeyboardInterrupt
            On Ctrl-C; every process has ended by then.
        """
        bus = self._bus
        try:
            bus.subscribe(keys.WANTED.format(rig=self._rig), lambda _key, payload: self._ticks.put(Tick.parse(payload)))
            self._table.start("medium")
            with interrupts_into(self._ticks):
                self._supervise(bus)
            return ask(bus)
        finally:
            self._table.stop()

    def _supervise(self, bus: ZenohBus) -> None:
        wanted: tuple[str, ...] = ()
        answered = ""
        answer = bus.publisher(keys.CUE.format(rig=self._rig))
        watchdog = Watchdog(self._stall_limit)
        while True:
            kill: tuple[str, ...] = ()
            try:
                tick = self._ticks.get(timeout=SUPERVISE_EVERY)
                if tick is None:
                    raise KeyboardInterrupt
                wanted, kill = tick.wanted, tick.kill
                self._show(tick)
                watchdog.on_tick(tick)
                if not tick.cue:
                    answered = ""
                elif tick.cue != answered and (acted := self._act(bus, tick.cue)) is not Acted.NO_ANSWER:
                    answered = tick.cue
                    answer.put(f"{acted} {answered}".encode())
                if tick.finished:
                    return
            except queue.Empty:
                pass
            medium = self._table.running.get("medium")
            if medium is None or medium.exitcode is not None:
                raise RigError("the medium process ended before the schedule did; its message stands above")
            self._table.reconcile(list(wanted), list(kill))
            watchdog.check(self._table.running)
            if self._table.failures:
                raise RigError(self._table.failures[0])


class Watchdog:
    """Ends a rig whose time stands still, and says what it waits for.

    Parameters
    ----------
    limit : wall s
    """

    def __init__(self, limit: float) -> None:
        self._limit = limit
        self._moved_at = time.monotonic()
        self._newest: Tick | None = None

    def on_tick(self, tick: Tick) -> None:
        """The medium has told how far it is; a cue that changes is progress too."""
        before = self._newest
        if before is None or (tick.rig_time, tick.cue, tick.wanted) != (before.rig_time, before.cue, before.wanted):
            self._moved_at = time.monotonic()
        self._newest = tick

    def check(self, running: Collection[str]) -> None:
        """Look whether the rig still moves.

        Raises
        ------
        RigError
            When it does not; it names what is waited for.
        """
        if time.monotonic() < self._moved_at + self._limit:
            return
        tick = self._newest
        if tick is None:
            raise RigError(f"the medium has said nothing for {self._limit:.0f} s")
        absent = [name for name in tick.wanted if name not in running]
        waits = f"cue {tick.cue}" if tick.cue else f"processes {', '.join(absent or tick.wanted)}"
        raise RigError(
            f"rig time stands at {tick.rig_time:.1f} s ({tick.phase}) for {self._limit:.0f} s; it waits for {waits}"
        )


@contextlib.contextmanager
def interrupts_into(ticks: queue.SimpleQueue[Tick | None]) -> Iterator[None]:
    """Turn Ctrl-C and a termination request into the end of the supervision."""

    def interrupt(_number: int, _frame: object) -> None:
        ticks.put(None)

    before = {number: signal.signal(number, interrupt) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def next_run_folder(base: Path) -> Path:
    """First ``run-NNNN`` of ``base`` that does not exist yet."""
    number = 1 + max((int(p.name[4:]) for p in base.glob("run-[0-9]*") if p.name[4:].isdigit()), default=0)
    return base / f"run-{number:04d}"


def private_folder(folder: Path, name: str) -> Path:
    """Folder of one process below the run's."""
    return folder / "state" / name
