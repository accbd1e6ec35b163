"""``borechain calibrate turntable`` and ``attitudes``: matrix and bias of a triad."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
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
from borechain.cli.faults import InputFault, plain_faults

if TYPE_CHECKING:
    from groundstation.calibration.attitudes import AttitudeFit
    from groundstation.calibration.block import Calibration
    from groundstation.calibration.jig import Jig
    from groundstation.calibration.temperature import Array
    from groundstation.report.calibration_sheets import AttitudeErrors

STANDARD_GRAVITY = 9.80665  # m/s^2
UNITS = {  # SI of one unit of the file, and whose unit it is
    "deg/s": (math.pi / 180.0, "gyroscope"),
    "rad/s": (1.0, "gyroscope"),
    "g": (STANDARD_GRAVITY, "accelerometer"),
    "m/s2": (1.0, "accelerometer"),
}
jig_option = click.option(
    "--jig-deg",
    type=click.FloatRange(0.0),
    nargs=2,
    metavar="COMMON RANDOM",
    help="Standard deviations of the attitudes: common to all readings of one setting, and of each reading.",
)
NOMINAL_C = 25.0  # of a block without temperature terms, which no reading depends on
temperature_option = click.option("--temperature-c", type=float, help="Temperature of the record, if it was measured.")


def jig_of(jig_deg: tuple[float, float] | None) -> Jig | None:
    """Errors of a jig as an option gives them."""
    from groundstation.calibration.jig import Jig

    return None if jig_deg is None else Jig(*(math.radians(value) for value in jig_deg))


@dataclass(frozen=True, slots=True)
class LinearCalibration:
    """A record of G = M w + b and its fit: ``truth`` and ``readings`` (n, 3), SI of one unit of each."""

    fit: AttitudeFit
    names: Sequence[str]
    truth: Array
    readings: Array
    truth_si: float
    reading_si: float
    unit: str
    matrix_unit: str
    sensor: str
    design: str
    record_sha256: str


@click.command()
@file_argument
@click.option(
    "--reference",
    type=click.FloatRange(0.0, min_open=True),
    required=True,
    help="True rate or specific force of the first column of each pair, in the unit of FILE.",
)
@click.option("--unit", type=click.Choice(list(UNITS)), default="deg/s", show_default=True, help="Unit of FILE.")
@jig_option
@temperature_option
@full_scale_option
@plain_faults
@output_options
def turntable(
    file: Path,
    day: str,
    reference: float,
    unit: str,
    jig_deg: tuple[float, float] | None,
    temperature_c: float | None,
    full_scale: float,
) -> CalibrationOutcome:
    """Matrix and bias of a triad from a turn-table record: a row per axis turned, two columns per sensor axis.

    \b
    Examples:
      borechain calibrate turntable tests/data/calibration/calibration_node_a1_gyro.csv --reference 720
      borechain calibrate turntable six-positions.csv --reference 1 --unit g --out accelerometer.json
    """
    from groundstation.calibration.attitudes import fit_attitudes
    from groundstation.calibration.calibration_records import read_turn_table
    from groundstation.calibration.turntable import SETTINGS, as_observations, turntable_alignment

    record = read_turn_table(file, reference, limit=full_scale)
    truth, readings = as_observations(record.positive, record.negative, reference)
    with faults_of_file(file):
        aligned = turntable_alignment(record.positive, record.negative, reference)
        # the same matrix and bias, with their standard errors; an axis is one setting, whichever way it is turned
        errors = fit_attitudes(truth, readings, jig=jig_of(jig_deg), settings=SETTINGS)
    job = LinearCalibration(
        fit=replace(errors, matrix=aligned.matrix, bias=aligned.bias),
        names=[f"{sign}{axis}" for sign in "+-" for axis in "xyz"],
        truth=truth,
        readings=readings,
        truth_si=UNITS[unit][0],
        reading_si=UNITS[unit][0],
        unit=unit,
        matrix_unit="",
        sensor=UNITS[unit][1],
        design=f"turn table, two rotations about each axis at {reference:g} {unit}",
        record_sha256=record.sha256,
    )
    return linear_outcome(job, day, temperature_c, {"reference": reference})


@click.command()
@file_argument
@click.option(
    "--free-yaw",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="REFERENCE",
    help="Solve for the fixture's yaw too; REFERENCE holds the known matrix: a file of --out, or TOML with `matrix`.",
)
@jig_option
@temperature_option
@full_scale_option
@plain_faults
@output_options
def attitudes(
    file: Path,
    day: str,
    free_yaw: Path | None,
    jig_deg: tuple[float, float] | None,
    temperature_c: float | None,
    full_scale: float,
) -> CalibrationOutcome:
    """Matrix (m/s2 per g) and bias (m/s2) of an accelerometer from mean readings at preset pitch and roll.

    \b
    Examples:
      borechain calibrate attitudes tests/data/calibration/calibration_vn100_accel.csv
      borechain calibrate attitudes accelerometer.csv --free-yaw mounting.toml --certificate accelerometer.pdf
    """
    from groundstation.calibration.attitudes import fit_attitudes, fit_free_yaw, true_vectors
    from groundstation.calibration.calibration_records import read_attitudes
    from groundstation.calibration.matrix_files import read_matrix

    record = read_attitudes(file, limit=full_scale)
    truth = true_vectors(record.pitch, record.roll)
    if free_yaw is not None and jig_deg is not None:
        raise InputFault("expected --free-yaw or --jig-deg, got both")
    like = None if free_yaw is None else read_matrix(free_yaw, STANDARD_GRAVITY)
    with faults_of_file(file):
        found = (
            fit_attitudes(truth, record.readings, jig=jig_of(jig_deg))
            if like is None
            else fit_free_yaw(truth, record.readings, like)
        )
    job = LinearCalibration(
        fit=found,
        names=record.names,
        truth=truth,
        readings=record.readings,
        truth_si=STANDARD_GRAVITY,
        reading_si=1.0,
        unit="m/s2",
        matrix_unit=", m/s\N{SUPERSCRIPT TWO} per g,",
        sensor="accelerometer",
        design=f"least squares over {len(truth)} attitudes" + ("" if like is None else ", yaw of the rig free"),
        record_sha256=record.sha256,
    )
    extra: dict[str, Any] = {}
    if like is not None:
        beside = [[None if math.isnan(v) else v for v in row] for row in (found.matrix - like).tolist()]
        extra = {"yaw_deg": math.degrees(found.yaw), "yaw_std_deg": math.degrees(found.yaw_std)}
        extra["reference_difference"] = beside
    return linear_outcome(job, day, temperature_c, extra)


def linear_outcome(
    job: LinearCalibration, day: str, temperature_c: float | None, extra: dict[str, Any]
) -> CalibrationOutcome:
    """Block, JSON, sheet and figures of a matrix and a bias."""
    from groundstation.calibration.block import to_json
    from groundstation.calibration.coverage import COVERAGE
    from groundstation.report.calibration_sheets import linear_sheet

    fit, at, calibration = job.fit, errors_of(job), linear_block(job, day, temperature_c)
    warmth = "not stated" if temperature_c is None else f"{temperature_c:g} \N{DEGREE SIGN}C"
    facts = [("Method", job.design), ("Temperature", warmth)]
    factor = fit.coverage_factor() if fit.combined is None else None
    if "yaw_deg" in extra:
        facts.append(("Yaw of the rig", f"{extra['yaw_deg']:.4f} deg, standard error {extra['yaw_std_deg']:.4f} deg"))
    sheet = linear_sheet(f"Calibration of {job.sensor}", fit, at, job.matrix_unit, facts)
    result = {
        "sensor": job.sensor,
        "unit": job.unit,
        "matrix_unit": job.matrix_unit.strip(", ").replace("\N{SUPERSCRIPT TWO}", "2") or "1",
        "matrix": fit.matrix.tolist(),
        "bias": fit.bias.tolist(),
        "standard_errors": {"matrix": fit.matrix_std().tolist(), "bias": fit.bias_std().tolist()},
        "degrees_of_freedom": fit.degrees,
        "coverage": COVERAGE,
        "coverage_factor": factor,
        "expanded_uncertainty": {
            "matrix": fit.matrix_expanded().tolist(),
            "bias": fit.bias_expanded().tolist(),
        },
        "residual_rms": fit.residual_rms(),
        "attitudes": [
            {"name": name, "residual": residual, "lever": lever}
            for name, residual, lever in zip(job.names, fit.residuals.tolist(), fit.levers.tolist(), strict=True)
        ],
        "rank": fit.rank,
        "condition": fit.condition,
        **extra,
        "warnings": list(sheet.warnings),
        "design": job.design,
        "temperature_c": temperature_c,
        "date": day,
        "record_sha256": job.record_sha256,
        "block_sha256": calibration.sha256(),
    }

    def panels() -> Sequence[Any]:
        from groundstation.report.calibration_plots import linear_panels

        return linear_panels(fit, at)

    return CalibrationOutcome(result, to_json(calibration), calibration.sha256(), job.record_sha256, sheet, panels)


def errors_of(job: LinearCalibration) -> AttitudeErrors:
    """Lengths of the errors of the readings before and after, in their unit."""
    import numpy as np

    from groundstation.calibration.turntable import correct_readings
    from groundstation.report.calibration_sheets import AttitudeErrors

    scale = job.truth_si / job.reading_si
    c, s = math.cos(job.fit.yaw), math.sin(job.fit.yaw)
    turned = job.truth @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T
    before = np.linalg.norm(job.readings - scale * job.truth, axis=1)
    after = scale * np.linalg.norm(correct_readings(job.readings, job.fit.matrix, job.fit.bias) - turned, axis=1)
    return AttitudeErrors(job.names, job.unit.replace("s2", "s\N{SUPERSCRIPT TWO}"), before, after)


def linear_block(job: LinearCalibration, day: str, temperature_c: float | None) -> Calibration:
    """The parameters in SI with their provenance, as a node takes them."""
    import numpy as np

    from groundstation.calibration.block import Calibration, Provenance

    fit, by_matrix, none = job.fit, job.reading_si / job.truth_si, (np.zeros((0, 3, 3)), np.zeros((0, 3)))
    provenance = Provenance(
        input_sha256=job.record_sha256,
        day=day,
        design=job.design,
        residual_rms=job.reading_si * fit.residual_rms(),
        matrix_std=by_matrix * fit.matrix_std(),
        bias_std=job.reading_si * fit.bias_std(),
        matrix_slopes_std=none[0],
        bias_slopes_std=none[1],
    )
    return Calibration(
        sensor=job.sensor,
        matrix=by_matrix * fit.matrix,
        bias=job.reading_si * fit.bias,
        matrix_slopes=none[0],
        bias_slopes=none[1],
        reference=NOMINAL_C if temperature_c is None else temperature_c,
        provenance=provenance,
    )
