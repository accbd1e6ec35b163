"""``borechain survey``: trajectory and region of uncertainty of a record."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.console_tables import show_warnings, table_console
from borechain.cli.faults import plain_faults
from borechain.cli.shared_options import json_option
from borechain.cli.survey.survey_options import HolePaperRequest, SurveyFiles, survey_options
from borechain.cli.whole_files import write_whole

if TYPE_CHECKING:
    from groundstation.survey.requests.survey_answer import SurveyAnswer
    from groundstation.survey.requests.survey_request import SurveyRequest

SOURCES_SHOWN = 12


@click.command()
@survey_options
@json_option
@plain_faults
def survey(request: SurveyRequest, files: SurveyFiles, paper: HolePaperRequest, as_json: bool) -> None:
    """Compute trajectory and region of uncertainty of FILE.

    FILE is a table of stations (measured depth, inclination, azimuth, as most programs write them) or of lateral
    displacements (md_m, a_cm, b_cm); - is standard input. The first line of the answer says how it was read.

    \b
    Examples:
      borechain survey scenarios/wellbore-1-path.csv --displacement-rule thesis
      borechain survey stations.csv --sigma 2 --instrument mwd-rev5.1 --at 52.4,13.1 --date 2026-11-27 --plot survey.svg
    """
    from borechain import api

    files.check(request)
    answer = api.answer_survey(request)
    write_survey(answer, files, paper)
    if as_json:
        click.echo(json.dumps(answer.result))
    else:
        show_survey(answer.result)


def write_survey(answer: SurveyAnswer, files: SurveyFiles, paper: HolePaperRequest) -> None:
    """Write what is asked for: tables, picture, error model, report."""
    from groundstation.survey.requests.survey_tables import source_table_text, station_table_text

    if files.out is not None:
        write_whole(files.out, station_table_text(answer.result["stations"], answer.found.frame, answer.result["site"]))
    if files.by_source is not None:
        write_whole(files.by_source, source_table_text(answer.found))
    if files.plot is not None:
        from groundstation.report.plots import draw_survey
        from groundstation.report.style import save_figure

        save_figure(draw_survey(answer), files.plot)
    if files.export_tool is not None:
        write_whole(files.export_tool, answer.tool_text())
    if files.report is not None:
        write_whole(files.report, paper.to_pdf(answer))


def brought_words(result: dict[str, Any]) -> str:
    """Where the depths were read from, if from another reference than that of the answer."""
    read = result["read_from"]
    same = read["depth_reference"] == result["depth_reference"]
    return "" if same else f" (read from {read['depth_reference']}, {read['height_m']:g} m above it)"


def show_survey(result: dict[str, Any]) -> None:
    """Tables for people."""
    from rich.table import Table

    from groundstation.survey.requests.site_place import site_words

    paper = table_console(110)
    paper.print(result["read_as"])
    show_warnings(paper, result["warnings"])
    paper.print(site_words(result["site"]))
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
