"""Figures of the filter of a node: yaw and azimuth by update mode, tuning, delay, consistency.

Source: thesis figures 4.11-4.22. Angles in deg, times in s, biases in deg/s.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from groundstation.report.style import GREY, INK, LIGHT, MARKERS, SERIES, WRONG, new_figure, styled, tidy

Array = npt.NDArray[np.float64]
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
    return tidy(figure)


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
    return tidy(figure)


@styled
def ingredients_figure(panels: Mapping[str, Mapping[str, Sequence[Reach]]], title: str) -> Figure:
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
    return tidy(figure)


@styled
def bias_figure(groups: Mapping[str, Mapping[str, tuple[Array, Array]]], residual_dps: float, title: str) -> Figure:
    """Error of the z bias after the stop at zero, a panel a tuning factor.

    Parameters
    ----------
    groups : factor to name to times (n,) s and errors (n,) deg/s
    residual_dps : deg/s, error that the filter began with
    """
    figure = new_figure(3.6, title)
    for k, (axes, (factor, series)) in enumerate(
        zip(figure.subplots(1, len(groups), sharey=True), groups.items(), strict=True)
    ):
        axes.axhline(residual_dps, color=GREY, ls="--", lw=0.9)
        for colour, (name, (t, error)) in zip(SERIES, series.items(), strict=False):
            axes.plot(t, np.abs(error), color=colour, label=name)
        axes.set(title=factor, xlabel="Time after the stop (s)", xlim=(-5.0, 60.0), ylim=(0.0, 1.6 * residual_dps))
        axes.legend(loc="upper right", ncols=2)
        if k == 0:
            axes.set_ylabel("Error of the z bias (deg/s)")
    figure.legend(
        handles=[Line2D([], [], color=GREY, ls="--", lw=0.9, label="left over by the boot")], loc="outside lower left"
    )
    return tidy(figure)


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
    return tidy(figure)


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
    return tidy(figure)


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
    return tidy(figure)


@dataclass(frozen=True, slots=True)
class SchemeNees:
    """Consistency of one scheme at one epoch and hop."""

    scheme: str
    state: str
    hop: int
    nees: float
    nees_total: float  # with the constant errors of joints and mounts


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
    return tidy(figure)
