"""Uncertainty of wellbore 1 by instrument, and its lateral part with and without the filter.

Source: thesis figures 4.5-4.7 and 4.24-4.27. Frame: north, east, down; cm.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from groundstation.report.style import GREY, MARKERS, SERIES, above_zero, log_if_needed, new_figure, styled, tidy_ticks
from sim.studies.published import AXES, wellbore_1
from sim.studies.region_of_uncertainty.run import FILTERED_AZIMUTH_DEG

Array = npt.NDArray[np.float64]


def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """Two figures: by instrument, and filtered against unfiltered."""
    md = wellbore_1().md
    tables = {}
    for name in dict.fromkeys(row["instrument"] for row in result["cases"]):
        ours, printed = (np.zeros((len(md), 3)) for _ in range(2))
        for row in result["cases"]:
            if row["instrument"] == name:
                axis = AXES.index(row["axis"])
                ours[row["station"], axis], printed[row["station"], axis] = row["ours"], row["published"]
        tables[name] = (md[1:], ours[1:], printed[1:])
    held = {}
    for name in dict.fromkeys(row["instrument"] for row in result["filtered"]):
        rows = [row for row in result["filtered"] if row["instrument"] == name]
        raw, kept = (np.array([row[key] for row in rows]) for key in ("unfiltered_cm", "filtered_cm"))
        held[name] = (md[1:], raw, kept)
    title = f"Lateral error: gyro against an azimuth held to {FILTERED_AZIMUTH_DEG:g} deg"
    return {
        "region-of-uncertainty": uncertainty_figure(tables, level="1 or 2 sigma, as printed"),
        "filtered": azimuth_error_figure(held, FILTERED_AZIMUTH_DEG, title),
    }


@styled
def uncertainty_figure(
    instruments: Mapping[str, tuple[Array, Array, Array | None]],
    title: str = "Region of uncertainty by instrument",
    names: tuple[str, str, str] = ("North", "East", "TVD"),
    level: str = "2 sigma",
) -> Figure:
    """Uncertainty of the stations by instrument: ours (lines) beside what was printed (dots, dashed).

    Parameters
    ----------
    instruments : name to depths (n,) m, ours (n, 3) cm and printed (n, 3) cm or None
    names : of the three columns
    level : of confidence, for the labels
    """
    figure = new_figure(8.6, title)
    panels = figure.subplots(3, 1, sharex=True)
    for c, axes in enumerate(panels):
        shown = []
        for k, (name, (md, ours, printed)) in enumerate(instruments.items()):
            look = {"color": SERIES[k % len(SERIES)]}
            axes.plot(md, above_zero(ours[:, c]), label=name, **look)
            shown.append(ours[:, c])
            if printed is not None:
                marker = MARKERS[k % len(MARKERS)]
                axes.plot(md, above_zero(printed[:, c]), ls="--", lw=0.8, marker=marker, **look)
                shown.append(printed[:, c])
        log_if_needed(axes, shown)
        axes.set_ylabel(f"{names[c]}, {level} (cm)")
    panels[-1].set_xlabel("Measured depth (m)")
    handles = [
        Line2D([], [], color=SERIES[k % len(SERIES)], marker=MARKERS[k % len(MARKERS)] if dots else "", label=name)
        for k, (name, dots) in enumerate((name, row[2] is not None) for name, row in instruments.items())
    ]
    handles.append(Line2D([], [], color=GREY, label="computed"))
    if any(printed is not None for _, _, printed in instruments.values()):
        handles.append(Line2D([], [], color=GREY, ls="--", lw=0.8, marker="o", label="printed"))
    figure.legend(handles=handles, loc="outside lower left", ncols=4)
    return tidy_ticks(figure)


@styled
def azimuth_error_figure(
    instruments: Mapping[str, tuple[Array, Array, Array]], azimuth_error_deg: float, title: str
) -> Figure:
    """Lateral standard deviation over depth: gyro terms against a fixed azimuth error, a panel an instrument.

    Parameters
    ----------
    instruments : name to depths (n,) m, unfiltered (n,) cm and filtered (n,) cm
    azimuth_error_deg : that of the filter, in place of the gyro terms
    """
    rows = -(-len(instruments) // 2)
    figure = new_figure(1.2 + 2.4 * rows, title)
    panels = figure.subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
    for axes in panels.flat[len(instruments) :]:
        axes.remove()
    for k, (axes, (name, (md, unfiltered, filtered))) in enumerate(zip(panels.flat, instruments.items(), strict=False)):
        axes.plot(md, above_zero(unfiltered), "o--", color=GREY)
        axes.plot(md, above_zero(filtered), "s-", color=SERIES[0])
        axes.set_title(name)
        if k % 2 == 0:
            axes.set_ylabel("Lateral standard deviation (cm)")
        if k + 2 >= len(instruments):
            axes.set_xlabel("Measured depth (m)")
            axes.tick_params(labelbottom=True)  # also where the panel below it is left out
    log_if_needed(panels[0, 0], [values for _, *both in instruments.values() for values in both])
    handles = [
        Line2D([], [], color=GREY, ls="--", marker="o", label="unfiltered: gyro terms"),
        Line2D([], [], color=SERIES[0], marker="s", label=f"filtered: azimuth error {azimuth_error_deg:g} deg"),
    ]
    figure.legend(handles=handles, loc="outside lower left", ncols=2)
    return tidy_ticks(figure)
