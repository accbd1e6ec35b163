"""What is asked of a calibration: the record, how it was taken, and what is known beside it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from groundstation.calibration.jig import Jig
    from telemetry.records.record_reading import RecordReading

STANDARD_GRAVITY = 9.80665  # m/s^2
UNITS = {  # SI of one unit of the file, and whose unit it is
    "deg/s": (math.pi / 180.0, "gyroscope"),
    "rad/s": (1.0, "gyroscope"),
    "g": (STANDARD_GRAVITY, "accelerometer"),
    "m/s2": (1.0, "accelerometer"),
}
NO_LIMIT = 1e30  # full scale of a sensor that saturates nowhere
JigFigures = tuple[float, float] | None  # deg, standard deviations of attitudes: common to a setting, of each reading


def jig_of(jig_deg: JigFigures) -> Jig | None:
    """Errors of a jig in rad."""
    from groundstation.calibration.jig import Jig

    return None if jig_deg is None else Jig(*map(math.radians, jig_deg))


@dataclass(frozen=True, slots=True)
class TurntableRequest:
    """A triad on a turn table; ``reference`` and ``full_scale`` in ``unit``, that of the file."""

    file: Path
    reference: float
    unit: str = "deg/s"
    jig_deg: JigFigures = None
    temperature_c: float | None = None
    full_scale: float = NO_LIMIT
    force: bool = False


@dataclass(frozen=True, slots=True)
class AttitudesRequest:
    """An accelerometer at preset pitch and roll; ``free_yaw`` is a file with its known matrix, m/s^2."""

    file: Path
    free_yaw: Path | None = None
    jig_deg: JigFigures = None
    temperature_c: float | None = None
    full_scale: float = NO_LIMIT
    force: bool = False


@dataclass(frozen=True, slots=True)
class MwdRequest:
    """Accelerometers of an MWD tool; ``parameters`` is 12 at one temperature, 30 over temperature."""

    file: Path
    parameters: Literal["12", "30"]
    tool_face: bool = False
    jig_deg: JigFigures = None
    full_scale: float = NO_LIMIT
    force: bool = False


@dataclass(frozen=True, slots=True)
class MagnetometerRequest:
    """Magnetometers of an MWD tool; what is not given of field (microtesla) and dip is read from the record."""

    file: Path
    parameters: Literal["12", "30"]
    accelerometers: Path | None = None
    field_ut: float | None = None
    dip_deg: float | None = None
    full_scale: float = NO_LIMIT
    force: bool = False


@dataclass(frozen=True, slots=True)
class QualityRequest:
    """An MWD tool at twelve tool faces of one attitude; a triad without a file has its nominal coefficients."""

    file: Path
    accelerometers: Path | None = None
    magnetometers: Path | None = None
    full_scale: float = NO_LIMIT


@dataclass(frozen=True, slots=True)
class RecordWords:
    """What is told of an IMU's record in words, as ``telemetry.records.record_reading`` reads them."""

    columns: str = ""
    gyro: str = ""
    accel: str = ""
    mag: str = ""
    begin: float = 0.0
    end: float = math.inf
    without: tuple[str, ...] = ()

    def to_reading(self, rate: float | None = None) -> RecordReading:
        """The reading that is meant, of a record of ``rate`` rows a second.

        Raises
        ------
        LoggerError
            When a word cannot be meant; the message names it.
        """
        from telemetry.records.record_reading import reading_of

        return reading_of(
            self.columns, self.gyro, self.accel, self.mag, rate or 0.0, self.begin, self.end, self.without
        )


@dataclass(frozen=True, slots=True)
class AllanRequest:
    """A static record of ``rate`` readings a second, where it has no times; ``unit`` is that of the answer.

    Where the columns have no unit either it is that of the file too, deg/s by default.
    """

    file: Path
    rate: float | None = None
    unit: str = ""
    sensor: str | None = None
    full_scale: float = NO_LIMIT
    words: RecordWords = RecordWords()


@dataclass(frozen=True, slots=True)
class RestsRequest:
    """An IMU laid down at attitudes that are not known; ``gravity`` (m/s^2) of the place."""

    file: Path
    gravity: float = STANDARD_GRAVITY
    rate: float | None = None
    force: bool = False
    words: RecordWords = RecordWords()


@dataclass(frozen=True, slots=True)
class TemperatureRequest:
    """A triad at known truths and several temperatures; ``unit`` of the file, degrees of the polynomials."""

    file: Path
    unit: str = "deg/s"
    bias_degree: int = 2
    matrix_degree: int = 1
    full_scale: float = NO_LIMIT
    force: bool = False


CalibrationRequest = (
    TurntableRequest
    | AttitudesRequest
    | MwdRequest
    | MagnetometerRequest
    | QualityRequest
    | AllanRequest
    | RestsRequest
    | TemperatureRequest
)
