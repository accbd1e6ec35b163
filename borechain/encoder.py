"""``borechain encoder``: the encoder node on the drive head."""

from __future__ import annotations

from pathlib import Path

import click

from borechain.faults import plain_faults
from borechain.options import place_options


@click.command()
@click.option("--counter", help="The node's own counter: counter:FILE or replay:FILE.")
@place_options
@plain_faults
def encoder(counter: str | None, rig_name: str, endpoint: str, folder: Path) -> None:
    """Run the encoder node until it is stopped.

    \b
    Example:
      borechain encoder --folder state/encoder
    """
    from borechain.processes import Place, run_encoder
    from node.process.drivers.choice import encoder_source

    run_encoder(Place(rig_name, endpoint, folder), encoder_source(counter) if counter else None)
