"""Commands of ours, each in a process of its own that is forked from one which has imported what they import.

What a command writes, how it ends and what it leaves behind are those of ``python -m borechain``; a start costs a
hundredth of a second where it costs one or two. Of a ``warm`` forker everything that a rig hosts is forked too: its
children give their rigs a fork server that has imported and compiled everything, which costs another second else.
"""

from __future__ import annotations

import contextlib
import fcntl
import functools
import gc
import importlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
import traceback
from pathlib import Path
from typing import IO, Any

from telemetry.runtime.one_thread import one_thread_each

LAZY = ("matplotlib.pyplot", "scipy.optimize", "scipy.stats", "scipy.signal", "scipy.spatial")  # inside commands
WARM = "borechain.drilling.preload"
RUN = int(os.environ.get("BORECHAIN_TEST_RUN", os.getpid()))  # pid of what all workers of the tests descend from
END = b"end"
LONGEST = 1 << 16  # bytes of an order
ASIDE = 500  # no file of a launcher has such a number


class Forker:
    """A process that forks commands of ``python``'s environment, for all workers of one run of the tests.

    The first worker that needs it starts it; it ends with the run, or after a ``with``.

    Parameters
    ----------
    python : interpreter
    preload : modules besides those of the commands
    options : of ``subprocess.Popen``
    """

    def __init__(self, python: str | Path = sys.executable, preload: tuple[str, ...] = (), **options: Any) -> None:
        self._server: subprocess.Popen[bytes] | None = None
        self._channel = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        address = "\0" + " ".join(map(str, ("forker", RUN, python, *preload)))  # that no file stands for
        while True:
            with contextlib.suppress(ConnectionRefusedError):
                self._channel.connect(address)
                return
            with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listener:
                try:
                    listener.bind(address)
                except OSError:  # another worker begins just now
                    continue
                listener.listen()
                words = [python, __file__, str(RUN), *preload]
                self._server = subprocess.Popen(words, stdin=listener, **options)

    def __enter__(self) -> Forker:
        return self

    def __exit__(self, *_: object) -> None:
        self._channel.send(END)
        self._channel.close()
        if self._server is not None:
            self._server.wait()

    def order(self, order: dict[str, Any], files: list[int]) -> None:
        """Have a command forked that writes into ``files``; the last of them tells its pid and its exit status."""
        socket.send_fds(self._channel, [json.dumps(order).encode()], files)


@functools.cache
def forker(*preload: str) -> Forker:
    """The forker of this run of the tests."""
    one_thread_each()  # a process with more of them cannot fork
    return Forker(preload=preload, env=os.environ)


def warm_forker() -> Forker:
    """One with the kernels, whose children host processes of a rig."""
    return forker(WARM)


class Command:
    """``borechain`` with ``words`` as a process, with the methods of ``subprocess.Popen``.

    Parameters
    ----------
    source : who forks it
    own_session : whether it begins a session and a process group
    """

    def __init__(self, *words: object, source: Forker, cwd: Path | None = None, own_session: bool = False) -> None:
        ends = [os.pipe() for _ in range(3)]
        self.args = [str(word) for word in words]
        source.order(
            {"words": self.args, "cwd": str(cwd or Path.cwd()), "own_session": own_session}, [end[1] for end in ends]
        )
        for _, theirs in ends:
            os.close(theirs)
        self.stdout, self.stderr, self._status = (os.fdopen(ours, encoding="utf-8") for ours, _ in ends)
        self.returncode: int | None = None
        self.pid = int(self._status.readline())

    def __enter__(self) -> Command:
        return self

    def __exit__(self, *_: object) -> None:
        self.stdout.close()
        self.stderr.close()
        self.wait()

    def poll(self) -> int | None:
        """Exit status, or None while it lives."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.wait(0.0)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Exit status, once it has ended."""
        if self.returncode is None:
            if not select.select([self._status], [], [], timeout)[0]:
                raise subprocess.TimeoutExpired(self.args, timeout or 0.0)
            self.returncode = int(self._status.readline())
            self._status.close()
        return self.returncode

    def communicate(self, timeout: float | None = None) -> tuple[str, str]:
        """What it wrote, once it has ended and nothing can be written any more."""
        until = None if timeout is None else time.monotonic() + timeout
        texts = {self.stdout: b"", self.stderr: b""}
        rest: list[IO[str]] = [file for file in texts if not file.closed]
        while rest:
            left = None if until is None else max(until - time.monotonic(), 0.0)
            ready = select.select(rest, [], [], left)[0]
            if not ready:
                raise subprocess.TimeoutExpired(self.args, timeout or 0.0)
            for file in ready:
                if read := os.read(file.fileno(), LONGEST):
                    texts[file] += read
                else:
                    rest.remove(file)
                    file.close()
        self.wait(timeout)
        return texts[self.stdout].decode(), texts[self.stderr].decode()

    def send_signal(self, number: int) -> None:
        """Send it a signal, where it lives."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def terminate(self) -> None:
        """Ask it to end."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """End it."""
        self.send_signal(signal.SIGKILL)


def run(
    *words: object, timeout: float = 120.0, cwd: Path | None = None, source: Forker | None = None
) -> subprocess.CompletedProcess[str]:
    """Run ``borechain`` with ``words`` to its end, forked from ``source`` or from this worker's own forker."""
    command = Command(*words, source=source or forker(), cwd=cwd)
    try:
        out, err = command.communicate(timeout)
    finally:
        command.kill()
    return subprocess.CompletedProcess(command.args, command.wait(), out, err)


class Server:
    """Forks a child for every order that comes, and tells its pid and how it ended.

    Parameters
    ----------
    run : pid; with that process it ends
    is_host : whether its children give fork servers to rigs
    """

    def __init__(self, run: int, *, is_host: bool) -> None:
        self._is_host = is_host
        self._listener = socket.socket(fileno=os.dup(0))
        self._end = os.pidfd_open(run)
        self._woken, self._wake = os.pipe()
        os.set_blocking(self._wake, False)
        signal.set_wakeup_fd(self._wake)
        signal.signal(signal.SIGCHLD, lambda _number, _frame: None)
        self._users: list[socket.socket] = []
        self._told: dict[int, int] = {}  # who hears how a child ends, by its pid

    def serve(self) -> None:
        """Take orders until one says that it is the last."""
        while True:
            ready = select.select([self._listener, self._woken, self._end, *self._users], [], [])[0]
            if self._end in ready:
                return
            if self._woken in ready:
                os.read(self._woken, LONGEST)
                self._tell_ends()
            if self._listener in ready:
                self._users.append(self._listener.accept()[0])
            for user in [user for user in self._users if user in ready]:
                order, files, _, _ = socket.recv_fds(user, LONGEST, 3)
                if order == END:
                    return
                if order:
                    self._fork(json.loads(order), files)
                else:
                    self._users.remove(user)
                    user.close()

    def _fork(self, order: dict[str, Any], files: list[int]) -> None:
        child = os.fork()
        if child == 0:
            sockets = (self._listener, *self._users)
            for file in (self._end, self._woken, self._wake, *self._told.values(), *(s.detach() for s in sockets)):
                os.close(file)
            be(order, files, is_host=self._is_host)
        os.write(files[2], f"{child}\n".encode())
        self._told[child] = files[2]
        for file in files[:2]:
            os.close(file)

    def _tell_ends(self) -> None:
        while self._told:
            child, status = os.waitpid(-1, os.WNOHANG)
            if child == 0:
                return
            with contextlib.suppress(BrokenPipeError), os.fdopen(self._told.pop(child), "w") as listener:
                listener.write(f"{os.waitstatus_to_exitcode(status)}\n")


def serve(run: int, preload: list[str]) -> None:
    """Import what commands import, and fork them until the run of the tests has ended."""
    from borechain.__main__ import COMMANDS

    for module in (*preload, *(module for module, _, _ in COMMANDS.values()), *LAZY):
        with contextlib.suppress(ModuleNotFoundError):  # where an extra is missing, its commands say so
            importlib.import_module(module)
    gc.collect()
    gc.freeze()
    Server(run, is_host=bool(preload)).serve()


def be(order: dict[str, Any], files: list[int], *, is_host: bool) -> None:
    """Be the command, and end."""
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    if order["own_session"]:
        os.setsid()
    os.chdir(order["cwd"])
    for number, file in enumerate((os.open(os.devnull, os.O_RDONLY), files[0], files[1])):
        os.dup2(file, number)
        os.close(file)
    os.close(files[2])
    program = sys.modules["__main__"] = importlib.import_module("borechain.__main__")
    if is_host:
        fork_servers_from(server_in_waiting())
    status = 0
    try:
        program.main(order["words"])
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
    except BaseException:
        traceback.print_exc()
        status = 1
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


def server_in_waiting() -> tuple[int, socket.socket]:
    """A copy of this process that will be a fork server once it is told; it ends where it is not.

    It is made before the command has a thread, which no fork takes along.
    """
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    child = os.fork()
    if child:
        theirs.close()
        return child, ours
    ours.close()
    order, files, _, _ = socket.recv_fds(theirs, LONGEST, 8)
    if order:
        code, numbers = json.loads(order)
        aside = [fcntl.fcntl(file, fcntl.F_DUPFD, ASIDE) for file in files]  # never on a number still to be given
        for number, file in zip(numbers, aside, strict=True):
            os.dup2(file, number)
            os.close(file)
        exec(code, {})
    os._exit(0)


def fork_servers_from(waiting: tuple[int, socket.socket]) -> None:
    """Have ``multiprocessing`` take what waits for its first fork server, in place of an interpreter that it starts."""
    from multiprocessing import util

    usual = util.spawnv_passfds

    def spawn(path: Any, words: Any, files: Any) -> int:
        if "multiprocessing.forkserver" not in words[-1]:
            return int(usual(path, words, files))
        socket.send_fds(waiting[1], [json.dumps([words[-1], list(files)]).encode()], files)
        waiting[1].close()
        util.spawnv_passfds = usual  # type: ignore[attr-defined]
        return waiting[0]

    util.spawnv_passfds = spawn  # type: ignore[attr-defined]


if __name__ == "__main__":
    serve(int(sys.argv[1]), sys.argv[2:])
