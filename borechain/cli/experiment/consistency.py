"""``borechain experiment consistency``: whether fifty nodes tell the truth about their own error."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import click

from borechain.cli.experiment.output import bar, keep, options, tell
from borechain.cli.tables import Columns

COLUMNS: Columns = (
    ("case", "case"),
    ("yaw_rms_deg", "yaw rms, deg"),
    ("yaw_sigma_deg", "stated sigma, deg"),
    ("nees", "NEES"),
    ("nees_total", "with joints and mounts"),
    ("published", "studied"),
    ("ours", "ours"),
    ("unit", "unit"),
)


@click.command()
@click.option(
    "--control-seeds",
    type=click.IntRange(2, 10_000),
    help="Of the other schemes; as many if absent.",
)
@click.option("--kernel", type=click.Choice(["float64", "fixed"]), default="float64", show_default=True)
@options
def consistency(
    seeds: int, control_seeds: int | None, kernel: Literal["float64", "fixed"], out: Path | None, as_json: bool
) -> None:
    """Consistency (NEES) to hop 50 under clock errors, loss, outages, joint and mount errors, by relay scheme.

    \b
    Examples:
      borechain experiment consistency --seeds 500 --control-seeds 100 --out docs/results
      borechain experiment consistency --seeds 500 --kernel fixed
    """
    from sim.studies.consistency import EVERY, OUTSIDE, USUAL, run, schemes_of

    controls = control_seeds or seeds
    with bar(seeds + (len(schemes_of(kernel)) - 1) * controls, quiet=as_json) as step:
        result = run(seeds, controls, step, kernel=kernel)
    keep(out, result, COLUMNS, draw)
    tell(result, COLUMNS, f"NEES to hop 50, {kernel}, {seeds} seeds", as_json=as_json)
    if not as_json:
        for scheme, found in result["schemes"].items():
            outside = f"{found['outside']:.0%} of the cells outside {USUAL[0]:g}..{USUAL[1]:g} (allowed {OUTSIDE:.0%})"
            worst = f"worst {found['worst']:.3g} (allowed {EVERY[0]:g}..{EVERY[1]:g})"
            word = "consistent" if found["consistent"] else "not consistent"
            seen = f"{found['seeds']} seeds, standard error {found['standard_error']:.2f}"
            click.echo(f"{scheme}: {outside}, {worst}: {word}; {seen}")


def draw(folder: Path, result: dict[str, Any]) -> None:
    """NEES over hops, a panel a state."""
    from groundstation.report.plots_node import SchemeNees, scheme_figure
    from groundstation.report.style import save
    from sim.studies.consistency import EVERY

    found = [
        SchemeNees(row["scheme"], row["state"], row["hop"], row["nees"], row["nees_total"]) for row in result["cases"]
    ]
    title = f"NEES of relay schemes, {result['kernel']}, {result['seeds']} seeds"
    save(scheme_figure(found, EVERY, title), folder / f"{result['experiment']}.svg")
