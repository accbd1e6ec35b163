"""Quality control of an MWD tool, with everything that is written of it."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

from groundstation.calibration.mwd_files import read_mwd
from groundstation.calibration.mwd_model import nominal_triad, tool_readings
from groundstation.calibration.mwd_record import ACCELEROMETER_VOLTS_PER_G, MAGNETOMETER_VOLTS_PER_MICROTESLA
from groundstation.calibration.quality import QualityReport, judge_readings
from groundstation.report.calibration_sheets import quality_sheet
from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome
from groundstation.report.calibrations.calibration_request import QualityRequest
from groundstation.report.calibrations.triad_files import (
    ACCELEROMETERS,
    MAGNETOMETERS,
    calibration_label,
    read_triad_file,
)
from telemetry.errors import CalibrationError


def answer_quality(request: QualityRequest, day: str) -> CalibrationOutcome:
    """Spread of inclination, azimuth and |G| over readings at twelve tool faces, and whether the tool passes.

    Raises
    ------
    CalibrationError
        The file and line, what was expected and what came.
    """
    record = read_mwd(request.file, request.full_scale)
    a = read_triad_file(request.accelerometers, ACCELEROMETERS)
    m = read_triad_file(request.magnetometers, MAGNETOMETERS)
    gravity = a.triad() if a is not None else nominal_triad("ABC", ACCELEROMETER_VOLTS_PER_G)
    field = m.triad() if m is not None else nominal_triad("XYZ", MAGNETOMETER_VOLTS_PER_MICROTESLA)
    seen = tool_readings(gravity, field, record.gravity_volts, record.magnetic_volts(), record.temperature)
    try:
        report = judge_readings(seen)
    except CalibrationError as error:
        raise record.located(error) from error
    used = {
        "accelerometers": calibration_label(request.accelerometers, a),
        "magnetometers": calibration_label(request.magnetometers, m),
    }
    result = quality_result(report) | used | {"date": day, "record_sha256": record.sha256}
    sheet = quality_sheet(
        report, [("Accelerometers", used["accelerometers"]), ("Magnetometers", used["magnetometers"])]
    )

    def panels() -> Sequence[Any]:
        from groundstation.report.calibration_plots import quality_panels

        return quality_panels(report)

    return CalibrationOutcome(result, json.dumps(result, indent=1) + "\n", None, record.sha256, sheet, panels)


def quality_result(report: QualityReport) -> dict[str, Any]:
    """Verdicts and readings as one object; angles in deg."""
    verdicts = [(v, (math.degrees(1.0), "deg") if v.unit == "rad" else (1.0, v.unit)) for v in report.verdicts]
    return {
        "passed": report.passed,
        "verdicts": [
            {"name": v.name, "spread": k * v.spread, "limit": k * v.limit, "unit": unit, "passed": v.passed}
            for v, (k, unit) in verdicts
        ],
        "tool_face_deg": [math.degrees(v) for v in report.tool_face],
        "inclination_deg": [math.degrees(v) for v in report.inclination],
        "azimuth_deg": [math.degrees(v) for v in report.azimuth],
        "gravity_g": report.gravity_size.tolist(),
    }
