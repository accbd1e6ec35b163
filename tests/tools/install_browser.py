"""Find the browser of the page's tests, or install chromium: part of `make test`, beside the other preparations."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

NAMES = ("chromium", "chromium-browser", "google-chrome")
REMEDY = "install chromium with the system's package manager, then run this again"


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


def main() -> None:
    """Install a browser where there is none."""
    if find_browser():
        return
    before, apt = as_root(), shutil.which("apt-get")
    if before is None or apt is None:
        sys.exit(f"no browser for the tests of the page: {REMEDY}")
    settings = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for words in (["update"], ["install", "--yes", "--no-install-recommends", "chromium", "fonts-dejavu-core"]):
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
            sys.exit(f"no browser for the tests of the page: apt-get {words[0]}: {last}; {REMEDY}")
    if not find_browser():
        sys.exit(f"no browser for the tests of the page: {REMEDY}")


if __name__ == "__main__":
    main()
