"""``borechain crew``: the crew's screen of a running rig."""

from __future__ import annotations

import getpass
from pathlib import Path

import click

from borechain.cli.faults import plain_faults, require_modules
from borechain.cli.ground.query import rig_option, role_option
from telemetry import keys
from telemetry.runtime.process_options import insecure_option, keys_option


@click.command()
@click.option("--rig", "rig_name", default=keys.DEFAULT_RIG, show_default=True, help="Name of the rig.")
@insecure_option
@rig_option
@keys_option
@role_option
@click.option("--by", help="Who orders, for the record  [default: the user's name]")
@require_modules("textual")
@plain_faults
def crew(rig_name: str, endpoint: str, keys_place: Path | None, role: str, by: str | None) -> None:
    """Show a running rig to its crew: verdict, plan, string, alarms, and the course of what is ordered.

    \b
    Examples:
      borechain crew
      borechain crew --rig rig-2 --by anna
      borechain crew --endpoint tls/10.0.0.7:7447 --keys stick --role driller
    """
    from borechain.client import connect_to_ground
    from borechain.crew.app import CrewApp

    with connect_to_ground(endpoint, rig_name, keys_place=keys_place, role=role) as ground:
        CrewApp(ground, rig_name, by or user_name()).run()


def user_name() -> str:
    """Name of the user of this machine."""
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return "crew"
