"""Yaw error with every ingredient left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from groundstation.report.style import MARKERS, SERIES, new_figure, styled, tidy_ticks


@dataclass(frozen=True, slots=True)
class Bar:
    """One figure with its interval; deg."""

    name: str
    ours: float
    low: float
    high: float


def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """One figure, a panel for rotating and one for rest."""
    panels: dict[str, dict[str, list[Bar]]] = {}
    for r in result["cases"]:
        bar = Bar(r["case"], r["ours"], r["low"], r["high"])
        panels.setdefault(r["quantity"].capitalize(), {}).setdefault(r["mode"], []).append(bar)
    return {"ingredients": ingredients_figure(panels, f"What each ingredient buys, {result['seeds']} seeds")}


@styled
def ingredients_figure(panels: Mapping[str, Mapping[str, Sequence[Bar]]], title: str) -> Figure:
    """Figures of every ingredient left out, with their intervals, a panel a state and a colour a mode of aiding.

    Parameters
    ----------
    panels : state to mode to rows, the same names in each; the first row is that of the filter as shipped
    """
    names = [row.name for row in next(iter(next(iter(panels.values())).values()))]
    figure = new_figure(1.3 + 0.3 * len(names), title)
    for axes, (state, modes) in zip(
        figure.subplots(1, len(panels), sharex=True, squeeze=False)[0], panels.items(), strict=True
    ):
        for k, (mode, rows) in enumerate(modes.items()):
            y = np.arange(len(rows)) + 0.3 * (k - 0.5 * (len(modes) - 1))
            axes.axvline(rows[0].ours, color=SERIES[k], ls=":", lw=0.9)
            axes.hlines(y, [row.low for row in rows], [row.high for row in rows], color=SERIES[k], lw=2.0)
            axes.plot([row.ours for row in rows], y, MARKERS[k], color=SERIES[k], label=mode)
        axes.set(xscale="log", xlabel=f"{state}, rms (deg)", ylim=(len(names) - 0.5, -0.5))
        axes.set_yticks(range(len(names)), names)
    for axes in figure.axes[1:]:
        axes.tick_params(labelleft=False)
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower left", ncols=2)
    return tidy_ticks(figure)
