"""``borechain clearance``: clearance between two holes, with the errors they share."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from borechain.cli.console_tables import show_warnings, table_console
from borechain.cli.faults import plain_faults
from borechain.cli.shared_options import json_option
from borechain.cli.survey.site_options import site_options
from groundstation.survey.requests.clearance_request import ClearanceRequest
from groundstation.survey.requests.survey_request import SiteFigures
from telemetry.runtime.typed_options import gather_options

TOO_NEAR = 3  # exit status
clearance_options = gather_options(
    click.argument("reference", type=click.Path(path_type=Path)),
    click.argument("offset", type=click.Path(path_type=Path)),
    click.option(
        "--instrument", default="relay", show_default=True, metavar="NAME|FILE", help="Of the reference hole."
    ),
    click.option("--offset-instrument", metavar="NAME|FILE", help="Of the offset hole; the same by default."),
    click.option(
        "--same-instrument", is_flag=True, help="One and the same instrument surveyed both: its errors are shared."
    ),
    click.option(
        "--radius-m", type=click.FloatRange(0.0), default=0.0, show_default=True, help="Of the reference hole."
    ),
    click.option(
        "--offset-radius-m", type=click.FloatRange(0.0), default=0.0, show_default=True, help="Of the offset hole."
    ),
    click.option(
        "--offset-head",
        type=float,
        nargs=3,
        default=(0.0, 0.0, 0.0),
        metavar="NORTH EAST TVD",
        help="Head of the offset hole from that of the reference hole, m.",
    ),
    click.option(
        "--from-m",
        type=float,
        help="Of a sidetrack: depth of a station of both, down to which they are one hole.",
    ),
    click.option("--hole", metavar="NAME", help="Of a REFERENCE that holds several."),
    click.option("--offset-hole", metavar="NAME", help="Of an OFFSET that holds several."),
    click.option("--k", type=click.FloatRange(0.0, min_open=True), default=3.5, show_default=True, help="Of the rule."),
    click.option(
        "--sigma-ahead-m", type=click.FloatRange(0.0), default=0.5, show_default=True, help="Of projecting ahead."
    ),
    click.option("--margin-m", type=click.FloatRange(0.0), default=0.3, show_default=True, help="Surface margin."),
    click.option(
        "--curvature-sigma-deg-per-m",
        type=click.FloatRange(0.0),
        help="Of the paths between stations: 0.3 for relay, none for other instruments by default.",
    ),
    click.option(
        "--curvature-length-m",
        type=click.FloatRange(0.0, min_open=True),
        default=20.0,
        show_default=True,
        help="Over which that curvature is forgotten.",
    ),
    *site_options("Magnetic field of the site.", "Of magnetic from true north."),
    site=SiteFigures,
    request=ClearanceRequest,
)


@click.command()
@clearance_options
@json_option
@click.pass_context
@plain_faults
def clearance(context: click.Context, request: ClearanceRequest, as_json: bool) -> None:
    """Separation factor of the hole REFERENCE from the hole OFFSET, all along.

    Both are tables of stations from the collar, azimuths from true north. A factor above 1 keeps clear. It is given
    twice: with the errors that both holes share, and as the published rule has it, as if they shared none; at every
    station of the first hole, and where it is least on the arcs between them. The exit status is 3 where either is 1
    or less anywhere.

    \b
    Example:
      borechain clearance pipe-1.csv pipe-2.csv --offset-head 0 1.2 0 --instrument gyro-continuous --same-instrument
    """
    from borechain import api

    result = api.answer_clearance(request)
    if as_json:
        click.echo(json.dumps(result))
    else:
        show_clearance(result, f"{request.reference.name} from {request.offset.name}")
    if not result["clear"]:
        context.exit(TOO_NEAR)


def show_clearance(result: dict[str, Any], title: str) -> None:
    """Factors of every station and the verdict, for people."""
    from rich.table import Table

    from groundstation.survey.requests.site_place import site_words

    paper = table_console(100)
    table = Table(title=f"Clearance of {title}, true north, depths from their heads")
    for name in ("MD m", "offset MD m", "distance m", "sigma m", "factor", "as if nothing is shared"):
        table.add_column(name, justify="right")
    for row in result["stations"]:
        table.add_row(*(f"{value:.3f}" for value in row.values()))
    paper.print(table)
    show_warnings(paper, result["warnings"])
    paper.print(site_words(result["site"]))
    verdict = "clear" if result["clear"] else "TOO NEAR"
    least, nearest = result["least"], result["nearest"]
    decides = min(least["factor"], least["independent_factor"])
    paper.print(f"{verdict}: least factor {decides:.2f}, {_where(least)}")
    paper.print(f"nearest: {_where(nearest)}")


def _where(row: dict[str, float]) -> str:
    """Distance and the depths at which it lies."""
    return f"{row['distance_m']:.2f} m apart at {row['md_m']:.2f} m, {row['offset_md_m']:.2f} m of the other hole"
