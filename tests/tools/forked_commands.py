"""Commands of ours, each in a process of its own that is forked from one which has imported what they import.

What a command writes, how it ends and what it leaves behind are those of ``python -m borechain``; a start costs a
hundredth of a second where it costs one or two. Not for a command that hosts a process of the rig: those look at who
started them.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import importlib
import json
import os
import select
import subprocess
import sys
import tempfile
import traceback
from pathlib import Path
from typing import Any

LAZY = ("matplotlib.pyplot", "scipy.optimize", "scipy.stats", "scipy.signal", "scipy.spatial")  # inside commands


def run(
    *words: object, timeout: float = 120.0, cwd: Path | None = None, forker: Any = None
) -> subprocess.CompletedProcess[str]:
    """Run ``borechain`` with ``words`` to its end, forked from ``forker`` or from this worker's own."""
    with tempfile.TemporaryDirectory() as folder:
        out, err = Path(folder) / "out", Path(folder) / "err"
        said = [str(word) for word in words]
        order = {"words": said, "cwd": str(cwd or Path.cwd()), "out": str(out), "err": str(err)}
        forker = forker or server()
        forker.stdin.write(json.dumps(order) + "\n")
        forker.stdin.flush()
        if not select.select([forker.stdout], [], [], timeout)[0]:
            forker.kill()
            raise TimeoutError(f"borechain {' '.join(said)}: not done in {timeout:g} s")
        status = int(forker.stdout.readline())
        return subprocess.CompletedProcess(said, status, out.read_text(), err.read_text())


@functools.cache
def server() -> Any:
    """The process that forks, one for each worker of the tests."""
    started = start(sys.executable)
    atexit.register(started.__exit__, None, None, None)  # it ends with its input
    return started


def start(python: str | Path, **options: Any) -> subprocess.Popen[str]:
    """A process that forks commands of ``python``'s environment."""
    return subprocess.Popen([python, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, **options)


def serve() -> None:
    """Fork a child for every order that comes, wait for it and answer its exit status."""
    from borechain.__main__ import COMMANDS, main

    for module in (*(module for module, _, _ in COMMANDS.values()), *LAZY):
        with contextlib.suppress(ModuleNotFoundError):  # where an extra is missing, its commands say so
            importlib.import_module(module)
    for line in sys.stdin:
        order = json.loads(line)
        child = os.fork()
        if child == 0:
            be(order, main)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


def be(order: dict[str, Any], main: Any) -> None:
    """Be the command, and end."""
    os.chdir(order["cwd"])
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    for number, name in ((1, "out"), (2, "err")):
        os.dup2(os.open(order[name], os.O_WRONLY | os.O_CREAT), number)
    status = 0
    try:
        main(order["words"])
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


if __name__ == "__main__":
    serve()
