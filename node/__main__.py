"""``python -m node``: the node of a tube, or the encoder node, on a board that holds this package and telemetry."""

from __future__ import annotations

import sys
from importlib.util import find_spec

PACKAGES = ("node", "telemetry")
PROGRAM = "python -m node"


def main() -> None:
    """Run the command: ``node`` (the default) or ``encoder``."""
    try:
        from node.process.command_group import commands
        from telemetry.runtime.command_line import run_command
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "telemetry":
            raise
        found = find_spec("telemetry")
        sys.exit(f"{PROGRAM}: expected the package telemetry of borechain, got {found.origin if found else 'none'}")
    run_command(commands, PROGRAM, packages=PACKAGES)


if __name__ == "__main__":
    main()
