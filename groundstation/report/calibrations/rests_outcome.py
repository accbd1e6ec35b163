"""Accelerometer and gyroscope of a record of rests at unknown attitudes, with everything that is written of them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from groundstation.calibration.block import Array, Calibration, Provenance, to_json
from groundstation.calibration.gravity_sphere import GravityFit, fit_gravity_sphere
from groundstation.calibration.landing_gates import LARGEST_RESIDUAL, Gate, axes_gates, pass_gates
from groundstation.calibration.rest_finder import find_rests
from groundstation.calibration.turns_between_rests import TurnsFit, fit_turns
from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome, naming_file
from groundstation.report.calibrations.calibration_request import RestsRequest
from groundstation.report.sheet import Sheet, SheetTable, number_text
from telemetry.errors import CalibrationError
from telemetry.records.imu_record import ImuRecord, read_imu_record
from telemetry.records.understood_record import understood_line, understood_object

NO_SLOPES: Final = (np.zeros((0, 3, 3)), np.zeros((0, 3)))
USUAL_C: Final = 25.0  # of a block of a record without temperature
AXES: Final = "xyz"
LARGEST_TURN_DEG: Final = 1.0  # rms, of gravity turned beside gravity felt; two real MPU-9150 have 0.1


def answer_rests(request: RestsRequest, day: str) -> CalibrationOutcome:
    """Both sensors of a record; ``document`` is the accelerometer's block, ``gyroscope_document`` the other's.

    Raises
    ------
    CalibrationError, LoggerError
        The file and line, what was expected and what came.
    """
    record = read_imu_record(request.file, request.words.to_reading(request.rate), leave_out_repeats=True)
    force = record.triad("accelerometer")
    with naming_file(request.file):
        rests = find_rests(force, None, record.breaks)
        means = np.array([force[rest].mean(axis=0) for rest in rests]).reshape(-1, 3)
        fit = fit_gravity_sphere(means, request.gravity)
        forced = pass_gates(gravity_gates(fit, means, request.gravity), force=request.force)
        turns, why_not, overruled = turns_of(record, fit, force, force_past=request.force)
    warmth = USUAL_C if record.temperature is None else float(record.temperature.mean())
    design = f"{len(rests)} rests at unknown attitudes, |f| = {request.gravity:g} m/s2"
    design += "".join(f"; forced past {found}" for found in forced)
    rms = fit.residual_rms()
    block = block_of("accelerometer", fit, rms, design, record.sha256, day, warmth)
    other = None
    if turns is not None:
        how = f"{len(turns.residuals)} turns between rests, {rms_deg(turns.left_out):.3g} deg rms at turns not used"
        how += "".join(f"; forced past {found}" for found in overruled)
        other = block_of("gyroscope", turns, 0.0, how, record.sha256, day, warmth)
    result = rests_json(fit, turns, means, request.gravity) | {
        "why_no_gyroscope": why_not,
        "design": design,
        "forced": [*forced, *overruled],
        "warnings": [],
        "rests": [
            {"lines": [int(record.lines[rest.start]), int(record.lines[rest.stop - 1])], "residual": residual}
            for rest, residual in zip(rests, fit.residuals.tolist(), strict=True)
        ],
        "record": understood_object(record),
        "date": day,
        "record_sha256": record.sha256,
        "block_sha256": block.sha256(),
        "gyroscope_block_sha256": other.sha256() if other is not None else None,
    }
    sheet = rests_sheet(record, fit, turns, result)

    def panels() -> Sequence[Any]:
        from groundstation.report.rest_panels import rests_panels

        return rests_panels(np.linalg.norm(means, axis=1) - request.gravity, fit, turns)

    return CalibrationOutcome(
        result, to_json(block), block.sha256(), record.sha256, sheet, panels, to_json(other) if other else None
    )


def gravity_gates(fit: GravityFit, means: Array, gravity: float) -> list[Gate]:
    """Gates of an accelerometer from rests: residuals, rests that were not used, and what was there before."""
    before = float(np.sqrt(np.mean((np.linalg.norm(means, axis=1) - gravity) ** 2)))
    rms, left = fit.residual_rms(), fit.left_out_rms()
    sizes = np.linalg.svd(fit.matrix, compute_uv=False)
    return [
        Gate("residual", rms <= LARGEST_RESIDUAL, f"{rms:.3g} m/s2 of |f|, expected up to {LARGEST_RESIDUAL:g}"),
        Gate("halves", left <= 2.0 * LARGEST_RESIDUAL, f"{left:.3g} m/s2 of |f| at rests that were not used"),
        Gate("gain", rms < before, f"{rms:.3g} m/s2 after, {before:.3g} before: no better than uncalibrated"),
        Gate("scale", bool(sizes[-1] > 0.7 and sizes[0] < 1.4), f"axes answer with {sizes[-1]:.3g} to {sizes[0]:.3g}"),
    ]


def turns_of(
    record: ImuRecord, fit: GravityFit, force: Array, *, force_past: bool
) -> tuple[TurnsFit | None, str, tuple[str, ...]]:
    """Gyroscope by the turns between rests of both sensors, or the reason why there is none; findings overruled."""
    if record.rate is None:
        return None, "the record has no gyroscope", ()
    if record.stamps is None:
        return None, "the record has no times: expected --rate for the gyroscope", ()
    rests = find_rests(force, record.rate, record.breaks)
    if any(np.any(record.breaks[a.stop : b.start]) for a, b in itertools.pairwise(rests)):
        return None, "the record has a gap between two rests", ()
    means = np.array([force[rest].mean(axis=0) for rest in rests]).reshape(-1, 3)
    forces = (means - fit.bias) @ np.linalg.inv(fit.matrix).T
    up = forces / np.linalg.norm(forces, axis=1, keepdims=True)
    try:
        turns = fit_turns(record.rate, record.stamps.period, rests, up)
        return turns, "", pass_gates(turn_gates(turns), force=force_past)
    except CalibrationError as error:
        return None, str(error), ()


def turn_gates(turns: TurnsFit) -> list[Gate]:
    """Gates of a gyroscope from turns: its axes, in the accelerometer's frame, and turns that were not used."""
    left = rms_deg(turns.left_out)
    found = f"{left:.3g} deg rms at turns that were not used, expected up to {LARGEST_TURN_DEG:g}"
    return [*axes_gates(turns.matrix), Gate("turns", left <= LARGEST_TURN_DEG, found)]


def block_of(
    sensor: str, fit: GravityFit | TurnsFit, rms: float, design: str, sha256: str, day: str, warmth: float
) -> Calibration:
    """Parameters as a node takes them."""
    provenance = Provenance(sha256, day, design, rms, fit.matrix_std, fit.bias_std, *NO_SLOPES)
    return Calibration(sensor, fit.matrix, fit.bias, *NO_SLOPES, warmth, provenance)


def rests_json(fit: GravityFit, turns: TurnsFit | None, means: Array, gravity: float) -> dict[str, Any]:
    """Numbers of both sensors, SI, angles in deg."""
    before = float(np.sqrt(np.mean((np.linalg.norm(means, axis=1) - gravity) ** 2)))
    found: dict[str, Any] = {
        "sensor": "accelerometer",
        "unit": "m/s2",
        "matrix": fit.matrix.tolist(),
        "bias": fit.bias.tolist(),
        "standard_errors": {"matrix": fit.matrix_std.tolist(), "bias": fit.bias_std.tolist()},
        "before_rms": before,
        "residual_rms": fit.residual_rms(),
        "left_out_rms": fit.left_out_rms(),
        "condition": fit.condition,
        "gyroscope": None,
    }
    if turns is not None:
        found["gyroscope"] = {
            "unit": "rad/s",
            "matrix": turns.matrix.tolist(),
            "bias": turns.bias.tolist(),
            "standard_errors": {"matrix": turns.matrix_std.tolist(), "bias": turns.bias_std.tolist()},
            "turns": len(turns.residuals),
            "residual_rms_deg": rms_deg(turns.residuals),
            "left_out_rms_deg": rms_deg(turns.left_out),
            "uncalibrated_rms_deg": rms_deg(turns.uncalibrated),
        }
    return found


def rms_deg(angles: Array) -> float:
    """Root mean square of angles (n,) rad, in deg."""
    return math.degrees(float(np.sqrt(np.mean(angles**2))))


def rests_sheet(record: ImuRecord, fit: GravityFit, turns: TurnsFit | None, result: dict[str, Any]) -> Sheet:
    """Sheet of both sensors."""
    facts = [
        ("Record", understood_line(record)),
        ("Method", result["design"].partition(";")[0]),
        ("|f| beside gravity", f"{result['before_rms']:.4f} m/s2 rms before, {result['residual_rms']:.4f} after"),
        ("At rests not used", f"{result['left_out_rms']:.4f} m/s2 rms"),
    ]
    facts.extend(("Forced past", found) for found in result["forced"])
    tables = [_parameters("Accelerometer, m/s2", fit)]
    if turns is None:
        facts.append(("No gyroscope", result["why_no_gyroscope"]))
    else:
        judged = result["gyroscope"]
        text = f"{judged['left_out_rms_deg']:.3f} deg rms, by the bias alone {judged['uncalibrated_rms_deg']:.3f}"
        facts.append(("At turns not used", text))
        tables.append(_parameters("Gyroscope, rad/s", turns))
    return Sheet("Calibration from rests", facts, tables, ())


def _parameters(title: str, fit: GravityFit | TurnsFit) -> SheetTable:
    rows: Sequence[tuple[str, ...]] = [
        (AXES[k], *(number_text(v, 6) for v in (*fit.matrix[k], fit.bias[k])), number_text(fit.bias_std[k], 2))
        for k in range(3)
    ]
    return SheetTable(title, ("reading of", "from x", "from y", "from z", "bias", "1 sigma"), rows)
