"""The rig in one process beside the rig of real processes: CPU of both in one run, and that the digests agree."""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import resource
import socket
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

PR_SET_CHILD_SUBREAPER = 36
SCENARIO = Path(__file__).parents[1] / "scenarios" / "wellbore-1.toml"


def run() -> dict[str, Any]:
    """Drill wellbore 1, seed 1, inline and with processes.

    Returns
    -------
    dict
        ``ratios``: CPU seconds inline (ours) and of all processes together (peer); ``digests`` of both.

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
    ratio = {"ours": inline_s, "peer": processes_s, "ratio": processes_s / inline_s}
    return {"bench": "inline", "ratios": {"wellbore-1, CPU": ratio}, "digests": [inline, processes]}


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
    """An endpoint on loopback that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


if __name__ == "__main__":
    print(json.dumps(run(), indent=1))
