"""Options of ``borechain survey`` as what is asked and the files that are written."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from borechain import __version__
from borechain.cli.faults import InputFault
from borechain.cli.report_options import PaperRequest, paper_options
from borechain.cli.survey.site_options import site_options
from borechain.cli.whole_files import PLOT_FORMATS, check_suffix
from groundstation.survey.requests.survey_request import PROGRAMME_ALONE, FrameRequest, SiteFigures, SurveyRequest
from telemetry.runtime.command_line import check_installed
from telemetry.runtime.typed_options import gather_options

if TYPE_CHECKING:
    from groundstation.survey.requests.survey_answer import SurveyAnswer

NORTHS = ("site", "true", "grid", "magnetic")
DEPTHS_FROM = (
    "collar", "ground-level", "rotary-table", "kelly-bushing", "drill-floor", "mean-sea-level", "height-datum",
)  # fmt: skip
METHODS = ("tangential", "balanced-tangential", "average-angle", "radius-of-curvature", "minimum-curvature")


@dataclass(frozen=True, slots=True)
class SurveyFiles:
    """Files that the command writes."""

    out: Path | None
    by_source: Path | None
    plot: Path | None
    export_tool: Path | None
    report: Path | None

    def check(self, request: SurveyRequest) -> None:
        """Refuse files that could not be written or do not fit what is asked, before anything is computed.

        Raises
        ------
        InputFault, EnvironmentFault
            Naming the option, or the package that is missing.
        """
        check_suffix("--out", self.out, ".csv")
        check_suffix("--by-source", self.by_source, ".csv")
        check_suffix("--plot", self.plot, *PLOT_FORMATS)
        check_suffix("--export-tool", self.export_tool, ".json")
        check_suffix("--report", self.report, ".pdf")
        if self.plot is not None:
            check_installed("matplotlib")
        if self.report is not None:
            check_installed("matplotlib", "typst")
        if self.export_tool is not None and request.programme is not None:
            raise InputFault(PROGRAMME_ALONE)


@dataclass(frozen=True, slots=True)
class HolePaperRequest:
    """What a report of a hole says that no record does."""

    report_date: datetime | None
    project: str
    client: str
    serial: str
    calibration: str
    books: PaperRequest

    def to_pdf(self, answer: SurveyAnswer) -> bytes:
        """The report; errors as ``report_pdf``, and InputFault."""
        from groundstation.report.document import Origin, report_pdf
        from groundstation.report.hole_report import HolePapers, hole_report

        file, day = answer.request.file, (self.report_date or datetime.now(UTC)).date()
        inputs = []
        if file.is_file():
            inputs.append((f"SHA-256 of {file.name}", hashlib.sha256(file.read_bytes()).hexdigest()))
        papers = HolePapers(self.project, self.serial, self.calibration)
        origin = Origin(day, __version__, inputs, self.books.to_papers(self.client))
        return report_pdf(hole_report(answer, papers, origin))


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


def parse_constants(_context: click.Context, _parameter: click.Parameter, words: tuple[str, ...]) -> dict[str, float]:
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


survey_options = gather_options(
    click.argument("file", type=click.Path(path_type=Path, allow_dash=True)),
    click.option(
        "--method",
        type=click.Choice(METHODS),
        help="How the path between two stations is computed; by default minimum-curvature, of lateral displacements "
        "balanced-tangential, as their form was published with.",
    ),
    click.option(
        "--instrument",
        default="relay",
        show_default=True,
        metavar="NAME|FILE",
        help="Error model: one that comes with the program, one of the OWSG set, or a TOML or JSON file.",
    ),
    click.option(
        "--parameter",
        multiple=True,
        callback=parse_constants,
        metavar="NAME=VALUE",
        help="A constant that the error model leaves out, or in place of its own, such as GXYRunningSpeed=1800.",
    ),
    click.option(
        "--tools", is_flag=True, is_eager=True, expose_value=False, callback=list_tools, help="List error models."
    ),
    click.option(
        "--sigma",
        type=click.FloatRange(0.0, min_open=True),
        default=1.0,
        show_default=True,
        help="Standard deviations of the result.",
    ),
    click.option(
        "--azimuth-error-deg",
        type=click.FloatRange(0.0),
        help="One constant azimuth error in place of the gyro's terms.",
    ),
    click.option(
        "--displacement-rule",
        type=click.Choice(["exact", "thesis"]),
        default="exact",
        show_default=True,
        help="How lateral displacements become angles.",
    ),
    click.option("--from-collar", is_flag=True, help="Add a vertical station at 0 m, where FILE begins deeper."),
    click.option("--hole", metavar="NAME", help="Hole of a table of several; '*' where all rows are one."),
    click.option(
        "--decimal", type=click.Choice(["comma", "point"]), help="Sign of decimals, where FILE may be read either way."
    ),
    click.option(
        "--md-unit", type=click.Choice(["m", "ft", "usft"]), help="Unit of a depth whose header does not say; m."
    ),
    click.option("--md", type=float, multiple=True, help="Also give the position at this depth, m. Repeatable."),
    click.option(
        "--tie-on",
        type=click.Path(path_type=Path),
        metavar="FILE",
        help="Where the survey begins, if not at its collar: depth, direction, position and their uncertainty, .toml.",
    ),
    click.option(
        "--programme",
        type=click.Path(path_type=Path),
        metavar="FILE",
        help="Which instrument surveyed which depths, .toml; in place of --instrument.",
    ),
    click.option(
        "--north",
        type=click.Choice(NORTHS),
        default="site",
        show_default=True,
        help="North that the azimuths of FILE count from.",
    ),
    click.option(
        "--answer-north",
        type=click.Choice(NORTHS),
        help="North of the whole answer; by default that of FILE, or true north with --north-of-site-deg; with "
        "--origin that of its coordinates.",
    ),
    click.option("--north-of-site-deg", type=float, help="Azimuth of the site's north from true north."),
    click.option(
        "--convergence-deg", type=float, help="Azimuth of grid north from true north; 0 where it is not needed."
    ),
    click.option(
        "--origin",
        type=float,
        nargs=3,
        metavar="NORTHING EASTING HEIGHT",
        help="Site coordinates of the point where positions and depths are zero, m; adds those of every station. They "
        "count from grid north, or from the site's where the answer does.",
    ),
    click.option(
        "--grid-scale-factor",
        type=float,
        default=1.0,
        show_default=True,
        help="Metres of the grid a metre on the ground, of site coordinates.",
    ),
    click.option(
        "--depth-reference",
        type=click.Choice(DEPTHS_FROM),
        default="collar",
        show_default=True,
        help="What the depths of FILE, --tie-on and --programme count from.",
    ),
    click.option(
        "--answer-depth-reference",
        type=click.Choice(DEPTHS_FROM),
        help="What depths of the answer, --md and --origin count from; by default that of FILE. Every output names it.",
    ),
    click.option(
        "--depth-reference-height-m", type=float, help="Height of --depth-reference above --answer-depth-reference."
    ),
    click.option("--height-datum", metavar="NAME", help="Datum of heights, as it is to be named."),
    click.option(
        "--section-azimuth-deg", type=float, default=0.0, show_default=True, help="Azimuth of the vertical section."
    ),
    click.option("--report", type=click.Path(path_type=Path, dir_okay=False), help="Report to be signed, a .pdf file."),
    click.option("--report-date", type=click.DateTime(["%Y-%m-%d"]), help="Day of the report.  [default: today, UTC]"),
    click.option("--project", default="", help="For --report."),
    click.option("--client", default="", help="For --report."),
    click.option("--serial", default="", help="Serial number of what surveyed, for --report."),
    click.option("--calibration", default="", help="Its certificate, for --report."),
    *paper_options(),
    *site_options("Magnetic field of the site, for magnetic tools.", "Azimuth of magnetic north from true north."),
    click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Station table, a .csv file."),
    click.option(
        "--by-source",
        type=click.Path(path_type=Path, dir_okay=False),
        help="Covariance of every source at every station at one sigma, a .csv file.",
    ),
    click.option(
        "--plot",
        type=click.Path(path_type=Path, dir_okay=False),
        help="Plan, sections and uncertainty as .svg, .png or .pdf.",
    ),
    click.option(
        "--export-tool", type=click.Path(path_type=Path, dir_okay=False), help="Error model as an ISCWSA .json file."
    ),
    site=SiteFigures,
    frame=FrameRequest,
    request=SurveyRequest,
    files=SurveyFiles,
    books=PaperRequest,
    paper=HolePaperRequest,
)
