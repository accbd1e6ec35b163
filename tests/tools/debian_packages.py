"""Debian's packages for the tests, installed as root where that may be."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys


def as_root() -> list[str] | None:
    """What to put before a command that only root may run; None where nothing helps."""
    if os.geteuid() == 0:
        return []
    sudo = shutil.which("sudo")
    may = sudo is not None and subprocess.run([sudo, "-n", "true"], capture_output=True, check=False).returncode == 0
    return [str(sudo), "-n"] if may else None


def install(wanted: list[str], refusal: str, remedy: str) -> None:
    """Install packages; exits with ``refusal``, the reason and the ``remedy`` where that cannot be."""
    before, apt = as_root(), shutil.which("apt-get")
    if before is None or apt is None:
        sys.exit(f"{refusal}: {remedy}")
    settings = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for words in (["update"], ["install", "--yes", "--no-install-recommends", *wanted]):
        done = subprocess.run(
            [*before, apt, "--quiet=2", "-o", "DPkg::Lock::Timeout=120", *words],
            env=settings,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            last = (done.stderr.strip().splitlines() or ["no reason"])[-1]
            sys.exit(f"{refusal}: apt-get {words[0]}: {last}; {remedy}")
