"""``borechain link``: whether the ends of two tubes hear each other."""

from __future__ import annotations

import click

from borechain.cli.link.pipe import pipe
from borechain.cli.link.soil import soil


@click.group()
def link() -> None:
    """Links between tubes: what a radio hears through soil and inside the pipe.

    \b
    Examples:
      borechain link soil --sand 0.05 --clay 0.47 --water 0.40 --distance-m 0.3
      borechain link pipe --frequency-ghz 5 --grade "X52 seamless"
    """


for command in (soil, pipe):
    link.add_command(command)
