"""``borechain link pipe``: what a radio hears inside the bore of the string."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.faults import InputFault, plain_faults, require_modules
from borechain.cli.link.link_output import check_plot, plot_option, show_links
from borechain.cli.shared_options import json_option

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@click.command()
@click.option("--radius-cm", type=float, default=3.0, show_default=True, help="Of the bore.")
@click.option("--frequency-ghz", type=float, default=5.0, show_default=True, help="Above the cut-off of the pipe.")
@click.option("--grade", help="Of API 5L, such as 'X52 seamless'; its largest carbon content is taken.")
@click.option("--carbon-percent", type=float, help="Of the steel by weight, 0.06..1.22  [default: 0.26]")
@click.option("--temperature-c", type=float, default=20.0, show_default=True, help="Of the wall, 20..400 C.")
@click.option("--budget-db", type=float, default=110.0, show_default=True, help="What may be lost on the way.")
@plot_option
@json_option
@require_modules("scipy")
@plain_faults
def pipe(
    radius_cm: float,
    frequency_ghz: float,
    grade: str | None,
    carbon_percent: float | None,
    temperature_c: float,
    budget_db: float,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Cut-off, attenuation and reach of the lowest modes inside a steel pipe.

    \b
    Example:
      borechain link pipe --frequency-ghz 5 --grade "X52 seamless" --plot pipe.svg
    """
    from telemetry.radio.steel import carbon_of, steel_resistivity
    from telemetry.radio.waveguide import LOWEST, TE11, cut_off, wall_attenuation

    check_plot(plot)
    if grade is not None and carbon_percent is not None:
        raise InputFault("--grade: expected either a grade or --carbon-percent, got both")
    carbon = carbon_of(grade) if grade is not None else 0.26 if carbon_percent is None else carbon_percent
    rho = float(steel_resistivity(carbon, temperature_c))
    radius, f = radius_cm * 1e-2, frequency_ghz * 1e9
    wall_attenuation(TE11, radius, f, rho)  # a pipe in which nothing propagates is refused
    links = [link_of(mode, float(cut_off(mode, radius)), radius, f, rho, budget_db) for mode in LOWEST]

    def figure() -> Figure:
        from groundstation.report.plots_radio import pipe_figure

        return pipe_figure(radius, rho, f, f"Attenuation inside a pipe of {radius_cm:g} cm radius")

    result = {"carbon_percent": carbon, "resistivity_ohm_m": rho, "links": links}
    title = f"Pipe of {radius_cm:g} cm at {frequency_ghz:g} GHz: {carbon:g} % carbon, {rho * 1e8:.3g}e-8 ohm m"
    show_links(title, result, as_json=as_json, plot=plot, figure=figure)


def link_of(mode: Any, lowest: float, radius: float, frequency: float, rho: float, budget: float) -> dict[str, Any]:
    """One line of the table; nothing is lost or reached where nothing propagates."""
    from telemetry.radio.waveguide import link_reach, nepers_to_decibels, wall_attenuation

    row: dict[str, Any] = {"mode": str(mode), "cut_off_ghz": lowest * 1e-9, "attenuation_db_per_m": None}
    row["reach_m"] = None
    if frequency > lowest:
        lost = nepers_to_decibels(wall_attenuation(mode, radius, frequency, rho))
        row |= {"attenuation_db_per_m": float(lost), "reach_m": float(link_reach(lost, budget))}
    return row
