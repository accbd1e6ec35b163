"""``borechain calibrate mwd``, ``magnetometer`` and ``qc``: the sixty coefficients of an MWD tool and its control."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.calibrate.calibration_output import (
    CalibrationOutcome,
    file_argument,
    full_scale_option,
    output_options,
)
from borechain.cli.calibrate.linear import jig_of, jig_option
from borechain.cli.faults import InputFault, plain_faults

if TYPE_CHECKING:
    from groundstation.calibration.jig import Jig
    from groundstation.calibration.mwd_block import TriadCalibration
    from groundstation.calibration.mwd_files import MwdRecord
    from groundstation.calibration.mwd_model import Triad
    from groundstation.calibration.mwd_solve import MwdErrors, MwdFit
    from groundstation.calibration.temperature import Array
    from groundstation.report.calibration_sheets import TriadErrors

ACCELEROMETERS, MAGNETOMETERS = "mwd accelerometers", "mwd magnetometers"
calibration_path = click.Path(path_type=Path, dir_okay=False)
parameters_option = click.option(
    "--parameters",
    type=click.Choice(["12", "30"]),
    required=True,
    help="12 for a record at one temperature, 30 for a record over temperature.",
)
accelerometers_option = click.option(
    "--accelerometers", type=calibration_path, help="Calibration of the accelerometers, a file of `mwd --out`."
)


@click.command()
@file_argument
@parameters_option
@click.option("--tool-face", is_flag=True, help="Align the solution with the jig's tool faces; otherwise m_AB = m_BA.")
@jig_option
@full_scale_option
@plain_faults
@output_options
def mwd(
    file: Path,
    day: str,
    parameters: str,
    tool_face: bool,
    jig_deg: tuple[float, float] | None,
    full_scale: float,
) -> CalibrationOutcome:
    """Coefficients of the accelerometers of an MWD tool from voltages at the tilts of a jig.

    \b
    Examples:
      borechain calibrate mwd scenarios/instruments/mwd-room.csv --parameters 12
      borechain calibrate mwd scenarios/instruments/mwd-oven.csv --parameters 30 --out accelerometers.json
    """
    from groundstation.calibration.mwd_files import read_mwd

    record = read_mwd(file, full_scale)
    fit = solve_gravity(record, int(parameters), tool_face=tool_face, jig=jig_of(jig_deg))
    return triad_outcome(record, fit, day, errors_of_gravity(record, fit), {"reference": "1 g and the jig's tilt"})


@click.command()
@file_argument
@parameters_option
@accelerometers_option
@click.option(
    "--field-ut",
    "--field",
    "field_ut",
    type=click.FloatRange(1.0, 100.0),
    help="Strength of the site's magnetic field, uT.",
)
@click.option("--dip-deg", type=click.FloatRange(-90.0, 90.0), help="Dip of the site's field below the horizontal.")
@full_scale_option
@plain_faults
@output_options
def magnetometer(
    file: Path,
    day: str,
    parameters: str,
    accelerometers: Path | None,
    field_ut: float | None,
    dip_deg: float | None,
    full_scale: float,
) -> CalibrationOutcome:
    """Coefficients of the magnetometers of an MWD tool, with the site's field and dip as references.

    The vertical comes from --accelerometers, or from accelerometers calibrated on the same record. Field and dip
    that are not given are read from the columns field_ut,dip_deg of FILE.

    \b
    Example:
      borechain calibrate magnetometer scenarios/instruments/mwd-oven.csv --parameters 30 --field-ut 50 --dip-deg 65
    """
    from groundstation.calibration.errors import CalibrationError
    from groundstation.calibration.mwd_files import read_mwd
    from groundstation.calibration.mwd_model import vectors_of_volts
    from groundstation.calibration.mwd_solve import solve_magnetometers

    record = read_mwd(file, full_scale)
    volts = record.magnetic_volts()
    size, dip = field_and_dip(record, field_ut, dip_deg)
    block = block_of(accelerometers, ACCELEROMETERS)
    other = block.triad() if block is not None else solve_gravity(record, int(parameters)).triad
    gravity = vectors_of_volts(other, record.gravity_volts, record.temperature)
    try:
        fit = solve_magnetometers(volts, record.temperature, gravity, size, dip, int(parameters))
    except CalibrationError as error:
        raise record.located(error) from error
    source = "the same record" if block is None else calibration_label(accelerometers, block)
    extra = {"reference": f"field and dip of the site, vertical by accelerometers of {source}"}
    return triad_outcome(record, fit, day, errors_of_field(record, fit, gravity, size, dip), extra)


@click.command()
@file_argument
@accelerometers_option
@click.option(
    "--magnetometers", type=calibration_path, help="Calibration of the magnetometers, of `magnetometer --out`."
)
@full_scale_option
@plain_faults
@output_options
def qc(
    file: Path, day: str, accelerometers: Path | None, magnetometers: Path | None, full_scale: float
) -> CalibrationOutcome:
    """Check a tool: readings at twelve tool faces of one attitude must agree in inclination, azimuth and G_L.

    A triad without a calibration file has the nominal coefficients. The exit status is 0 whether the tool passes or
    not: read `passed`.

    \b
    Example:
      borechain calibrate qc scenarios/instruments/mwd-control.csv --accelerometers a.json --magnetometers m.json
    """
    from groundstation.calibration.errors import CalibrationError
    from groundstation.calibration.mwd_files import read_mwd
    from groundstation.calibration.mwd_model import nominal_triad, tool_readings
    from groundstation.calibration.mwd_record import ACCELEROMETER_VOLTS_PER_G, MAGNETOMETER_VOLTS_PER_MICROTESLA
    from groundstation.calibration.quality import judge_readings
    from groundstation.report.calibration_sheets import quality_sheet

    record = read_mwd(file, full_scale)
    a, m = block_of(accelerometers, ACCELEROMETERS), block_of(magnetometers, MAGNETOMETERS)
    gravity = a.triad() if a is not None else nominal_triad("ABC", ACCELEROMETER_VOLTS_PER_G)
    field = m.triad() if m is not None else nominal_triad("XYZ", MAGNETOMETER_VOLTS_PER_MICROTESLA)
    seen = tool_readings(gravity, field, record.gravity_volts, record.magnetic_volts(), record.temperature)
    try:
        report = judge_readings(seen)
    except CalibrationError as error:
        raise record.located(error) from error
    used = {
        "accelerometers": calibration_label(accelerometers, a),
        "magnetometers": calibration_label(magnetometers, m),
    }
    verdicts = [(v, (math.degrees(1.0), "deg") if v.unit == "rad" else (1.0, v.unit)) for v in report.verdicts]
    result = {
        "passed": report.passed,
        "verdicts": [
            {"name": v.name, "spread": k * v.spread, "limit": k * v.limit, "unit": unit, "passed": v.passed}
            for v, (k, unit) in verdicts
        ],
        "tool_face_deg": [math.degrees(v) for v in report.tool_face],
        "inclination_deg": [math.degrees(v) for v in report.inclination],
        "azimuth_deg": [math.degrees(v) for v in report.azimuth],
        "gravity_g": report.gravity_size.tolist(),
        **used,
        "date": day,
        "record_sha256": record.sha256,
    }
    sheet = quality_sheet(
        report, [("Accelerometers", used["accelerometers"]), ("Magnetometers", used["magnetometers"])]
    )

    def panels() -> Sequence[Any]:
        from groundstation.report.calibration_plots import quality_panels

        return quality_panels(report)

    return CalibrationOutcome(result, json.dumps(result, indent=1) + "\n", None, record.sha256, sheet, panels)


def solve_gravity(record: MwdRecord, parameters: int, *, tool_face: bool = False, jig: Jig | None = None) -> MwdFit:
    """Fit of the accelerometers; a refusal carries the file and the line."""
    from groundstation.calibration.errors import CalibrationError
    from groundstation.calibration.mwd_solve import solve_accelerometers

    reference = record.tool_face if tool_face else None
    try:
        return solve_accelerometers(
            record.gravity_volts, record.temperature, record.tilt, parameters, tool_face_reference=reference, jig=jig
        )
    except CalibrationError as error:
        raise record.located(error) from error


def block_of(path: Path | None, sensor: str) -> TriadCalibration | None:
    """Calibration of a file, if one is given."""
    from groundstation.calibration.mwd_block import read_triad

    return None if path is None else read_triad(path, sensor)


def calibration_label(path: Path | None, block: TriadCalibration | None) -> str:
    """File and hash of a calibration that was applied."""
    return "nominal, not calibrated" if path is None or block is None else f"{path.name}, block {block.sha256()}"


def field_and_dip(
    record: MwdRecord, field_ut: float | None, dip_deg: float | None
) -> tuple[Array | float, Array | float]:
    """Field (microtesla) and dip (rad) at the readings: what is given, else what the record holds."""
    size = field_ut if field_ut is not None else record.field
    dip = math.radians(dip_deg) if dip_deg is not None else record.dip
    if size is None or dip is None:
        raise InputFault(
            f"{record.name}: expected --field-ut and --dip-deg, or the columns field_ut,dip_deg, got neither"
        )
    return size, dip


def errors_of_gravity(record: MwdRecord, fit: MwdFit) -> tuple[TriadErrors, TriadErrors]:
    """Errors of |G| (g) and tilt (deg) before and after."""
    import numpy as np

    from groundstation.calibration.mwd_model import gravity_inclination, nominal_triad, vectors_of_volts
    from groundstation.calibration.mwd_record import ACCELEROMETER_VOLTS_PER_G
    from groundstation.report.calibration_sheets import TriadErrors

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
    import numpy as np

    from groundstation.calibration.mwd_model import magnetic_dip, nominal_triad, vectors_of_volts
    from groundstation.calibration.mwd_record import MAGNETOMETER_VOLTS_PER_MICROTESLA
    from groundstation.report.calibration_sheets import TriadErrors

    def errors(triad: Triad) -> TriadErrors:
        field = vectors_of_volts(triad, record.magnetic_volts(), record.temperature)
        return TriadErrors(np.linalg.norm(field, axis=1) - size, np.degrees(magnetic_dip(gravity, field) - angle))

    return errors(nominal_triad("XYZ", MAGNETOMETER_VOLTS_PER_MICROTESLA)), errors(fit.triad)


def triad_outcome(
    record: MwdRecord, fit: MwdFit, day: str, errors: tuple[TriadErrors, TriadErrors], extra: dict[str, str]
) -> CalibrationOutcome:
    """File, JSON, sheet and figures of a triad."""
    from groundstation.calibration.mwd_block import of_fit, to_json
    from groundstation.report.calibration_sheets import triad_sheet

    gravity = fit.triad.axes == "ABC"
    unit, angle = ("g", "tilt_deg") if gravity else ("ut", "dip_deg")
    after = errors_json(fit.after, unit, angle)
    design = f"{len(record.lines)} attitudes, {fit.parameters} parameters"
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
        **extra,
        "date": day,
        "record_sha256": record.sha256,
        "block_sha256": block.sha256(),
    }
    facts = [("Record of", design), ("Reference", extra["reference"])]
    sheet = triad_sheet(f"Calibration of {block.sensor.replace('mwd', 'MWD')}", fit, facts)

    def panels() -> Sequence[Any]:
        import numpy as np

        from groundstation.calibration.mwd_record import ACCELEROMETER_VOLTS_PER_G, MAGNETOMETER_VOLTS_PER_MICROTESLA
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
