"""``borechain survey``: trajectory and region of uncertainty of a record."""

from __future__ import annotations

import datetime
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.console_tables import table_console
from borechain.cli.faults import InputFault, plain_faults
from borechain.cli.shared_options import json_option
from borechain.cli.survey.answer import at_depth, source_rows, source_text, station_rows, table_text
from borechain.cli.whole_files import PLOT_FORMATS, check_suffix, write_whole
from telemetry.runtime.command_line import check_installed

if TYPE_CHECKING:
    from groundstation.survey.tools.instruments import SurveyTool
    from groundstation.survey.well.analysis import Analysis
    from groundstation.survey.well.depth_reference import DepthReference
    from groundstation.survey.well.reference_frames import ReferenceFrame
    from groundstation.survey.well.well_record import SurveyRecord

NORTHS = ("site", "true", "grid", "magnetic")
DEPTHS_FROM = (
    "collar", "ground-level", "rotary-table", "kelly-bushing", "drill-floor", "mean-sea-level", "height-datum",
)  # fmt: skip
METHODS = ("tangential", "balanced-tangential", "average-angle", "radius-of-curvature", "minimum-curvature")
SOURCES_SHOWN = 12


def list_tools(context: click.Context, _option: click.Parameter, value: bool) -> None:
    """Names of the error models, one a line."""
    if not value:
        return
    from groundstation.survey.tools.instruments import load_tool, shipped_tool_names
    from groundstation.survey.tools.owsg import owsg_names

    for name in shipped_tool_names():
        click.echo(f"{name:28} {load_tool(name).title}")
    for name, title in owsg_names().items():
        click.echo(f"{name:28} OWSG: {title}")
    context.exit()


def parameters_of(words: tuple[str, ...]) -> dict[str, float]:
    """Constants of an error model as given: ``NAME=VALUE``."""
    found = {}
    for word in words:
        name, sign, text = word.partition("=")
        try:
            found[name.strip()] = float(text)
        except ValueError:
            sign = ""
        if not sign or not name.strip().isidentifier() or not math.isfinite(found[name.strip()]):
            raise InputFault(f"--parameter: expected NAME=VALUE with a number, got {word!r}")
    return found


@click.command()
@click.argument("file", type=click.Path(path_type=Path, allow_dash=True))
@click.option(
    "--method",
    type=click.Choice(METHODS),
    default="balanced-tangential",
    show_default=True,
    help="How the path between two stations is computed.",
)
@click.option(
    "--instrument",
    default="relay",
    show_default=True,
    metavar="NAME|FILE",
    help="Error model: one that comes with the program, one of the OWSG set, or a TOML or JSON file.",
)
@click.option(
    "--parameter",
    multiple=True,
    metavar="NAME=VALUE",
    help="A constant that the error model leaves out, or in place of its own, such as GXYRunningSpeed=1800.",
)
@click.option(
    "--tools", is_flag=True, is_eager=True, expose_value=False, callback=list_tools, help="List error models."
)
@click.option(
    "--sigma",
    type=click.FloatRange(0.0, min_open=True),
    default=1.0,
    show_default=True,
    help="Standard deviations of the result.",
)
@click.option(
    "--azimuth-error-deg", type=click.FloatRange(0.0), help="One constant azimuth error in place of the gyro's terms."
)
@click.option(
    "--displacement-rule",
    type=click.Choice(["exact", "thesis"]),
    default="exact",
    show_default=True,
    help="How lateral displacements become angles.",
)
@click.option("--from-collar", is_flag=True, help="Add a vertical station at 0 m, where FILE begins deeper.")
@click.option("--md-unit", type=click.Choice(["m", "ft"]), help="Unit of a depth whose header does not say; m.")
@click.option("--md", type=float, multiple=True, help="Also give the position at this depth, m. Repeatable.")
@click.option(
    "--tie-on",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Where the survey begins, if not at its collar: depth, direction, position and their uncertainty, .toml.",
)
@click.option(
    "--programme",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Which instrument surveyed which depths, .toml; in place of --instrument.",
)
@click.option(
    "--north",
    type=click.Choice(NORTHS),
    default="site",
    show_default=True,
    help="North that the azimuths of FILE count from.",
)
@click.option(
    "--answer-north",
    type=click.Choice(NORTHS),
    help="North of the whole answer; by default that of FILE, or true north with --north-of-site-deg.",
)
@click.option("--north-of-site-deg", type=float, help="Azimuth of the site's north from true north.")
@click.option(
    "--convergence-deg", type=float, default=0.0, show_default=True, help="Azimuth of grid north from true north."
)
@click.option(
    "--origin",
    type=float,
    nargs=3,
    metavar="NORTHING EASTING HEIGHT",
    help="Site coordinates of the point where positions and depths are zero, m; adds those of every station.",
)
@click.option(
    "--depth-reference",
    type=click.Choice(DEPTHS_FROM),
    default="collar",
    show_default=True,
    help="What the depths of FILE, --tie-on and --programme count from.",
)
@click.option(
    "--answer-depth-reference",
    type=click.Choice(DEPTHS_FROM),
    help="What depths of the answer, --md and --origin count from; by default that of FILE. Every output names it.",
)
@click.option(
    "--depth-reference-height-m", type=float, help="Height of --depth-reference above --answer-depth-reference."
)
@click.option("--height-datum", metavar="NAME", help="Datum of heights, as it is to be named.")
@click.option(
    "--section-azimuth-deg", type=float, default=0.0, show_default=True, help="Azimuth of the vertical section."
)
@click.option("--gravity", type=float, default=9.81, show_default=True, help="Gravity of the site, m/s^2.")
@click.option(
    "--field-nt",
    type=float,
    default=50_000.0,
    show_default=True,
    help="Magnetic field of the site, for magnetic tools.",
)
@click.option("--dip-deg", type=float, default=70.0, show_default=True, help="Dip of the magnetic field.")
@click.option(
    "--declination-deg", type=float, default=0.0, show_default=True, help="Azimuth of magnetic north from true north."
)
@click.option("--latitude-deg", type=float, default=52.0, show_default=True, help="Latitude, for gyroscopes.")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Station table, a .csv file.")
@click.option(
    "--by-source",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Covariance of every source at every station at one sigma, a .csv file.",
)
@click.option(
    "--plot",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Plan, sections and uncertainty as .svg, .png or .pdf.",
)
@click.option(
    "--export-tool", type=click.Path(path_type=Path, dir_okay=False), help="Error model as an ISCWSA .json file."
)
@json_option
@plain_faults
def survey(
    file: Path,
    method: str,
    instrument: str,
    parameter: tuple[str, ...],
    sigma: float,
    azimuth_error_deg: float | None,
    displacement_rule: str,
    from_collar: bool,
    md_unit: str | None,
    md: tuple[float, ...],
    tie_on: Path | None,
    programme: Path | None,
    north: str,
    answer_north: str | None,
    north_of_site_deg: float | None,
    convergence_deg: float,
    origin: tuple[float, float, float] | None,
    depth_reference: str,
    answer_depth_reference: str | None,
    depth_reference_height_m: float | None,
    height_datum: str | None,
    section_azimuth_deg: float,
    gravity: float,
    field_nt: float,
    dip_deg: float,
    declination_deg: float,
    latitude_deg: float,
    out: Path | None,
    by_source: Path | None,
    plot: Path | None,
    export_tool: Path | None,
    as_json: bool,
) -> None:
    """Compute trajectory and region of uncertainty of FILE.

    FILE is a table of stations (measured depth, inclination, azimuth, as most programs write them) or of lateral
    displacements (md_m, a_cm, b_cm); - is standard input. The first line of the answer says how it was read.

    \b
    Examples:
      borechain survey scenarios/wellbore-1-path.csv --displacement-rule thesis
      borechain survey stations.csv --method minimum-curvature --instrument mwd-rev5.1 --sigma 2 --plot survey.svg
    """
    from groundstation.survey.files.field_files import read_any
    from groundstation.survey.files.programme import read_programme, read_tie_on
    from groundstation.survey.files.survey_records import DisplacementRule, with_collar
    from groundstation.survey.tools.instruments import load_tool
    from groundstation.survey.well.analysis import analyse_survey, with_azimuth_error
    from groundstation.survey.well.error_sources import Site
    from groundstation.survey.well.methods import Method

    check_suffix("--out", out, ".csv")
    check_suffix("--by-source", by_source, ".csv")
    check_suffix("--plot", plot, *PLOT_FORMATS)
    check_suffix("--export-tool", export_tool, ".json")
    if plot is not None:
        check_installed("matplotlib")
    check_together(from_collar, tie_on, programme, azimuth_error_deg, export_tool)
    understood = read_any(file, DisplacementRule(displacement_rule), md_unit)
    record = understood.record
    if from_collar:
        record = with_collar(record)
    tool = load_tool(instrument, parameters_of(parameter))
    if azimuth_error_deg is not None:
        tool = with_azimuth_error(tool, math.radians(azimuth_error_deg))
    legs = [] if programme is None else read_programme(programme)
    named = ", ".join(f"{leg.tool.name} from {leg.top:g} m" for leg in legs) or tool.name
    frame = replace(
        frame_of(north, answer_north, north_of_site_deg, convergence_deg, declination_deg),
        depths=depths_of(depth_reference, answer_depth_reference, depth_reference_height_m, height_datum, origin),
        height_datum=height_datum or "",
    )
    tied = None if tie_on is None else read_tie_on(tie_on)
    site = Site(gravity, field_nt, math.radians(dip_deg), math.radians(declination_deg), math.radians(latitude_deg))
    found = analyse_survey(record, Method(method), legs or tool, site, math.radians(section_azimuth_deg), frame, tied)
    mds = found.md
    outside = [depth for depth in md if not mds[0] <= depth <= mds[-1]]
    if outside:
        raise InputFault(f"--md {outside[0]:g}: expected a depth of {mds[0]:g}..{mds[-1]:g} m")
    rows = station_rows(found, sigma, origin)
    result = {
        "file": str(file),
        "read_as": understood.line,
        "method": method,
        "instrument": named,
        "north": frame.answer,
        "depth_reference": frame.depths.answer,
        "read_from": {"depth_reference": frame.depths.record, "height_m": frame.depths.height},
        "height_datum": frame.height_datum or None,
        "origin_m": None if origin is None else list(origin),
        "sigma": sigma,
        "stations": rows,
        "at": [at_depth(found, depth, sigma) for depth in md],
        "closure_m": float(found.closure_distance[-1]),
        "closure_azimuth_deg": math.degrees(found.closure_azimuth[-1]),
        "sources": source_rows(found, sigma),
    }
    if out is not None:
        write_whole(out, table_text(rows, found.frame))
    if by_source is not None:
        write_whole(by_source, source_text(found))
    if plot is not None:
        draw_survey(found, named, sigma, str(file), plot)
    if export_tool is not None:
        write_tool_json(tool, record, export_tool)
    if as_json:
        click.echo(json.dumps(result))
    else:
        show_survey(result)


def check_together(
    from_collar: bool,
    tie_on: Path | None,
    programme: Path | None,
    azimuth_error_deg: float | None,
    export_tool: Path | None,
) -> None:
    """Refuse options that contradict each other."""
    if from_collar and tie_on is not None:
        raise InputFault("expected --from-collar or --tie-on, got both")
    if programme is not None and (azimuth_error_deg is not None or export_tool is not None):
        raise InputFault("--programme: expected neither --azimuth-error-deg nor --export-tool beside it")


def frame_of(
    north: str, answer: str | None, north_of_site_deg: float | None, convergence_deg: float, declination_deg: float
) -> ReferenceFrame:
    """Norths of the record and of the answer."""
    from groundstation.survey.well.reference_frames import Norths, ReferenceFrame

    angles = (math.radians(angle) for angle in (north_of_site_deg or 0.0, convergence_deg, declination_deg))
    if answer is None:
        answer = north if north_of_site_deg is None else "true"
    return ReferenceFrame(north, answer, Norths(*angles))


def depths_of(
    record: str,
    answer: str | None,
    height: float | None,
    height_datum: str | None,
    origin: tuple[float, float, float] | None,
) -> DepthReference:
    """Depth references of the record and of the answer."""
    from groundstation.survey.well.depth_reference import depth_reference

    found = depth_reference(record, answer, height)
    from_datum = "height-datum" in (found.record, found.answer)
    if from_datum and height_datum is None:
        raise InputFault("--depth-reference height-datum: expected --height-datum NAME beside it")
    if height_datum is not None and origin is None and not from_datum:
        raise InputFault("--height-datum: expected --origin beside it")
    if found.answer == "height-datum" and origin is not None and origin[2] != 0.0:
        raise InputFault(f"--origin: depths count from {height_datum}, so its height is 0; got {origin[2]:g} m")
    return found


def draw_survey(found: Analysis, instrument: str, sigma: float, title: str, path: Path) -> None:
    """Plan view, sections and uncertainty."""
    from groundstation.report.plots import survey_figure
    from groundstation.report.style import save_figure
    from groundstation.survey.well.ellipsoid import probability_of

    confidence = probability_of(sigma, 2)
    words = (
        f"{title}, {instrument}, {found.frame.answer} north, depth from {found.frame.depths.answer}, {sigma:g} sigma"
    )
    figure = survey_figure(found.md, found.positions, found.uncertainty.cov, confidence, words)
    save_figure(figure, path)


def write_tool_json(tool: SurveyTool, record: SurveyRecord, path: Path) -> None:
    """Instrument as ISCWSA JSON; one that asks for columns of a record, as a gyro with those of this one."""
    from groundstation.survey.tools.iscwsa_json import to_json
    from groundstation.survey.well.gyro_export import as_gyro, needs_record

    written = as_gyro(tool, record) if needs_record(tool) else tool
    write_whole(path, to_json(written, datetime.datetime.now(datetime.UTC).date()))


def brought_words(result: dict[str, Any]) -> str:
    """Where the depths were read from, if from another reference than that of the answer."""
    read = result["read_from"]
    same = read["depth_reference"] == result["depth_reference"]
    return "" if same else f" (read from {read['depth_reference']}, {read['height_m']:g} m above it)"


def show_survey(result: dict[str, Any]) -> None:
    """Tables for people."""
    from rich.table import Table

    paper = table_console(110)
    paper.print(result["read_as"], markup=False)
    words = (
        result["method"],
        result["instrument"],
        f"{result['north']} north",
        f"depth from {result['depth_reference']}{brought_words(result)}",
        *([f"height above {result['height_datum']}"] if result["height_datum"] else []),
        f"{result['sigma']:g} sigma",
    )
    table = Table(title=f"{result['file']}: {', '.join(words)}")
    names = ("#", "MD m", "incl deg", "azi deg", "north m", "east m", "TVD m", "DLS deg/30m")
    for name in (*names, "+-N cm", "+-E cm", "+-TVD cm"):
        table.add_column(name, justify="right")
    for row in result["stations"]:
        u = row["uncertainty"]
        table.add_row(
            str(row["station"]),
            f"{row['md_m']:.2f}",
            f"{row['inclination_deg']:.2f}",
            f"{row['azimuth_deg']:.2f}",
            f"{row['north_m']:.4f}",
            f"{row['east_m']:.4f}",
            f"{row['tvd_m']:.4f}",
            f"{row['dogleg_severity_deg_per_30m']:.2f}",
            *(f"{100.0 * u[key]:.3f}" for key in ("north_m", "east_m", "tvd_m")),
        )
    paper.print(table)
    for row in result["at"]:
        paper.print(f"at {row['md_m']:g} m: {row['north_m']:.4f} {row['east_m']:.4f} {row['tvd_m']:.4f} m")
    paper.print(f"closure {result['closure_m']:.4f} m towards {result['closure_azimuth_deg']:.2f} deg")
    parts = Table(title="What the uncertainty at the last station is made of, cm")
    for name in ("source", "north", "east", "TVD"):
        parts.add_column(name, justify="right")
    for row in result["sources"][:SOURCES_SHOWN]:
        parts.add_row(row["source"], *(f"{100.0 * row[key]:.4f}" for key in ("north_m", "east_m", "tvd_m")))
    paper.print(parts)
