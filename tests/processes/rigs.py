"""Real rigs on loopback, each on a port of its own and in a process group of its own."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import queue
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from forked_commands import Command, warm_forker
from forked_commands import run as run_forked

from telemetry.media.zenoh_bus import ZenohBus

REPOSITORY = Path(__file__).parents[2]
PATIENCE = 120.0
FIRST_PORT, SHARE = 12_000, 1_000
NUMBERS = itertools.count(os.getpid())


def free_endpoint() -> str:
    """Return a free endpoint, which no other process gets before the rig listens there.

    The system never hands out ports of this range by itself, and every worker of the tests looks in its own share.
    """
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")) % 20
    for number in NUMBERS:
        with contextlib.suppress(OSError), socket.socket() as probe:
            endpoint = ("127.0.0.1", FIRST_PORT + SHARE * worker + number % SHARE)
            probe.bind(endpoint)
            return f"tcp/{endpoint[0]}:{endpoint[1]}"
    raise AssertionError("unreachable")


def command(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "borechain", *arguments]


def titles_of_group(group: int) -> dict[int, str]:
    """Command lines of the living processes of a process group, by pid."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
            if int(fields[2]) == group and fields[0] != "Z":
                title = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
                found[int(folder.name)] = title
    return found


def ends(group: int) -> bool:
    """Whether every process of a group ends by itself; the fork server may leave a moment after its parent."""
    deadline = time.monotonic() + PATIENCE
    idle: queue.SimpleQueue[None] = queue.SimpleQueue()
    while titles_of_group(group) and time.monotonic() < deadline:
        with contextlib.suppress(queue.Empty):
            idle.get(timeout=0.05)
    return titles_of_group(group) == {}


@dataclass
class Rig:
    """A running ``borechain rig`` and how to talk to it."""

    process: Command | subprocess.Popen[str]
    endpoint: str
    out: Path

    def pid_of(self, title: str) -> int:
        """Pid of the process with a title; waits until it is there."""
        return self.until(lambda: next((p for p, t in titles_of_group(self.process.pid).items() if t == title), None))

    def until(self, probe: Callable[[], Any]) -> Any:
        """First answer of ``probe`` that is neither None nor False, while the rig lives."""
        deadline = time.monotonic() + PATIENCE
        idle: queue.SimpleQueue[None] = queue.SimpleQueue()
        while time.monotonic() < deadline:
            if answer := probe():
                return answer
            assert self.process.poll() is None, self.process.communicate()
            with contextlib.suppress(queue.Empty):
                idle.get(timeout=0.05)
        raise AssertionError("gave up waiting")

    def result(self, patience: float = PATIENCE) -> dict[str, Any]:
        """The JSON object the rig ends with."""
        output, errors = self.process.communicate(timeout=patience)
        assert self.process.returncode == 0, errors
        return dict(json.loads(output.splitlines()[-1]))


@contextlib.contextmanager
def running_rig(
    tmp_path: Path, *arguments: str, scenario: str = "scenarios/rig-3.toml", by: Sequence[str] | None = None
) -> Iterator[Rig]:
    """A rig that is forked, or started by a command line that begins with the words ``by``."""
    endpoint, out = free_endpoint(), tmp_path / "run"
    words = ("rig", scenario, "--json", "--endpoint", endpoint, "--out", str(out), *arguments)
    process = started(*words, own_session=True) if by is None else started_by(by, *words)
    try:
        yield Rig(process, endpoint, out)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def started_by(by: Sequence[str], *words: str) -> subprocess.Popen[str]:
    """A command in a session of its own, started as a user does, behind the words ``by``."""
    return subprocess.Popen(
        [*by, *command(*words)],
        cwd=REPOSITORY,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def started(*words: str, own_session: bool = False) -> Command:
    """A command that hosts processes of a rig, or is one."""
    return Command(*words, source=warm_forker(), cwd=REPOSITORY, own_session=own_session)


def run(*words: str, cwd: Path = REPOSITORY) -> subprocess.CompletedProcess[str]:
    """A command to its end."""
    return run_forked(*words, timeout=PATIENCE, cwd=cwd, source=warm_forker())


def first_answer(bus: ZenohBus, rig: str, path: str, fits: Callable[[Any], bool]) -> Any:
    """The first answer of a ground station that fits."""
    deadline = time.monotonic() + PATIENCE
    idle: queue.SimpleQueue[None] = queue.SimpleQueue()
    while time.monotonic() < deadline:
        for reply in bus.get(f"borechain/{rig}/ground/{path}", 10.0):
            if reply.error is None and fits(answer := json.loads(reply.payload)):
                return answer
        with contextlib.suppress(queue.Empty):  # asking without a pause keeps the others from a core
            idle.get(timeout=0.05)
    raise TimeoutError(path)
