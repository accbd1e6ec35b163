"""Static readings of one triad with their references, and the refusal of anything else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.calibration.mwd_cost import SPAN, Problem
from groundstation.calibration.mwd_model import (
    ACCELEROMETER_AXES,
    LOCAL,
    MAGNETOMETER_AXES,
    POWERS,
    REFERENCE_TEMPERATURE,
    Triad,
    axis_signs,
    vertical_directions,
)
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
ACCELEROMETER_VOLTS_PER_G = 3.0
MAGNETOMETER_VOLTS_PER_MICROTESLA = 0.06
GROSS = 0.3  # of the reference, size error that is a wrong unit or a wrong row


@dataclass(frozen=True, slots=True)
class TriadRecord:
    """Static readings of one triad and their references, all (n,) but ``volts`` and ``axis`` (n, 3)."""

    volts: Array
    temperature: Array  # C
    size: Array  # g or microtesla
    axis: Array  # unit vectors from which the angle counts
    angle: Array  # rad
    axes: str
    volts_per_unit: float

    @property
    def unit(self) -> float:
        """Size in which the solver counts."""
        return float(np.mean(self.size))

    def problem(self, parameters: int) -> Problem:
        """The cost in reduced quantities."""
        unit = self.unit
        return Problem(
            self.volts / (self.volts_per_unit * unit),
            (self.temperature - REFERENCE_TEMPERATURE) / SPAN,
            self.size / unit,
            self.angle,
            self.axis,
            axis_signs(self.axes),
            1 if parameters == LOCAL else POWERS,
        )

    def triad(self, x: Array, base: float = 1.0) -> Triad:
        """Coefficients in their own units of the reduced parameters x; ``base`` 0 for their standard errors."""
        p = (len(x) - 6) // 6
        reduced = SPAN ** -np.arange(p, dtype=np.float64)
        scale, bias = np.zeros((3, POWERS)), np.zeros((3, POWERS))
        scale[:, :p] = self.volts_per_unit * x[: 3 * p].reshape(3, p) * reduced
        scale[:, 0] += self.volts_per_unit * base
        bias[:, :p] = self.unit * x[3 * p : 6 * p].reshape(3, p) * reduced
        return Triad(self.axes, scale, bias, x[6 * p :].copy())


def accelerometer_record(
    volts: Array, temperature: Array, tilt: Array, volts_per_g: float = ACCELEROMETER_VOLTS_PER_G
) -> TriadRecord:
    """References of the accelerometers: 1 g, and the angle from the tool's axis."""
    n = len(volts)
    axis = np.tile([0.0, 0.0, 1.0], (n, 1))
    return TriadRecord(volts, temperature, np.ones(n), axis, tilt, ACCELEROMETER_AXES, volts_per_g)


def magnetometer_record(
    volts: Array,
    temperature: Array,
    gravity: Array,
    size: Array | float,
    dip: Array | float,
    volts_per_microtesla: float = MAGNETOMETER_VOLTS_PER_MICROTESLA,
) -> TriadRecord:
    """References of the magnetometers: the site's field, and its angle from the vertical."""
    sizes = np.broadcast_to(np.asarray(size, np.float64), (len(volts),))
    angles = np.broadcast_to(np.pi / 2.0 - np.asarray(dip, np.float64), (len(volts),))
    return TriadRecord(
        volts, temperature, sizes, vertical_directions(gravity), angles, MAGNETOMETER_AXES, volts_per_microtesla
    )


def check_record(record: TriadRecord, parameters: int) -> None:
    """Refuse an invalid record.

    Raises
    ------
    CalibrationError
        Naming the reading and what was expected of it.
    """
    n = len(record.volts)
    columns = {"temperature": record.temperature, "size": record.size, "angle": record.angle}
    if parameters not in (LOCAL, 30):
        raise CalibrationError(f"expected 12 or 30 parameters, got {parameters}")
    if (
        {record.volts.shape, record.axis.shape} != {(n, 3)}
        or any(c.shape != (n,) for c in columns.values())
        or 2 * n < parameters
    ):
        raise CalibrationError(f"expected at least {parameters // 2} readings of 3 voltages with references, got {n}")
    for name, column in {"volts": record.volts.sum(axis=1), "axis": record.axis.sum(axis=1), **columns}.items():
        _refuse(~np.isfinite(column), f"{name} is not finite")
    _refuse((record.angle < 0.0) | (record.angle > np.pi), "angle outside 0..pi rad; degrees?")
    _refuse((record.temperature < -60.0) | (record.temperature > 250.0), "temperature outside -60..250 C; kelvin?")
    ratio = np.linalg.norm(record.volts, axis=1) / (record.volts_per_unit * record.size)
    _refuse(
        np.abs(ratio - 1.0) > GROSS, "voltages do not add up to the reference within 30 %; units, saturation or motion?"
    )


def _refuse(bad: npt.NDArray[np.bool_], why: str) -> None:
    if np.any(bad):
        raise CalibrationError(f"reading {int(np.argmax(bad)) + 1}: {why}")
