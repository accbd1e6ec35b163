"""``borechain link``: whether the ends of two tubes hear each other, and what a wired joint carries."""

from __future__ import annotations

import click

from borechain.cli.link.can import dbc, load
from borechain.cli.link.chip_command import chip
from borechain.cli.link.pipe import pipe
from borechain.cli.link.soil_command import soil


@click.group()
def link() -> None:
    """Links between tubes: what a radio hears through soil and inside the pipe, what a CAN bus carries.

    \b
    Examples:
      borechain link soil --sand 0.05 --clay 0.47 --water 0.40 --distance-m 0.3
      borechain link pipe --frequency-ghz 5 --grade "X52 seamless"
      borechain link load --tubes 25 --bitrate 500000
      borechain link dbc --check their.dbc
      borechain link chip --line /dev/ttyACM0 --bus can0
    """


for command in (soil, pipe, load, dbc, chip):
    link.add_command(command)
