"""A calibration as the laboratory sees it: its file, and its model over the temperature."""

from __future__ import annotations

import numpy as np

from groundstation.calibration.temperature import TemperatureModel
from telemetry.calibration import (
    Array,
    Calibration,
    Provenance,
    from_json,
    read_calibration,
    to_json,
    write_calibration,
)

__all__ = [
    "Array",
    "Calibration",
    "Provenance",
    "from_json",
    "model_of",
    "read_calibration",
    "to_json",
    "write_calibration",
]


def model_of(calibration: Calibration) -> TemperatureModel:
    """Bias and matrix of a calibration as polynomials in the temperature."""
    bias = np.concatenate([calibration.bias[np.newaxis], calibration.bias_slopes])
    matrix = np.concatenate([calibration.matrix[np.newaxis], calibration.matrix_slopes])
    return TemperatureModel(calibration.reference, bias, matrix)
