"""``borechain router``: where the processes of a rig meet when no launcher started them."""

from __future__ import annotations

from pathlib import Path

import click

from borechain.cli.faults import plain_faults
from telemetry.runtime.process_options import endpoint_option, insecure_option, keys_option


@click.command()
@insecure_option
@endpoint_option("Where to listen.")
@keys_option
@plain_faults
def router(endpoint: str, keys_place: Path | None) -> None:
    """Run the zenoh router of a rig.

    Over TLS it shows router.pem of the folder --keys, and lets everybody do what access.json there says.

    \b
    Examples:
      borechain router --endpoint tcp/127.0.0.1:7447
      borechain router --endpoint tls/0.0.0.0:7447 --keys /etc/borechain
    """
    from borechain.drilling.router_host import run_router

    run_router(endpoint, keys_place)
