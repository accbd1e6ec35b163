"""Matrix and bias of a triad, from a turn table or from attitudes, with everything that is written of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from groundstation.calibration.attitudes import AttitudeFit, fit_attitudes, fit_free_yaw, true_vectors
from groundstation.calibration.block import Calibration, Provenance, to_json
from groundstation.calibration.calibration_records import read_attitudes, read_turn_table
from groundstation.calibration.coverage import COVERAGE
from groundstation.calibration.landing_gates import linear_gates, pass_gates
from groundstation.calibration.matrix_files import read_matrix
from groundstation.calibration.residual_walk import largest_widening, walk_widening
from groundstation.calibration.temperature import Array
from groundstation.calibration.turntable import SETTINGS, as_observations, correct_readings, turntable_alignment
from groundstation.report.calibration_sheets import AttitudeErrors, linear_sheet
from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome, naming_file
from groundstation.report.calibrations.calibration_request import (
    STANDARD_GRAVITY,
    UNITS,
    AttitudesRequest,
    TurntableRequest,
    jig_of,
)
from telemetry.errors import CalibrationError

NOMINAL_C = 25.0  # of a block without temperature terms, which no reading depends on


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
    forced: tuple[str, ...] = ()  # what its gates found, and was overruled
    widened: float = 1.0  # its intervals at most, for what a walk of the bias may have moved unseen


def answer_turntable(request: TurntableRequest, day: str) -> CalibrationOutcome:
    """Matrix and bias of a triad from a turn-table record.

    Raises
    ------
    CalibrationError
        The file and line, what was expected and what came.
    """
    record = read_turn_table(request.file, request.reference, limit=request.full_scale)
    truth, readings = as_observations(record.positive, record.negative, request.reference)
    with naming_file(request.file):
        aligned = turntable_alignment(record.positive, record.negative, request.reference)
        # the same matrix and bias, with their standard errors; an axis is one setting, whichever way it is turned
        errors = fit_attitudes(truth, readings, jig=jig_of(request.jig_deg), settings=SETTINGS)
    job = LinearCalibration(
        fit=replace(errors, matrix=aligned.matrix, bias=aligned.bias),
        names=[f"{sign}{axis}" for sign in "+-" for axis in "xyz"],
        truth=truth,
        readings=readings,
        truth_si=UNITS[request.unit][0],
        reading_si=UNITS[request.unit][0],
        unit=request.unit,
        matrix_unit="",
        sensor=UNITS[request.unit][1],
        design=f"turn table, two rotations about each axis at {request.reference:g} {request.unit}",
        record_sha256=record.sha256,
    )
    return linear_outcome(
        judged_calibration(job, request), day, request.temperature_c, {"reference": request.reference}
    )


def answer_attitudes(request: AttitudesRequest, day: str) -> CalibrationOutcome:
    """Matrix (m/s2 per g) and bias (m/s2) of an accelerometer from mean readings at attitudes; errors as above."""
    record = read_attitudes(request.file, limit=request.full_scale)
    truth = true_vectors(record.pitch, record.roll)
    if request.free_yaw is not None and request.jig_deg is not None:
        raise CalibrationError("expected --free-yaw or --jig-deg, got both")
    like = None if request.free_yaw is None else read_matrix(request.free_yaw, STANDARD_GRAVITY)
    with naming_file(request.file):
        found = (
            fit_attitudes(truth, record.readings, jig=jig_of(request.jig_deg))
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
    return linear_outcome(judged_calibration(job, request), day, request.temperature_c, extra)


def judged_calibration(job: LinearCalibration, request: TurntableRequest | AttitudesRequest) -> LinearCalibration:
    """The calibration with what its gates found.

    Raises
    ------
    CalibrationError
        When a gate does not hold and nothing forces it.
    """
    nominal, stated = job.truth_si / job.reading_si, jig_of(request.jig_deg)
    jig = 0.0 if stated is None else math.hypot(stated.common, stated.random)
    with naming_file(request.file):
        gates = linear_gates(job.truth, job.readings, job.names, job.fit, nominal, job.reading_si, job.sensor, jig)
        forced = pass_gates(gates, force=request.force)
    if jig == 0.0 and job.fit.yaw_std == 0.0:
        job = widened_calibration(job)
    return replace(job, forced=forced, design=job.design + "".join(f"; forced past {found}" for found in forced))


def widened_calibration(job: LinearCalibration) -> LinearCalibration:
    """The calibration with the standard errors that the order of its residuals allows."""
    factors = walk_widening(job.truth, job.fit.residuals)
    by_parameter = np.concatenate([factors[:, 0], factors[:, 1:].ravel()])
    cov = job.fit.cov * np.outer(by_parameter, by_parameter)
    return replace(job, fit=replace(job.fit, cov=cov), widened=largest_widening(factors))


def linear_outcome(
    job: LinearCalibration, day: str, temperature_c: float | None, extra: dict[str, Any]
) -> CalibrationOutcome:
    """Block, JSON, sheet and figures of a matrix and a bias."""
    fit, at, calibration = job.fit, errors_of(job), linear_block(job, day, temperature_c)
    warmth = "not stated" if temperature_c is None else f"{temperature_c:g} \N{DEGREE SIGN}C"
    facts = [("Method", job.design), ("Temperature", warmth)]
    factor = fit.coverage_factor() if fit.combined is None else None
    if "yaw_deg" in extra:
        facts.append(("Yaw of the rig", f"{extra['yaw_deg']:.4f} deg, standard error {extra['yaw_std_deg']:.4f} deg"))
    if job.widened > 1.0:
        facts.append(("Intervals", f"up to {job.widened:g} times wider, for the order of the residuals"))
    facts.extend(("Forced past", found) for found in job.forced)
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
        "widened": job.widened,
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
        "forced": list(job.forced),
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
    scale = job.truth_si / job.reading_si
    c, s = math.cos(job.fit.yaw), math.sin(job.fit.yaw)
    turned = job.truth @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T
    before = np.linalg.norm(job.readings - scale * job.truth, axis=1)
    after = scale * np.linalg.norm(correct_readings(job.readings, job.fit.matrix, job.fit.bias) - turned, axis=1)
    return AttitudeErrors(job.names, job.unit.replace("s2", "s\N{SUPERSCRIPT TWO}"), before, after)


def linear_block(job: LinearCalibration, day: str, temperature_c: float | None) -> Calibration:
    """The parameters in SI with their provenance, as a node takes them."""
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
