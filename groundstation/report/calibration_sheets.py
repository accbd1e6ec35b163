"""Sheets of the calibrations: what the terminal prints and a certificate certifies, angles in degrees."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.calibration.allan_analysis import AXES, AllanReading, AllanResult
from groundstation.calibration.allan_fit import Estimate
from groundstation.calibration.attitudes import AttitudeFit
from groundstation.calibration.bias_model import LEARNT, SPANS, FilterNoise
from groundstation.calibration.coverage import COVERAGE
from groundstation.calibration.mwd_model import ACCELEROMETER_AXES
from groundstation.calibration.mwd_solve import MwdErrors, MwdFit
from groundstation.calibration.quality import QualityReport
from groundstation.report.sheet import Sheet, SheetTable, column_texts, number_text

Array = npt.NDArray[np.float64]
LONG_LEVER = 10.0
Facts = Sequence[tuple[str, str]]


@dataclass(frozen=True, slots=True)
class AttitudeErrors:
    """Names (n,) of attitudes and the errors (n,) of their readings before and after, in ``unit``."""

    names: Sequence[str]
    unit: str
    before: Array
    after: Array


@dataclass(frozen=True, slots=True)
class TriadErrors:
    """Errors (n,) of an MWD triad at its readings: of the size (g or microtesla) and of tilt or dip (deg)."""

    size: Array
    angle: Array


def linear_sheet(title: str, fit: AttitudeFit, at: AttitudeErrors, matrix_unit: str, facts: Facts) -> Sheet:
    """Matrix and bias of G = M w + b; bias and residuals are in the unit of the readings."""
    std, bias_std = fit.matrix_std(), fit.bias_std()
    wide, bias_wide = fit.matrix_expanded(), fit.bias_expanded()
    cells = column_texts(fit.residuals.ravel())
    residual = [cells[k::3] for k in range(3)]
    worst = int(np.argmax(fit.levers))
    warnings = list[str]()
    if fit.levers[worst] > LONG_LEVER:
        warnings.append(
            f"one {at.unit} of error at attitude {at.names[worst]} moves a parameter by up to {fit.levers[worst]:.0f} "
            "units; hold it more than once, or lean further"
        )
    if fit.combined is not None and any(fit.combined.refuted):
        axes = ", ".join(itertools.compress(AXES, fit.combined.refuted))
        warnings.append(
            f"residuals of {axes} are smaller than the jig's stated errors leave them in 998 of 1000 records; "
            "intervals are those of the jig as stated: state it finer if it is"
        )
    tables = (
        SheetTable(
            f"Matrix M{matrix_unit} and bias b, {at.unit}",
            ("reading of", "from x", "from y", "from z", "bias"),
            [(AXES[i], *(number_text(v, 7) for v in (*fit.matrix[i], fit.bias[i]))) for i in range(3)],
        ),
        SheetTable(
            "Standard errors",
            ("reading of", "from x", "from y", "from z", "bias"),
            [(AXES[i], *(number_text(v, 3) for v in (*std[i], bias_std[i]))) for i in range(3)],
        ),
        SheetTable(
            f"Expanded uncertainty, {100.0 * COVERAGE:g} %: {expanded_uncertainty_text(fit)}",
            ("reading of", "from x", "from y", "from z", "bias"),
            [(AXES[i], *(number_text(v, 3) for v in (*wide[i], bias_wide[i]))) for i in range(3)],
        ),
        SheetTable(
            f"Residuals and errors, {at.unit}",
            ("attitude", "residual x", "y", "z", "lever", "error before", "after"),
            list(
                zip(
                    at.names,
                    *residual,
                    column_texts(fit.levers),
                    column_texts(at.before),
                    column_texts(at.after),
                    strict=True,
                )
            ),
        ),
    )
    ends = (
        ("Residual rms", f"{number_text(fit.residual_rms(), 4)} {at.unit}"),
        ("Degrees of freedom", "of known covariances" if fit.degrees is None else f"{fit.degrees} for each axis"),
        ("Design", f"{len(at.names)} attitudes, rank {fit.rank} of 4, condition {number_text(fit.condition, 4)}"),
    )
    return Sheet(title, (*facts, *ends), tables, warnings)


def expanded_uncertainty_text(fit: AttitudeFit) -> str:
    """Text on how the expanded uncertainty follows from the standard errors."""
    if fit.combined is not None:
        return "noise and jig together"
    return f"{number_text(fit.coverage_factor(), 3)} standard errors"


def triad_sheet(title: str, fit: MwdFit, facts: Facts) -> Sheet:
    """Coefficients of an MWD triad with their standard errors, and the errors they leave."""
    accelerometers = fit.triad.axes == ACCELEROMETER_AXES
    unit, angle = ("g", "tilt") if accelerometers else ("\N{MICRO SIGN}T", "dip")
    low, high = fit.temperatures
    ends = (
        ("Parameters", f"{fit.parameters}, SF in V/{unit}, B in {unit}, temperature in \N{DEGREE SIGN}C from 30"),
        ("Temperature", f"{number_text(low, 4)} to {number_text(high, 4)} \N{DEGREE SIGN}C"),
        ("Search", f"{fit.iterations} iterations, E = {number_text(fit.cost, 4)}"),
        (
            "Largest error elsewhere",
            f"{number_text(fit.predicted_size_std, 2)} {unit} and "
            f"{number_text(math.degrees(fit.predicted_angle_std), 2)} deg, one standard deviation",
        ),
    )
    errors = SheetTable(
        "Errors over the record",
        ("", f"size, largest, {unit}", "rms", f"{angle}, largest, deg", "rms"),
        [(name, *_errors(found)) for name, found in (("before", fit.before), ("after", fit.after))],
    )
    return Sheet(title, (*facts, *ends), (errors, *_coefficients(fit)), fit.warnings)


def quality_sheet(report: QualityReport, facts: Facts) -> Sheet:
    """Verdicts and the readings behind them."""
    verdicts = []
    for v in report.verdicts:
        scale, unit = (math.degrees(1.0), "deg") if v.unit == "rad" else (1.0, v.unit)
        verdict = "pass" if v.passed else "FAIL"
        verdicts.append((v.name, number_text(scale * v.spread, 3), number_text(scale * v.limit, 3), unit, verdict))
    rows = [
        (f"{face:.2f}", f"{inclination:.4f}", f"{azimuth:.3f}", f"{size:.5f}")
        for face, inclination, azimuth, size in zip(
            *(np.degrees(c) for c in (report.tool_face, report.inclination, report.azimuth)),
            report.gravity_size,
            strict=True,
        )
    ]
    return Sheet(
        "MWD quality control",
        (("Verdict", "PASS" if report.passed else "FAIL"), *facts),
        (
            SheetTable("Spread over the tool faces", ("quantity", "spread", "limit", "unit", "verdict"), verdicts),
            SheetTable("Readings", ("tool face, deg", "inclination, deg", "azimuth, deg", "G_L, g"), rows),
        ),
    )


def allan_sheet(
    results: Sequence[AllanResult],
    noises: Sequence[FilterNoise],
    drifts: Sequence[list[dict[str, Any]]],
    unit: str,
    facts: Facts,
) -> Sheet:
    """Terms of the fit with their 95 % intervals, the raw readings beside them, what the filter takes and predicts."""
    terms, raw, taken, drifted, warnings = [], [], [], [], []
    for name, result, noise, drift in zip(AXES, results, noises, drifts, strict=False):
        walk = result.fit.rate_walk
        terms.append(
            (name, *_interval(result.random_walk), *_interval(result.floor), number_text(walk.value, 3) if walk else "")
        )
        low = result.raw_minimum
        raw.append((name, *_reading(result.raw_at_1s), number_text(low.tau, 4), *_reading(low)))
        bound = "at most, none is seen" if noise.is_bound else ""
        taken.append((name, *(number_text(v, 4) for v in (noise.white, noise.bias_std, noise.bias_tau)), bound))
        drifted.append((name, *(_drift(one[of]) for one in drift for of in ("predicted", "seen"))))
        if not result.fit.consistent:
            warnings.append(
                f"axis {name}: the curve is not of the fitted shape, chi^2 {result.fit.chi2:.0f} of "
                f"{result.fit.degrees} degrees of freedom; the intervals are widened by it"
            )
    rooted = f"{unit}/\N{SQUARE ROOT}Hz"
    tables = (
        SheetTable(
            f"Fit: N, {rooted}, and F, {unit}", ("axis", "N", "95 % from", "to", "F", "95 % from", "to", "K"), terms
        ),
        SheetTable(
            f"Raw readings of the curve, {unit}",
            ("axis", "at 1 s", "1 sigma", "minimum at, s", "minimum", "1 sigma"),
            raw,
        ),
        SheetTable(
            f"For the filter: white, {rooted}, bias, {unit}", ("axis", "white", "bias", "correlation, s", ""), taken
        ),
        SheetTable(
            f"Drift after {LEARNT:g} s at rest, {unit.removesuffix('/s')}{'' if unit.endswith('/s') else ' s'}",
            ("axis", *(text for span in SPANS for text in (f"in {span:g} s", "seen"))),
            drifted,
        ),
    )
    return Sheet("Allan deviation", facts, tables, warnings)


def _drift(size: float | None) -> str:
    return "" if size is None else number_text(size, 3)


def _errors(found: MwdErrors) -> tuple[str, ...]:
    angles = math.degrees(found.angle_max), math.degrees(found.angle_rms)
    return tuple(number_text(v, 3) for v in (found.size_max, found.size_rms, *angles))


def _coefficients(fit: MwdFit) -> tuple[SheetTable, ...]:
    """Polynomials a row each with their standard errors, and the misalignments."""
    powers = range(1 if fit.parameters == 12 else 4)
    columns = ("coefficient of", *(f"(T \N{MINUS SIGN} 30)^{p}" for p in powers))
    named = [
        (f"{kind}_{axis}", [f"{kind}_{axis}{p}" for p in powers]) for kind in ("SF", "B") for axis in fit.triad.axes
    ]
    values = [(name, *(number_text(fit.coefficients[n]) for n in of)) for name, of in named]
    stds = [(name, *(number_text(fit.standard_errors[n], 2) for n in of)) for name, of in named]
    crossed = [
        (name, f"{1e3 * value:.4f}".replace("-", "\N{MINUS SIGN}"), f"{1e3 * fit.standard_errors[name]:.4f}")
        for name, value in fit.coefficients.items()
        if name.startswith("m_")
    ]
    return (
        SheetTable("Scale factors and biases", columns, values),
        SheetTable("Standard errors of scale factors and biases", columns, stds),
        SheetTable("Misalignments, mrad", ("", "value", "standard error"), crossed),
    )


def _interval(found: Estimate) -> tuple[str, ...]:
    return tuple(number_text(value, 4) for value in (found.value, found.low, found.high))


def _reading(found: AllanReading) -> tuple[str, str]:
    return number_text(found.deviation, 4), f"{100.0 * found.confidence:.2g} %"
