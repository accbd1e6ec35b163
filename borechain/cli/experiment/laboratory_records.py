"""``borechain experiment records``: what the synthetic instruments of a laboratory would have written."""

from __future__ import annotations

import json
from pathlib import Path

import click

from borechain.cli.faults import plain_faults
from borechain.cli.shared_options import json_option, seed_option


@click.command()
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), required=True, help="Folder of the records.")
@seed_option
@json_option
@plain_faults
def records(out: Path, seed: int, as_json: bool) -> None:
    """Write what the synthetic instruments of a laboratory would have written, with the truth beside.

    \b
    Example:
      borechain experiment records --out out/records --seed 1
    """
    from sim.instruments.instrument_table import INSTRUMENTS
    from sim.instruments.record_files import write_records

    names = write_records(out, seed, INSTRUMENTS.values())
    if as_json:
        click.echo(json.dumps({"experiment": "records", "seed": seed, "files": names}))
    else:
        click.echo("\n".join(names))
