"""Margin over texture and water, and the delivery time of surveys through wet clay."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from groundstation.report.plots_radio import soil_map
from groundstation.report.style import INK, SERIES, new_figure, styled, tidy_ticks
from sim.studies.soil_link.delivery_time import STEP


def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """The map and the delivery."""
    traces = result["traces"]
    title = "Margin over -103 dBm through 0.3 m of soil, 868 MHz, 2 dBm"
    return {
        "soil-link": soil_map(traces["sand"], traces["clay"], traces["margins"], title),
        "soil-link-delivery": delivery_figure(traces["times"], traces["expected"]),
    }


@styled
def delivery_figure(times: Any, distribution: Any) -> Figure:
    """Share of the surveys that has come to the surface over time, beside its expectation."""
    figure = new_figure(3.4, f"Wellbore 1 in wet clay: delivery of {len(times)} surveys")
    axes = figure.subplots()
    order = np.sort(times)
    axes.step(order, np.arange(1, len(order) + 1) / len(order), where="post", color=SERIES[0], label="came")
    axes.plot(STEP * np.arange(len(distribution)), np.cumsum(distribution), color=INK, ls="--", label="expected")
    axes.set(
        xscale="log",
        xlim=(0.5 * float(order[0]), 2.0 * float(order[-1])),
        ylim=(0.0, 1.02),
        xlabel="Time from the end of the average to the surface (s)",
        ylabel="Share of the surveys",
    )
    axes.legend(loc="lower right")
    return tidy_ticks(figure)
