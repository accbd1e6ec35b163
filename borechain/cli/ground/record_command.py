"""``borechain record`` and ``borechain replay``: a rig into a file, and the file into a ground station."""

from __future__ import annotations

import contextlib
import json
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.faults import EnvironmentFault, plain_faults, require_modules
from borechain.cli.ground.query import rig_option, role_option
from borechain.cli.shared_options import parse_speed
from groundstation.page_options import PageRequest, page_settings
from telemetry import keys
from telemetry.media.credentials import Credentials, credentials_for
from telemetry.runtime.process_options import insecure_option, keys_option

if TYPE_CHECKING:
    from groundstation.recording.recorder import RecordingSummary
    from telemetry.media.zenoh_bus import ZenohBus

DAMAGE_SHOWN = 20  # lines
ONE_TRY = 2.0  # wall s to join a router that may not be there yet


@click.command()
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@click.option("--rig", "rig_name", default=keys.DEFAULT_RIG, show_default=True, help="Name of the rig.")
@insecure_option
@rig_option
@keys_option
@role_option
@click.option(
    "--wait",
    type=click.FloatRange(0.0),
    default=60.0,
    show_default=True,
    help="Seconds to wait for the router: a recording that begins before the rig is whole.",
)
@require_modules("mcap", "sqlalchemy")
@plain_faults
def record(file: Path, rig_name: str, endpoint: str, keys_place: Path | None, role: str, wait: float) -> None:
    """Record a rig into FILE (MCAP) until Ctrl-C: every answer with its schema, and what the ground station takes in.

    \b
    Examples:
      borechain record shift.mcap
      borechain replay shift.mcap
    """
    course = record_rig(file, rig_name, endpoint, wait, credentials_for(endpoint, keys_place, role))
    click.echo(f"{course.samples} samples, {course.newest} events taken in by the ground station", err=True)
    if not course.is_whole:
        first = f"begins at event {course.first}" if course.first else "holds no event of the ground station"
        lost = f", {course.missing} events and {course.dropped} samples were lost" if course.missing else ""
        click.echo(f"not whole: the recording {first}{lost}; a replay knows what it has", err=True)


def record_rig(
    file: Path, rig_name: str, endpoint: str, wait: float, credentials: Credentials | None = None
) -> RecordingSummary:
    """Record until a signal comes, from when the router is there, which may be within ``wait`` wall seconds.

    Raises
    ------
    MediumError
        When no router is there by then.
    """
    from groundstation.recording.recorder import Recorder

    with contextlib.ExitStack() as stack:
        recorder = Recorder(stack.enter_context(patient_client(endpoint, wait, credentials)), rig_name, file)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_signal: recorder.stop())
        click.echo(f"recording {rig_name} at {endpoint} into {file}, Ctrl-C ends it", err=True)
        return recorder.run()


@contextlib.contextmanager
def patient_client(endpoint: str, wait: float, credentials: Credentials | None) -> Iterator[ZenohBus]:
    """Session at a router, tried in short tries; a single long one would miss how soon it is there."""
    from telemetry.errors import MediumError
    from telemetry.media.zenoh_bus import open_client

    deadline = time.monotonic() + wait
    with contextlib.ExitStack() as stack:
        bus = None
        while bus is None:
            try:
                bus = stack.enter_context(open_client(endpoint, min(ONE_TRY, max(wait, 0.1)), credentials))
            except MediumError:
                if time.monotonic() >= deadline:
                    raise
        yield bus


@click.command()
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "--folder",
    type=click.Path(path_type=Path, file_okay=False),
    help="New folder for the database of the replay, to keep it  [default: none is kept]",
)
@click.option("--page", metavar="HOST:PORT", help="Show it on the page there, until Ctrl-C.")
@click.option(
    "--speed",
    default="60",
    show_default=True,
    callback=parse_speed,
    metavar="max|X",
    help="With --page, times real time.",
)
@click.option("--json", "as_json", is_flag=True, help="One JSON object on one line.")
@require_modules("mcap", "scipy", "sqlalchemy")
@plain_faults
def replay(file: Path, folder: Path | None, page: str | None, speed: float, as_json: bool) -> None:
    """Give what a ground station took in (FILE of ``borechain record``) to a new one, and show what it knows then.

    \b
    Examples:
      borechain replay shift.mcap
      borechain replay shift.mcap --json
      borechain replay shift.mcap --page 127.0.0.1:8080 --speed 60

    \b
    Exit status: 0 for a whole recording, 1 for one that is cut or damaged: what could be read is shown all the same.
    """
    from groundstation.recording.recording_file import Recording

    recording = Recording(file)
    if folder is not None and folder.exists() and any(folder.iterdir()):
        raise EnvironmentFault(f"folder {folder}: expected a new or empty one, it holds something")
    shown = page_settings(PageRequest(page))
    with tempfile.TemporaryDirectory(prefix="borechain-") as place:
        if shown is not None:
            from groundstation.recording.show import show_recording

            show_recording(recording, folder or Path(place), replace(shown, replay=file.name), speed)
            tell_damage([one.line for one in recording.damage])
            return
        from borechain import api

        result = api.replay(recording, folder or Path(place))
    if as_json:
        click.echo(json.dumps(result))
    else:
        print_replay(result)
    if not result["whole"]:
        sys.exit(EnvironmentFault.exit_code)


def print_replay(result: dict[str, Any]) -> None:
    """Print what a replay knows, and what its recording has lost."""
    for station in result["stations"]:
        lean = f"{station['inclination_deg']:.3f} deg to {station['azimuth_deg']:.2f} deg"
        click.echo(f"station {station['station']} at {station['md_m']:.2f} m: {lean}")
    click.echo(result["verdict"]["line"])
    file = "damaged" if result["damage"] else "whole" if result["whole"] else "cut"
    click.echo(f"{result['events']} events, {result['missing']} missing; {file} file")
    tell_damage(result["damage"])
    click.echo(f"digest {result['digest']}")


def tell_damage(lines: list[str]) -> None:
    """Say on the error stream which parts of a recording could not be read."""
    for line in lines[:DAMAGE_SHOWN]:
        click.echo(line, err=True)
    if len(lines) > DAMAGE_SHOWN:
        click.echo(f"and {len(lines) - DAMAGE_SHOWN} more damaged parts", err=True)
