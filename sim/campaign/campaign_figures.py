"""Pictures of a campaign: NEES and coverage over hops, errors over depth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from groundstation.report.style import GREY, MARKERS, SERIES, log_if_needed, new_figure, styled, tidy_ticks

Rows = Sequence[dict[str, Any]]


@styled
def honesty_figure(rows: Rows, title: str) -> Figure:
    """NEES without and with joints, and the share of errors inside the 95 % interval stated, with intervals."""
    figure = new_figure(3.4, title)
    grid = figure.subplots(1, 3, squeeze=False)[0]
    shown = (
        ("nees", "nees_low", "nees_high", "NEES, filter alone", 1.0),
        ("nees_total", "nees_total_low", "nees_total_high", "NEES with joints and mount", 1.0),
        ("inside_95_percent", "inside_low", "inside_high", "Inside 95 % (%)", 95.0),
    )
    for axes, (middle, low, high, label, honest) in zip(grid, shown, strict=True):
        axes.axhline(honest, color=GREY, lw=0.8)
        for k, state in enumerate(dict.fromkeys(row["state"] for row in rows)):
            of = [row for row in rows if row["state"] == state]
            value = np.array([row[middle] for row in of])
            bars = np.abs(np.array([[row[low] for row in of], [row[high] for row in of]]) - value)
            place = [row["hop"] + 0.15 * k for row in of]
            axes.errorbar(place, value, np.nan_to_num(bars), ls="", marker=MARKERS[k], color=SERIES[k], label=state)
        axes.set(xlabel="Hop", ylabel=label)
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=2)
    return tidy_ticks(figure)


@styled
def accuracy_figure(rows: Rows, title: str) -> Figure:
    """Error of inclination and azimuth of single surveys over depth."""
    figure = new_figure(3.0, title)
    axes = figure.subplots()
    depth = [row["md_m"] for row in rows]
    azimuth = np.array([row["azimuth_rms_deg"] for row in rows])
    bars = np.abs(np.array([[r["azimuth_low_deg"] for r in rows], [r["azimuth_high_deg"] for r in rows]]) - azimuth)
    axes.errorbar(depth, azimuth, np.nan_to_num(bars), ls="", marker=MARKERS[0], color=SERIES[0], label="azimuth")
    inclination = np.array([row["inclination_rms_deg"] for row in rows])
    axes.plot(depth, inclination, ls="", marker=MARKERS[1], color=SERIES[1], label="inclination")
    axes.set(xlabel="Measured depth (m)", ylabel="Error of one survey, rms (deg)")
    log_if_needed(axes, [azimuth[np.isfinite(azimuth)], inclination])
    axes.legend()
    return tidy_ticks(figure)
