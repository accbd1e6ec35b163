"""``borechain link load`` and ``link dbc``: what a joint on CAN carries, and its messages for foreign tools."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from borechain.cli.console_tables import show_table
from borechain.cli.faults import InputFault, plain_faults
from borechain.cli.shared_options import json_option
from telemetry.runtime.command_line import check_installed


@click.command()
@click.option(
    "--tubes", type=click.IntRange(1, 250), multiple=True, default=(10, 25, 50), help="Tubes below it. Repeat."
)
@click.option(
    "--bitrate",
    type=click.FloatRange(min=10e3, max=1e6),
    multiple=True,
    default=(125e3, 500e3, 1e6),
    help="Nominal bit rate, bit/s. Repeat.",
)
@click.option(
    "--data-ratio",
    type=click.FloatRange(min=1.0, max=16.0),
    default=4.0,
    show_default=True,
    help="Bit rate of CAN FD's data as a multiple of the nominal one.",
)
@click.option("--sealed", is_flag=True, help="Under keys: every frame has a seal, and goes by ISO-TP.")
@json_option
@plain_faults
def load(tubes: tuple[int, ...], bitrate: tuple[float, ...], data_ratio: float, sealed: bool, as_json: bool) -> None:
    """Load of the top joint's CAN bus in per cent, worst bit stuffing; over 60 % node states are thinned out.

    \b
    Examples:
      borechain link load --tubes 50 --bitrate 125000
      borechain link load --tubes 50 --bitrate 125000 --sealed
    """
    from telemetry.application.can_load import load_table

    rows: list[dict[str, Any]] = [
        {"tubes": count, "profile": profile, "frames": frames, "bitrate": int(rate), "load_percent": 100.0 * busy}
        for count, profile, frames, rate, busy in load_table(tubes, bitrate, data_ratio, sealed=sealed)
    ]
    if as_json:
        click.echo(json.dumps({"load": rows}))
        return
    check_installed("rich")
    columns = [("tubes", "tubes"), ("profile", "profile"), ("frames", "frames"), ("bitrate", "bit/s")]
    show_table("load of the top joint" + (", sealed" if sealed else ""), rows, (*columns, ("load_percent", "load, %")))


@click.command()
@click.option(
    "--check", type=click.Path(path_type=Path, dir_okay=False, exists=True), help="A DBC file to compare with ours."
)
@plain_faults
def dbc(check: Path | None) -> None:
    """Print the DBC file of the native profile, or compare another one with it, signal by signal.

    \b
    Examples:
      borechain link dbc > borechain.dbc
      borechain link dbc --check their.dbc
    """
    from telemetry.presentation.can_dbc import database_differences, dbc_text

    if check is None:
        click.echo(dbc_text(), nl=False)
        return
    check_installed("cantools")
    import cantools

    try:
        database = cantools.database.load_file(str(check))
    except (cantools.Error, UnicodeDecodeError) as error:
        raise InputFault(f"{check}: expected a DBC file: {error}") from error
    found = database_differences(database)
    if found:
        raise InputFault("\n".join(f"{check}: {line}" for line in found))
    click.echo("no difference")
