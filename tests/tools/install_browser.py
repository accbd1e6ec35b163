"""Install the browser and the database server of the tests where there are none: part of `make test`."""

from __future__ import annotations

import shutil
import sys

from debian_packages import install
from postgres import find_program

NAMES = ("chromium", "chromium-browser", "google-chrome")
REMEDY = "install chromium and postgresql with the system's package manager, then run this again"


def find_browser() -> str | None:
    """Path of an installed browser."""
    return next((path for path in map(shutil.which, NAMES) if path), None)


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
    install(wanted, refusal, REMEDY)
    if lacking():
        sys.exit(f"{refusal}: {REMEDY}")


if __name__ == "__main__":
    main()
