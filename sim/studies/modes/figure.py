"""Yaw over time and the reach of every case. Source: thesis figures 4.11-4.22."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from groundstation.report.style import GREY, INK, LIGHT, MARKERS, SERIES, WRONG, new_figure, styled, tidy_ticks
from sim.studies.modes.run import CASES
from sim.studies.published_form.published_forms import FORMS

Array = npt.NDArray[np.float64]
BEFORE_STOP = 130.0  # s, from which the yaw is drawn
SMALLEST = 1e-3  # deg, below which an error is no longer drawn
SHOWN = (0.005, 2.0)  # deg, of figures beside the published ones, at least
FORM_MARKERS = {"published filter, simulated": MARKERS[3], "published scheme, simulated": MARKERS[2]}
OURS_LABEL = "ours, 95 % interval"


@dataclass(frozen=True, slots=True)
class YawPanel:
    """Yaw error of one case over time; deg."""

    name: str
    t: Array  # s after the stop
    one: Array  # of one seed
    rms: Mapping[str, Array]  # over seeds, by the state of the node
    to_reach: float | None  # at rest


@dataclass(frozen=True, slots=True)
class Reach:
    """One figure beside the published one and the one to reach; deg."""

    name: str
    ours: float
    low: float
    high: float
    published: float | None
    to_reach: float | None
    simulated: tuple[float, ...] = ()  # the published filter and the published scheme


def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """Both figures of one of the tables."""
    name, seeds = result["experiment"], result["seeds"]
    return {
        name: yaw_figure(yaw_panels(result), f"Yaw error: {name}, {seeds} seeds"),
        f"{name}-reach": reach_figure(reaches_by_quantity(result), f"Reach: {name}, {seeds} seeds"),
    }


def yaw_panels(result: dict[str, Any]) -> list[YawPanel]:
    """One a case."""
    panels = []
    for case in CASES[result["experiment"]]:
        trace = result["traces"][case.name]
        seen = trace["t"] >= -BEFORE_STOP
        panels.append(
            YawPanel(case.name, trace["t"][seen], trace["one"][seen], {"all seeds": trace["rms"][seen]}, case.yaw)
        )
    return panels


def reaches_by_quantity(result: dict[str, Any]) -> dict[str, list[Reach]]:
    """Rows with a figure to reach, by quantity."""
    found: dict[str, list[Reach]] = {}
    ours = {(r["case"], r["quantity"]): r["ours"] for r in result["cases"]}
    for r in result["cases"]:
        if r["to_reach"] is not None:
            published = float(r["published"]) if isinstance(r["published"], float) else None
            simulated = [ours[key] for form in FORMS if (key := (f"{r['case']}, {form}", r["quantity"])) in ours]
            reach = Reach(r["case"], r["ours"], r["low"], r["high"], published, r["to_reach"], tuple(simulated))
            found.setdefault(r["quantity"].capitalize(), []).append(reach)
    return found


@styled
def yaw_figure(panels: Sequence[YawPanel], title: str) -> Figure:
    """Size of the yaw error around the stop at zero, a panel a case."""
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    figure = new_figure(1.1 + 1.9 * rows, title)
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axes in grid.flat[len(panels) :]:
        axes.remove()
    top = 1.5 * max(float(rms.max()) for panel in panels for rms in panel.rms.values())
    for k, (axes, panel) in enumerate(zip(grid.flat, panels, strict=False)):
        end = float(panel.t.max())
        axes.axvspan(0.0, end, color=LIGHT, alpha=0.35, lw=0.0)
        axes.plot(panel.t, np.maximum(np.abs(panel.one), SMALLEST), color=GREY, lw=0.5)
        for colour, rms in zip(SERIES, panel.rms.values(), strict=False):
            axes.plot(panel.t, rms, color=colour)
        if panel.to_reach is not None:
            axes.plot([0.0, end], [panel.to_reach] * 2, color=INK, ls="--", lw=0.9)
        axes.set(title=panel.name, yscale="log", xlim=(float(panel.t.min()), end))
        axes.set_ylim(SMALLEST, top)
        if k % columns == 0:
            axes.set_ylabel("Yaw error (deg)")
        if k + columns >= len(panels):
            axes.set_xlabel("Time after the stop (s)")
            axes.tick_params(labelbottom=True)
    names = list(panels[0].rms)
    handles = [Line2D([], [], color=c, label=f"rms, {n}") for c, n in zip(SERIES, names, strict=False)]
    handles.append(Line2D([], [], color=GREY, lw=0.5, label="one seed"))
    handles.append(Line2D([], [], color=INK, ls="--", lw=0.9, label="to reach at rest"))
    figure.legend(
        handles=[*handles, Patch(color=LIGHT, alpha=0.35, label="at rest")], loc="outside lower left", ncols=5
    )
    return tidy_ticks(figure)


@styled
def reach_figure(panels: Mapping[str, Sequence[Reach]], title: str) -> Figure:
    """Figures with their intervals beside the published ones and those to reach, a panel a quantity."""
    longest = max(len(rows) for rows in panels.values())
    end = max(SHOWN[1], 1.5 * max(d for rows in panels.values() for row in rows for d in (row.ours, *row.simulated)))
    figure = new_figure(1.3 + 0.24 * longest, title)
    for axes, (quantity, rows) in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels.items(), strict=True):
        for y, reach in enumerate(rows):
            missed = reach.to_reach is not None and reach.ours > reach.to_reach
            colour = WRONG if missed else SERIES[0]
            axes.plot([reach.low, reach.high], [y, y], color=colour, lw=2.0)
            axes.plot(reach.ours, y, MARKERS[0], color=colour)
            if reach.to_reach is not None:
                axes.plot(reach.to_reach, y, "|", color=INK, ms=11.0, mew=1.4)
            if reach.published is not None:
                axes.plot(reach.published, y, "x", color=GREY, ms=6.0, mew=1.4)
            for marker, figure_deg in zip(FORM_MARKERS.values(), reach.simulated, strict=False):
                axes.plot(figure_deg, y, marker, color=GREY, mfc="none")
        axes.set(xscale="log", xlabel=f"{quantity}, rms (deg)", xlim=(SHOWN[0], end), ylim=(len(rows) - 0.5, -0.5))
        axes.set_yticks(range(len(rows)), [reach.name for reach in rows])
    for axes in figure.axes[1:]:
        axes.tick_params(labelleft=False)
    handles = [
        Line2D([], [], color=SERIES[0], marker=MARKERS[0], lw=2.0, label=OURS_LABEL),
        Line2D([], [], color=WRONG, marker=MARKERS[0], lw=2.0, label="ours, not reached"),
        Line2D([], [], color=INK, ls="", marker="|", ms=11.0, mew=1.4, label="to reach"),
        Line2D([], [], color=GREY, ls="", marker="x", ms=6.0, mew=1.4, label="published"),
    ]
    if any(row.simulated for rows in panels.values() for row in rows):
        handles += [Line2D([], [], color=GREY, ls="", marker=m, mfc="none", label=n) for n, m in FORM_MARKERS.items()]
    figure.legend(handles=handles, loc="outside lower left", ncols=3)
    return tidy_ticks(figure)
