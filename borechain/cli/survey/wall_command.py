"""``borechain wall``: the joints of a wall, a shaft or a grid, what is not known of it, and whether it is tight."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain import __version__
from borechain.cli.console_tables import show_warnings, table_console
from borechain.cli.faults import InputFault, plain_faults
from borechain.cli.report_options import PaperRequest, paper_options
from borechain.cli.shared_options import json_option
from borechain.cli.whole_files import PLOT_FORMATS, check_suffix, write_whole
from telemetry.runtime.command_line import check_installed
from telemetry.runtime.typed_options import gather_options

if TYPE_CHECKING:
    from borechain.api import JudgedWall

SHOWN = 10
LEAST_SHOWN = 1e-9  # a probability
NOT_TIGHT = 3  # exit status


@dataclass(frozen=True, slots=True)
class WallFiles:
    """Files that the command writes, and what the report is about."""

    plot: Path | None
    report: Path | None
    column: str | None
    date: datetime | None

    def check(self) -> None:
        """Refuse files that could not be written, before anything is computed.

        Raises
        ------
        InputFault, EnvironmentFault
            Naming the option, or the package that is missing.
        """
        check_suffix("--plot", self.plot, *PLOT_FORMATS)
        check_suffix("--report", self.report, ".pdf")
        if self.report is None and (self.column is not None or self.date is not None):
            raise InputFault("--column and --date: expected --report FILE.pdf beside them")
        drawn = self.plot is not None or self.report is not None
        check_installed("scipy", *(["matplotlib"] if drawn else []), *(["typst"] if self.report is not None else []))


wall_options = gather_options(
    click.argument("file", type=click.Path(path_type=Path)),
    click.option(
        "--plot", type=click.Path(path_type=Path, dir_okay=False), help="Thickness over depth as .svg, .png or .pdf."
    ),
    click.option("--report", type=click.Path(path_type=Path, dir_okay=False), help="Report to be signed, a .pdf file."),
    click.option("--column", metavar="NAME", help="Column that --report is about; without it, the whole wall."),
    click.option("--date", type=click.DateTime(["%Y-%m-%d"]), help="Day of the report.  [default: today, UTC]"),
    *paper_options(),
    files=WallFiles,
    books=PaperRequest,
)


@click.command()
@wall_options
@json_option
@click.pass_context
@plain_faults
def wall(context: click.Context, file: Path, files: WallFiles, books: PaperRequest, as_json: bool) -> None:
    """Judge the wall, shaft or grid in FILE: every joint, every void, what is missing or not surveyed, and the whole.

    The exit status is 0 when it is tight and 3 when it is not, or not proven to be.

    \b
    Examples:
      borechain wall scenarios/walls/wall-40.toml --plot wall.svg
      borechain wall scenarios/walls/wall-40.toml --report wall.pdf
      borechain wall scenarios/walls/wall-40.toml --report K021.pdf --column K021
    """
    from borechain import api

    files.check()
    judged = api.wall(file)
    result = judged.to_result()
    write_wall_files(judged, files, books)
    if as_json:
        click.echo(json.dumps(result))
    else:
        show_wall(result)
    if not judged.is_tight:
        context.exit(NOT_TIGHT)


def write_wall_files(judged: JudgedWall, files: WallFiles, books: PaperRequest) -> None:
    """Write what is asked for: picture, report."""
    if files.plot is not None:
        from groundstation.report.plots_wall import draw_wall
        from groundstation.report.style import save_figure

        save_figure(draw_wall(judged.wall, judged.judgement), files.plot)
    if files.report is not None:
        from groundstation.report.wall_report import wall_report_pdf

        day = (files.date or datetime.now(UTC)).date()
        papers = books.to_papers(judged.wall.file.client)
        write_whole(
            files.report, wall_report_pdf(judged.wall, judged.judgement, files.column, day, __version__, papers)
        )


def show_wall(result: dict[str, Any]) -> None:
    """Verdict, reasons, worst joints and columns, for people."""
    from rich.table import Table
    from rich.text import Text

    paper = table_console(100)
    colour = "green" if result["verdict"] == "tight" else "bold red"
    frame = f"{result['north']} north, depth from {result['depth_reference']}"
    if result["stations_north"] != result["north"]:
        frame += f", stations read from {result['stations_north']} north"
    paper.print(Text.assemble((f"{result['wall']}: {result['verdict']}", colour), f" ({frame})"))
    ends = {f"{row['tight_from_m']:g} to {row['tight_to_m']:g} m" for row in result["joints"]}
    paper.print(f"to be tight from {ends.pop() if len(ends) == 1 else 'the upper head to the lower toe of each joint'}")
    touching = {finding["text"] for finding in result["findings"]}
    show_warnings(paper, [row for row in result["warnings"] if row["text"] not in touching])
    for finding in result["findings"]:
        paper.print(f"  {finding['kind']}: {finding['text']}")
    table = Table(title=f"the {min(SHOWN, len(result['joints']))} most doubtful of {len(result['joints'])} joints")
    for name in ("joint", "state", "depth m", "thickness m", "thinnest at m", "P(too thin)", "apart cm", "towards deg"):
        table.add_column(name, justify="right")
    thin = {row["joint"]: -math.inf if row["thickness_m"] is None else row["thickness_m"] for row in result["joints"]}
    for row in sorted(result["joints"], key=lambda r: (-r["probability"], thin[r["joint"]]))[:SHOWN]:
        table.add_row(
            row["joint"],
            row["state"],
            f"{row['depth_m']:.2f}",
            number_text(row["thickness_m"], 3),
            f"{row['thinnest_at_m']:.2f}",
            chance_text(row["probability"]),
            number_text(row["moved_apart_cm"], 1),
            number_text(row["direction_deg"], 0),
        )
    paper.print(table)
    if result["margin"] is not None:
        m = result["margin"]
        paper.print(f"one column alone may be {m['shift_cm']:.1f} cm off at its toe, {m['deviation_deg']:.3f} deg")
    over = [row for row in result["columns"] if row["used_percent"] is not None and row["used_percent"] >= 100.0]
    paper.print(
        f"required {result['required_thickness_m']:g} m: "
        f"{result['gaps']} of {len(result['joints'])} joints are thinner or open, "
        f"{result['doubtful']} are so with a probability of more than {result['allowed_probability']:g}; "
        f"{len(over)} columns beyond their tolerance"
    )
    for row in result["closing"][-SHOWN:]:
        widest = row["largest_spacing"]
        spacing = "" if widest is None else f", widest {widest['spacing_m']:.3f} m ({widest['joint']})"
        paper.print(f"{row['day']}: {row['closed_percent']:.1f} % closed, {row['open_joints']} joints open{spacing}")
    paper.print(f"anything open or too thin: probability {result['probability_of_any']:.2g}")
    paper.print(f"worst joint {result['worst']['joint']} at {result['worst']['depth_m']:g} m")
    for row in result["extra_columns"]:
        extra = row["extra_column"]
        verdict = "closes" if extra["closes"] else "does not close"
        paper.print(
            f"a column at north {extra['north_m']:.2f} m, east {extra['east_m']:.2f} m "
            f"from {extra['from_m']:g} to {extra['to_m']:g} m {verdict} {row['joint']}"
        )


def chance_text(probability: float) -> str:
    """A probability of a table; far below what any wall allows, only that it is."""
    return f"{probability:.2g}" if probability >= LEAST_SHOWN else f"<{LEAST_SHOWN:g}"


def number_text(value: float | None, digits: int) -> str:
    """A number of a table, a dash where there is none."""
    return "-" if value is None else f"{value:.{digits}f}"
