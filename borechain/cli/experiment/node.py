"""Experiments of the node's filter: update modes, single updates, strings of nodes, tuning, delay, outages."""

from __future__ import annotations

from pathlib import Path

import click

from borechain.cli.experiment.node_plots import draw_delay, draw_modes, draw_outage, draw_tuning
from borechain.cli.experiment.output import COLUMNS, conduct, keep, options, tell
from borechain.cli.tables import Columns

MODES = {
    "update-modes": "Yaw and azimuth at rest under continuous aiding and under 20 s on and 5 to 60 s off.",
    "single-updates": "Yaw and azimuth at rest under single updates from one a second to one a minute.",
    "two-nodes": "Yaw and azimuth at rest of two nodes, the second aided through the first.",
    "fifty-nodes": "Yaw of the last of fifty nodes: clocks off by 5 ms a joint, 30 % lost, 20 s on and 30 s off.",
}
SHOWN_COLUMNS: Columns = (
    ("case", "case"),
    ("quantity", "rms, deg, of"),
    ("published", "published"),
    ("ours", "ours"),
    ("interval", "95 %"),
    ("to_reach", "to reach"),
    ("reached", "reached"),
)
TUNING_COLUMNS: Columns = (
    ("case", "case"),
    ("published", "published"),
    ("ours", "bias converged"),
    ("unit", "unit"),
    ("to_reach", "to reach"),
    ("reached", "reached"),
    ("left_dps", "error left, deg/s"),
    ("scatter_dps", "scatter, deg/s"),
    ("yaw_rms_deg", "yaw rms at rest, deg"),
)
OUTAGE_SHOWN: Columns = (
    ("case", "case"),
    *((f"hop_{k}", f"hop {k}") for k in range(1, 6)),
    ("reached", "reached"),
)
OUTAGE_COLUMNS: Columns = (
    ("case", "case"),
    *((f"hop_{k}", f"hop {k}") for k in range(1, 6)),
    ("published", "published"),
    ("ours", "ours"),
    ("unit", "unit"),
    ("to_reach", "to_reach"),
    ("reached", "reached"),
)


def modes_command(name: str, words: str) -> click.Command:
    """Command of one of the experiments that differ in their cases alone."""

    @click.command(name, help=f"{words}\n\n\b\nExample:\n  borechain experiment {name} --seeds 200 --out docs/results")
    @options
    def run_modes(seeds: int, out: Path | None, as_json: bool) -> None:
        from sim.studies.node_modes import batches, run

        result = conduct(lambda n, step: run(name, n, step), seeds, batches(name), as_json=as_json)
        keep(out, result, COLUMNS, draw_modes)
        tell(result, SHOWN_COLUMNS, f"{name}, {seeds} seeds", as_json=as_json)

    return run_modes


@click.command()
@options
def tuning(seeds: int, out: Path | None, as_json: bool) -> None:
    """Time from the stop until the bias is found, over the tuning factors A and B.

    \b
    Example:
      borechain experiment tuning --seeds 200 --out docs/results
    """
    from sim.studies.node_tuning import FACTORS, run

    result = conduct(run, seeds, len(FACTORS), as_json=as_json)
    keep(out, result, TUNING_COLUMNS, draw_tuning)
    tell(result, TUNING_COLUMNS, f"Tuning, {seeds} seeds", as_json=as_json)


@click.command()
@options
def delay(seeds: int, out: Path | None, as_json: bool) -> None:
    """Yaw error over the delay of the aiding, with its time of validity and with that of its arrival.

    \b
    Example:
      borechain experiment delay --seeds 200 --out docs/results
    """
    from sim.studies.node_delay import DELAYS_MS, FORMS, run

    result = conduct(run, seeds, len(DELAYS_MS) * len(FORMS), as_json=as_json)
    keep(out, result, COLUMNS, draw_delay)
    tell(result, SHOWN_COLUMNS, f"Delay, {seeds} seeds", as_json=as_json)


@click.command()
@options
def outage(seeds: int, out: Path | None, as_json: bool) -> None:
    """Consistency (NEES) of a string of five over the length of outages and the loss of every hop.

    \b
    Example:
      borechain experiment outage --seeds 200 --out docs/results
    """
    from sim.studies.node_outage import OUTSIDE, USUAL, batches, run

    result = conduct(run, seeds, batches(), as_json=as_json)
    keep(out, result, OUTAGE_COLUMNS, draw_outage)
    tell(result, OUTAGE_SHOWN, f"NEES of five hops, {seeds} seeds", as_json=as_json)
    if not as_json:
        low, high = USUAL
        click.echo(f"{result['outside']:.0%} of the cells outside {low:g}..{high:g}, allowed {OUTSIDE:.0%}")
        errors = result["standard_errors"]
        click.echo(f"standard error of a cell {errors['epochs']:.2f}, with joints {errors['joints']:.2f}")


COMMANDS = (*(modes_command(name, words) for name, words in MODES.items()), tuning, delay, outage)
