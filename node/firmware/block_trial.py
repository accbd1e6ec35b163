"""Parameter blocks on the node: what is refused, what is waited for, and the record that the kernel reads."""

from __future__ import annotations

import enum
from typing import Any

import numpy as np

from node.kernels.arithmetic.formats import DEG, Array
from node.kernels.filter.modes import UNBIASED_STILL_RATE
from node.kernels.sensors.correction import COLDEST, HOTTEST, USUAL, correct_cycle, identity_parameters
from telemetry.messages import Vector3
from telemetry.parameters import (
    MAX_BIAS,
    MAX_CONDITION,
    MAX_DISTANCE,
    MAX_DRIFT,
    MAX_FORCE_ERROR,
    POWERS,
    ParameterBlock,
    SensorParameters,
)

STILL_CYCLES = 4  # that must agree before a block is applied
DIFFER_CYCLES = 8  # that must contradict before it is refused
SENSORS = ("gyroscope", "accelerometer")


class TrialVerdict(enum.Enum):
    """What a trial has come to."""

    WAIT = enum.auto()
    APPLY = enum.auto()
    REFUSE = enum.auto()


def record_of(block: ParameterBlock) -> Array:
    """The block as one record of dtype ``PARAMETERS``."""
    made = identity_parameters()
    if block.gyroscope == block.accelerometer == SensorParameters():
        return made
    made["identity"] = 0
    for name in SENSORS:
        sensor: SensorParameters = getattr(block, name)
        made[0][name]["matrix"] = np.array([sensor.matrix, *sensor.matrix_slopes])
        made[0][name]["bias"] = np.array([sensor.bias, *sensor.bias_slopes])
        made[0][name]["reference"] = sensor.reference
    return made


def unfit_reason(block: ParameterBlock, tube: int) -> str:
    """Why a block can be used on no reporter, on this tube; empty when it can. For a block that was accepted once."""
    if block.tube != tube:
        return f"tube: expected {tube}, got {block.tube}"
    for name in SENSORS:
        if reason := _unfit_sensor(getattr(block, name), MAX_BIAS[name]):
            return f"{name}: {reason}"
    return ""


def refusal_reason(block: ParameterBlock, tube: int, in_use: ParameterBlock) -> str:
    """Why a block that arrives is not taken; empty when it may be tried."""
    if block.version <= in_use.version:
        return f"version: expected newer than {in_use.version}, got {block.version}"
    if reason := unfit_reason(block, tube):
        return reason
    for name in SENSORS:
        matrix, before = np.array(getattr(block, name).matrix), np.array(getattr(in_use, name).matrix)
        distance = min(_distance(matrix, np.eye(3)), _distance(matrix, before))
        if distance > MAX_DISTANCE:
            return f"{name}: expected a matrix within {MAX_DISTANCE} of the identity or the last, got {distance:.3g}"
    return ""


def recorrect_ring(state: Any, before: ParameterBlock, after: ParameterBlock, temperature: float) -> None:
    """Read the cycles that are still in the ring, which ``before`` corrected, by ``after`` instead."""
    for name, ring in (("gyroscope", "ring_rate"), ("accelerometer", "ring_force")):
        old, new = getattr(before, name), getattr(after, name)
        if old != new:
            matrix, bias = model_at(old, temperature)
            raw = state[ring] @ matrix.T + bias
            matrix, bias = model_at(new, temperature)
            state[ring] = np.linalg.solve(matrix, (raw - bias).T).T
    if before.gyroscope != after.gyroscope:
        state["ring_split"] = 0


def model_at(sensor: SensorParameters, temperature: float) -> tuple[Array, Array]:
    """M (3, 3) and b (3) at a temperature (C), which is kept within the range that is followed."""
    kept = min(max(temperature, COLDEST), HOTTEST) if np.isfinite(temperature) else USUAL
    powers = (kept - sensor.reference) ** np.arange(POWERS + 1)
    matrix = np.tensordot(powers, np.array([sensor.matrix, *sensor.matrix_slopes]), axes=1)
    return matrix, powers @ np.array([sensor.bias, *sensor.bias_slopes])


class Trial:
    """A checked block and the question whether it fits a node that stands still, before it is taken for good.

    At rest the corrected rate is near zero and the corrected force is gravity. A block that would make a body at rest
    look turning must never be used: the node would never count as standing still again and take no further block.
    """

    def __init__(self, block: ParameterBlock, gravity: float) -> None:
        self.block = block
        self.reason = ""
        self._gravity = gravity
        self._record = record_of(block)
        self._agreed = 0
        self._differed = 0

    def judge_reading(
        self, rate: Vector3, force: Vector3, temperature: float, *, standing: bool, quiet: bool
    ) -> TrialVerdict:
        """Try one cycle's raw reading (rad/s, m/s^2, C).

        ``standing`` is what the node takes for rest, ``quiet`` whether it knows it by the block in use.
        """
        w, f = np.array(rate), np.array(force)
        correct_cycle(self._record[0], temperature, w, f)
        if not standing or not (np.all(np.isfinite(w)) and np.all(np.isfinite(f))):
            self._agreed = self._differed = 0
            return TrialVerdict.WAIT
        fastest, weight = float(np.abs(w).max()), float(np.linalg.norm(f))
        if fastest < UNBIASED_STILL_RATE and abs(weight - self._gravity) <= MAX_FORCE_ERROR * self._gravity:
            self._agreed, self._differed = self._agreed + 1, 0
            return TrialVerdict.APPLY if self._agreed >= STILL_CYCLES else TrialVerdict.WAIT
        self._agreed, self._differed = 0, self._differed + int(quiet)
        if self._differed < DIFFER_CYCLES:
            return TrialVerdict.WAIT
        self.reason = f"at rest it gives {fastest / DEG:.3g} deg/s and {weight:.4g} m/s^2"
        return TrialVerdict.REFUSE


def _unfit_sensor(sensor: SensorParameters, max_bias: float) -> str:
    coefficients = np.array([sensor.matrix, *sensor.matrix_slopes])
    biases = np.array([sensor.bias, *sensor.bias_slopes])
    if not (np.all(np.isfinite(coefficients)) and np.all(np.isfinite(biases)) and np.isfinite(sensor.reference)):
        return "expected finite numbers, got some that are not"
    if not COLDEST <= sensor.reference <= HOTTEST:
        return f"expected a reference of {COLDEST:g}..{HOTTEST:g} C, got {sensor.reference:.4g}"
    for temperature in np.linspace(COLDEST, HOTTEST, 22):
        matrix, bias = model_at(sensor, float(temperature))
        where = f"at {temperature:.0f} C"
        if not np.linalg.cond(matrix) <= MAX_CONDITION or np.linalg.det(matrix) <= 0.0:
            return f"expected a right-handed matrix of condition up to {MAX_CONDITION:g} {where}"
        if not _distance(matrix, coefficients[0]) <= MAX_DRIFT:
            return f"expected a matrix that drifts by at most {MAX_DRIFT:g} {where}"
        if not np.abs(bias).max() <= max_bias:
            return f"expected a bias of at most {max_bias:.3g} {where}, got {np.abs(bias).max():.3g}"
    return ""


def _distance(matrix: Array, other: Array) -> float:
    return float(np.abs(matrix - other).max())
