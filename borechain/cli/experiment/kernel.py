"""Experiments of the kernel itself: what each of its ingredients buys, and its integers against its floats."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from borechain.cli.experiment.output import COLUMNS, bar, conduct, keep, options, out_option, tell, yes
from borechain.cli.faults import plain_faults
from borechain.cli.options import json_option, seed_option
from borechain.cli.tables import Columns, show_table, write_table

INGREDIENT_COLUMNS: Columns = (("mode", "mode"), *COLUMNS)
SHOWN_COLUMNS: Columns = (
    ("case", "case"),
    ("mode", "aiding"),
    ("quantity", "rms, deg, of"),
    ("ours", "ours"),
    ("interval", "95 %"),
    ("published", "studied"),
)
FIXED_COLUMNS: Columns = (
    ("case", "case"),
    ("cycles", "cycles"),
    ("yaw_max_deg", "yaw, largest, deg"),
    ("yaw_rms_deg", "rms, deg"),
    ("sigma_max", "sigma, largest, of 1"),
    ("overflows", "overflows"),
    ("status_differs", "status differs"),
)
NEES_COLUMNS: Columns = (
    ("kernel", "kernel"),
    ("hop", "hop"),
    ("yaw_rms_rest_deg", "yaw rms at rest, deg"),
    ("yaw_rms_turning_deg", "turning, deg"),
    ("nees_rest", "NEES at rest"),
    ("nees_turning", "turning"),
    ("nees_total", "with joints"),
)
NEES_HOPS = 5


@click.command()
@options
def ingredients(seeds: int, out: Path | None, as_json: bool) -> None:
    """Yaw at rest and rotating with one ingredient of the filter or of its sensors switched off at a time.

    \b
    Example:
      borechain experiment ingredients --seeds 40 --out docs/results
    """
    from sim.studies.node_ingredients import batches, run

    result = conduct(run, seeds, batches(), as_json=as_json)
    keep(out, result, INGREDIENT_COLUMNS, draw_ingredients)
    tell(result, SHOWN_COLUMNS, f"Ingredients, {seeds} seeds", as_json=as_json)


@click.command("fixed-point")
@click.option("--cycles", type=click.IntRange(2000, 100_000_000), default=1_000_000, show_default=True)
@click.option("--seeds", type=click.IntRange(2, 10_000), default=24, show_default=True, help="Of the NEES.")
@seed_option
@out_option
@json_option
@plain_faults
def fixed_point(cycles: int, seeds: int, seed: int, out: Path | None, as_json: bool) -> None:
    """Compare the integer kernel with the float64 kernel on the same inputs, cycle by cycle, and their NEES.

    \b
    Example:
      borechain experiment fixed-point --cycles 1000000 --out docs/results
    """
    from sim.studies.fixed_point import LIMITS, run

    with bar(cycles // 1000 + 2 * seeds, quiet=as_json) as step:
        result = run(cycles, seed, NEES_HOPS, seeds, step)
    if out is not None:
        write_table(out / "fixed-point.csv", result["cases"], FIXED_COLUMNS)
        write_table(out / "fixed-point-nees.csv", result["nees"], NEES_COLUMNS)
    tell(result, FIXED_COLUMNS, f"Fixed point against float64, {cycles} cycles", as_json=as_json)
    if not as_json:
        show_table(f"NEES of {NEES_HOPS} hops, {seeds} seeds", result["nees"], NEES_COLUMNS)
        asked = f"yaw within {LIMITS['yaw_deg']:g} deg, sigma within {LIMITS['sigma']:.0%}, no overflow"
        click.echo(f"{asked}: {yes(result['within'])}")


COMMANDS = (ingredients, fixed_point)


def draw_ingredients(folder: Path, result: dict[str, Any]) -> None:
    """Yaw error with every ingredient left out."""
    from groundstation.report.plots_node import Reach, ingredients_figure
    from groundstation.report.style import save

    panels: dict[str, dict[str, list[Reach]]] = {}
    for r in result["cases"]:
        reach = Reach(r["case"], r["ours"], r["low"], r["high"], None, None)
        panels.setdefault(r["quantity"].capitalize(), {}).setdefault(r["mode"], []).append(reach)
    title = f"What each ingredient buys, {result['seeds']} seeds"
    save(ingredients_figure(panels, title), folder / "ingredients.svg")
