"""Experiments of survey mathematics: regions of uncertainty, weights of readings, coverage."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from borechain.faults import plain_faults
from borechain.tables import CASE_COLUMNS, show_table, write_table

out_option = click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), help="Folder for tables and plots."
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else on stdout.")
REGION_COLUMNS = (*CASE_COLUMNS, ("ratio", "ratio"))
SWEEP_COLUMNS = tuple(
    (name, name) for name in ("changed", "value_deg", "scheme", "station", "north_cm", "east_cm", "tvd_cm")
)
FILTERED_COLUMNS = (
    ("instrument", "instrument"),
    ("unfiltered_cm", "gyro, cm"),
    ("filtered_cm", "0.25 deg azimuth, cm"),
)
COVERAGE_COLUMNS = (
    ("case", "case"),
    ("published", "claimed, %"),
    ("ours", "inside, %"),
    ("half_interval", "+- (95 %)"),
    ("unit", "unit"),
)


@click.command("region-of-uncertainty")
@out_option
@json_option
@plain_faults
def regions(out: Path | None, as_json: bool) -> None:
    """Regions of uncertainty of wellbore 1 for five instruments, the printed tables beside ours.

    \b
    Example:
      borechain experiment region-of-uncertainty --out docs/results
    """
    from sim.experiments.regions import run

    result = run()
    if out is not None:
        write_table(out / "region-of-uncertainty.csv", result["cases"], REGION_COLUMNS)
        draw_regions(out, result)
    if as_json:
        click.echo(json.dumps(result))
        return
    show_table("Region of uncertainty of wellbore 1", result["cases"], REGION_COLUMNS)
    show_table("Lateral error at the toe: gyro against a held azimuth", result["filtered"], FILTERED_COLUMNS)


def draw_regions(folder: Path, result: dict[str, Any]) -> None:
    """Figures 4.5-4.7."""
    import numpy as np

    from groundstation.report.plots_study import uncertainty_figure
    from groundstation.report.style import save
    from sim.experiments.published import wellbore_1

    md = wellbore_1().md
    tables = {}
    for name in dict.fromkeys(row["instrument"] for row in result["cases"]):
        ours, printed = (np.zeros((len(md), 3)) for _ in range(2))
        for row in result["cases"]:
            if row["instrument"] == name:
                axis = ("north", "east", "tvd").index(row["axis"])
                ours[row["station"], axis], printed[row["station"], axis] = row["ours"], row["published"]
        tables[name] = (md[1:], ours[1:], printed[1:])
    save(uncertainty_figure(tables), folder / "region-of-uncertainty.svg")


@click.command()
@out_option
@json_option
@plain_faults
def weighting(out: Path | None, as_json: bool) -> None:
    """Weights of the readings of one station when the hole moves, the published reductions beside ours.

    \b
    Example:
      borechain experiment weighting --out docs/results
    """
    from sim.experiments.weighting import run

    result = run()
    if out is not None:
        write_table(out / "weighting.csv", result["cases"], CASE_COLUMNS)
        write_table(out / "weighting-sweeps.csv", result["sweeps"], SWEEP_COLUMNS)
    if as_json:
        click.echo(json.dumps(result))
        return
    show_table("Remaining error at the fourth stop", result["cases"], CASE_COLUMNS)


@click.command()
@click.option("--wells", type=click.IntRange(100, 1_000_000), default=2000, show_default=True)
@click.option(
    "--strings", type=click.IntRange(2, 10_000), default=100, show_default=True, help="Whose filters are run."
)
@out_option
@json_option
@plain_faults
def coverage(wells: int, strings: int, out: Path | None, as_json: bool) -> None:
    """How often the claimed ellipse holds the true position, over wells drilled with the rig's own numbers.

    \b
    Example:
      borechain experiment coverage --wells 2000
    """
    from rich.console import Console
    from rich.progress import Progress

    from sim.experiments.coverage import WELLS_A_JOB, run

    with Progress(console=Console(stderr=True), disable=as_json) as bar:
        task = bar.add_task("strings, then wells", total=strings + -(-wells // WELLS_A_JOB))
        result = run(wells, strings, lambda: bar.advance(task))
    if out is not None:
        write_table(out / "coverage.csv", result["cases"], COVERAGE_COLUMNS)
    if as_json:
        click.echo(json.dumps(result))
        return
    show_table(f"Coverage over {result['wells']} wells", result["cases"], COVERAGE_COLUMNS)
