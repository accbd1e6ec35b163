"""``borechain experiment``: published experiments, ours beside the printed values."""

from __future__ import annotations

import json
from pathlib import Path

import click

from borechain.cli.experiment.alignment import alignment
from borechain.cli.experiment.consistency import consistency
from borechain.cli.experiment.kernel import COMMANDS as KERNEL_COMMANDS
from borechain.cli.experiment.node import COMMANDS as NODE_COMMANDS
from borechain.cli.experiment.output import bar, keep, out_option, seeds_option, tell, yes
from borechain.cli.experiment.survey import coverage, regions, weighting
from borechain.cli.faults import plain_faults
from borechain.cli.options import json_option, seed_option
from borechain.cli.tables import Columns

RELAY_COLUMNS: Columns = (
    ("scheme", "scheme"),
    ("hop", "hop"),
    ("yaw_rms_rest_deg", "yaw rms at rest, deg"),
    ("yaw_rms_turning_deg", "turning, deg"),
    ("nees_rest", "NEES at rest"),
    ("nees_turning", "turning"),
    ("nees_total", "with joints"),
    ("published", "studied, at rest"),
)
MWD_COLUMNS: Columns = (
    ("design", "design"),
    ("parameters", "parameters"),
    ("converged", "converged"),
    ("iterations_median", "iterations, median"),
    ("iterations_max", "largest"),
    ("magnetometer_iterations_max", "largest, magnetometers"),
    ("size_before_median", "G_L error before, g"),
    ("size_after_max", "after, worst tool, g"),
    ("published", "asked, g"),
    ("tilt_before_median_deg", "tilt error before, deg"),
    ("tilt_after_max_deg", "after, worst tool, deg"),
    ("within_reach", "tools within reach"),
    ("warned", "warned of the design"),
    ("control_passed_before", "control passed before"),
    ("control_passed_after", "after"),
    ("cost_difference_max", "E beside another solver"),
    ("time_over_other", "time over its, with our Jacobian"),
    ("time_over_other_alone", "without"),
)
ALLAN_COLUMNS: Columns = (
    ("axis", "axis"),
    ("quantity", "quantity"),
    ("unit", "unit"),
    ("published", "truth"),
    ("ours", "mean estimate"),
    ("median_error_percent", "median error, %"),
    ("error_95_percent", "95th percentile, %"),
    ("raw_error_percent", "raw reading, mean error, %"),
    ("coverage_95", "95 % intervals that hold"),
)


@click.group()
def experiment() -> None:
    """Rerun a published experiment beside ours.

    \b
    Examples:
      borechain experiment list
      borechain experiment relay --hops 10 --seeds 40
    """


for command in (alignment, consistency, coverage, regions, weighting, *NODE_COMMANDS, *KERNEL_COMMANDS):
    experiment.add_command(command)


@experiment.command("list")
def list_() -> None:
    """Name every experiment."""
    for name in sorted(experiment.commands.keys() - {"list"}):
        text = (experiment.commands[name].help or "").partition(".")[0].strip()
        click.echo(f"{name:24} {' '.join(text.split())}")


@experiment.command()
@click.option("--hops", type=click.IntRange(1, 50), default=10, show_default=True)
@seeds_option
@out_option
@json_option
@plain_faults
def relay(hops: int, seeds: int, out: Path | None, as_json: bool) -> None:
    """Judge at every hop whether a node's own variance is the truth about its error (NEES, 1 is honest).

    \b
    Example:
      borechain experiment relay --hops 10 --seeds 40 --out docs/results
    """
    from node.kernels.layout import Scheme
    from sim.studies.relay import run

    with bar(len(Scheme) * seeds, quiet=as_json, what="seeds") as step:
        result = run(hops, seeds, step)
    keep(out, result, RELAY_COLUMNS)
    tell(result, RELAY_COLUMNS, f"Relay over {hops} hops, {seeds} seeds", as_json=as_json)
    if not as_json:
        for scheme, good in result["consistent"].items():
            click.echo(f"{scheme}: every NEES within [0.5, 2]: {yes(good)}")


@experiment.command()
@click.option("--tools", type=click.IntRange(1, 10_000), default=200, show_default=True, help="Synthetic tools.")
@out_option
@json_option
@plain_faults
def mwd(tools: int, out: Path | None, as_json: bool) -> None:
    """Calibrate synthetic MWD tools at five designs of tilts, tool faces and temperatures.

    \b
    Example:
      borechain experiment mwd --tools 200 --out docs/results
    """
    from sim.studies.mwd import HEATINGS, run

    with bar(len(HEATINGS) * tools, quiet=as_json, what="tools") as step:
        result = run(tools, step)
    keep(out, result, MWD_COLUMNS)
    tell(result, MWD_COLUMNS, f"MWD calibration, {tools} tools a design", as_json=as_json, sideways=True)


@experiment.command()
@click.option("--records", type=click.IntRange(1, 10_000), default=20, show_default=True, help="Records of 2 h.")
@out_option
@json_option
@plain_faults
def allan(records: int, out: Path | None, as_json: bool) -> None:
    """Recover the published noise of the node's sensor from synthetic records of 2 h at 65 Hz.

    \b
    Example:
      borechain experiment allan --records 20 --out docs/results
    """
    from sim.studies.allan import run

    with bar(records, quiet=as_json, what="records") as step:
        result = run(records, step)
    keep(out, result, ALLAN_COLUMNS)
    tell(result, ALLAN_COLUMNS, f"Allan analysis of {records} records", as_json=as_json)
    if not as_json:
        for name, q in result["quantities"].items():
            asked = f"median error {q['median_error_percent']:.2f} %, asked {q['asked_error_percent']} %"
            click.echo(f"{name}: {asked}, 95 % intervals hold {q['coverage_95']:.1%}: {yes(q['reached'])}")


@experiment.command()
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), required=True, help="Folder of the records.")
@seed_option
@json_option
@plain_faults
def records(out: Path, seed: int, as_json: bool) -> None:
    """Write records of synthetic instruments: an MWD tool in its jig, oven and control, and a gyroscope at rest.

    \b
    Example:
      borechain experiment records --out out/records --seed 1
    """
    from sim.instruments.record_files import write_records

    names = write_records(out, seed)
    if as_json:
        click.echo(json.dumps({"experiment": "records", "seed": seed, "files": names}))
    else:
        click.echo("\n".join(names))
