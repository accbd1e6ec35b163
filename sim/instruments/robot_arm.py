"""An accelerometer on a robot arm, with its matrix and bias known. Source: AHRS-calibration paper."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.calibration.calibration_records import ATTITUDES_HEADER, STANDARD_GRAVITY
from sim.instruments.instrument import InstrumentError, Records
from sim.world.random_streams import RandomStream, random_stream

Array = npt.NDArray[np.float64]
PITCHES_DEG = (0.0, 30.0, -30.0, 0.0, 0.0, 60.0, -60.0, 0.0, 0.0, 45.0, -45.0, 0.0)
ROLLS_DEG = (0.0, 0.0, 0.0, 30.0, -30.0, 0.0, 0.0, 90.0, -90.0, 120.0, -120.0, 180.0)
SCALE_STD, MISALIGNMENT_STD = 5e-3, 1e-2
BIAS_STD, NOISE_STD = 0.2, 0.02  # m/s^2, of the sensor and of one reading
ARM_STD = math.radians(0.01)


@dataclass(frozen=True, slots=True)
class ArmRecord:
    """Robot-arm record as published: preset pitch and roll (k,), rad; mean readings (k, 3) with covariance (3, 3)."""

    pitch: Array
    roll: Array
    readings: Array
    cov: Array


def arm_truth(pitch: Array, roll: Array, yaw: float = 0.0) -> Array:
    """Specific force (k, 3) in g at preset attitudes (rad), of a rig frame turned by ``yaw`` (rad) from the sensor's.

    x = sin p, y = cos p sin r, z = cos p cos r. Source: AHRS-calibration paper.
    """
    level = np.stack([np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)], axis=1)
    c, s = math.cos(yaw), math.sin(yaw)
    return np.asarray(level @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T)


def robot_arm(
    random: np.random.Generator,
    pitch: Array,
    roll: Array,
    matrix: Array,
    bias: Array,
    *,
    noise_std: float = 0.0,
    samples: int = 1000,
    attitude_std: float = 0.0,
    yaw: float = 0.0,
) -> ArmRecord:
    """Mean readings G = M f + b at preset attitudes (k,); ``matrix`` maps g to the reading's unit, as published.

    ``noise_std`` is of one of ``samples`` readings of a mean; ``attitude_std`` (rad) is the arm's, in pitch and roll.
    """
    if pitch.ndim != 1 or pitch.shape != roll.shape or samples < 1:
        shapes = f"{pitch.shape}, {roll.shape}, {samples}"
        raise InstrumentError(f"robot arm: expected equal (k,) pitch and roll and samples, got {shapes}")
    errors = attitude_std * random.standard_normal((2, pitch.size))
    mean_std = noise_std / math.sqrt(samples)
    force = arm_truth(pitch + errors[0], roll + errors[1], yaw)
    readings = force @ matrix.T + bias + mean_std * random.standard_normal(force.shape)
    return ArmRecord(pitch, roll, readings, mean_std**2 * np.eye(3))


def simulate_records(seed: int) -> Records:
    """Means of one accelerometer at twelve attitudes, m/s^2."""
    random = random_stream(seed, RandomStream.ROBOT_ARM)
    scale = np.eye(3) + MISALIGNMENT_STD * random.standard_normal((3, 3))
    np.fill_diagonal(scale, 1.0 + SCALE_STD * random.standard_normal(3))
    matrix, bias = STANDARD_GRAVITY * scale, BIAS_STD * random.standard_normal(3)
    pitch, roll = np.radians(PITCHES_DEG), np.radians(ROLLS_DEG)
    record = robot_arm(random, pitch, roll, matrix, bias, noise_std=NOISE_STD, attitude_std=ARM_STD)
    rows = zip(PITCHES_DEG, ROLLS_DEG, record.readings.tolist(), strict=True)
    lines = [
        f"# Synthetic accelerometer {seed} on a robot arm; preset angles in deg, means of 1000 readings in m/s^2.",
        ATTITUDES_HEADER,
        *(f"{k},{p:g},{r:g},{x:.6f},{y:.6f},{z:.6f}" for k, (p, r, (x, y, z)) in enumerate(rows, 1)),
    ]
    truth = {"matrix_mps2_per_g": matrix.tolist(), "bias_mps2": bias.tolist()}
    return Records({"attitudes.csv": ("\n".join(lines) + "\n").encode()}, {"attitudes": truth})
