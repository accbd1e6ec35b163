"""A calibration on a record in time: what becomes of every reading, and how much less it errs.

Source: AHRS laboratory, IV.B, a calibrated sensor's readings before and after. The readings are SI.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.calibration.block import Calibration, model_of
from telemetry.errors import CalibrationError
from telemetry.records.imu_record import ImuRecord
from telemetry.records.sensor_columns import FIELD, FORCE, RATE

Array = npt.NDArray[np.float64]
UNITS = {RATE: "rad/s", FORCE: "m/s2", FIELD: "T"}


@dataclass(frozen=True, slots=True)
class AppliedSeries:
    """Readings (n, 3) of a sensor before and after its calibration, at times (n,) s."""

    sensor: str
    times: Array
    before: Array
    after: Array


@dataclass(frozen=True, slots=True)
class SeriesFigures:
    """What a series says, SI: mean and standard deviation of each axis, and how far its length is from what it is.

    ``off`` is the root mean square of all readings: of an accelerometer at rest from gravity, of a gyroscope at rest
    from zero; not a number of another sensor, whose truth is not told.
    """

    mean: Array
    std: Array
    off: float


def apply_calibration(record: ImuRecord, calibration: Calibration) -> AppliedSeries:
    """A sensor's readings of a record with and without its calibration.

    Raises
    ------
    CalibrationError
        When the calibration follows the temperature and the record has none.
    LoggerError
        When the record has no readings of the sensor, or no times.
    """
    before, model = record.triad(calibration.sensor), model_of(calibration)
    follows = len(calibration.matrix_slopes) + len(calibration.bias_slopes) > 0
    if follows and record.temperature is None:
        raise CalibrationError(f"{record.name}: expected a column of temperatures, which the calibration follows")
    temperature = np.array([model.reference]) if record.temperature is None else record.temperature
    after = model.correct(before, temperature)
    return AppliedSeries(calibration.sensor, record.times(), before, after)


def series_figures(sensor: str, readings: Array, gravity: float) -> SeriesFigures:
    """Figures of readings (n, 3) of a sensor at rest, by gravity (m/s^2); rows without values do not count."""
    kept = readings[np.all(np.isfinite(readings), axis=1)]
    truth = {FORCE: gravity, RATE: 0.0}.get(sensor, math.nan)
    off = math.sqrt(float(np.mean((np.linalg.norm(kept, axis=1) - truth) ** 2)))
    return SeriesFigures(kept.mean(axis=0), kept.std(axis=0), off)
