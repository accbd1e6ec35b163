"""Ellipsoids against the chi-square that they are to follow."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from groundstation.report.style import SERIES, new_figure, styled


@styled
def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """Share of rigs whose position is inside the region of a probability, at three stations."""
    from scipy.stats import chi2

    squares = result["traces"]["squares"]
    probability = np.linspace(0.01, 0.99, 99)
    figure = new_figure(3.4, f"Regions of {result['seeds']} rigs against what they are to hold")
    axes = figure.subplots()
    axes.plot(probability, probability, color="0.6", linewidth=0.8)
    for place, color in zip((0, squares.shape[1] // 2, squares.shape[1] - 1), SERIES, strict=False):
        held = [float(np.mean(squares[:, place] <= chi2.ppf(p, 3))) for p in probability]
        axes.plot(probability, held, color=color, label=f"station {place + 1}")
    axes.set(xlabel="stated probability of the ellipsoid", ylabel="share of rigs inside", xlim=(0, 1), ylim=(0, 1))
    axes.legend()
    return {result["experiment"]: figure}
