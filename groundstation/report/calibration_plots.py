"""Figures of calibrations: errors before and after, residuals, temperature curves, quality control, Allan deviation.

Units come with the numbers, angles in degrees.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import FixedLocator, NullLocator

from groundstation.calibration.allan_analysis import AXES, LONGEST_IN_FIT, AllanResult
from groundstation.calibration.applied_series import UNITS as SERIES_UNITS
from groundstation.calibration.applied_series import AppliedSeries
from groundstation.calibration.attitudes import AttitudeFit
from groundstation.calibration.mwd_model import ACCELEROMETER_AXES, Triad, temperature_powers
from groundstation.calibration.mwd_solve import MwdFit
from groundstation.calibration.quality import QualityReport
from groundstation.report.calibration_sheets import AttitudeErrors, TriadErrors
from groundstation.report.figure_panels import AFTER, BEFORE, COLOURS, LIMIT, Panel, row_of
from groundstation.report.style import GREY as QUIET
from groundstation.report.style import MARKERS, plain_text

Array = npt.NDArray[np.float64]
FEW = 24  # places that still have room for their names
LETTERS = 60  # of all names on one line
SMALLEST = 0.02  # of the median error after, below which none is drawn lower
HEADROOM = 1.6  # of a limit, the half height of a panel that shows it


def linear_panels(fit: AttitudeFit, at: AttitudeErrors) -> tuple[Panel, ...]:
    """Residuals at each attitude, and the errors before and after."""
    pair = (f"|reading \N{MINUS SIGN} truth|, {at.unit}", at.before, at.after)
    return (
        Panel("Residuals at each attitude", 2.3, lambda part: draw_residuals(part, at.names, fit.residuals, at.unit)),
        Panel("Errors before and after", 2.3, lambda part: before_after(part, at.names, [pair])),
    )


def triad_panels(
    fit: MwdFit, angle: tuple[str, Array], temperature: Array, before: TriadErrors, after: TriadErrors, nominal: float
) -> tuple[Panel, ...]:
    """Errors before and after, residuals over an angle (name, (n,) deg), temperature curves of 30 parameters."""
    accelerometers = fit.triad.axes == ACCELEROMETER_AXES
    unit, name = ("g", "tilt") if accelerometers else ("\N{MICRO SIGN}T", "dip")
    small = ("mg", 1e-3) if accelerometers else ("\N{MICRO SIGN}T", 1.0)
    pairs = [
        (f"|size error|, {unit}", before.size, after.size),
        (f"|{name} error|, deg", before.angle, after.angle),
    ]
    errors = [(f"size error, {small[0]}", after.size / small[1]), (f"{name} error, deg", after.angle)]
    numbers = [str(k + 1) for k in range(len(temperature))]
    panels = (
        Panel("Errors before and after", 2.3, lambda part: before_after(part, numbers, pairs)),
        Panel("Residuals at each attitude", 2.3, lambda part: over_angle(part, angle, temperature, errors)),
    )
    if fit.parameters == 12:
        return panels
    curves = Panel(
        "Scale factors and biases over the temperature",
        2.3,
        lambda part: temperature_curves(part, fit.triad, nominal, fit.temperatures, small),
    )
    return (*panels, curves)


def quality_panels(report: QualityReport) -> tuple[Panel, ...]:
    """The control over the tool face."""
    return (Panel("Readings over the tool face", 2.3, lambda part: draw_quality(part, report)),)


def allan_panels(results: Sequence[AllanResult], unit: str) -> tuple[Panel, ...]:
    """The curves."""
    return (Panel("Allan deviation", 2.9, lambda part: draw_allan_curves(part, results, unit)),)


def series_panels(found: Sequence[AppliedSeries]) -> tuple[Panel, ...]:
    """Readings in time before and after their calibrations, a panel a sensor."""
    return tuple(
        Panel(f"{series.sensor.capitalize()} in time", 2.1, lambda part, series=series: draw_series(part, series))  # type: ignore[misc]
        for series in found
    )


def draw_series(part: Figure | SubFigure, series: AppliedSeries) -> None:
    """Each axis of a sensor in time, before and after its calibration."""
    for k, axes in enumerate(row_of(part, 3, sharex=True)):
        for readings, name, colour in ((series.before, "before", BEFORE), (series.after, "after", AFTER)):
            axes.plot(series.times, readings[:, k], color=colour, lw=0.7, label=name)
        axes.set(xlabel="time, s", ylabel=f"{AXES[k]}, {SERIES_UNITS[series.sensor]}")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1)


def before_after(part: Figure | SubFigure, names: Sequence[str], pairs: Sequence[tuple[str, Array, Array]]) -> None:
    """Absolute errors (n,) of each reading before and after, one axes a pair (label with its unit, before, after)."""
    for axes, (label, before, after) in zip(row_of(part, len(pairs)), pairs, strict=True):
        place = np.arange(1, len(before) + 1)
        floor = SMALLEST * float(np.median(np.abs(after)))
        for error, name, style in ((before, "before", _open(BEFORE)), (after, "after", _filled(AFTER))):
            axes.plot(place, np.maximum(np.abs(error), floor), label=name, **style)
        if len(names) <= FEW:
            axes.vlines(place, *np.maximum(np.abs([before, after]), floor), color=BEFORE, lw=0.7, zorder=1)
        axes.set(yscale="log", ylabel=label)
        _places(axes, names)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.1, handletextpad=0.2)


def draw_residuals(part: Figure | SubFigure, names: Sequence[str], values: Array, unit: str) -> None:
    """Residuals (n, 3) of each axis over the attitudes, with one root mean square on either side of zero."""
    (axes,) = row_of(part, 1)
    rms = float(np.sqrt(np.mean(values**2)))
    axes.axhspan(-rms, rms, color=QUIET, alpha=0.12, lw=0, label=f"rms {rms:.3g} {unit}")
    axes.axhline(0.0, color=QUIET, lw=0.8)
    place = np.arange(1, len(values) + 1)
    for k in range(3):
        axes.plot(place + 0.12 * (k - 1), values[:, k], MARKERS[k], color=COLOURS[k], label=AXES[k])
    axes.set(ylabel=f"residual, {unit}")
    axes.grid(visible=False, axis="x")
    _places(axes, names)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderaxespad=0.1, handletextpad=0.4)


def over_angle(
    part: Figure | SubFigure, angle: tuple[str, Array], temperature: Array, errors: Sequence[tuple[str, Array]]
) -> None:
    """Residuals (n,) over an angle (name, (n,) deg), the colour is the temperature (n,) C where that varies."""
    warm = float(np.ptp(temperature)) > 1.0
    all_axes = row_of(part, len(errors))
    for axes, (label, error) in zip(all_axes, errors, strict=True):
        axes.axhline(0.0, color=QUIET, lw=0.8)
        dots = axes.scatter(
            angle[1], error, s=9, c=temperature if warm else AFTER, cmap="viridis" if warm else None, linewidths=0
        )
        axes.set(xlabel=angle[0], ylabel=label)
        if float(np.ptp(angle[1])) > 90.0:
            axes.xaxis.set_major_locator(FixedLocator(list(range(0, 361, 30 if max(angle[1]) <= 180.0 else 60))))
    if warm:
        bar = part.colorbar(dots, ax=all_axes, pad=0.01, aspect=30)
        bar.set_label("temperature, °C")
        bar.outline.set_visible(False)


def temperature_curves(
    part: Figure | SubFigure, triad: Triad, volts_per_unit: float, span: tuple[float, float], unit: tuple[str, float]
) -> None:
    """Scale factors (% off nominal) and biases over the temperatures ``span`` (C); ``unit`` has a name and a size."""
    low, high = span
    t = np.linspace(low, high, 200) if high - low > 1.0 else np.linspace(low - 0.5, high + 0.5, 2)
    powers = temperature_powers(t)
    scale = 100.0 * (powers @ triad.scale.T / volts_per_unit - 1.0)
    bias = powers @ triad.bias.T / unit[1]
    for axes, values, label in zip(
        row_of(part, 2), (scale, bias), ("scale factor off nominal, %", f"bias, {unit[0]}"), strict=True
    ):
        for k, name in enumerate(triad.axes):
            axes.plot(t, values[:, k], color=COLOURS[k], label=name)
        axes.axhline(0.0, color=QUIET, lw=0.8)
        axes.set(xlabel="temperature, °C", ylabel=label)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.1)


def draw_quality(part: Figure | SubFigure, report: QualityReport) -> None:
    """Inclination, azimuth and G_L over the tool face about their middle, between the limits of the spread."""
    face = np.degrees(report.tool_face)
    mean = float(np.angle(np.sum(np.exp(1j * report.azimuth))))
    series = (
        np.degrees(report.inclination),
        math.degrees(mean) % 360.0 + np.degrees(np.angle(np.exp(1j * (report.azimuth - mean)))),
        1e3 * report.gravity_size,
    )
    for axes, values, verdict in zip(row_of(part, 3), series, report.verdicts, strict=True):
        unit, scale = ("deg", math.degrees(1.0)) if verdict.unit == "rad" else ("mg", 1e3)
        limit, spread = scale * verdict.limit, scale * verdict.spread
        middle = float(values.min() + values.max()) / 2.0
        axes.axhspan(-limit / 2.0, limit / 2.0, color=QUIET, alpha=0.12, lw=0)
        for side in (-limit / 2.0, limit / 2.0):
            axes.axhline(side, color=LIMIT, lw=0.9, ls=(0, (4, 3)))
        axes.plot(face, values - middle, "o-", lw=0.8, color=AFTER if verdict.passed else LIMIT)
        half = HEADROOM * max(limit, spread) / 2.0
        axes.set(xlabel="tool face, deg", ylabel=f"{verdict.name} {_signed(-middle)}, {unit}", ylim=(-half, half))
        axes.xaxis.set_major_locator(FixedLocator(list(range(0, 361, 90))))
        axes.set_title(
            f"{'pass' if verdict.passed else 'FAIL'}: {spread:.2g} of {limit:.2g} {unit}",
            color=AFTER if verdict.passed else LIMIT,
        )


def draw_allan_curves(part: Figure | SubFigure, results: Sequence[AllanResult], unit: str) -> None:
    """Log-log curves with their confidence, the fit as far as it goes, and N and F read off it."""
    all_axes = row_of(part, len(results), sharey=True)
    for k, (axes, result) in enumerate(zip(all_axes, results, strict=True)):
        curve, error = result.deviation, result.deviation * result.confidence
        axes.fill_between(
            result.tau, np.maximum(curve - error, curve / 10.0), curve + error, color=COLOURS[k], alpha=0.22, lw=0,
            label="curve, 1 sigma" if k == 0 else None,
        )  # fmt: skip
        axes.plot(result.tau, curve, color=COLOURS[k], lw=1.0)
        tau = np.geomspace(0.1, result.tau[-1] * 3.0 / LONGEST_IN_FIT, 200)
        axes.plot(tau, _model(result, tau), color="black", lw=0.9, ls=(0, (4, 2)), label="fit" if k == 0 else None)
        axes.plot(1.0, result.random_walk.value, "D", color="black", ms=3.5, label="N, at 1 s" if k == 0 else None)
        axes.axhline(result.floor.value, color=QUIET, lw=0.9, ls=":", label="F" if k == 0 else None)
        axes.set(xscale="log", yscale="log", xlabel="averaging time, s")
        axes.set_title(f"{AXES[k]}: N {result.random_walk.value:#.3g}, F {result.floor.value:#.3g}", color=COLOURS[k])
        axes.yaxis.set_minor_locator(NullLocator())
    all_axes[0].set_ylabel(f"Allan deviation, {unit}")
    all_axes[0].legend(loc="lower left")


def _model(result: AllanResult, tau: Array) -> Array:
    walk = result.fit.rate_walk.value if result.fit.rate_walk is not None else 0.0
    return np.sqrt(result.random_walk.value**2 / tau + result.floor.value**2 + walk**2 * tau / 3.0)


def _places(axes: Axes, names: Sequence[str]) -> None:
    """Names below the places where they have room, else the numbers of the readings."""
    if len(names) > FEW:
        axes.set(xlabel="reading")
        return
    axes.xaxis.set_major_locator(FixedLocator(list(range(1, len(names) + 1))))
    tight = max(map(len, names)) * len(names) > LETTERS
    shown = [plain_text(name) for name in names]
    axes.set_xticklabels(shown, rotation=35 if tight else 0, ha="right" if tight else "center")


def _open(colour: str) -> dict[str, Any]:
    return {"ls": "", "marker": "o", "mfc": "white", "mec": colour, "mew": 1.0, "ms": 3.6}


def _filled(colour: str) -> dict[str, Any]:
    return {"ls": "", "marker": "o", "mfc": colour, "mec": colour, "mew": 0.4, "ms": 3.4}


def _signed(value: float) -> str:
    sign = "+" if value >= 0.0 else "\N{MINUS SIGN}"
    return f"{sign} {abs(value):.2f}"
