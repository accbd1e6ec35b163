"""The processes of a rig: one table, one idempotent reconcile step, a stop that escalates."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from multiprocessing.context import ForkServerProcess
from typing import Any

from telemetry.runtime.one_thread import one_thread_each

STOP_SCHEDULE = ((signal.SIGTERM, 5.0), (signal.SIGKILL, 5.0))  # signal, wall seconds until the next
RESTART_LIMIT = 5  # deaths of a process that are answered with a new start within ...
RESTART_WINDOW = 600.0  # ... this time, wall s


@dataclass(frozen=True, slots=True)
class Spec:
    """One line of the table: what runs under a name."""

    target: Callable[..., None]
    arguments: tuple[Any, ...]


@dataclass(slots=True)
class ProcessTable:
    """Starts, watches and ends the processes of one rig.

    All are forked from one server that has imported everything and compiled the kernels, so that a start costs a
    fork. ``specs`` names what may run, ``reconcile`` makes what runs equal to what is wanted.
    """

    specs: Mapping[str, Spec]
    preload: list[str]
    running: dict[str, ForkServerProcess] = field(default_factory=dict)
    restarts: dict[str, int] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)
    _deaths: dict[str, list[float]] = field(default_factory=dict)  # wall s, those of the window

    def __post_init__(self) -> None:
        """Prepare the fork server; it starts with the first process."""
        one_thread_each()
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(self.preload)

    _context: Any = None

    def warm(self) -> None:
        """Start the fork server and wait until it has imported everything."""
        process = self._context.Process(target=do_nothing)
        process.start()
        process.join()

    def reconcile(self, wanted: list[str], kill: list[str]) -> None:
        """Start what is wanted and not running, kill what is to be killed, note what died by itself."""
        for name in kill:
            self.kill(name)
            if name in wanted:
                self._count_death(name, "did not answer")
        for name, process in list(self.running.items()):
            if process.exitcode is not None:
                self._bury(name, process)
        for name in wanted:
            if name not in self.running:
                self.start(name)

    def start(self, name: str) -> None:
        """Start one process of the table."""
        spec = self.specs[name]
        process = self._context.Process(target=spec.target, args=spec.arguments, name=f"borechain {name}")
        process.start()
        self.running[name] = process

    def kill(self, name: str) -> None:
        """End one process without warning, as a power cut would."""
        process = self.running.pop(name, None)
        if process is not None:
            process.kill()
            process.join()

    def stop(self) -> None:
        """End every process: asked first, then forced; returns when none is left."""
        for number, patience in STOP_SCHEDULE:
            for process in self.running.values():
                if process.exitcode is None and process.pid is not None:
                    os.kill(process.pid, number)
            deadline = time.monotonic() + patience
            for process in self.running.values():
                process.join(max(deadline - time.monotonic(), 0.0))
        self.running.clear()

    def _bury(self, name: str, process: ForkServerProcess) -> None:
        del self.running[name]
        self._count_death(name, f"ended with status {process.exitcode}")

    def _count_death(self, name: str, how: str) -> None:
        now = time.monotonic()
        self.restarts[name] = self.restarts.get(name, 0) + 1
        recent = [at for at in self._deaths.get(name, []) if at > now - RESTART_WINDOW]
        self._deaths[name] = recent = [*recent, now]
        if len(recent) > RESTART_LIMIT:
            self.failures.append(
                f"process {name} was started again {len(recent) - 1} times within {RESTART_WINDOW:.0f} s; last it {how}"
            )


def do_nothing() -> None:
    """What the first process forked does."""
