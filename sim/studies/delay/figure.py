"""Yaw error over the delay of the aiding."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from groundstation.report.style import GREY, INK, MARKERS, SERIES, new_figure, styled, tidy_ticks
from sim.studies.delay.run import DELAYS_MS, FORMS, STUDIED_DEG, TO_REACH_DEG

Array = npt.NDArray[np.float64]


def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """One figure, a panel for rotating and one for rest."""
    panels: dict[str, dict[str, Any]] = {}
    for quantity, state in (("yaw, rotating", "Rotating"), ("yaw, at rest", "At rest")):
        for form in FORMS:
            found = [r["ours"] for r in result["cases"] if r["quantity"] == quantity and r["form"] == form]
            panels.setdefault(state, {})[form] = (np.array(DELAYS_MS), np.array(found))
    studied = np.array([[ms, deg] for (_, ms), deg in STUDIED_DEG.items()]).T
    title = f"Delay of the aiding, {result['seeds']} seeds"
    return {"delay": delay_figure(panels, (studied[0], studied[1]), TO_REACH_DEG, title)}


@styled
def delay_figure(
    panels: Mapping[str, Mapping[str, tuple[Array, Array]]], published: tuple[Array, Array], to_reach: float, title: str
) -> Figure:
    """Yaw error over the delay of the aiding, a panel a state of the string.

    Parameters
    ----------
    panels : state to form to delays (n,) ms and rms (n,) deg
    published : delays (m,) ms and errors (m,) deg of the first panel, without compensation
    to_reach : deg, in the first panel
    """
    figure = new_figure(3.6, title)
    grid = figure.subplots(1, len(panels), sharey=True)
    for axes, (state, forms) in zip(grid, panels.items(), strict=True):
        for k, (form, (delays, rms)) in enumerate(forms.items()):
            axes.plot(delays, rms, color=SERIES[k], marker=MARKERS[k], label=form)
        axes.set(title=state, xlabel="Delay (ms)", yscale="log")
    grid[0].plot(*published, "x", color=GREY, ms=8.0, mew=1.4, label="published, uncompensated")
    grid[0].axhline(to_reach, color=INK, ls="--", lw=0.9, label="to reach, compensated")
    grid[0].set_ylabel("Yaw error, rms (deg)")
    figure.legend(*grid[0].get_legend_handles_labels(), loc="outside lower left", ncols=3)
    return tidy_ticks(figure)
