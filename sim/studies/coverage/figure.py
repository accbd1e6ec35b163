"""Claimed confidence against the share inside."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from groundstation.errors import SurveyError
from groundstation.report.style import GREY, LIGHT, MARKERS, SERIES, WRONG, new_figure, styled, tidy_ticks

Array = npt.NDArray[np.float64]


def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """One figure, of the toes."""
    toe = [row for row in result["cases"] if row["case"].startswith("plan ellipse, toe")]
    claimed, inside = (np.array([row[key] for row in toe]) / 100.0 for key in ("published", "ours"))
    title = f"Toes inside the claimed ellipse, {result['wells']} wells"
    return {"coverage": coverage_figure(claimed, {"plan ellipse at the toe": inside}, result["wells"], title)}


@styled
def coverage_figure(
    claimed: Array, observed: Mapping[str, Array], trials: int, title: str, band: float = 0.95
) -> Figure:
    """Share of trials that fell inside a region against the confidence claimed for it.

    Parameters
    ----------
    claimed : (n,) in (0, 1)
    observed : series to (n,)
    trials : independent ones behind every share
    band : probability of the binomial band; what is outside of it is marked

    Raises
    ------
    SurveyError
        When a confidence is not between 0 and 1, or there are no trials.
    """
    from scipy.special import bdtrik

    if trials < 1 or not np.all((claimed > 0.0) & (claimed < 1.0)):
        raise SurveyError(f"plot: expected confidences of 0..1 and trials, got {claimed.tolist()} and {trials}")

    def ends(confidence: Array) -> list[Array]:
        # a count k is within the central band when low <= k < high + 1, which is smooth in the confidence
        low, high = (np.nan_to_num(bdtrik(0.5 * (1.0 + s * band), trials, confidence)) for s in (-1.0, 1.0))
        return [low / trials, (high + 1.0) / trials]

    fine = np.linspace(0.001, 0.999, 400)
    (low, high), (at_low, at_high) = ends(fine), ends(claimed)
    low, high = np.maximum(low, 0.0), np.minimum(high, 1.0)
    figure = new_figure(3.9, title)
    share, difference = figure.subplots(1, 2)
    for axes, minus in ((share, 0.0), (difference, 1.0)):
        axes.fill_between(
            100.0 * fine, 100.0 * (low - minus * fine), 100.0 * (high - minus * fine), color=LIGHT, lw=0.0
        )
        axes.plot([0.0, 100.0], [0.0, 100.0 * (1.0 - minus)], color=GREY, lw=0.8)
        for k, values in enumerate(observed.values()):
            look: dict[str, Any] = {"ls": "", "marker": MARKERS[k % len(MARKERS)], "color": SERIES[k % len(SERIES)]}
            outside = (values < at_low - 1e-12) | (values > at_high - 1e-12)
            drawn = 100.0 * (values - minus * claimed)
            axes.plot(100.0 * claimed, drawn, clip_on=False, **look)
            axes.plot(100.0 * claimed[outside], drawn[outside], ls="", marker="o", ms=9.0, mfc="none", mec=WRONG,
                      mew=1.4, gid="outside")  # fmt: skip
        axes.set_xlabel("Claimed confidence (%)")
        axes.set_xlim(0.0, 100.0)
    share.set(ylabel="Observed share (%)", ylim=(0.0, 100.0), title="Coverage")
    difference.set(ylabel="Observed less claimed (percentage points)", title="Difference")
    handles = [
        Line2D([], [], ls="", marker=MARKERS[k % len(MARKERS)], color=SERIES[k % len(SERIES)], label=name)
        for k, name in enumerate(observed)
    ]
    handles.append(Line2D([], [], color=LIGHT, lw=6.0, label=f"{100.0 * band:g} % of {trials} trials"))
    handles.append(Line2D([], [], ls="", marker="o", ms=9.0, mfc="none", mec=WRONG, mew=1.4, label="outside"))
    figure.legend(handles=handles, loc="outside lower left", ncols=5)
    return tidy_ticks(figure)
