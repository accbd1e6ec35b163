"""``python -m groundstation``: the ground station of one rig."""

from __future__ import annotations

import sys
from importlib.util import find_spec

PACKAGES = ("groundstation", "node", "telemetry")
PROGRAM = "python -m groundstation"


def main() -> None:
    """Run the ground station."""
    try:
        from telemetry.runtime.one_thread import one_thread_each

        one_thread_each()  # before the library of matrices is loaded
        from groundstation.command import ground
        from telemetry.runtime.command_line import run_command
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "telemetry":
            raise
        found = find_spec("telemetry")
        sys.exit(f"{PROGRAM}: expected the package telemetry of borechain, got {found.origin if found else 'none'}")
    run_command(ground, PROGRAM, packages=PACKAGES)


if __name__ == "__main__":
    main()
