"""Error of the z bias over time, by tuning factor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from groundstation.report.style import GREY, SERIES, new_figure, styled, tidy_ticks
from sim.studies.tuning.run import RESIDUAL_DPS

Array = npt.NDArray[np.float64]


def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """One figure, a panel a factor."""
    series = {name: (trace["t"], trace["bias"]) for name, trace in result["traces"].items()}
    groups = {
        f"Factor {letter}": {name: both for name, both in series.items() if name.startswith(("A = B", letter))}
        for letter in "BA"
    }
    return {"tuning": bias_figure(groups, abs(RESIDUAL_DPS), f"Tuning factors, {result['seeds']} seeds")}


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
    return tidy_ticks(figure)
