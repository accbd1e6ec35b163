"""Allan deviation of a static record, with everything that is written of it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from groundstation.calibration.allan_analysis import (
    AXES,
    AllanResult,
    FilterNoise,
    analyse_allan_deviation,
    filter_noise_of,
)
from groundstation.calibration.calibration_records import read_static
from groundstation.report.calibration_sheets import allan_sheet
from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome, naming_file
from groundstation.report.calibrations.calibration_request import AllanRequest
from telemetry.errors import CalibrationError


def answer_allan(request: AllanRequest, day: str) -> CalibrationOutcome:
    """Angle random walk and bias floor of each axis, fitted and read off the curve, with their intervals.

    Raises
    ------
    CalibrationError
        The file and line, what was expected and what came.
    """
    record = read_static(request.file, limit=request.full_scale)
    with naming_file(request.file):
        found = analyse_allan_deviation(record.samples, request.rate)
    noises = [noise_of(result) for result in found]
    count = len(record.samples)
    axes = {name: allan_axis_json(result, noise) for name, result, noise in zip(AXES, found, noises, strict=True)}
    result = {
        "axes": axes,
        "unit": request.unit,
        "rate_hz": request.rate,
        "readings": count,
        "duration_s": count / request.rate,
    }
    result |= {"date": day, "record_sha256": record.sha256}
    facts = (("Readings", f"{count} at {request.rate:g} Hz, {count / request.rate:.1f} s"), ("Unit", request.unit))

    def panels() -> Sequence[Any]:
        from groundstation.report.calibration_plots import allan_panels

        return allan_panels(found, request.unit)

    text = json.dumps(result, indent=1, allow_nan=False) + "\n"
    return CalibrationOutcome(
        result, text, None, record.sha256, allan_sheet(found, noises, request.unit, facts), panels
    )


def noise_of(result: AllanResult) -> FilterNoise | None:
    """White and Gauss-Markov noise for the filter, None where the curve has no such pair."""
    try:
        return filter_noise_of(result.fit)
    except CalibrationError:
        return None


def allan_axis_json(result: AllanResult, noise: FilterNoise | None) -> dict[str, Any]:
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
        "filter": asdict(noise) if noise is not None else None,
    }
