"""From calibrations, as they are solved and filed, to the parameter block of a node."""

from __future__ import annotations

import re
from pathlib import Path

from telemetry.calibration import Calibration, read_calibration, sensor_parameters
from telemetry.errors import CalibrationError
from telemetry.parameters import ParameterBlock, SensorParameters

IDENTITY = "identity"  # name that asks for no correction instead of a file
NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")


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
        When a name is invalid, or its file holds no calibration or that of another sensor.
    """
    return block_of(tube, version, _read_block_file(folder, gyroscope), _read_block_file(folder, accelerometer))


def _read_block_file(folder: Path, name: str) -> Calibration | None:
    if not NAME.fullmatch(name):
        raise CalibrationError(f"expected the name of a file below {folder} without its .json, got {name!r:.80}")
    return None if name == IDENTITY else read_calibration(folder / f"{name}.json")
