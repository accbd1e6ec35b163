"""From calibrations, as they are solved and filed, to the parameter block of a node."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from groundstation.calibration.block import Array, Calibration, read
from groundstation.calibration.errors import CalibrationError
from telemetry.messages import Matrix3, Vector3
from telemetry.parameters import POWERS, ParameterBlock, SensorParameters

IDENTITY = "identity"  # name that asks for no correction instead of a file
NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")


def sensor_parameters(calibration: Calibration) -> SensorParameters:
    """What a node applies of a calibration.

    Raises
    ------
    CalibrationError
        When it follows the temperature to a higher power than a node does.
    """
    for name in ("matrix_slopes", "bias_slopes"):
        if (powers := len(getattr(calibration, name))) > POWERS:
            raise CalibrationError(f"{name}: expected at most {POWERS} powers of the temperature, got {powers}")
    matrices = np.zeros((POWERS, 3, 3))
    biases = np.zeros((POWERS, 3))
    matrices[: len(calibration.matrix_slopes)] = calibration.matrix_slopes
    biases[: len(calibration.bias_slopes)] = calibration.bias_slopes
    return SensorParameters(
        matrix=_matrix(calibration.matrix),
        bias=_vector(calibration.bias),
        matrix_slopes=(_matrix(matrices[0]), _matrix(matrices[1]), _matrix(matrices[2])),
        bias_slopes=_matrix(biases),
        reference=calibration.reference,
    )


def block_of(
    tube: int, version: int, gyroscope: Calibration | None, accelerometer: Calibration | None
) -> ParameterBlock:
    """Block of two calibrations; None leaves a sensor's readings as they are.

    Raises
    ------
    CalibrationError
        When a calibration is that of another sensor.
    """
    sensors = {}
    for name, calibration in (("gyroscope", gyroscope), ("accelerometer", accelerometer)):
        if calibration is not None and calibration.sensor != name:
            raise CalibrationError(f"sensor: expected {name}, got {calibration.sensor}")
        sensors[name] = SensorParameters() if calibration is None else sensor_parameters(calibration)
    return ParameterBlock(tube, version, **sensors)


def block_of_files(folder: Path, tube: int, version: int, gyroscope: str, accelerometer: str) -> ParameterBlock:
    """Block of two files ``NAME.json`` of ``folder``, or of ``identity`` where a sensor is to stay as it is.

    Raises
    ------
    CalibrationError
        When a name is none, its file holds no calibration or one of another sensor.
    """
    return block_of(tube, version, _read(folder, gyroscope), _read(folder, accelerometer))


def _read(folder: Path, name: str) -> Calibration | None:
    if not NAME.fullmatch(name):
        raise CalibrationError(f"expected the name of a file below {folder} without its .json, got {name!r:.80}")
    return None if name == IDENTITY else read(folder / f"{name}.json")


def _vector(values: Array) -> Vector3:
    return float(values[0]), float(values[1]), float(values[2])


def _matrix(rows: Array) -> Matrix3:
    return _vector(rows[0]), _vector(rows[1]), _vector(rows[2])
