"""``borechain link soil``: what one tube end hears of the next through soil."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from borechain.cli.faults import plain_faults
from borechain.cli.link.link_output import check_plot, plot_option, show_links
from borechain.cli.notices import warnings_in_lines
from borechain.cli.shared_options import json_option
from telemetry.radio.link_request import SoilRequest
from telemetry.runtime.typed_options import gather_options

if TYPE_CHECKING:
    from matplotlib.figure import Figure

soil_options = gather_options(
    click.option("--sand", type=float, default=0.3, show_default=True, help="Mass fraction of the solids, 0..1."),
    click.option("--clay", type=float, default=0.3, show_default=True, help="Mass fraction of the solids, 0..1."),
    click.option("--density", type=float, default=1.5, show_default=True, help="Of the dry soil, g/cm^3."),
    click.option(
        "--water",
        "waters",
        type=float,
        multiple=True,
        default=(0.01, 0.25, 0.40),
        show_default=True,
        help="Volume of water over volume of soil, 0..1. Repeatable.",
    ),
    click.option("--temperature-c", type=float, default=10.0, show_default=True, help="Of the soil's water, 0..40 C."),
    click.option("--frequency-mhz", type=float, default=868.0, show_default=True, help="300..1300 MHz."),
    click.option(
        "--distance-m",
        "distances",
        type=float,
        multiple=True,
        default=(0.1, 0.2, 0.3),
        show_default=True,
        help="Between the tube ends. Repeatable.",
    ),
    click.option("--transmit-dbm", type=float, default=2.0, show_default=True, help="Power of the transmitter."),
    click.option("--gain-dbi", type=float, default=0.0, show_default=True, help="Of each antenna."),
    click.option(
        "--threshold-dbm", type=float, default=-103.0, show_default=True, help="Where half the packets are lost."
    ),
    click.option("--map", "textures", is_flag=True, help="Plot the margin over all textures at the largest distance."),
    plot_option,
    json_option,
    request=SoilRequest,
)


@click.command()
@soil_options
@plain_faults
def soil(request: SoilRequest, textures: bool, plot: Path | None, as_json: bool) -> None:
    """Received power, margin and packet error rate through soil, by its water and the distance.

    The dielectric of the soil is the model of Peplinski, Ulaby and Dobson (1995), 0.3 to 1.3 GHz.

    \b
    Example:
      borechain link soil --sand 0.05 --clay 0.47 --water 0.40 --distance-m 0.3 --plot soil.svg
    """
    from telemetry.radio.soil_links import soil_links

    check_plot(plot)
    with warnings_in_lines():
        links = soil_links(request)

    def figure() -> Figure:
        from groundstation.report.plots_radio import draw_soil, draw_soil_map

        return draw_soil_map(request) if textures else draw_soil(request)

    solids = f"{request.sand:g} sand, {request.clay:g} clay, {request.density:g} g/cm^3"
    title = f"Through soil at {request.frequency_mhz:g} MHz: {solids}"
    show_links(title, {"links": links}, as_json=as_json, plot=plot, figure=figure)
