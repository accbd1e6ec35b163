"""Figure of one survey: plan, two sections, uncertainty over depth.

Source: thesis figure 4.1. Frame: north, east, down; m unless a name says cm.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from groundstation.errors import SurveyError
from groundstation.report.style import (
    GREY,
    INK,
    MARKERS,
    MOST_ELLIPSES,
    NICE,
    SERIES,
    WRONG,
    draw_covariance_ellipse,
    in_unit,
    log_if_needed,
    new_figure,
    styled,
    tidy_ticks,
)
from groundstation.survey.requests.survey_answer import SurveyAnswer
from groundstation.survey.wall.column_deviation import ColumnDesign, axis_deviations
from groundstation.survey.well.ellipsoid import coverage_radius, probability_of

Array = npt.NDArray[np.float64]


def _spread(n: int) -> list[int]:
    """Stations whose ellipse is drawn: all, or evenly spread ones with the last."""
    step = -(-n // MOST_ELLIPSES)
    return list(range(n - 1, -1, -step))[::-1]


@styled
def survey_figure(
    md: Array, positions: Array, covs: Array, confidence: float, title: str, design: ColumnDesign | None = None
) -> Figure:
    """Plan, two sections and standard deviations of one hole.

    Parameters
    ----------
    md : (n,) m
    positions : (n, 3) m
    covs : (n, 3, 3) m^2
    confidence : of the ellipses, each in its plane, in (0, 1)
    design : its axis and tolerance are drawn along

    Raises
    ------
    SurveyError
        When the arrays do not fit each other or the confidence is not between 0 and 1.
    """
    n = len(md)
    if n < 2 or positions.shape != (n, 3) or covs.shape != (n, 3, 3):
        raise SurveyError(
            f"plot: expected (n,), (n, 3) and (n, 3, 3) with n >= 2, got {md.shape}, {positions.shape}, {covs.shape}"
        )
    sigma = coverage_radius(confidence, 2)
    off, limit = _off_axis(positions[-1], design)
    wrong = off > limit
    extent = float(np.ptp(positions[:, :2], axis=0).max())
    scale, unit = in_unit(extent if design is None else max(extent, design.tolerance.at(design.length)))
    figure = new_figure(8.6, title)
    (plan, stds), (north, east) = figure.subplots(2, 2, height_ratios=(1.0, 1.2))
    _plan(plan, positions, covs, sigma, design, scale)
    plan.set(xlabel=f"East ({unit})", ylabel=f"North ({unit})", title="Plan")
    toe: dict[str, Any] = {
        "marker": "v",
        "color": WRONG if wrong else INK,
        "mfc": "none",
        "mew": 1.5,
        "ms": 7.0,
        "ls": "",
    }
    plan.plot(*(scale * positions[-1, 1::-1]), **toe)
    plan.plot(*(scale * positions[0, 1::-1]), "s", color="white", mec=INK, ms=6.0, zorder=4)
    _sections((north, east), positions, covs, sigma, design, (scale, unit))
    for axes, column in ((north, 0), (east, 1)):
        axes.plot(scale * positions[-1, column], positions[-1, 2], **toe)
    _deviations(stds, md, covs)
    step = -(-n // MOST_ELLIPSES)
    which = "of every station" if step == 1 else f"of one station in {step}"
    toe_text = f"toe, MD {md[-1]:.1f} m"
    if design is not None:
        toe_text += f": {100.0 * off:.1f} cm off the axis, allowed {100.0 * limit:.1f} cm"
    handles = [
        Line2D([], [], color=INK, marker=".", label="hole and its stations"),
        Line2D([], [], color=SERIES[0], lw=1.0, label=f"{100.0 * confidence:.4g} % region {which}"),
        Line2D([], [], ls="", marker="s", color="white", mec=INK, ms=6.0, label="start"),
        Line2D([], [], label=toe_text, **toe),
    ]
    if design is not None:
        at = f"{design.tolerance.name} ({100.0 * design.tolerance.at(design.length):.1f} cm at {design.length:g} m)"
        handles.append(Line2D([], [], color=GREY, ls="-.", lw=1.0, label="design axis"))
        handles.append(Line2D([], [], color=GREY, ls="--", lw=1.0, label=f"tolerance {at}"))
    figure.legend(handles=handles, loc="outside lower left", ncols=2)
    return tidy_ticks(figure)


def _off_axis(position: Array, design: ColumnDesign | None) -> tuple[float, float]:
    """Distance (m) from the design axis and its tolerance (m) there."""
    if design is None:
        return 0.0, math.inf
    found = axis_deviations(np.zeros(1), position[None], np.zeros((1, 3, 3)), design)[0]
    return found.size, found.limit


def _plan(axes: Axes, positions: Array, covs: Array, sigma: float, design: ColumnDesign | None, scale: float) -> None:
    axes.set_aspect("equal", adjustable="datalim")
    axes.plot(scale * positions[:, 1], scale * positions[:, 0], ".-", color=INK, lw=1.0)
    for k in _spread(len(positions)):
        # the axes are east, north: both rows and columns the other way round
        draw_covariance_ellipse(
            axes, scale * positions[k, 1::-1], scale**2 * covs[k, 1::-1, 1::-1], sigma, fc="none", ec=SERIES[0]
        )
    if design is not None:
        angle = np.linspace(0.0, math.tau, 121)
        around = np.stack([np.cos(angle), np.sin(angle)], axis=-1) @ design.end.across
        circle = scale * (design.end.point + design.end.limit * around)
        axes.add_patch(Polygon(circle[:, 1::-1], fc="none", ec=GREY, ls="--", lw=1.0, gid="tolerance"))
        course = scale * design.points_at(np.linspace(0.0, design.length, 2 if design.plan is None else 25))
        axes.plot(course[:, 1], course[:, 0], "-.+", color=GREY, lw=1.0, markevery=[0, -1])
    axes.autoscale_view()
    axes.margins(0.08)


def _sections(
    both: tuple[Axes, Axes],
    positions: Array,
    covs: Array,
    sigma: float,
    design: ColumnDesign | None,
    lengths: tuple[float, str],
) -> None:
    """North and east over depth, both exaggerated by the same factor."""
    scale, unit = lengths
    spans = []
    for c, axes in enumerate(both):
        pair = [c, 2]
        unequal = np.array([scale, 1.0])
        axes.plot(scale * positions[:, c], positions[:, 2], ".-", color=INK, lw=1.0)
        for k in _spread(len(positions)):
            cov = covs[k][np.ix_(pair, pair)] * np.outer(unequal, unequal)
            draw_covariance_ellipse(axes, positions[k, pair] * unequal, cov, sigma, fc="none", ec=SERIES[0])
        if design is not None:
            _section_design(axes, design, c, scale)
        axes.autoscale_view()
        spans.append(np.ptp(axes.get_xlim()) / scale)
    depth = max(float(np.ptp(axes.get_ylim())) for axes in both)
    fits = 0.75 * depth / max(*spans, 1e-6)  # the panels are about three quarters as wide as high
    factor = max([k for k in NICE if k <= fits], default=1)
    for axes, name in zip(both, ("North", "East"), strict=True):
        axes.set_aspect(scale / factor, adjustable="datalim")
        axes.invert_yaxis()
        note = f", exaggerated {factor} times" if factor > 1 else ""
        axes.set(xlabel=f"{name} ({unit}){note}", ylabel="TVD (m)", title=f"Section {name.lower()} and down")


def _section_design(axes: Axes, design: ColumnDesign, c: int, scale: float) -> None:
    along = np.linspace(0.0, design.length, 25)
    centre, across = design.points_at(along), design.across_at(along)
    # outermost points of the circle around the axis in the direction of this section
    out = np.einsum("kai,ka->ki", across, across[:, :, c])
    reach = np.array([design.tolerance.at(s) for s in along])[:, None] * out / np.linalg.norm(out, axis=1)[:, None]
    axes.plot(scale * centre[:, c], centre[:, 2], "-.", color=GREY, lw=1.0)
    for edge in (centre - reach, centre + reach):
        axes.plot(scale * edge[:, c], edge[:, 2], "--", color=GREY, lw=1.0)


def _deviations(axes: Axes, md: Array, covs: Array) -> None:
    stds = np.sqrt(np.maximum(np.diagonal(covs, axis1=1, axis2=2), 0.0))
    scale, unit = in_unit(float(np.max(stds)))
    for k, name in enumerate(("north", "east", "TVD")):
        values = np.where(stds[:, k] > 0.0, scale * stds[:, k], np.nan)
        marker = MARKERS[k] if len(md) <= MOST_ELLIPSES else ""
        # north and east may be the same: the dashes let the line below show
        axes.plot(md, values, ("-", "--", "-.")[k], color=SERIES[k], marker=marker, ms=5.0 - k, label=name)
    log_if_needed(axes, [scale * stds])
    axes.set(xlabel="Measured depth (m)", ylabel=f"Standard deviation ({unit})", title="Standard deviations")
    axes.legend()


def draw_survey(answer: SurveyAnswer) -> Figure:
    """Figure of a survey as it was asked for, its regions of uncertainty at the sigma of the answer."""
    found, sigma = answer.found, answer.request.sigma
    frame = f"{found.frame.answer} north, depth from {found.frame.depths.answer}"
    title = f"{answer.request.file}, {answer.instrument}, {frame}, {sigma:g} sigma"
    return survey_figure(found.md, found.positions, found.uncertainty.cov, probability_of(sigma, 2), title)
