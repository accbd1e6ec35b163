"""``borechain crew``: the crew's screen of a running rig."""

from __future__ import annotations

import getpass

import click

from borechain.cli.faults import needs, plain_faults
from telemetry import keys
from telemetry.runtime.options import endpoint_option


@click.command()
@click.option("--rig", "rig_name", default=keys.DEFAULT_RIG, show_default=True, help="Name of the rig.")
@endpoint_option("Router of the rig.")
@click.option("--by", help="Who orders, for the record  [default: the user's name]")
@needs("textual")
@plain_faults
def crew(rig_name: str, endpoint: str, by: str | None) -> None:
    """Show a running rig to its crew: verdict, plan, string, alarms, and the course of what is ordered.

    \b
    Examples:
      borechain crew
      borechain crew --rig rig-2 --by anna
    """
    from borechain.client import connect
    from borechain.crew.app import CrewApp

    with connect(endpoint, rig_name) as ground:
        CrewApp(ground, rig_name, by or user()).run()


def user() -> str:
    """Name of the user of this machine."""
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return "crew"
