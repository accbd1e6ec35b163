"""Coefficients of the accelerometers and magnetometers of an MWD tool, with everything that is written of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from groundstation.calibration.jig import Jig
from groundstation.calibration.landing_gates import Gate, face_gate, pass_gates, rows_twice, triad_gates
from groundstation.calibration.mwd_block import of_fit, to_json
from groundstation.calibration.mwd_files import MwdRecord, read_mwd
from groundstation.calibration.mwd_model import (
    Triad,
    gravity_inclination,
    magnetic_dip,
    nominal_triad,
    tool_face,
    vectors_of_volts,
)
from groundstation.calibration.mwd_record import ACCELEROMETER_VOLTS_PER_G, MAGNETOMETER_VOLTS_PER_MICROTESLA
from groundstation.calibration.mwd_solve import MwdErrors, MwdFit, solve_accelerometers, solve_magnetometers
from groundstation.calibration.temperature import Array
from groundstation.report.calibration_sheets import TriadErrors, triad_sheet
from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome, naming_file
from groundstation.report.calibrations.calibration_request import MagnetometerRequest, MwdRequest, jig_of
from groundstation.report.calibrations.triad_files import (
    ACCELEROMETERS,
    MAGNETOMETERS,
    calibration_label,
    read_triad_file,
)
from telemetry.errors import CalibrationError


def answer_mwd(request: MwdRequest, day: str) -> CalibrationOutcome:
    """Coefficients of the accelerometers of an MWD tool from voltages at the tilts of a jig.

    Raises
    ------
    CalibrationError
        The file and line, what was expected and what came.
    """
    record = read_mwd(request.file, request.full_scale)
    fit = solve_gravity(record, int(request.parameters), tool_face=request.tool_face, jig=jig_of(request.jig_deg))
    faces = tool_face(vectors_of_volts(fit.triad, record.gravity_volts, record.temperature))
    gates = [*triad_gates(fit.after.size_rms, fit.after.angle_rms, "G"), twice_gate(record)]
    gates.append(face_gate(faces, record.tool_face, record.tilt))
    with naming_file(request.file):
        forced = pass_gates(gates, force=request.force)
    reference = {"reference": "1 g and the jig's tilt"}
    return triad_outcome(record, fit, day, errors_of_gravity(record, fit), reference, forced)


def answer_magnetometer(request: MagnetometerRequest, day: str) -> CalibrationOutcome:
    """Coefficients of the magnetometers of an MWD tool, the site's field and dip as references; errors as above."""
    record = read_mwd(request.file, request.full_scale)
    volts = record.magnetic_volts()
    size, dip = field_and_dip(record, request.field_ut, request.dip_deg)
    block = read_triad_file(request.accelerometers, ACCELEROMETERS)
    other = block.triad() if block is not None else solve_gravity(record, int(request.parameters)).triad
    gravity = vectors_of_volts(other, record.gravity_volts, record.temperature)
    try:
        fit = solve_magnetometers(volts, record.temperature, gravity, size, dip, int(request.parameters))
    except CalibrationError as error:
        raise record.located(error) from error
    source = "the same record" if block is None else calibration_label(request.accelerometers, block)
    extra = {"reference": f"field and dip of the site, vertical by accelerometers of {source}"}
    gates = [*triad_gates(fit.after.size_rms / float(np.mean(size)), fit.after.angle_rms, "H"), twice_gate(record)]
    with naming_file(request.file):
        forced = pass_gates(gates, force=request.force)
    return triad_outcome(record, fit, day, errors_of_field(record, fit, gravity, size, dip), extra, forced)


def twice_gate(record: MwdRecord) -> Gate:
    """Whether no reading of a record stands in it twice."""
    columns = [record.tilt, record.tool_face, record.temperature, *record.gravity_volts.T]
    pairs = rows_twice(np.column_stack(columns))
    lines = [record.lines[k] for k in pairs[0]] if pairs else []
    return Gate("duplicates", not pairs, f"{len(pairs)} readings stand twice, as in lines {lines}")


def solve_gravity(record: MwdRecord, parameters: int, *, tool_face: bool = False, jig: Jig | None = None) -> MwdFit:
    """Fit of the accelerometers; a refusal carries the file and the line."""
    reference = record.tool_face if tool_face else None
    try:
        return solve_accelerometers(
            record.gravity_volts, record.temperature, record.tilt, parameters, tool_face_reference=reference, jig=jig
        )
    except CalibrationError as error:
        raise record.located(error) from error


def field_and_dip(
    record: MwdRecord, field_ut: float | None, dip_deg: float | None
) -> tuple[Array | float, Array | float]:
    """Field (microtesla) and dip (rad) at the readings: what is given, else what the record holds."""
    size = field_ut if field_ut is not None else record.field
    dip = math.radians(dip_deg) if dip_deg is not None else record.dip
    if size is None or dip is None:
        raise CalibrationError(
            f"{record.name}: expected --field-ut and --dip-deg, or the columns field_ut,dip_deg, got neither"
        )
    return size, dip


def errors_of_gravity(record: MwdRecord, fit: MwdFit) -> tuple[TriadErrors, TriadErrors]:
    """Errors of |G| (g) and tilt (deg) before and after."""

    def errors(triad: Triad) -> TriadErrors:
        gravity = vectors_of_volts(triad, record.gravity_volts, record.temperature)
        return TriadErrors(
            np.linalg.norm(gravity, axis=1) - 1.0, np.degrees(gravity_inclination(gravity) - record.tilt)
        )

    return errors(nominal_triad("ABC", ACCELEROMETER_VOLTS_PER_G)), errors(fit.triad)


def errors_of_field(
    record: MwdRecord, fit: MwdFit, gravity: Array, size: Array | float, angle: Array | float
) -> tuple[TriadErrors, TriadErrors]:
    """Errors of |H| (microtesla) and dip (deg) before and after."""

    def errors(triad: Triad) -> TriadErrors:
        field = vectors_of_volts(triad, record.magnetic_volts(), record.temperature)
        return TriadErrors(np.linalg.norm(field, axis=1) - size, np.degrees(magnetic_dip(gravity, field) - angle))

    return errors(nominal_triad("XYZ", MAGNETOMETER_VOLTS_PER_MICROTESLA)), errors(fit.triad)


def triad_outcome(
    record: MwdRecord,
    fit: MwdFit,
    day: str,
    errors: tuple[TriadErrors, TriadErrors],
    extra: dict[str, str],
    forced: tuple[str, ...],
) -> CalibrationOutcome:
    """File, JSON, sheet and figures of a triad."""
    gravity = fit.triad.axes == "ABC"
    unit, angle = ("g", "tilt_deg") if gravity else ("ut", "dip_deg")
    after = errors_json(fit.after, unit, angle)
    design = f"{len(record.lines)} attitudes, {fit.parameters} parameters"
    design += "".join(f"; forced past {found}" for found in forced)
    provenance = {"record_sha256": record.sha256, "day": day, "design": design, "cost": fit.cost, "errors": after}
    block = of_fit(fit, ACCELEROMETERS if gravity else MAGNETOMETERS, provenance | extra)
    result = {
        "sensor": block.sensor,
        "parameters": fit.parameters,
        "coefficients": fit.coefficients,
        "standard_errors": fit.standard_errors,
        "iterations": fit.iterations,
        "cost": fit.cost,
        "before": errors_json(fit.before, unit, angle),
        "after": after,
        "residual_rms": fit.after.size_rms,
        f"predicted_size_std_{unit}": fit.predicted_size_std,
        "predicted_angle_std_deg": math.degrees(fit.predicted_angle_std),
        "temperature_c": list(fit.temperatures),
        "warnings": list(fit.warnings),
        "design": design,
        "forced": list(forced),
        **extra,
        "date": day,
        "record_sha256": record.sha256,
        "block_sha256": block.sha256(),
    }
    facts = [("Record of", design), ("Reference", extra["reference"])]
    facts.extend(("Forced past", found) for found in forced)
    sheet = triad_sheet(f"Calibration of {block.sensor.replace('mwd', 'MWD')}", fit, facts)

    def panels() -> Sequence[Any]:
        from groundstation.report.calibration_plots import triad_panels

        around = ("tilt, deg", np.degrees(record.tilt)) if gravity else ("tool face, deg", np.degrees(record.tool_face))
        drawn = ACCELEROMETER_VOLTS_PER_G if gravity else MAGNETOMETER_VOLTS_PER_MICROTESLA
        return triad_panels(fit, around, record.temperature, *errors, drawn)

    return CalibrationOutcome(result, to_json(block), block.sha256(), record.sha256, sheet, panels)


def errors_json(found: MwdErrors, unit: str, angle: str) -> dict[str, float]:
    """Errors over a record with their units in the names."""
    name, _, deg = angle.partition("_")
    return {
        f"size_max_{unit}": found.size_max,
        f"size_rms_{unit}": found.size_rms,
        f"{name}_max_{deg}": math.degrees(found.angle_max),
        f"{name}_rms_{deg}": math.degrees(found.angle_rms),
    }
