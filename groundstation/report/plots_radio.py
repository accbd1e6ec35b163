"""Radio links between tubes: margin over the texture of the soil, attenuation inside the pipe."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation

from groundstation.report.style import INK, MARKERS, SERIES, WRONG, new_figure, styled, tidy_ticks
from telemetry.radio.link_request import PipeRequest, SoilRequest
from telemetry.radio.path_loss import link_margin
from telemetry.radio.soil_links import soil_power
from telemetry.radio.steel import CARBON, TEMPERATURES, steel_resistivity
from telemetry.radio.waveguide import LOWEST, TE11, cut_off, nepers_to_decibels, wall_attenuation

Array = npt.NDArray[np.float64]
LEVEL = 5.0  # dB, from one shade to the next
FREQUENCIES = 400
CURVE = 200  # points
GRID = 41  # textures along a side of the map


@styled
def soil_map(sand: Array, clay: Array, margins: Mapping[float, Array], title: str) -> Figure:
    """Margin over all textures, a panel for each water content; what is below the threshold is marked.

    Parameters
    ----------
    sand, clay : (n,) mass fractions
    margins : water content (0..1) to margins (n,) dB
    """
    figure = new_figure(3.2, title)
    panels = figure.subplots(1, len(margins), sharey=True, squeeze=False)[0]
    mesh = Triangulation(100.0 * sand, 100.0 * clay)
    every = np.concatenate(list(margins.values()))
    levels = LEVEL * np.arange(np.floor(every.min() / LEVEL), np.ceil(every.max() / LEVEL) + 1.0)
    shades = ScalarMappable(Normalize(2.0 * levels[0] - levels[-1], levels[-1]), "Greys_r")  # black text stays readable
    for axes, (water, values) in zip(panels, margins.items(), strict=True):
        axes.tricontourf(mesh, values, levels=levels, cmap=shades.cmap, norm=shades.norm)
        lines = axes.tricontour(mesh, values, levels=levels, colors=INK, linewidths=0.5)
        axes.clabel(lines, fmt="%.0f", fontsize=6.0)
        if values.min() < 0.0 < values.max():
            axes.tricontour(mesh, values, levels=[0.0], colors=WRONG, linewidths=1.5)
        axes.set(title=f"{100.0 * water:g} % water", xlabel="Sand (%)", xlim=(0.0, 100.0), ylim=(0.0, 100.0))
        axes.grid(visible=False)
    panels[0].set_ylabel("Clay (%)")
    figure.colorbar(shades, ax=list(panels), label="Margin (dB)", boundaries=levels)
    return tidy_ticks(figure)


@styled
def soil_curves(distances: Array, powers: Mapping[str, Array], threshold: float, title: str) -> Figure:
    """Received power over the distance, a line for each water content, and the threshold.

    Parameters
    ----------
    distances : (n,) m
    powers : label to powers (n,) dBm
    threshold : dBm
    """
    figure = new_figure(3.2, title)
    axes = figure.subplots()
    for k, (label, values) in enumerate(powers.items()):
        axes.plot(distances, values, color=SERIES[k % len(SERIES)], label=label)
    axes.axhline(threshold, color=WRONG, lw=1.0, ls="--", label="threshold")
    axes.set(xlabel="Distance (m)", ylabel="Received power (dBm)")
    axes.legend()
    return tidy_ticks(figure)


@styled
def pipe_figure(
    radius: float,
    rho: float,
    frequency: float,
    title: str,
    published: Mapping[str, tuple[float, float]] | None = None,
) -> Figure:
    """Attenuation of the lowest modes over frequency, and of TE11 over the carbon of the steel by temperature.

    Parameters
    ----------
    radius : m
    rho : ohm m, of the left panel
    frequency : Hz, of the right panel
    published : mode to frequency (GHz) and attenuation (dB/m)
    """
    figure = new_figure(3.4, title)
    over_frequency, over_carbon = figure.subplots(1, 2)
    top = max(4.0 * float(cut_off(TE11, radius)), 1.2 * frequency)
    for k, mode in enumerate(LOWEST):
        lowest = float(cut_off(mode, radius))
        f = np.geomspace(1.01 * lowest, top, FREQUENCIES)
        lost = nepers_to_decibels(wall_attenuation(mode, radius, f, rho))
        over_frequency.plot(f * 1e-9, lost, color=SERIES[k], label=f"{mode}, from {lowest * 1e-9:.3f} GHz")
        over_frequency.axvline(lowest * 1e-9, color=SERIES[k], lw=0.7, ls=":")
        if published and str(mode) in published:
            over_frequency.plot(*published[str(mode)], "x", ms=8.0, color=SERIES[k], gid="published")
    over_frequency.set(xlabel="Frequency (GHz)", ylabel="Attenuation (dB/m)", ylim=(0.0, 0.3))
    over_frequency.set_title(f"{rho * 1e8:.3g}e-8 ohm m" + (", crosses as printed" if published else ""))
    over_frequency.legend()
    carbon = np.linspace(CARBON.low, CARBON.high, 100)
    over_carbon.set_title(f"TE11 at {frequency * 1e-9:g} GHz")
    if frequency > float(cut_off(TE11, radius)):
        for k, warm in enumerate(TEMPERATURES.tolist()):
            lost = nepers_to_decibels(wall_attenuation(TE11, radius, frequency, steel_resistivity(carbon, warm)))
            look = {"color": SERIES[k], "marker": MARKERS[k], "markevery": 20}
            over_carbon.plot(carbon, lost, label=f"{warm:g} C", **look)
        over_carbon.set_ylim(top=1.12 * float(lost.max()))
        over_carbon.legend(loc="upper center", ncols=len(TEMPERATURES), columnspacing=1.0)
    over_carbon.set(xlabel="Carbon (% by weight)", ylabel="Attenuation (dB/m)")
    return tidy_ticks(figure)


def draw_soil(request: SoilRequest) -> Figure:
    """Received power over the distance, half as far to half as far again as was asked for."""
    reach = np.linspace(0.5 * min(request.distances), 1.5 * max(request.distances), CURVE)
    with warnings.catch_warnings():  # those of the model are told with the links themselves
        warnings.simplefilter("ignore")
        curves = {
            f"{100.0 * water:g} % water": soil_power(request, request.sand, request.clay, water, reach)
            for water in request.waters
        }
    texture = f"{100.0 * request.sand:g} % sand, {100.0 * request.clay:g} % clay"
    return soil_curves(
        reach, curves, request.threshold_dbm, f"Received power at {request.frequency_mhz:g} MHz, {texture}"
    )


def draw_soil_map(request: SoilRequest) -> Figure:
    """Margin over all textures at the largest distance that was asked for."""
    across, along = (side.ravel() for side in np.meshgrid(*2 * [np.linspace(0.0, 1.0, GRID)]))
    kept = across + along <= 1.0 + 1e-9
    across, along, far = across[kept], along[kept], max(request.distances)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fields = {
            water: link_margin(soil_power(request, across, along, water, far), request.threshold_dbm)
            for water in request.waters
        }
    return soil_map(across, along, fields, f"Margin through {far:g} m of soil at {request.frequency_mhz:g} MHz")


def draw_pipe(request: PipeRequest, rho: float) -> Figure:
    """Attenuation inside the pipe that was asked for, of a steel of ``rho`` (ohm m)."""
    title = f"Attenuation inside a pipe of {request.radius_cm:g} cm radius"
    return pipe_figure(request.radius_cm * 1e-2, rho, request.frequency_ghz * 1e9, title)
