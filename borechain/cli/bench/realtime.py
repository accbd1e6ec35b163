"""``borechain bench realtime``: a string of real node processes on their own clocks, over zenoh on loopback."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import click

from borechain.cli.console_tables import Columns, show_table, write_table
from borechain.cli.faults import plain_faults, require_modules
from borechain.cli.shared_options import json_option, seed_option
from telemetry import keys

COLUMNS: Columns = (
    ("process", "process"),
    ("hop", "hop"),
    ("cycles", "cycles"),
    ("overruns", "overruns"),
    ("start_median_ms", "start jitter, median, ms"),
    ("start_p99_ms", "p99"),
    ("start_max_ms", "max"),
    ("cycle_median_ms", "cycle, median, ms"),
    ("cycle_p99_ms", "p99"),
    ("cycle_max_ms", "max"),
    ("first_cycle_s", "first cycle ended after, s"),
    ("cpu_percent", "CPU, %"),
    ("private_mb", "private memory, MB"),
    ("pss_mb", "PSS, MB"),
    ("yaw_known", "yaw known"),
    ("yaw_rest_deg", "yaw error at rest, rms, deg"),
    ("yaw_rest_nees", "its NEES"),
    ("yaw_turning_deg", "yaw error turning, rms, deg"),
    ("yaw_turning_nees", "its NEES"),
)


@click.command()
@click.option("--nodes", type=click.IntRange(1, 250), default=50, show_default=True, help="Tubes of the string.")
@click.option(
    "--seconds",
    type=click.FloatRange(4.0, 86400.0),
    default=120.0,
    show_default=True,
    help="Duration of the measurement.",
)
@click.option("--endpoint", default=keys.DEFAULT_ENDPOINT, show_default=True, help="Where its router listens.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), help="Folder for realtime.csv.")
@json_option
@seed_option
@require_modules("orjson", "scipy", "sqlalchemy")
@plain_faults
def realtime(nodes: int, seconds: float, endpoint: str, out: Path | None, as_json: bool, seed: int) -> None:
    """Run a string of real node processes on their own clocks and measure it: overruns, jitter, memory, yaw.

    \b
    Example:
      borechain bench realtime --nodes 50 --seconds 120
    """
    from borechain.load.realtime_string import measure_realtime_string
    from sim.rig.launcher import check_port_free

    check_port_free(endpoint)
    with tempfile.TemporaryDirectory(prefix="borechain-") as place:
        measured = measure_realtime_string(nodes, seconds, endpoint, Path(place), seed)
    result: dict[str, Any] = {"bench": "realtime", "nodes": nodes, "seconds": seconds} | measured
    if out is not None:
        write_table(out / "realtime.csv", result["cases"], COLUMNS)
    if as_json:
        click.echo(json.dumps(result))
    else:
        show_realtime_table(result)


def show_realtime_table(result: dict[str, Any]) -> None:
    """Table for people: the worst of all, and the sums."""
    worst, total = result["worst"], result["total"]
    rows = [
        {"what": key.replace("_", " "), "worst": worst[key], "total": total.get(key)}
        for key, _ in COLUMNS
        if key in worst
    ]
    show_table(
        f"{result['nodes']} nodes in real time, {result['seconds']:g} s",
        rows,
        (("what", "figure"), ("worst", "worst process"), ("total", "all together")),
    )
    click.echo(f"router and base station: {result['router_and_base_cpu_percent']:.1f} % of a core")
