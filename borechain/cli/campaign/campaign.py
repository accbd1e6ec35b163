"""``borechain campaign``: thousands of runs of one scenario, kept as Parquet, and what they show."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import click

from borechain.cli.console_tables import show_table, write_table
from borechain.cli.experiment.study_output import progress_bar
from borechain.cli.faults import InputFault, plain_faults
from borechain.cli.shared_options import json_option, scenario_argument
from telemetry.runtime.command_line import check_installed

LARGEST_RUN = 10**8 - 1  # that the names of the files hold


@click.command()
@scenario_argument
@click.option("--runs", type=click.IntRange(1, 10**7), required=True, help="Number of runs, each a seed.")
@click.option("--first", type=click.IntRange(1, LARGEST_RUN), default=1, show_default=True, help="First seed.")
@click.option(
    "--engine",
    type=click.Choice(["local", "dask"]),
    default="local",
    show_default=True,
    help="The cores of this machine, or a dask cluster.",
)
@click.option("--scheduler", metavar="ADDRESS", help="Of the dask cluster; without it one is started here.")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder of the results.  [default: out/campaign-NAME]",
)
@json_option
@plain_faults
def campaign(
    scenario: Path, runs: int, first: int, engine: str, scheduler: str | None, out: Path | None, as_json: bool
) -> None:
    """Run a scenario many times in a compiled loop and judge the filter and the surveys.

    Every run is a seed: its string, sensors, noise and losses. The link is off; what stands for it are its effects,
    as [medium], [clocks] and [aiding] of the scenario have them. Results are Parquet tables, a pair for 64 runs, which
    pandas, polars and duckdb read; a campaign that was cut off goes on where it was, and --runs may grow. A key that
    a campaign cannot express, of [rough] too, is refused by its name.

    \b
    Examples:
      borechain campaign wellbore-1 --runs 1000
      borechain campaign rough --runs 1000
      borechain campaign wellbore-1 --runs 100000 --engine dask --scheduler tcp://head:8786
    """
    if scheduler is not None and engine != "dask":
        raise InputFault("--scheduler: expected with --engine dask alone")
    if first + runs - 1 > LARGEST_RUN:
        raise InputFault(f"--first {first} --runs {runs}: expected a last run of at most {LARGEST_RUN}")
    for package in ("pyarrow", "matplotlib", "scipy", *(["distributed"] if engine == "dask" else [])):
        check_installed(package)
    from sim.campaign.campaign_run import run_campaign
    from sim.world.scenario import load_scenario

    loaded = load_scenario(scenario)
    name = scenario.stem
    folder = out or Path("out") / f"campaign-{name}"
    with progress_bar(runs, "runs", quiet=as_json) as step:
        began = time.monotonic()
        result = run_campaign(loaded, name, folder, first, runs, engine, scheduler, step)
        took = time.monotonic() - began
    write_campaign(folder, result)
    if as_json:
        click.echo(json.dumps(result))
        return
    show_campaign(result, folder, took)


def write_campaign(folder: Path, result: dict[str, Any]) -> None:
    """Write tables and pictures beside the runs."""
    from groundstation.report.style import save_figure
    from sim.campaign.campaign_figures import accuracy_figure, honesty_figure
    from sim.campaign.summary import ACCURACY, HONESTY

    title = f"{result['scenario']}, {result['runs']} runs"
    write_table(folder / "honesty.csv", result["honesty"], HONESTY)
    save_figure(honesty_figure(result["honesty"], f"Honesty of the nodes: {title}"), folder / "honesty.svg")
    if result["accuracy"]:
        write_table(folder / "accuracy.csv", result["accuracy"], ACCURACY)
        save_figure(accuracy_figure(result["accuracy"], f"Surveys: {title}"), folder / "accuracy.svg")


def show_campaign(result: dict[str, Any], folder: Path, took: float) -> None:
    """Print the tables, and how fast it went."""
    from sim.campaign.summary import ACCURACY, HONESTY

    show_table(f"Honesty of the nodes, {result['runs']} runs", result["honesty"], HONESTY)
    show_table("Single surveys", result["accuracy"], ACCURACY)
    computed, cycles = result["computed"], result["node_cycles"]
    if computed:
        click.echo(f"{computed} runs of {cycles} node-cycles in {took:.1f} s: {computed * cycles / took:.3g} a second")
    click.echo(f"{folder}: surveys-*.parquet, epochs-*.parquet, honesty and accuracy as tables and pictures")
