"""``borechain clearance``: clearance between two holes, with the errors they share."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.console_tables import table_console
from borechain.cli.faults import plain_faults
from borechain.cli.shared_options import json_option

if TYPE_CHECKING:
    from groundstation.survey.well.clearance import Clearance, ClearanceHole

TOO_NEAR = 3  # exit status


@click.command()
@click.argument("reference", type=click.Path(path_type=Path))
@click.argument("offset", type=click.Path(path_type=Path))
@click.option("--instrument", default="relay", show_default=True, metavar="NAME|FILE", help="Of the reference hole.")
@click.option("--offset-instrument", metavar="NAME|FILE", help="Of the offset hole; the same by default.")
@click.option(
    "--same-instrument", is_flag=True, help="One and the same instrument surveyed both: its errors are shared."
)
@click.option("--radius-m", type=click.FloatRange(0.0), default=0.0, show_default=True, help="Of the reference hole.")
@click.option(
    "--offset-radius-m", type=click.FloatRange(0.0), default=0.0, show_default=True, help="Of the offset hole."
)
@click.option(
    "--offset-head",
    type=float,
    nargs=3,
    default=(0.0, 0.0, 0.0),
    metavar="NORTH EAST TVD",
    help="Head of the offset hole from that of the reference hole, m.",
)
@click.option("--k", type=click.FloatRange(0.0, min_open=True), default=3.5, show_default=True, help="Of the rule.")
@click.option(
    "--sigma-ahead-m", type=click.FloatRange(0.0), default=0.5, show_default=True, help="Of projecting ahead."
)
@click.option("--margin-m", type=click.FloatRange(0.0), default=0.3, show_default=True, help="Surface margin.")
@click.option("--gravity", type=float, default=9.81, show_default=True, help="Gravity of the site, m/s^2.")
@click.option("--field-nt", type=float, default=50_000.0, show_default=True, help="Magnetic field of the site.")
@click.option("--dip-deg", type=float, default=70.0, show_default=True, help="Dip of the magnetic field.")
@click.option("--declination-deg", type=float, default=0.0, show_default=True, help="Of magnetic from true north.")
@click.option("--latitude-deg", type=float, default=52.0, show_default=True, help="Latitude, for gyroscopes.")
@json_option
@click.pass_context
@plain_faults
def clearance(
    context: click.Context,
    reference: Path,
    offset: Path,
    instrument: str,
    offset_instrument: str | None,
    same_instrument: bool,
    radius_m: float,
    offset_radius_m: float,
    offset_head: tuple[float, float, float],
    k: float,
    sigma_ahead_m: float,
    margin_m: float,
    gravity: float,
    field_nt: float,
    dip_deg: float,
    declination_deg: float,
    latitude_deg: float,
    as_json: bool,
) -> None:
    """Separation factor of the hole REFERENCE from the hole OFFSET at every station of the first.

    Both are tables of stations from the collar, azimuths from true north. A factor above 1 keeps clear. It is given
    twice: with the errors that both holes share, and as the published rule has it, as if they shared none. The exit
    status is 3 where either is 1 or less.

    \b
    Example:
      borechain clearance pipe-1.csv pipe-2.csv --offset-head 0 1.2 0 --instrument gyro-continuous --same-instrument
    """
    from groundstation.survey.well.clearance import Rule, clearance_between
    from groundstation.survey.well.error_sources import Site

    site = Site(gravity, field_nt, math.radians(dip_deg), math.radians(declination_deg), math.radians(latitude_deg))
    serial = "one" if same_instrument else ""
    first = _hole(reference, instrument, (0.0, 0.0, 0.0), radius_m, serial)
    second = _hole(offset, offset_instrument or instrument, offset_head, offset_radius_m, serial)
    found = clearance_between(first, second, site, Rule(k, sigma_ahead_m, margin_m))
    result = _result(first, found)
    if as_json:
        click.echo(json.dumps(result))
    else:
        _show(result, f"{reference.name} from {offset.name}")
    if not result["clear"]:
        context.exit(TOO_NEAR)


def _hole(path: Path, instrument: str, head: tuple[float, float, float], radius: float, serial: str) -> ClearanceHole:
    import numpy as np

    from groundstation.survey.files.field_files import read_any
    from groundstation.survey.tools.instruments import load_tool
    from groundstation.survey.well.clearance import ClearanceHole
    from groundstation.survey.well.error_sources import Leg, WellSurvey
    from groundstation.survey.well.methods import Method, station_positions

    record = read_any(path).record
    places = np.array(head) + station_positions(Method.MINIMUM_CURVATURE, record.md, record.inclination, record.azimuth)
    survey = WellSurvey(record.md, record.inclination, record.azimuth, places[:, 2] - head[2])
    return ClearanceHole(survey, places, (Leg(load_tool(instrument)),), radius, serial)


def _result(hole: ClearanceHole, found: Clearance) -> dict[str, Any]:
    columns = {
        "md_m": hole.survey.md,
        "offset_md_m": found.offset_md,
        "distance_m": found.distance,
        "sigma_m": found.sigma,
        "factor": found.factor,
        "independent_factor": found.independent_factor,
    }
    values = [column.tolist() for column in columns.values()]
    stations = [dict(zip(columns, row, strict=True)) for row in zip(*values, strict=True)]
    least = min(stations, key=lambda row: min(row["factor"], row["independent_factor"]))
    frame = {"north": "true", "depth_reference": "head of the reference hole"}
    return frame | {
        "clear": min(least["factor"], least["independent_factor"]) > 1.0,
        "least": least,
        "stations": stations,
    }


def _show(result: dict[str, Any], title: str) -> None:
    from rich.table import Table

    paper = table_console(100)
    table = Table(title=f"Clearance of {title}, true north, depths from their heads")
    for name in ("MD m", "offset MD m", "distance m", "sigma m", "factor", "as if nothing is shared"):
        table.add_column(name, justify="right")
    for row in result["stations"]:
        table.add_row(*(f"{value:.3f}" for value in row.values()))
    paper.print(table)
    least = result["least"]
    verdict = "clear" if result["clear"] else "TOO NEAR"
    paper.print(
        f"{verdict}: least factor {least['factor']:.2f}, {least['distance_m']:.2f} m apart at {least['md_m']:g} m"
    )
