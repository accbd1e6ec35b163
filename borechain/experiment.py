"""``borechain experiment``: published experiments, ours beside the printed values."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import click

from borechain.faults import EnvironmentFault, plain_faults

RELAY_COLUMNS = (
    ("scheme", "scheme"),
    ("hop", "hop"),
    ("yaw_rms_rest_deg", "yaw rms at rest, deg"),
    ("yaw_rms_turning_deg", "turning, deg"),
    ("nees_rest", "NEES at rest"),
    ("nees_turning", "turning"),
    ("nees_total", "with joints"),
    ("published", "studied, at rest"),
)


@click.group()
def experiment() -> None:
    """Rerun a published experiment beside ours.

    \b
    Example:
      borechain experiment relay --hops 10 --seeds 40
    """


@experiment.command("list")
def list_() -> None:
    """Name every experiment."""
    click.echo("relay   consistency of the yaw's variance at every hop, for both relay schemes")


@experiment.command()
@click.option("--hops", type=click.IntRange(1, 50), default=10, show_default=True)
@click.option("--seeds", type=click.IntRange(2, 10_000), default=40, show_default=True)
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), help="Folder for relay.csv.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else on stdout.")
@plain_faults
def relay(hops: int, seeds: int, out: Path | None, as_json: bool) -> None:
    """Judge at every hop whether a node's own variance is the truth about its error (NEES, 1 is honest)."""
    from rich.console import Console
    from rich.progress import Progress

    from sim.experiments.relay import run

    with Progress(console=Console(stderr=True), disable=as_json) as bar:
        task = bar.add_task("seeds", total=2 * seeds)
        result = run(hops, seeds, lambda: bar.advance(task))
    if out is not None:
        write_table(out, result["cases"])
    if as_json:
        click.echo(json.dumps(result))
    else:
        show(result)


def write_table(folder: Path, rows: list[dict[str, Any]]) -> None:
    """Keep the table as CSV, landing whole."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        fresh = folder / "relay.csv.new"
        with fresh.open("w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow([key for key, _ in RELAY_COLUMNS])
            writer.writerows([[cell(row[key]) for key, _ in RELAY_COLUMNS] for row in rows])
        fresh.replace(folder / "relay.csv")
    except OSError as error:
        raise EnvironmentFault(f"{folder}: {error.strerror}; choose a writable folder with --out") from error


def show(result: dict[str, Any]) -> None:
    """Print the table for people."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"Relay over {result['hops']} hops, {result['seeds']} seeds")
    for _, name in RELAY_COLUMNS:
        table.add_column(name, justify="right")
    for row in result["cases"]:
        table.add_row(*(cell(row[key]) for key, _ in RELAY_COLUMNS))
    console = Console()
    console.print(table)
    for scheme, good in result["consistent"].items():
        console.print(f"{scheme}: every NEES within [0.5, 2]: {'yes' if good else 'no'}")


def cell(value: Any) -> str:
    """Four significant digits for numbers, nothing for nothing."""
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
