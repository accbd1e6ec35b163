"""Accelerometer of a tube from static records at preset attitudes, as they are taken in the field.

A tube at rest feels f = -g d, with d = (sin p, cos p sin r, cos p cos r) the direction of gravity in its frame at pitch
p and roll r: at the home position it hangs. Bias and matrix of G = M f + b follow by ``attitudes.fit``, all records
alike, because the rack's angles are less certain than a record's mean. Source: AHRS-calibration paper, eqs. 13-15.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.calibration.attitudes import AttitudeFit, fit_attitudes, true_vectors
from groundstation.calibration.block import Calibration, Provenance
from groundstation.calibration.landing_gates import LARGEST_RESIDUAL, axes_gates
from groundstation.calibration.turntable import correct_readings
from telemetry.errors import CalibrationError
from telemetry.messages import StaticRecord

Array = npt.NDArray[np.float64]
FEWEST = 9  # attitudes; four determine the model, the others judge it
FEWEST_SAMPLES = 8  # of a record
LARGEST_FORCE_ERROR = 0.25  # of gravity; beyond it the unit or the sensor is wrong
LARGEST_CONDITION = 10.0  # of the design; nine tilts up to 90 deg have 1.7 to 3
OUTLIER = 4.0  # times the largest residual of a degree of freedom, of one record


@dataclass(frozen=True, slots=True)
class Rest:
    """A static record and the attitude (rad) at which it was taken."""

    pitch: float
    roll: float
    record: StaticRecord


@dataclass(frozen=True, slots=True)
class FieldResult:
    """Calibration of one tube; ``residual_rms`` (m/s^2) is of one degree of freedom."""

    calibration: Calibration
    fit: AttitudeFit
    residual_rms: float


def calibrate_accelerometer(rests: Sequence[Rest], gravity: float, day: str) -> FieldResult:
    """Calibration of the accelerometer from records at rest; ``gravity`` in m/s^2, ``day`` in ISO 8601.

    Raises
    ------
    CalibrationError
        When a record moved or is invalid, the attitudes are too few or leave something open, or the residuals say that
        an attitude was not the one reported; it names which.
    """
    _check(rests, gravity)
    forces = np.array([rest.record.force for rest in rests])
    solved = fit_attitudes(true_specific_forces(rests, gravity), forces)
    if solved.condition > LARGEST_CONDITION:
        raise CalibrationError(
            f"attitudes: expected a design of condition up to {LARGEST_CONDITION:g}, got {solved.condition:.3g}; "
            f"add attitudes of larger tilt"
        )
    residual_rms = math.sqrt(float(np.sum(solved.residuals**2)) / (3 * (len(rests) - 4)))
    _check_residuals(rests, solved, residual_rms)
    _check_axes(solved.matrix)
    none = np.zeros((0, 3, 3)), np.zeros((0, 3))
    provenance = Provenance(
        input_sha256=_digest(rests, gravity),
        day=day,
        design=f"{len(rests)} attitudes in the field, condition {solved.condition:.3g}",
        residual_rms=residual_rms,
        matrix_std=solved.matrix_std(),
        bias_std=solved.bias_std(),
        matrix_slopes_std=none[0],
        bias_slopes_std=none[1],
    )
    temperature = float(np.mean([rest.record.temperature for rest in rests]))
    calibration = Calibration("accelerometer", solved.matrix, solved.bias, *none, temperature, provenance)
    return FieldResult(calibration, solved, residual_rms)


def true_specific_forces(rests: Sequence[Rest], gravity: float) -> Array:
    """True specific force (n, 3, m/s^2) at each attitude."""
    pitch, roll = np.array([rest.pitch for rest in rests]), np.array([rest.roll for rest in rests])
    return -gravity * true_vectors(pitch, roll)


def inclination_rms(rests: Sequence[Rest], matrix: Array, bias: Array) -> float:
    """Error of the inclination (rad) over the attitudes, rms, of readings corrected by ``matrix`` and ``bias``."""
    forces = correct_readings(np.array([rest.record.force for rest in rests]), matrix, bias)
    errors = force_inclination(forces) - force_inclination(true_specific_forces(rests, 1.0))
    return float(np.sqrt(np.mean(errors**2)))


def force_inclination(forces: Array) -> Array:
    """Inclination (n,) rad in [0, pi] of specific forces (n, 3) at rest."""
    return np.arctan2(np.hypot(forces[:, 0], forces[:, 1]), -forces[:, 2])


def _check(rests: Sequence[Rest], gravity: float) -> None:
    for rest in rests:
        record = rest.record
        if record.moved:
            raise CalibrationError(f"{_name(rest)}: expected a record at rest, it moved; take it again")
        if record.samples < FEWEST_SAMPLES:
            raise CalibrationError(f"{_name(rest)}: expected {FEWEST_SAMPLES} samples or more, got {record.samples}")
        size = math.hypot(*record.force)
        if not abs(size - gravity) <= LARGEST_FORCE_ERROR * gravity:
            raise CalibrationError(f"{_name(rest)}: expected a force near {gravity:g} m/s^2, got {size:.4g}")
    if len(rests) < FEWEST:
        raise CalibrationError(f"attitudes: expected {FEWEST} or more with a record at rest, got {len(rests)}")


def _check_residuals(rests: Sequence[Rest], solved: AttitudeFit, residual_rms: float) -> None:
    sizes = np.linalg.norm(solved.residuals, axis=1)
    worst = int(np.argmax(sizes))
    if residual_rms > LARGEST_RESIDUAL or sizes[worst] > OUTLIER * LARGEST_RESIDUAL:
        raise CalibrationError(
            f"residuals: expected up to {LARGEST_RESIDUAL:g} m/s^2, got {residual_rms:.3g}; the largest, "
            f"{sizes[worst]:.3g}, is at {_name(rests[worst])}: was it this attitude?"
        )


def _check_axes(matrix: Array) -> None:
    failed = [f"{gate.name}: {gate.found}" for gate in axes_gates(matrix) if not gate.holds]
    if failed:
        raise CalibrationError("; ".join(failed))


def _name(rest: Rest) -> str:
    return f"pitch {math.degrees(rest.pitch):.5g} deg, roll {math.degrees(rest.roll):.5g} deg"


def _digest(rests: Sequence[Rest], gravity: float) -> str:
    rows = [[rest.pitch, rest.roll, rest.record.tube, rest.record.sequence, *rest.record.force] for rest in rests]
    return hashlib.sha256(json.dumps([gravity, rows]).encode()).hexdigest()
