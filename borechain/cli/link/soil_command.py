"""``borechain link soil``: what one tube end hears of the next through soil."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.faults import plain_faults
from borechain.cli.link.link_output import check_plot, plot_option, show_links
from borechain.cli.notices import warnings_in_lines
from borechain.cli.shared_options import json_option

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CURVE = 200  # points
GRID = 41  # textures along a side of the map


@click.command()
@click.option("--sand", type=float, default=0.3, show_default=True, help="Mass fraction of the solids, 0..1.")
@click.option("--clay", type=float, default=0.3, show_default=True, help="Mass fraction of the solids, 0..1.")
@click.option("--density", type=float, default=1.5, show_default=True, help="Of the dry soil, g/cm^3.")
@click.option(
    "--water",
    "waters",
    type=float,
    multiple=True,
    default=(0.01, 0.25, 0.40),
    show_default=True,
    help="Volume of water over volume of soil, 0..1. Repeatable.",
)
@click.option("--temperature-c", type=float, default=10.0, show_default=True, help="Of the soil's water, 0..40 C.")
@click.option("--frequency-mhz", type=float, default=868.0, show_default=True, help="300..1300 MHz.")
@click.option(
    "--distance-m",
    "distances",
    type=float,
    multiple=True,
    default=(0.1, 0.2, 0.3),
    show_default=True,
    help="Between the tube ends. Repeatable.",
)
@click.option("--transmit-dbm", type=float, default=2.0, show_default=True, help="Power of the transmitter.")
@click.option("--gain-dbi", type=float, default=0.0, show_default=True, help="Of each antenna.")
@click.option("--threshold-dbm", type=float, default=-103.0, show_default=True, help="Where half the packets are lost.")
@click.option("--map", "textures", is_flag=True, help="Plot the margin over all textures at the largest distance.")
@plot_option
@json_option
@plain_faults
def soil(
    sand: float,
    clay: float,
    density: float,
    waters: tuple[float, ...],
    temperature_c: float,
    frequency_mhz: float,
    distances: tuple[float, ...],
    transmit_dbm: float,
    gain_dbi: float,
    threshold_dbm: float,
    textures: bool,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Received power, margin and packet error rate through soil, by its water and the distance.

    The dielectric of the soil is the model of Peplinski, Ulaby and Dobson (1995), 0.3 to 1.3 GHz.

    \b
    Example:
      borechain link soil --sand 0.05 --clay 0.47 --water 0.40 --distance-m 0.3 --plot soil.svg
    """
    import numpy as np

    from telemetry.radio.path_loss import (
        link_margin,
        packet_error_rate,
        path_loss,
        propagation_constants,
        received_power,
    )
    from telemetry.radio.soil_dielectric import Soil, soil_permittivity

    check_plot(plot)
    f = frequency_mhz * 1e6

    def power(sand: Any, clay: Any, water: float, distance: Any) -> Any:
        eps = soil_permittivity(Soil(sand, clay, density, water, temperature_c), f)
        return received_power(path_loss(*propagation_constants(*eps, f), distance), transmit_dbm, 2.0 * gain_dbi)

    with warnings_in_lines():
        links = [
            soil_link_row(
                water,
                distance,
                float(power(sand, clay, water, distance)),
                threshold_dbm,
                link_margin,
                packet_error_rate,
            )
            for water in waters
            for distance in distances
        ]

    def figure() -> Figure:
        from groundstation.report.plots_radio import soil_curves, soil_map

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if textures:
                across, along = (side.ravel() for side in np.meshgrid(*2 * [np.linspace(0.0, 1.0, GRID)]))
                kept = across + along <= 1.0 + 1e-9
                across, along, far = across[kept], along[kept], max(distances)
                fields = {water: link_margin(power(across, along, water, far), threshold_dbm) for water in waters}
                return soil_map(across, along, fields, f"Margin through {far:g} m of soil at {frequency_mhz:g} MHz")
            reach = np.linspace(0.5 * min(distances), 1.5 * max(distances), CURVE)
            curves = {f"{100.0 * water:g} % water": power(sand, clay, water, reach) for water in waters}
        title = f"Received power at {frequency_mhz:g} MHz, {100.0 * sand:g} % sand, {100.0 * clay:g} % clay"
        return soil_curves(reach, curves, threshold_dbm, title)

    title = f"Through soil at {frequency_mhz:g} MHz: {sand:g} sand, {clay:g} clay, {density:g} g/cm^3"
    show_links(title, {"links": links}, as_json=as_json, plot=plot, figure=figure)


def soil_link_row(
    water: float, distance: float, dbm: float, threshold: float, margin: Any, error_rate: Any
) -> dict[str, Any]:
    """One line of the table."""
    over = float(margin(dbm, threshold))
    return {
        "water_percent": 100.0 * water,
        "distance_m": distance,
        "received_dbm": dbm,
        "margin_db": over,
        "packet_error_rate": float(error_rate(over)),
    }
