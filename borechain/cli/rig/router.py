"""``borechain router``: where the processes of a rig meet when no launcher started them."""

from __future__ import annotations

import click

from borechain.cli.faults import plain_faults
from telemetry.runtime.options import endpoint_option


@click.command()
@endpoint_option("Where to listen.")
@plain_faults
def router(endpoint: str) -> None:
    """Run the zenoh router of a rig.

    \b
    Example:
      borechain router --endpoint tcp/127.0.0.1:7447
    """
    from borechain.host import run_router

    run_router(endpoint)
