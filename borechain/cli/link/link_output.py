"""How the commands of a link tell what they found: a table or JSON, and maybe a plot."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.console_tables import show_table
from borechain.cli.whole_files import PLOT_FORMATS, check_suffix
from telemetry.runtime.command_line import check_installed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

plot_option = click.option(
    "--plot", type=click.Path(path_type=Path, dir_okay=False), help="Picture as .svg, .png or .pdf."
)


def check_plot(plot: Path | None) -> None:
    """Refuse a plot that could not be made, before anything is computed."""
    check_suffix("--plot", plot, *PLOT_FORMATS)
    if plot is not None:
        check_installed("scipy", "matplotlib")


def show_links(
    title: str, result: dict[str, Any], *, as_json: bool, plot: Path | None, figure: Callable[[], Figure]
) -> None:
    """Show or print a result, whose rows are ``links``, and draw it where a plot is asked for."""
    if plot is not None:
        from groundstation.report.style import save_figure

        save_figure(figure(), plot)
    if as_json:
        click.echo(json.dumps(result))
    else:
        rows = result["links"]
        show_table(title, rows, [(key, key) for key in rows[0]])
