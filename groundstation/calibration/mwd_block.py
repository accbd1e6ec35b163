"""The file of a calibrated triad of an MWD tool: its coefficients by name and where they come from."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from groundstation.calibration.mwd_model import ACCELEROMETER_AXES, LOCAL, MAGNETOMETER_AXES, Triad
from groundstation.calibration.mwd_solve import MwdFit
from telemetry.bounded_bytes import bounded_text
from telemetry.errors import CalibrationError

FORMAT = 1
SENSORS = {"mwd accelerometers": ACCELEROMETER_AXES, "mwd magnetometers": MAGNETOMETER_AXES}
PARAMETERS = (LOCAL, 30)


@dataclass(frozen=True, slots=True)
class TriadCalibration:
    """Coefficients of a triad by name with their standard errors, V per g or per microtesla, g, microtesla and C.

    ``temperature_c`` is the range they hold in, ``provenance`` the record's hash, the day, the design, the residuals.
    """

    sensor: str
    parameters: int
    coefficients: Mapping[str, float]
    standard_errors: Mapping[str, float]
    temperature_c: tuple[float, float]
    provenance: Mapping[str, Any]

    def __post_init__(self) -> None:
        _expect(self.sensor in SENSORS, "sensor", f"one of {', '.join(SENSORS)}", self.sensor)
        _expect(self.parameters in PARAMETERS, "parameters", "12 or 30", self.parameters)
        _expect(
            set(self.coefficients) == set(self.standard_errors), "standard_errors", "one of each coefficient", "others"
        )
        for name, value in (*self.coefficients.items(), *self.standard_errors.items()):
            number = type(value) in (float, int) and math.isfinite(value)
            _expect(number, name, "a finite number", value)
        self.triad()

    def triad(self) -> Triad:
        """Return the triad that these coefficients describe."""
        return Triad.of(SENSORS[self.sensor], self.coefficients)

    def plain(self) -> dict[str, Any]:
        """Return the content as a JSON object."""
        return {
            "sensor": self.sensor,
            "parameters": self.parameters,
            "coefficients": dict(self.coefficients),
            "standard_errors": dict(self.standard_errors),
            "temperature_c": list(self.temperature_c),
            "provenance": dict(self.provenance),
        }

    def sha256(self) -> str:
        """Hash of the content in canonical JSON: sorted keys, no spaces, shortest decimals."""
        text = json.dumps(self.plain(), sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()


def of_fit(fit: MwdFit, sensor: str, provenance: Mapping[str, Any]) -> TriadCalibration:
    """Return the calibration file's content for a fit."""
    return TriadCalibration(sensor, fit.parameters, fit.coefficients, fit.standard_errors, fit.temperatures, provenance)


def to_json(block: TriadCalibration) -> str:
    """Readable text of a triad with its hash."""
    return json.dumps({"format": FORMAT, "sha256": block.sha256(), "calibration": block.plain()}, indent=1) + "\n"


def read_triad(path: Path, sensor: str) -> TriadCalibration:
    """Calibration of the ``sensor`` that a file holds.

    Raises
    ------
    CalibrationError
        When the file holds none, one of another sensor, or one that was changed after it was written.
    """
    try:
        whole = json.loads(bounded_text(path))
        content = whole["calibration"]
        block = TriadCalibration(**content | {"temperature_c": tuple(content["temperature_c"])})
        written, found = whole["sha256"], block.sha256()
    except OSError as error:
        raise CalibrationError(f"{path.name}: expected a file to read, got {error.strerror}") from error
    except CalibrationError as error:
        raise CalibrationError(f"{path.name}: {error}") from error
    except (ValueError, TypeError, KeyError, RecursionError, AttributeError) as error:
        raise CalibrationError(f"{path.name}: expected the calibration of an MWD triad, got {error!r}") from error
    if block.sensor != sensor:
        raise CalibrationError(f"{path.name}: expected {sensor}, got {block.sensor}")
    if written != found:
        raise CalibrationError(f"{path.name}: sha256: expected {found}, got {written}")
    return block


def _expect(holds: bool, name: str, expected: str, got: object) -> None:
    if not holds:
        raise CalibrationError(f"{name}: expected {expected}, got {got}")
