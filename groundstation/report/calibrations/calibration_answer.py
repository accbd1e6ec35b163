"""A calibration as it was asked for: the kind of the request says which."""

from __future__ import annotations

from groundstation.report.calibrations.allan_outcome import answer_allan
from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome
from groundstation.report.calibrations.calibration_request import (
    AllanRequest,
    AttitudesRequest,
    CalibrationRequest,
    MagnetometerRequest,
    MwdRequest,
    TurntableRequest,
)
from groundstation.report.calibrations.linear_outcome import answer_attitudes, answer_turntable
from groundstation.report.calibrations.quality_outcome import answer_quality
from groundstation.report.calibrations.triad_outcome import answer_magnetometer, answer_mwd


def answer_calibration(request: CalibrationRequest, day: str) -> CalibrationOutcome:
    """Outcome of a request; ``day`` is that of the calibration, as 2025-12-31.

    Raises
    ------
    CalibrationError
        The file and line, what was expected and what came.
    """
    match request:
        case TurntableRequest():
            return answer_turntable(request, day)
        case AttitudesRequest():
            return answer_attitudes(request, day)
        case MwdRequest():
            return answer_mwd(request, day)
        case MagnetometerRequest():
            return answer_magnetometer(request, day)
        case AllanRequest():
            return answer_allan(request, day)
        case _:
            return answer_quality(request, day)
