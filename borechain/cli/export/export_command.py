"""``borechain export``: a hole or a wall as a file of another program."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from borechain.cli.faults import plain_faults
from borechain.cli.ground.query import rig_option, role_option
from borechain.cli.survey.site_options import site_options
from borechain.cli.survey.survey_options import NORTHS
from borechain.cli.whole_files import write_whole
from groundstation.survey.requests.survey_request import FrameRequest, SiteFigures, SurveyRequest
from telemetry import keys
from telemetry.runtime.process_options import insecure_option, keys_option
from telemetry.runtime.typed_options import Option, gather_options

if TYPE_CHECKING:
    from groundstation.survey.exports.export_hole import ExportSite
    from groundstation.survey.exports.live_hole import LivePlace

NAMES = ("ags", "diggs", "dxf", "geojson", "ifc", "las", "witsml")


@click.group()
def export() -> None:
    """Write a hole or a wall as a file of another program.

    DXF for drawings, IFC4 for building models, GeoJSON for maps, WITSML 2.1 with the covariance of every station,
    LAS 2.0, DIGGS 3.0 and AGS 4.1.1. Nothing outside this machine is asked.

    \b
    Example:
      borechain export wall scenarios/walls/wall-40.toml --format dxf --out wall.dxf
    """


def file_options() -> tuple[Option, ...]:
    """Options of what is exported of a file."""
    return (click.argument("file", type=click.Path(path_type=Path)), *format_options())


def format_options() -> tuple[Option, ...]:
    """Options of every export."""
    return (
        click.option("--format", "form", type=click.Choice(NAMES), required=True, help="Of the file that is written."),
        click.option("--out", type=click.Path(path_type=Path, dir_okay=False), required=True, help="File to write."),
    )


hole_options = gather_options(
    *file_options(),
    click.option("--name", help="Of the hole; by default that of FILE."),
    click.option("--hole", metavar="NAME", help="Hole of a table of several; '*' where all rows are one."),
    click.option("--instrument", default="relay", show_default=True, metavar="NAME|FILE", help="Error model."),
    click.option("--from-collar", is_flag=True, help="Add a vertical station at 0 m, where FILE begins deeper."),
    click.option(
        "--north", type=click.Choice(NORTHS), default="site", show_default=True, help="North that FILE counts from."
    ),
    click.option("--answer-north", type=click.Choice(NORTHS), help="North of the file that is written."),
    click.option("--convergence-deg", type=float, help="Azimuth of grid north from true north."),
    click.option(
        "--origin", type=float, nargs=3, metavar="NORTHING EASTING HEIGHT", help="Site coordinates of the collar, m."
    ),
    click.option("--grid-scale-factor", type=float, default=1.0, help="Metres of the grid a metre on the ground."),
    *site_options("Magnetic field of the site, for magnetic tools.", "Azimuth of magnetic north from true north."),
    site=SiteFigures,
    frame=FrameRequest,
    request=SurveyRequest,
)
wall_options = gather_options(
    *file_options(),
    click.option("--hole", metavar="NAME", help="Column that is to be written alone."),
    click.option("--grid-crs", default="", metavar="CODE", help="Grid of the wall's coordinates, such as EPSG:25833."),
)


@dataclass(frozen=True, slots=True)
class RigAsked:
    """A running rig, and the role that it is asked in."""

    rig_name: str
    endpoint: str
    keys_place: Path | None
    role: str

    def to_site(self, place: LivePlace) -> ExportSite:
        """The hole as its ground station answers it now."""
        from borechain.client import connect_to_ground
        from groundstation.survey.exports.live_hole import site_of_live

        with connect_to_ground(self.endpoint, self.rig_name, keys_place=self.keys_place, role=self.role) as ground:
            trajectory, column = ground.ask("trajectory"), ground.ask("column")
        return site_of_live(self.rig_name, trajectory, column, place, day_of_file())


live_options = gather_options(
    *format_options(),
    click.option("--rig", "rig_name", default=keys.DEFAULT_RIG, show_default=True, help="Name of the rig."),
    insecure_option,
    rig_option,
    keys_option,
    role_option,
    asked=RigAsked,
)


@export.command()
@live_options
@click.option("--origin", type=float, nargs=3, metavar="NORTHING EASTING HEIGHT", help="Coordinates of the collar, m.")
@click.option("--grid-crs", default="", metavar="CODE", help="Grid of these coordinates, such as EPSG:25833.")
@plain_faults
def live(
    asked: RigAsked, form: str, out: Path, origin: tuple[float, float, float] | None, grid_crs: str
) -> None:  # fmt: skip
    """Export the hole that a running rig drills, as surveyed now; its page has the same files.

    \b
    Example:
      borechain export live --rig rig-1 --format dxf --out hole.dxf
    """
    from groundstation.survey.exports.live_hole import LivePlace

    write_export(asked.to_site(LivePlace(origin, grid_crs)), form, None, out)


@export.command()
@hole_options
@plain_faults
def hole(request: SurveyRequest, form: str, out: Path, name: str | None) -> None:
    """Export the survey of one hole in FILE, in any format that ``borechain survey`` reads.

    \b
    Examples:
      borechain export hole stations.csv --format witsml --out hole.xml
      borechain export hole stations.csv --origin 5806123.4 389000.1 35 --grid-crs EPSG:25833 --at 52.4,13.1 \\
          --format dxf --out hole.dxf
    """
    from borechain import api
    from groundstation.survey.exports.export_request import site_of_survey

    day = datetime.date.fromisoformat(request.site.date) if request.site.date else day_of_file()
    answer = api.answer_survey(request)
    write_export(site_of_survey(answer, name or request.file.stem, day), form, None, out)


@export.command()
@wall_options
@plain_faults
def wall(file: Path, form: str, out: Path, hole: str | None, grid_crs: str) -> None:
    """Export the columns of the wall in FILE as built, each with its verdict.

    \b
    Example:
      borechain export wall scenarios/walls/wall-40.toml --format ifc --out wall.ifc
    """
    from borechain import api
    from groundstation.survey.exports.export_request import site_of_wall

    judged = api.wall(file)
    write_export(site_of_wall(judged.wall, judged.judgement, day_of_file(), grid_crs), form, hole, out)


def day_of_file() -> datetime.date:
    """Day of the file."""
    return datetime.datetime.now(datetime.UTC).date()


def write_export(site: ExportSite, form: str, hole: str | None, out: Path) -> None:
    """Write the file and say what is in it."""
    from groundstation.survey.exports.export_request import exported_bytes

    content = exported_bytes(site, form, hole)
    write_whole(out, content)
    click.echo(f"{out}: {form}, {len(site.holes) if hole is None else 1} holes, {len(content)} bytes")
