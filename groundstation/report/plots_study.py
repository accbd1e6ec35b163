"""Figures of studies: what the uncertainty of a survey is made of and worth.

Source: thesis figures 4.5-4.7, 4.24-4.37. Frame: north, east, down; cm.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from groundstation.errors import SurveyError
from groundstation.report.style import (
    GREY,
    LIGHT,
    MARKERS,
    SERIES,
    WRONG,
    log_if_needed,
    new_figure,
    styled,
    tidy,
)

Array = npt.NDArray[np.float64]


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
            axes.plot(md, _above_zero(ours[:, c]), label=name, **look)
            shown.append(ours[:, c])
            if printed is not None:
                marker = MARKERS[k % len(MARKERS)]
                axes.plot(md, _above_zero(printed[:, c]), ls="--", lw=0.8, marker=marker, **look)
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
    return tidy(figure)


def _above_zero(values: Array) -> Array:
    """Zero has no place on a logarithmic axis."""
    return np.where(values > 0.0, values, np.nan)


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
        axes.plot(md, _above_zero(unfiltered), "o--", color=GREY)
        axes.plot(md, _above_zero(filtered), "s-", color=SERIES[0])
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
    return tidy(figure)


@styled
def weighting_figure(
    changes_deg: Array,
    errors_cm: Mapping[str, Array],
    quantity: str,
    title: str,
    published: Mapping[str, tuple[Array, Array]] | None = None,
) -> Figure:
    """Error that remains at a station whose hole moved, by weighting scheme, and its reduction against ``equal``.

    Parameters
    ----------
    changes_deg : (n,) of ``quantity`` (inclination, azimuth)
    errors_cm : scheme to (n,), ``equal`` among them
    published : scheme to changes (m,) deg and errors (m,) cm

    Raises
    ------
    SurveyError
        When there are no errors of equal weights.
    """
    if "equal" not in errors_cm:
        raise SurveyError(f"plot: expected the scheme equal to compare with, got {', '.join(errors_cm) or 'none'}")
    figure = new_figure(3.9, title)
    remaining, reduction = figure.subplots(1, 2)
    equal = _above_zero(np.abs(errors_cm["equal"]))
    few = len(changes_deg) <= 40
    for k, (name, errors) in enumerate(errors_cm.items()):
        look = {"color": SERIES[k % len(SERIES)], "marker": MARKERS[k % len(MARKERS)], "ms": 3.0 if few else 0.0}
        remaining.plot(changes_deg, np.abs(errors), label=name, **look)
        reduction.plot(changes_deg, 100.0 * (1.0 - np.abs(errors) / equal), **look)
        for points in [published[name]] if published and name in published else []:
            remaining.plot(*points, ls="", marker="x", ms=10.0, mew=1.2, color=look["color"], gid="published")
    handles, _ = remaining.get_legend_handles_labels()
    if published:
        handles.append(Line2D([], [], ls="", marker="x", ms=10.0, mew=1.2, color=GREY, label="published"))
    for axes in (remaining, reduction):
        axes.set_xlabel(f"Change of {quantity} (deg)")
        axes.set_ylim(bottom=0.0)
    remaining.set(ylabel="Remaining error (cm)", title="Remaining error")
    reduction.set(ylabel="Reduction against equal weights (%)", title="Reduction", ylim=(-2.0, 100.0))
    figure.legend(handles=handles, loc="outside lower left", ncols=6)
    return tidy(figure)


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
    return tidy(figure)
