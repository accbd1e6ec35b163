"""Figures of calibrations from rests and over the temperature: before and after, and what the fit did not use."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure, SubFigure

from groundstation.calibration.allan_analysis import AXES
from groundstation.calibration.gravity_sphere import GravityFit
from groundstation.calibration.temperature import TemperatureFit
from groundstation.calibration.turns_between_rests import TurnsFit
from groundstation.report.calibration_plots import before_after
from groundstation.report.figure_panels import COLOURS, Panel, row_of
from groundstation.report.style import GREY, MARKERS

Array = npt.NDArray[np.float64]
CURVE: Final = 200  # points


def rests_panels(before: Array, fit: GravityFit, turns: TurnsFit | None) -> tuple[Panel, ...]:
    """Error of gravity (n,) m/s^2 at each rest before and after, and of turns in deg by a fit that did not use them."""
    size = "error of gravity, m/s\N{SUPERSCRIPT TWO}"
    panels = [
        before_after_panel("Gravity at each rest", size, before, fit.residuals),
        before_after_panel("Gravity at rests that a fit did not use", size, before, fit.left_out),
    ]
    if turns is not None:
        bare, left = np.degrees(turns.uncalibrated), np.degrees(turns.left_out)
        panels.append(before_after_panel("Turns that a fit did not use", "error, deg", bare, left))
    return tuple(panels)


def before_after_panel(caption: str, label: str, before: Array, after: Array) -> Panel:
    """Errors (n,) of numbered readings before and after, with their unit in the label."""
    names = [str(k + 1) for k in range(len(before))]
    return Panel(caption, 2.0, lambda part: before_after(part, names, [(label, before, after)]))


def warmth_panels(fit: TemperatureFit, temperature: Array, unit: str) -> tuple[Panel, ...]:
    """Bias and scale over the temperatures (n,) C of a record, and what is left of its readings."""
    return (
        Panel("Bias and scale over the temperature", 2.3, lambda part: draw_warmth(part, fit, temperature, unit)),
        Panel("Residuals", 2.3, lambda part: draw_left(part, fit.residuals, temperature, unit)),
    )


def draw_warmth(part: Figure | SubFigure, fit: TemperatureFit, temperature: Array, unit: str) -> None:
    """Curves of each axis as a node follows them."""
    at = np.linspace(temperature.min(), temperature.max(), CURVE)
    scale = 100.0 * (np.diagonal(fit.model.matrix_at(at), axis1=-2, axis2=-1) - 1.0)
    curves = ((fit.model.bias_at(at), f"bias, {unit}"), (scale, "scale factor off nominal, %"))
    for axes, (values, label) in zip(row_of(part, 2), curves, strict=True):
        for k in range(3):
            axes.plot(at, values[:, k], color=COLOURS[k], label=AXES[k])
        axes.axhline(0.0, color=GREY, lw=0.8)
        axes.set(xlabel="temperature, \N{DEGREE SIGN}C", ylabel=label)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.1)


def draw_left(part: Figure | SubFigure, residuals: Array, temperature: Array, unit: str) -> None:
    """Residuals (n, 3) over the temperature."""
    (axes,) = row_of(part, 1)
    axes.axhline(0.0, color=GREY, lw=0.8)
    for k in range(3):
        axes.plot(temperature, residuals[:, k], MARKERS[k], color=COLOURS[k], label=AXES[k])
    axes.set(xlabel="temperature, \N{DEGREE SIGN}C", ylabel=f"residual, {unit}")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.1)
