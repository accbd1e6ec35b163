"""``borechain allan``: what a static record says of a sensor's noise."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.calibrate.calibration_output import (
    CalibrationOutcome,
    faults_of_file,
    file_argument,
    full_scale_option,
    output_options,
)
from borechain.cli.faults import plain_faults

if TYPE_CHECKING:
    from groundstation.calibration.allan_analysis import AllanResult, FilterNoise


@click.command()
@file_argument
@click.option(
    "--rate", type=click.FloatRange(1.0, 1e6), required=True, metavar="HZ", help="Readings per second of FILE."
)
@click.option(
    "--unit", default="deg/s", show_default=True, help="Unit of FILE, shown in the report; nothing is converted."
)
@full_scale_option
@plain_faults
@output_options
def allan(file: Path, day: str, rate: float, unit: str, full_scale: float) -> CalibrationOutcome:
    """Allan deviation of a static record: a CSV with the columns x,y,z, or an .npy of shape (n, 3).

    Angle random walk N and bias floor F are fitted, with 95 % intervals; the values read off the curve are given too.

    \b
    Examples:
      borechain experiment records --out out/records
      borechain allan out/records/static.npy --rate 65 --plot out/allan.svg
    """
    from groundstation.calibration.allan_analysis import AXES, analyse_allan_deviation
    from groundstation.calibration.calibration_records import read_static
    from groundstation.report.calibration_sheets import allan_sheet as sheet_of

    record = read_static(file, limit=full_scale)
    with faults_of_file(file):
        found = analyse_allan_deviation(record.samples, rate)
    noises = [noise_of(result) for result in found]
    count = len(record.samples)
    axes = {name: allan_axis_json(result, noise) for name, result, noise in zip(AXES, found, noises, strict=True)}
    result = {"axes": axes, "unit": unit, "rate_hz": rate, "readings": count, "duration_s": count / rate}
    result |= {"date": day, "record_sha256": record.sha256}
    facts = (("Readings", f"{count} at {rate:g} Hz, {count / rate:.1f} s"), ("Unit", unit))

    def panels() -> Sequence[Any]:
        from groundstation.report.calibration_plots import allan_panels

        return allan_panels(found, unit)

    text = json.dumps(result, indent=1, allow_nan=False) + "\n"
    return CalibrationOutcome(result, text, None, record.sha256, sheet_of(found, noises, unit, facts), panels)


def noise_of(result: AllanResult) -> FilterNoise | None:
    """White and Gauss-Markov noise for the filter, None where the curve has no such pair."""
    from groundstation.calibration.allan_analysis import filter_noise_of
    from groundstation.calibration.errors import CalibrationError

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
