"""Allan deviation of a static record, with everything that is written of it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.calibration.allan_analysis import (
    AXES,
    AllanResult,
    analyse_allan_deviation,
)
from groundstation.calibration.bias_model import LEARNT, SPANS, FilterNoise, drift_std, fit_bias_model, seen_drift
from groundstation.calibration.laboratory_tables import check_range
from groundstation.report.calibration_sheets import allan_sheet
from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome, naming_file
from groundstation.report.calibrations.calibration_request import AllanRequest, RecordWords
from telemetry.errors import RecordError
from telemetry.records.imu_record import ImuRecord, has_bare_triad, read_imu_record
from telemetry.records.known_columns import FIELD, FORCE, RATE, UNITS, known_unit
from telemetry.records.understood_record import understood_line, understood_object


def answer_allan(request: AllanRequest, day: str) -> CalibrationOutcome:
    """Angle random walk and bias floor of each axis, fitted and read off the curve, with their intervals.

    Raises
    ------
    CalibrationError, RecordError
        The file and line, what was expected and what came.
    """
    record, found, unit = static_readings(request)
    part = record.longest_stretch()
    rate = record.row_rate()
    with naming_file(request.file):
        curves = analyse_allan_deviation(found[part], rate)
    noises = [fit_bias_model(result.tau, result.deviation, result.confidence) for result in curves]
    drifts = [drift_json(noise, found[part, k], rate) for k, noise in enumerate(noises)]
    count = part.stop - part.start
    axes = {
        name: allan_axis_json(curve, noise, drift)
        for name, curve, noise, drift in zip(AXES, curves, noises, drifts, strict=True)
    }
    lines = [int(record.lines[part.start]), int(record.lines[part.stop - 1])]
    result = {
        "axes": axes,
        "unit": unit,
        "rate_hz": rate,
        "readings": count,
        "duration_s": count / rate,
        "lines": lines,
        "record": understood_object(record),
    }
    result |= {"date": day, "record_sha256": record.sha256}
    facts = [
        ("Record", understood_line(record)),
        ("Readings", f"{count} at {rate:.6g} Hz, {count / rate:.1f} s"),
        ("Unit", unit),
    ]
    if count < len(record.lines):
        facts.insert(1, ("Used", f"lines {lines[0]} to {lines[1]}, the longest stretch without a fault"))

    def panels() -> Sequence[Any]:
        from groundstation.report.calibration_plots import allan_panels

        return allan_panels(curves, unit)

    text = json.dumps(result, indent=1, allow_nan=False) + "\n"
    return CalibrationOutcome(
        result, text, None, record.sha256, allan_sheet(curves, noises, drifts, unit, facts), panels
    )


def static_readings(request: AllanRequest) -> tuple[ImuRecord, npt.NDArray[np.float64], str]:
    """Record, readings (n, 3) of the sensor that is asked for, and the unit they are in.

    Raises
    ------
    RecordError
        When the record cannot be read so.
    CalibrationError
        When a reading is at its full scale.
    """
    words = request.words
    if not (words.gyro or words.accel or words.mag):
        words = _with_unit(words, request)
    record = read_imu_record(request.file, words.to_reading(request.rate), leave_out_repeats=True)
    sensor = request.sensor or next(name for name in (RATE, FORCE, FIELD) if name in record.placed)
    values = record.triad(sensor)
    unit = request.unit or record.placed[sensor].unit.split()[-1]
    known = known_unit(sensor, unit)
    if known not in UNITS[sensor]:
        raise RecordError(f"unit: expected one of the {sensor}, {', '.join(UNITS[sensor])}, got {unit!r}")
    readings = values / UNITS[sensor][known]
    for k in np.flatnonzero(np.any(np.abs(readings) >= request.full_scale, axis=1))[:1]:
        names = list(record.placed[sensor].names)
        check_range(record.name, int(record.lines[k]), names, readings[k], request.full_scale)
    return record, readings, known


def _with_unit(words: RecordWords, request: AllanRequest) -> RecordWords:
    """Unit of a file whose columns are x,y,z and say nothing: that of the answer, deg/s by default."""
    unit = request.unit or ("m/s2" if request.sensor == FORCE else "uT" if request.sensor == FIELD else "deg/s")
    if not has_bare_triad(request.file, words.columns):
        return words
    told = {RATE: replace(words, gyro=unit), FORCE: replace(words, accel=unit), FIELD: replace(words, mag=unit)}
    for quantity, meant in told.items():
        if known_unit(quantity, unit) in UNITS[quantity] and request.sensor in (None, quantity):
            return meant
    return words


def drift_json(noise: FilterNoise, record: npt.NDArray[np.float64], rate: float) -> list[dict[str, Any]]:
    """Drift of an axis without aiding, predicted and seen: 60 s at rest, then some seconds more, in unit s."""
    return [
        {"after_s": span, "predicted": drift_std(noise, span), "seen": seen_drift(record, rate, span)} for span in SPANS
    ]


def allan_axis_json(result: AllanResult, noise: FilterNoise, drift: list[dict[str, Any]]) -> dict[str, Any]:
    """One axis of the JSON object: the fit with its 95 % intervals, the raw readings with one sigma (relative)."""
    fit, minimum = result.fit, result.raw_minimum
    return {
        "random_walk": fit.random_walk.value,
        "bias_instability": fit.floor.value,
        "rate_random_walk": fit.rate_walk.value if fit.rate_walk is not None else None,
        "tau_s": minimum.tau,
        "confidence": {
            "random_walk": [fit.random_walk.low, fit.random_walk.high],
            "bias_instability": [fit.floor.low, fit.floor.high],
        },
        "standard_errors": {"random_walk": fit.random_walk.std, "bias_instability": fit.floor.std},
        "raw": {
            "at_1s": result.raw_at_1s.deviation,
            "at_1s_confidence": result.raw_at_1s.confidence,
            "minimum": minimum.deviation,
            "minimum_tau_s": minimum.tau,
            "minimum_confidence": minimum.confidence,
        },
        "curve": {
            "tau_s": result.tau.tolist(),
            "deviation": result.deviation.tolist(),
            "confidence": result.confidence.tolist(),
        },
        "consistent": fit.consistent,
        "filter": asdict(noise) | {"learnt_s": LEARNT, "drift": drift},
    }
