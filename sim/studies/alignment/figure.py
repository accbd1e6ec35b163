"""Error of an alignment over inclination, noise and turns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from groundstation.report.style import GREY, MARKERS, SERIES, new_figure, styled, tidy_ticks
from sim.studies.alignment.run import NAMES, PUBLISHED_DEG, SWEEPS


def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """One figure, a panel a sweep."""
    panels = {
        SWEEPS[name][0]: {NAMES[m]: [(p["x"], *p[m]) for p in points] for m in NAMES}
        for name, points in result["sweeps"].items()
    }
    published = {NAMES[m]: deg for m, deg in PUBLISHED_DEG.items()}
    return {"alignment": alignment_figure(panels, published, f"Alignment, {result['seeds']} seeds")}


@styled
def alignment_figure(
    panels: Mapping[str, Mapping[str, Sequence[tuple[float, ...]]]], published: Mapping[str, float], title: str
) -> Figure:
    """Error of an alignment, a panel for what it depends on.

    Parameters
    ----------
    panels : label of x to method to rows of x, rms, low, high and the node's own standard error; deg but for x
    published : method to error, deg, as lines
    """
    figure = new_figure(3.6, title)
    grid = figure.subplots(1, len(panels), sharey=True)
    for axes, (label, methods) in zip(grid, panels.items(), strict=True):
        for k, (method, rows) in enumerate(methods.items()):
            x, ours, low, high, said = np.array(rows).T
            axes.errorbar(x, ours, [ours - low, high - ours], color=SERIES[k], marker=MARKERS[k], ls="", label=method)
            axes.plot(x, said, color=SERIES[k], lw=1.0)
            axes.axhline(published[method], color=SERIES[k], ls=":", lw=0.9)
        axes.set(xlabel=label, xscale="log", yscale="log")
        axes.set_xticks(x, [f"{value:g}" for value in x])
        axes.set_yticks(ticks := [5e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02], [f"{value:g}" for value in ticks])
        axes.set_ylim(3e-4, 0.03)
        axes.minorticks_off()
    grid[0].set_ylabel("Error of pitch and roll, rms (deg)")
    handles, _ = grid[0].get_legend_handles_labels()
    handles.append(Line2D([], [], color=GREY, lw=1.0, label="standard error as the node says"))
    handles.append(Line2D([], [], color=GREY, ls=":", lw=0.9, label="published"))
    figure.legend(handles=handles, loc="outside lower left", ncols=4)
    return tidy_ticks(figure)
