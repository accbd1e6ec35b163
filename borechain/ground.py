"""``borechain ground``: the ground station."""

from __future__ import annotations

from pathlib import Path

import click

from borechain.faults import plain_faults
from borechain.options import key_option, place_options


@click.command()
@click.option("--tube-length-m", type=float, default=2.0, show_default=True, help="Length of every tube of the tally.")
@key_option
@place_options
@plain_faults
def ground(tube_length_m: float, key_file: Path | None, rig_name: str, endpoint: str, folder: Path) -> None:
    """Run the ground station of one rig.

    \b
    Example:
      borechain ground --folder state/ground --tube-length-m 2
    """
    from borechain.processes import Place, run_ground

    run_ground(Place(rig_name, endpoint, folder, key_file), tube_length_m)
