"""NEES of every scheme over hops, at rest and turning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from groundstation.report.style import GREY, INK, LIGHT, MARKERS, SERIES, new_figure, styled, tidy_ticks
from sim.studies.consistency.run import EVERY


@dataclass(frozen=True, slots=True)
class SchemeNees:
    """Consistency of one scheme at one epoch and hop."""

    scheme: str
    state: str
    hop: int
    nees: float
    nees_total: float  # with the constant errors of joints and mounts


def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """One figure, a panel a state."""
    found = [
        SchemeNees(row["scheme"], row["state"], row["hop"], row["nees"], row["nees_total"]) for row in result["cases"]
    ]
    title = f"NEES of relay schemes, {result['kernel']}, {result['seeds']} seeds"
    return {result["experiment"]: scheme_figure(found, EVERY, title)}


@styled
def scheme_figure(found: Sequence[SchemeNees], bounds: tuple[float, float], title: str) -> Figure:
    """NEES over hops of every scheme, at rest and turning; open markers count joints and mounts."""
    states = list(dict.fromkeys(f.state for f in found))
    schemes = list(dict.fromkeys(f.scheme for f in found))
    figure = new_figure(4.2, title)
    grid = figure.subplots(1, len(states), sharey=True, squeeze=False)[0]
    for axes, state in zip(grid, states, strict=True):
        axes.axhspan(*bounds, color=LIGHT, alpha=0.6, lw=0.0)
        axes.axhline(1.0, color=GREY, lw=0.8)
        for k, scheme in enumerate(schemes):
            of = [f for f in found if f.scheme == scheme and f.state == state]
            hops = [f.hop for f in of]
            axes.plot(hops, [f.nees for f in of], ls="", color=SERIES[k], marker=MARKERS[k])
            axes.plot(hops, [f.nees_total for f in of], ls="", color=SERIES[k], marker=MARKERS[k], mfc="none")
        ticks = sorted({f.hop for f in found})
        axes.set(title=state.capitalize(), xscale="log", yscale="log", xlabel="Hop")
        axes.set_xticks(ticks, [f"{hop}" for hop in ticks])
        axes.minorticks_off()
        if all(bounds[0] <= nees <= bounds[1] for f in found for nees in (f.nees, f.nees_total)):
            axes.set_yticks([bounds[0], 0.9, 1.0, 1.1, bounds[1]])  # less than a decade has no decades to mark
    grid[0].set_ylabel("NEES")
    handles = [Line2D([], [], ls="", color=SERIES[k], marker=MARKERS[k], label=s) for k, s in enumerate(schemes)]
    handles.append(Line2D([], [], ls="", color=INK, marker="o", mfc="none", label="with joints and mounts"))
    handles_all = [*handles, Patch(color=LIGHT, alpha=0.6, label=f"{bounds[0]:g} to {bounds[1]:g}")]
    figure.legend(handles=handles_all, loc="outside lower left", ncols=3)
    return tidy_ticks(figure)
