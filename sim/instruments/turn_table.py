"""A gyroscope on a turn table, with its matrix and bias known. Source: thesis appendix III."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.calibration.calibration_records import AXES, TURN_TABLE_HEADERS
from sim.instruments.instrument import Records
from sim.world.random_streams import RandomStream, random_stream

Array = npt.NDArray[np.float64]
REFERENCE_DPS = 720.0
SCALE_STD, MISALIGNMENT_STD = 5e-3, 1e-2
BIAS_STD_DPS, NOISE_STD_DPS, AXIS_STD = 2.0, 0.01, 1e-4  # of the sensor, of a mean reading, of the table (rad)


def turn_table(
    random: np.random.Generator,
    matrix: Array,
    bias: Array,
    reference: float,
    noise_std: float = 0.0,
    axis_std: float = 0.0,
) -> Array:
    """Table (3, 6) of mean readings, G = M w + b: row = the axis turned, column pair = the sensor's axis, + then -.

    ``noise_std`` is of each mean; ``axis_std`` (rad) is the rig's misalignment across the axis turned, each way, fixed.
    """
    table = np.empty((3, 6))
    for turned in range(3):
        across = axis_std * random.standard_normal(3)
        across[turned] = 0.0
        axis = np.eye(3)[turned] + across
        axis /= np.linalg.norm(axis)
        for way, sign in enumerate((1.0, -1.0)):
            table[turned, way::2] = matrix @ (sign * reference * axis) + bias + noise_std * random.standard_normal(3)
    return table


def simulate_records(seed: int) -> Records:
    """Table of one gyroscope, deg/s."""
    random = random_stream(seed, RandomStream.TURN_TABLE)
    matrix = np.eye(3) + MISALIGNMENT_STD * random.standard_normal((3, 3))
    np.fill_diagonal(matrix, 1.0 + SCALE_STD * random.standard_normal(3))
    bias = BIAS_STD_DPS * random.standard_normal(3)
    table = turn_table(random, matrix, bias, REFERENCE_DPS, NOISE_STD_DPS, AXIS_STD)
    lines = [
        f"# Synthetic gyroscope {seed}, turned at +-{REFERENCE_DPS:g} deg/s about each axis; mean readings in deg/s.",
        TURN_TABLE_HEADERS[0],
        *(",".join([axis, *(f"{value:.6f}" for value in row)]) for axis, row in zip(AXES, table, strict=True)),
    ]
    truth = {"reference_dps": REFERENCE_DPS, "matrix": matrix.tolist(), "bias_dps": bias.tolist()}
    return Records({"turntable.csv": ("\n".join(lines) + "\n").encode()}, {"turntable": truth})
