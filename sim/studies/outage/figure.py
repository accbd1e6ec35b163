"""NEES over hops, by outage and loss."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from groundstation.report.style import GREY, LIGHT, MARKERS, SERIES, WRONG, new_figure, styled, tidy_ticks
from sim.studies.outage.run import EVERY, HOPS, STATES

Array = npt.NDArray[np.float64]


def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """One figure, rows of states and columns of outages."""
    panels: dict[tuple[str, str], dict[str, Any]] = {}
    for state in STATES:
        for r in result["cases"]:
            if r["state"] == state:
                key = (state, f"{r['outage_s']:g} s off" if r["outage_s"] else "no outage")
                values = np.array([r[f"hop_{k + 1}"] for k in range(HOPS)])
                panels.setdefault(key, {})[f"{100.0 * r['loss']:g} % lost a hop"] = values
    return {"outage": consistency_figure(panels, EVERY, f"NEES, {result['seeds']} seeds")}


@styled
def consistency_figure(
    panels: Mapping[tuple[str, str], Mapping[str, Array]], bounds: tuple[float, float], title: str
) -> Figure:
    """NEES over hops with the bounds of all cells, rows of states and columns of outages.

    Parameters
    ----------
    panels : (state, outage) to loss to NEES (hops,)
    bounds : of an honest filter; cells beyond are marked
    """
    states, outages = (list(dict.fromkeys(key[k] for key in panels)) for k in (0, 1))
    figure = new_figure(1.0 + 1.9 * len(states), title)
    grid = figure.subplots(len(states), len(outages), sharex=True, sharey=True, squeeze=False)
    for (state, outage), losses in panels.items():
        axes = grid[states.index(state), outages.index(outage)]
        axes.axhspan(*bounds, color=LIGHT, alpha=0.6, lw=0.0)
        axes.axhline(1.0, color=GREY, lw=0.8)
        for k, values in enumerate(losses.values()):
            hops = np.arange(1, len(values) + 1)
            beyond = (values < bounds[0]) | (values > bounds[1])
            axes.plot(hops, values, color=SERIES[k], marker=MARKERS[k])
            axes.plot(hops[beyond], values[beyond], "o", ms=9.0, mfc="none", mec=WRONG, mew=1.2)
        axes.set(title=f"{outage}, {state}", yscale="log")
        axes.set_yticks([0.5, 0.7, 1.0, 1.4, 2.0])
        axes.set_xticks(hops)
    for axes in grid[:, 0]:
        axes.set_ylabel("NEES")
    for axes in grid[-1]:
        axes.set_xlabel("Hop")
    names = list(next(iter(panels.values())))
    handles = [Line2D([], [], color=SERIES[k], marker=MARKERS[k], label=name) for k, name in enumerate(names)]
    handles.append(Line2D([], [], ls="", marker="o", ms=9.0, mfc="none", mec=WRONG, label="beyond the bounds"))
    handles_all = [*handles, Patch(color=LIGHT, alpha=0.6, label=f"{bounds[0]:g} to {bounds[1]:g}")]
    figure.legend(handles=handles_all, loc="outside lower left", ncols=5)
    return tidy_ticks(figure)
