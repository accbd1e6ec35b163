"""Bias and matrix of a triad over the temperature, with everything that is written of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from groundstation.calibration.block import Array, Calibration, Provenance, to_json
from groundstation.calibration.coverage import COVERAGE, coverage_factor
from groundstation.calibration.laboratory_tables import check_range, line_error, read_table
from groundstation.calibration.landing_gates import (
    LARGEST_RESIDUAL,
    LARGEST_SHARE,
    SCALES,
    Gate,
    pass_gates,
    rows_twice,
)
from groundstation.calibration.temperature import TemperatureFit, fit_temperature_polynomials
from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome, naming_file
from groundstation.report.calibrations.calibration_request import UNITS, TemperatureRequest
from groundstation.report.sheet import Sheet, SheetTable, number_text

HEADER: Final = "temperature_c,true_x,true_y,true_z,x,y,z"
FEWEST: Final = 4  # temperatures
APART: Final = 3.0  # K, from which on two are two
COLDEST, HOTTEST = -60.0, 150.0  # C
AXES: Final = "xyz"


@dataclass(frozen=True, slots=True)
class WarmedRecord:
    """Readings (n, 3) of truths (n, 3) at temperatures (n,) C, in the unit of the file, with the file's lines (n,)."""

    temperature: Array
    truth: Array
    readings: Array
    lines: list[int]
    sha256: str


def answer_temperature(request: TemperatureRequest, day: str) -> CalibrationOutcome:
    """Polynomials of a triad, as a node applies them.

    Raises
    ------
    CalibrationError
        The file and line, what was expected and what came.
    """
    record = read_warmed(request.file, request.full_scale)
    si, sensor = UNITS[request.unit]
    reference = float(np.round(np.mean(record.temperature)))
    with naming_file(request.file):
        fit = fit_temperature_polynomials(
            record.truth, record.readings, record.temperature, reference, request.bias_degree, request.matrix_degree
        )
        forced = pass_gates(warmed_gates(record, fit, si, sensor), force=request.force)
    low, high = float(record.temperature.min()), float(record.temperature.max())
    held = temperatures_of(record.temperature)
    design = f"{len(held)} temperatures from {low:g} to {high:g} C, bias to power {request.bias_degree}, matrix to "
    design += f"{request.matrix_degree}" + "".join(f"; forced past {found}" for found in forced)
    block = block_of_fit(fit, si, sensor, provenance_of(record.sha256, day, design, fit, si), (low, high))
    degrees = len(record.truth) - (request.bias_degree + 1) - 3 * (request.matrix_degree + 1)
    factor = coverage_factor(max(degrees, 1))
    result = {
        "sensor": sensor,
        "unit": request.unit,
        "reference_c": reference,
        "valid_c": [low, high],
        "bias": fit.model.bias.tolist(),
        "matrix": fit.model.matrix.tolist(),
        "coverage": COVERAGE,
        "expanded_uncertainty": {
            "bias": (factor * fit.bias_std).tolist(),
            "matrix": (factor * fit.matrix_std).tolist(),
        },
        "residual_rms": fit.residual_rms(),
        "condition": fit.condition,
        "design": design,
        "forced": list(forced),
        "warnings": [],
        "date": day,
        "record_sha256": record.sha256,
        "block_sha256": block.sha256(),
    }
    sheet = temperature_sheet(fit, factor, request.unit, result)

    def panels() -> Sequence[Any]:
        from groundstation.report.rest_panels import warmth_panels

        return warmth_panels(fit, record.temperature, request.unit)

    return CalibrationOutcome(result, to_json(block), block.sha256(), record.sha256, sheet, panels)


def read_warmed(path: Path, limit: float) -> WarmedRecord:
    """Record of a file.

    Raises
    ------
    CalibrationError
        When it is none, has a temperature outside -60..150 C, a saturated reading or too few temperatures.
    """
    table = read_table(path, (HEADER,))
    rows = np.array([table.numbers(k, 0) for k in range(len(table.lines))])
    for line, row in zip(table.lines, rows, strict=True):
        if not COLDEST <= row[0] <= HOTTEST:
            raise line_error(table.name, line, f"a temperature of {COLDEST:g}..{HOTTEST:g} C", f"{row[0]:g}: kelvin?")
        check_range(table.name, line, table.header[4:], row[4:], limit)
    found = temperatures_of(rows[:, 0])
    if len(found) < FEWEST:
        got = ", ".join(f"{one:.3g}" for one in found)
        raise line_error(table.name, table.lines[-1], f"{FEWEST} temperatures or more, {APART:g} K apart", f"{got} C")
    return WarmedRecord(rows[:, 0], rows[:, 1:4], rows[:, 4:], table.lines, table.sha256)


def temperatures_of(temperature: Array) -> list[float]:
    """Temperatures that are `APART`, the lowest of each group."""
    found: list[float] = []
    for one in np.sort(temperature).tolist():
        if not found or one - found[-1] > APART:
            found.append(one)
    return found


def warmed_gates(record: WarmedRecord, fit: TemperatureFit, si: float, sensor: str) -> list[Gate]:
    """Gates of polynomials: sense and size of the axes at both ends, residuals, rows that stand twice."""
    ends = fit.model.matrix_at(np.array([record.temperature.min(), record.temperature.max()]))
    sizes = np.linalg.svd(ends, compute_uv=False)
    unknowns = len(fit.model.bias) + 3 * len(fit.model.matrix)
    noise = math.sqrt(float(np.sum(fit.residuals**2)) / (3 * max(len(record.truth) - unknowns, 1)))
    largest = LARGEST_RESIDUAL / si if sensor == "accelerometer" else LARGEST_SHARE * float(np.abs(record.truth).max())
    worst = record.lines[int(np.argmax(np.linalg.norm(fit.residuals, axis=1)))]
    pairs = rows_twice(np.column_stack([record.temperature, record.truth, record.readings]))
    return [
        Gate("right-handed", bool(np.all(np.linalg.det(ends) > 0.0)), "an axis is mirrored, or two are exchanged"),
        Gate(
            "scale",
            bool(sizes.min() >= SCALES[0] and sizes.max() <= SCALES[1]),
            f"the axes answer with {sizes.min():.3g} to {sizes.max():.3g} of the truth, expected {SCALES[0]} to "
            f"{SCALES[1]}",
        ),
        Gate(
            "residual", noise <= largest, f"{noise:.3g}, expected up to {largest:.3g}; the largest is in line {worst}"
        ),
        Gate("duplicates", not pairs, f"{len(pairs)} rows stand twice"),
    ]


def provenance_of(sha256: str, day: str, design: str, fit: TemperatureFit, si: float) -> Provenance:
    """Origin of the polynomials; a matrix has no unit, a bias is in SI."""
    return Provenance(
        sha256,
        day,
        design,
        si * fit.residual_rms(),
        fit.matrix_std[0],
        si * fit.bias_std[0],
        fit.matrix_std[1:],
        si * fit.bias_std[1:],
    )


def block_of_fit(
    fit: TemperatureFit, si: float, sensor: str, provenance: Provenance, valid: tuple[float, float]
) -> Calibration:
    """Parameters in SI as a node takes them, ``valid`` (C) where they were measured."""
    model = fit.model
    return Calibration(
        sensor,
        model.matrix[0],
        si * model.bias[0],
        model.matrix[1:],
        si * model.bias[1:],
        model.reference,
        provenance,
        valid,
    )


def temperature_sheet(fit: TemperatureFit, factor: float, unit: str, result: dict[str, Any]) -> Sheet:
    """Polynomials with the half widths of their intervals."""
    powers = [f"(T \N{MINUS SIGN} {fit.model.reference:g})^{p}" for p in range(len(fit.model.bias))]
    rows: Sequence[tuple[str, ...]] = [
        (f"b_{AXES[k]}", *(number_text(v, 4) for v in fit.model.bias[:, k])) for k in range(3)
    ]
    halves = [(f"b_{AXES[k]}", *(number_text(factor * v, 2) for v in fit.bias_std[:, k])) for k in range(3)]
    scales = [(f"M_{AXES[k]}{AXES[k]}", *(number_text(v, 5) for v in fit.model.matrix[:, k, k])) for k in range(3)]
    low, high = result["valid_c"]
    facts = [
        ("Method", result["design"].partition(";")[0]),
        ("Valid", f"{low:g} to {high:g} \N{DEGREE SIGN}C; beyond it a node says so and doubts the bias"),
        ("Residual rms", f"{number_text(fit.residual_rms(), 3)} {unit}"),
        *(("Forced past", found) for found in result["forced"]),
    ]
    tables = (
        SheetTable(f"Bias, {unit}", ("", *powers), rows),
        SheetTable(f"Half width of its 95 % interval, {unit}", ("", *powers), halves),
        SheetTable("Scale", ("", *powers[: len(fit.model.matrix)]), scales),
    )
    return Sheet(f"Calibration of {result['sensor']} over temperature", facts, tables, ())
