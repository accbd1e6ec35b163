"""``borechain rig`` on a terminal: the rig runs as a process of its own, its crew's screen in front of it."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

import click

from borechain.cli.faults import EnvironmentFault, InputFault
from borechain.cli.ground.crew import user_name
from borechain.client import Ground, connect_to_ground
from telemetry.errors import MediumError

ONE_TRY = 2.0  # wall s to join the rig's endpoint before looking whether the rig still lives
ENDS_WITHIN = 30.0  # wall s after Ctrl-C


def drill_on_screen(arguments: Sequence[str], rig_name: str, endpoint: str, keys_place: Path | None) -> None:
    """Drill with the arguments of this command and show it to the crew; at the end print what the rig printed.

    Leaving the screen ends the rig, as Ctrl-C does.

    Raises
    ------
    InputFault, EnvironmentFault
        When the rig refuses its scenario, or fails; its own line has been printed.
    """
    with tempfile.TemporaryFile("w+") as written, rig_process(arguments, written) as process:
        click.echo(f"starting; the screen of the crew opens when {endpoint} can be joined, Ctrl-C ends it")
        with join_ground(process, endpoint, rig_name, keys_place) as ground:
            if ground is not None:
                show_crew_screen(ground, rig_name, process)
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        process.wait(ENDS_WITHIN)
        written.seek(0)
        click.echo(written.read(), nl=False)
        if process.returncode:
            fault = InputFault if process.returncode == InputFault.exit_code else EnvironmentFault
            raise fault(f"the rig ended with status {process.returncode}; its message stands above")


@contextlib.contextmanager
def join_ground(
    process: subprocess.Popen[str], endpoint: str, rig_name: str, keys_place: Path | None
) -> Iterator[Ground | None]:
    """The ground station of a rig that is starting; None for one that has ended before it could be joined."""
    with contextlib.ExitStack() as stack:
        ground = None
        while ground is None and process.poll() is None:
            with contextlib.suppress(MediumError):
                ground = stack.enter_context(
                    connect_to_ground(endpoint, rig_name, ONE_TRY, keys_place=keys_place, role="driller")
                )
        yield ground


def show_crew_screen(ground: Ground, rig_name: str, process: subprocess.Popen[str]) -> None:
    """The screen, until its user leaves it or the rig ends."""
    from borechain.crew.app import CrewApp

    app = CrewApp(ground, rig_name, user_name(), ended=lambda: process.poll() is not None)
    app.run()


@contextlib.contextmanager
def rig_process(arguments: Sequence[str], written: IO[str]) -> Iterator[subprocess.Popen[str]]:
    """The rig itself, which logs; ended at the latest with the context."""
    words = [sys.executable, "-m", "borechain", *arguments, "--view", "log"]
    process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=written, stderr=subprocess.STDOUT, text=True)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
            process.wait(ENDS_WITHIN)
