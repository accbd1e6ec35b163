"""Install the browser and the database server of the tests where there are none: part of `make test`."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

from postgres import find_program

NAMES = ("chromium", "chromium-browser", "google-chrome")
REMEDY = "install chromium and postgresql with the system's package manager, then run this again"


def find_browser() -> str | None:
    """Path of an installed browser."""
    return next((path for path in map(shutil.which, NAMES) if path), None)


def as_root() -> list[str] | None:
    """What to put before a command that only root may run; None where nothing helps."""
    if os.geteuid() == 0:
        return []
    sudo = shutil.which("sudo")
    may = sudo is not None and subprocess.run([sudo, "-n", "true"], capture_output=True, check=False).returncode == 0
    return [str(sudo), "-n"] if may else None


def lacking() -> list[str]:
    """Debian's packages of what is not there."""
    browser = [] if find_browser() else ["chromium", "fonts-dejavu-core"]
    server = [] if find_program("initdb") else ["postgresql"]
    return browser + server


def main() -> None:
    """Install what is lacking."""
    wanted = lacking()
    if not wanted:
        return
    refusal = f"expected {', '.join(wanted)} for the tests"
    before, apt = as_root(), shutil.which("apt-get")
    if before is None or apt is None:
        sys.exit(f"{refusal}: {REMEDY}")
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
            sys.exit(f"{refusal}: apt-get {words[0]}: {last}; {REMEDY}")
    if lacking():
        sys.exit(f"{refusal}: {REMEDY}")


if __name__ == "__main__":
    main()
