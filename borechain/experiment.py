"""``borechain experiment``: published experiments, ours beside the printed values."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from borechain.faults import plain_faults
from borechain.survey_experiments import coverage, regions, weighting
from borechain.tables import show_table, write_table

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


for command in (coverage, regions, weighting):
    experiment.add_command(command)


@experiment.command("list")
def list_() -> None:
    """Name every experiment."""
    for name in sorted(experiment.commands.keys() - {"list"}):
        text = (experiment.commands[name].help or "").partition(".")[0].strip()
        click.echo(f"{name:24} {' '.join(text.split())}")


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
        write_table(out / "relay.csv", result["cases"], RELAY_COLUMNS)
    if as_json:
        click.echo(json.dumps(result))
    else:
        show(result)


def show(result: dict[str, Any]) -> None:
    """Print the table for people."""
    show_table(f"Relay over {result['hops']} hops, {result['seeds']} seeds", result["cases"], RELAY_COLUMNS)
    for scheme, good in result["consistent"].items():
        click.echo(f"{scheme}: every NEES within [0.5, 2]: {'yes' if good else 'no'}")
