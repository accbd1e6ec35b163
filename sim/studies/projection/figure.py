"""Share inside the cone, scores beside those of two simple guesses, and chances beside how often it was so."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from groundstation.report.style import GREY, LIGHT, MARKERS, SERIES, new_figure, styled, tidy_ticks
from sim.studies.projection.run import INSIDE, STRETCHES

SCORES = (
    ("score_cm", "as foreseen"),
    ("score_constant_cm", "curvature of now"),
    ("score_straight_cm", "straight on"),
)


@styled
def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """One figure of three panels."""
    figure = new_figure(3.2, f"Where {result['holes']} holes end, foreseen from every depth")
    inside, scores, chances = figure.subplots(1, 3)
    _draw_inside(inside, result["cases"])
    _draw_scores(scores, result["cases"])
    _draw_reliability(chances, result["reliability"])
    return {"projection": tidy_ticks(figure)}


def _draw_inside(axes: Axes, rows: list[dict[str, Any]]) -> None:
    depths = [row["depth_m"] for row in rows]
    axes.axhspan(*INSIDE, color=LIGHT, lw=0.0)
    axes.axhline(95.0, color=GREY, lw=0.8)
    axes.plot(depths, [row["inside_percent"] for row in rows], marker=MARKERS[0], color=SERIES[0])
    axes.set(xlabel="Foreseen from (m)", ylabel="Ends inside the cone (%)", ylim=(85.0, 100.0), title="Cone of 95 %")


def _draw_scores(axes: Axes, rows: list[dict[str, Any]]) -> None:
    depths = [row["depth_m"] for row in rows]
    for place, (key, name) in enumerate(SCORES):
        look = {"marker": MARKERS[place], "color": SERIES[place], "label": name}
        axes.semilogy(depths, [row[key] for row in rows], **look)
    axes.set(xlabel="Foreseen from (m)", ylabel="Score (cm, less is better)", title="Ranked probability")
    axes.legend(loc="lower left")


def _draw_reliability(axes: Axes, rows: list[dict[str, Any]]) -> None:
    axes.plot([0.0, 100.0], [0.0, 100.0], color=GREY, lw=0.8)
    for place, stretch in enumerate(list(STRETCHES)[1:]):
        stated, observed, number = (
            np.array([row[key] for row in rows if row["from"] == stretch])
            for key in ("stated_percent", "observed_percent", "holes")
        )
        share = np.clip(observed / 100.0, 0.5 / number, 1.0 - 0.5 / number)
        bars = 196.0 * np.sqrt(share * (1.0 - share) / number)
        marker, color, name = MARKERS[1 - place], SERIES[1 - place], f"from {stretch}"
        axes.errorbar(
            stated, observed, bars, ls="", marker=marker, color=color, elinewidth=0.8, clip_on=False, label=name
        )
    axes.set(xlabel="Chance stated (%)", ylabel="Ended within (%)", xlim=(0.0, 100.0), ylim=(0.0, 100.0))
    axes.set_title("Chance of ending within")
    axes.legend(loc="upper left")
