"""What remains at station 2 when the hole moves, by weighting scheme. Source: thesis figures 4.28-4.37."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from groundstation.errors import SurveyError
from groundstation.report.style import GREY, MARKERS, SERIES, above_zero, new_figure, styled, tidy_ticks
from sim.studies.weighting.run import AZIMUTH_DEG, INCLINATION_DEG

Array = npt.NDArray[np.float64]
BEFORE_DEG = {"inclination": INCLINATION_DEG, "azimuth": AZIMUTH_DEG}
STATION = 2


def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """One figure an angle."""
    found = {}
    for angle, before in BEFORE_DEG.items():
        rows = [row for row in result["sweeps"] if row["changed"] == angle and row["station"] == STATION]
        values = np.array(sorted({row["value_deg"] for row in rows}))
        errors = {
            scheme: np.array([np.hypot(r["north_cm"], r["east_cm"]) for r in rows if r["scheme"] == scheme])
            for scheme in dict.fromkeys(row["scheme"] for row in rows)
        }
        title = f"Error left at station {STATION} when its {angle} changed"
        found[f"weighting-{angle}"] = weighting_figure(values - before, errors, angle, title)
    return found


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
    equal = above_zero(np.abs(errors_cm["equal"]))
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
    return tidy_ticks(figure)
