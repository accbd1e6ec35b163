"""``borechain encoder``: the encoder node on the drive head."""

from __future__ import annotations

from pathlib import Path

import click

from borechain.faults import plain_faults
from borechain.options import place_options


@click.command()
@place_options
@plain_faults
def encoder(rig_name: str, endpoint: str, folder: Path) -> None:
    """Run the encoder node until it is stopped.

    \b
    Example:
      borechain encoder --folder state/encoder
    """
    from borechain.processes import Place, run_encoder

    run_encoder(Place(rig_name, endpoint, folder))
