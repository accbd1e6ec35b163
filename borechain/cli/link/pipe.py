"""``borechain link pipe``: what a radio hears inside the bore of the string."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from borechain.cli.faults import plain_faults, require_modules
from borechain.cli.link.link_output import check_plot, plot_option, show_links
from borechain.cli.shared_options import json_option
from telemetry.radio.link_request import PipeRequest
from telemetry.runtime.typed_options import gather_options

if TYPE_CHECKING:
    from matplotlib.figure import Figure

pipe_options = gather_options(
    click.option("--radius-cm", type=float, default=3.0, show_default=True, help="Of the bore."),
    click.option("--frequency-ghz", type=float, default=5.0, show_default=True, help="Above the cut-off of the pipe."),
    click.option("--grade", help="Of API 5L, such as 'X52 seamless'; its largest carbon content is taken."),
    click.option("--carbon-percent", type=float, help="Of the steel by weight, 0.06..1.22  [default: 0.26]"),
    click.option("--temperature-c", type=float, default=20.0, show_default=True, help="Of the wall, 20..400 C."),
    click.option("--budget-db", type=float, default=110.0, show_default=True, help="What may be lost on the way."),
    plot_option,
    json_option,
    request=PipeRequest,
)


@click.command()
@pipe_options
@require_modules("scipy")
@plain_faults
def pipe(request: PipeRequest, plot: Path | None, as_json: bool) -> None:
    """Cut-off, attenuation and reach of the lowest modes inside a steel pipe.

    \b
    Example:
      borechain link pipe --frequency-ghz 5 --grade "X52 seamless" --plot pipe.svg
    """
    from telemetry.radio.pipe_links import pipe_result

    check_plot(plot)
    result = pipe_result(request)
    carbon, rho = result["carbon_percent"], result["resistivity_ohm_m"]

    def figure() -> Figure:
        from groundstation.report.plots_radio import draw_pipe

        return draw_pipe(request, rho)

    pipe_words = f"Pipe of {request.radius_cm:g} cm at {request.frequency_ghz:g} GHz"
    title = f"{pipe_words}: {carbon:g} % carbon, {rho * 1e8:.3g}e-8 ohm m"
    show_links(title, result, as_json=as_json, plot=plot, figure=figure)
