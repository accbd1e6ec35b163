"""``borechain bench hour``: a rig of real processes, weighed while it drills."""

from __future__ import annotations

import json
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from borechain.cli.console_tables import show_table, write_table
from borechain.cli.faults import EnvironmentFault, plain_faults, require_modules
from borechain.cli.shared_options import json_option
from telemetry.runtime.process_options import endpoint_option

if TYPE_CHECKING:
    from collections.abc import Sequence

    from borechain.load.hour import Weight

COLUMNS = tuple(
    (name, name.replace("_", " ")) for name in ("hours", "process", "private_mb", "handles", "database_kb", "surveys")
)


@click.command()
@click.option("--tubes", type=click.IntRange(1, 250), default=3, show_default=True, help="Tubes of the string.")
@click.option(
    "--seconds", type=click.FloatRange(20.0, 864000.0), default=3600.0, show_default=True, help="Wall time of drilling."
)
@click.option("--speed", type=click.FloatRange(0.1, 100.0), default=1.0, show_default=True, help="X times real time.")
@endpoint_option("Where its router listens.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), help="Folder for hour.csv and hour.svg.")
@json_option
@require_modules("orjson", "rich", "scipy", "sqlalchemy")
@plain_faults
def hour(tubes: int, seconds: float, speed: float, endpoint: str, out: Path | None, as_json: bool) -> None:
    """Drill and survey for an hour with one real process a tube, and weigh each: memory, open files, database.

    Exit status 1 when a survey is missing at the end or a process had to be started again.

    \b
    Example:
      borechain bench hour --seconds 3600 --out docs/results
    """
    from borechain.load.weighed_rig import weigh_rig
    from sim.rig.launcher import check_port_free

    check_port_free(endpoint)
    with tempfile.TemporaryDirectory(prefix="borechain-") as folder:
        weights, result = weigh_rig(tubes, seconds, speed, endpoint, Path(folder))
    if out is not None:
        write_hour_files(weights, out)
    if as_json:
        click.echo(json.dumps(result | {"weights": [asdict(one) for one in weights]}))
    else:
        show_process_weights(weights)
    if result["missing"] or result["restarts"]:
        raise EnvironmentFault(f"{result['missing']} surveys are missing, {result['restarts']} processes started again")


def write_hour_files(weights: Sequence[Weight], out: Path) -> None:
    """Table and picture."""
    from borechain.load.hour_figure import hour_figure
    from groundstation.report.style import save_figure

    out.mkdir(parents=True, exist_ok=True)
    write_table(out / "hour.csv", [asdict(one) for one in weights], COLUMNS)
    save_figure(hour_figure(weights), out / "hour.svg")


def show_process_weights(weights: Sequence[Weight]) -> None:
    """Table for people: every process after a sixth of the time, when all is loaded, and at the end."""
    early, late = weights[-1].hours / 6.0, weights[-1].hours
    rows = []
    for at in (early, late):
        hours = min((one.hours for one in weights), key=lambda known: abs(known - at))
        rows += [asdict(one) for one in weights if one.hours == hours]
    show_table("what each process holds", rows, COLUMNS)
