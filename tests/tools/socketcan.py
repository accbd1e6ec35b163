"""Joints on the kernel's own CAN, in a User-Mode Linux that boots in seconds and needs no rights: make test-socketcan.

Where that cannot be had, one line says why and nothing is tested.
"""

from __future__ import annotations

import contextlib
import os
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
ROOM = REPOSITORY / "tests" / "socketcan"
LIMIT = 300.0  # s
QUIET = ("con=null", "con0=null,fd:1", "quiet", "loglevel=0")


def lacking() -> str:
    """Why it cannot be had here; empty where it can."""
    if platform.machine() != "x86_64":
        return f"no User-Mode Linux on {platform.machine()}"
    if shutil.which("linux.uml") is None or not Path("/usr/lib/uml/modules").is_dir():
        return "no linux.uml: install Debian's user-mode-linux"
    if shutil.which("ip") is None:
        return "no ip: install Debian's iproute2"
    if "amx_tile" in Path("/proc/cpuinfo").read_text() and shutil.which("cc") is None:
        return "this processor has AMX, which takes a C compiler to be hidden from User-Mode Linux"
    return ""


def preload(folder: Path) -> dict[str, str]:
    """What a processor needs whose registers are more than User-Mode Linux knows."""
    if "amx_tile" not in Path("/proc/cpuinfo").read_text():
        return {}
    library = folder / "xstate.so"
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", library, ROOM / "xstate.c"], check=True)
    return {"LD_PRELOAD": str(library)}


def boot(folder: Path) -> int:
    """Run the machine until it powers off; returns the exit status of the proof."""
    outcome = folder / "outcome"
    init = [sys.executable, str(ROOM / "machine.py"), sys.executable, str(REPOSITORY), str(outcome)]
    words = ["linux.uml", "mem=512M", "root=/dev/root", "rootfstype=hostfs", "rootflags=/", "rw", *QUIET]
    words += [f"uml_dir={folder}", f"init={init[0]}", "--", *init[1:]]
    environment = {**os.environ, **preload(folder), "TMPDIR": "/dev/shm"}
    machine = subprocess.Popen(words, env=environment, stdin=subprocess.DEVNULL, start_new_session=True)
    try:
        machine.wait(LIMIT)
    except subprocess.TimeoutExpired:
        print(f"the machine did not power off within {LIMIT:g} s")
    finally:
        with contextlib.suppress(ProcessLookupError):  # it leaves processes behind
            os.killpg(machine.pid, signal.SIGKILL)
        machine.wait()
    return int(outcome.read_text()) if outcome.exists() else 1


def main() -> int:
    """Prove it, or say why not."""
    if reason := lacking():
        print(f"test-socketcan: skipped: {reason}")
        return 0
    begun = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="borechain-") as folder:
        status = boot(Path(folder))
    print(f"test-socketcan: {'passed' if status == 0 else 'failed'} in {time.monotonic() - begun:.0f} s")
    return status


if __name__ == "__main__":
    raise SystemExit(main())
