"""First process of the User-Mode Linux in which joints run on the kernel's own CAN; see ``tests/tools/socketcan.py``.

Arguments (of the kernel's command line): the interpreter, the repository, a file for the outcome.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from pathlib import Path

LIBC = ctypes.CDLL(None, use_errno=True)
FINIT_MODULE = 313  # number of the system call on x86-64; Python has no function for it
POWER_OFF = 0x4321FEDC
MODULES = ("net/can/can", "net/can/can-raw", "drivers/net/can/dev/can-dev", "drivers/net/can/vxcan")
FD_FRAME = 72  # bytes, largest transfer of an interface that carries CAN FD
JOINT = ("can-upper", "can-lower")


def mount(kind: str, where: str) -> None:
    """Mount a file system of the kernel's own."""
    if LIBC.mount(kind.encode(), where.encode(), kind.encode(), 0, None) != 0:
        raise OSError(ctypes.get_errno(), f"mounting {kind} on {where}")


def load(module: str) -> None:
    """Load a module of the kernel's own release."""
    path = Path("/usr/lib/uml/modules") / os.uname().release / "kernel" / f"{module}.ko"
    with path.open("rb") as file:
        if LIBC.syscall(FINIT_MODULE, file.fileno(), b"", 0) != 0:
            raise OSError(ctypes.get_errno(), f"loading {path}")


def ip(*words: str) -> None:
    """Run ``ip``."""
    subprocess.run(["ip", *words], check=True)


def main() -> None:
    """Set the machine up, run the proof, write its outcome and power off."""
    interpreter, repository, outcome = sys.argv[1:4]
    status = 1
    try:
        for kind, where in (("proc", "/proc"), ("sysfs", "/sys"), ("tmpfs", "/dev/shm")):
            Path(where).mkdir(exist_ok=True)
            mount(kind, where)
        for module in MODULES:
            load(module)
        ip("link", "add", JOINT[0], "type", "vxcan", "peer", "name", JOINT[1])
        for name in JOINT:
            ip("link", "set", name, "mtu", str(FD_FRAME), "up")
        ip("link", "set", "lo", "up")
        environment = {
            "PATH": "/usr/sbin:/usr/bin:/sbin:/bin",
            "PYTHONPATH": repository,
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        proof = [interpreter, str(Path(__file__).with_name("joint.py")), *JOINT]
        status = subprocess.run(proof, cwd=repository, env=environment, check=False).returncode
    finally:
        Path(outcome).write_text(f"{status}\n")
        os.sync()
        LIBC.reboot(POWER_OFF)


if __name__ == "__main__":
    main()
