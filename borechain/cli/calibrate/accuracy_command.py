"""``borechain calibrate accuracy``: accuracy and precision of sensors against presets."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from borechain.cli.console_tables import table_console
from borechain.cli.faults import plain_faults
from borechain.cli.shared_options import json_option


@click.command()
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@json_option
@plain_faults
def accuracy(files: tuple[Path, ...], as_json: bool) -> None:
    """Accuracy and precision of the sensors in FILES, one record each, against presets; and those of all as one.

    A record has a reading a row (preset_deg,reading_deg), or a row a preset (preset_deg,mean_deg,std_deg); deg, dps,
    mps2 or g.

    \b
    Example:
      borechain calibrate accuracy first.csv second.csv
    """
    from groundstation.calibration.accuracy_records import answer_accuracy

    found = answer_accuracy(files)
    if as_json:
        click.echo(json.dumps(found))
    else:
        show_accuracy(found)


def show_accuracy(found: dict[str, Any]) -> None:
    """Tables for people."""
    from rich.table import Table

    paper, unit = table_console(80), found["unit"]
    for sensor in found["sensors"]:
        table = Table(title=sensor["file"])
        for name in (f"preset {unit}", f"mean {unit}", f"std {unit}", "error %"):
            table.add_column(name, justify="right")
        for row in sensor["presets"]:
            table.add_row(f"{row['preset']:g}", *(f"{row[key]:.4g}" for key in ("mean", "std", "error_percent")))
        paper.print(table)
        paper.print(f"accuracy {sensor['error_percent']:.4g} %, precision {sensor['std']:.4g} {unit}")
    if len(found["sensors"]) > 1:
        paper.print(f"all as one: accuracy {found['error_percent']:.4g} %, precision {found['std']:.4g} {unit}")
