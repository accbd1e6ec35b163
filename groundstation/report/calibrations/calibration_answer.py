"""A calibration as it was asked for: the kind of the request says which."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from groundstation.report.calibrations.allan_outcome import answer_allan
from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome
from groundstation.report.calibrations.calibration_request import (
    AllanRequest,
    AttitudesRequest,
    CalibrationRequest,
    MagnetometerRequest,
    MwdRequest,
    QualityRequest,
    RestsRequest,
    TemperatureRequest,
    TurntableRequest,
)
from groundstation.report.calibrations.linear_outcome import answer_attitudes, answer_turntable
from groundstation.report.calibrations.quality_outcome import answer_quality
from groundstation.report.calibrations.rests_outcome import answer_rests
from groundstation.report.calibrations.temperature_outcome import answer_temperature
from groundstation.report.calibrations.triad_outcome import answer_magnetometer, answer_mwd


def answer_calibration(request: CalibrationRequest, day: str) -> CalibrationOutcome:
    """Outcome of a request; ``day`` is that of the calibration, as 2025-12-31.

    Raises
    ------
    CalibrationError
        The file and line, what was expected and what came.
    """
    answers: dict[type, Callable[[Any, str], CalibrationOutcome]] = {
        TurntableRequest: answer_turntable,
        AttitudesRequest: answer_attitudes,
        MwdRequest: answer_mwd,
        MagnetometerRequest: answer_magnetometer,
        AllanRequest: answer_allan,
        RestsRequest: answer_rests,
        QualityRequest: answer_quality,
        TemperatureRequest: answer_temperature,
    }
    return answers[type(request)](request, day)
