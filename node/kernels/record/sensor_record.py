"""Records of what the sensors of a node keep: their mounts, an alignment's sums, a static record, their parameters."""

from __future__ import annotations

from typing import Final

import numpy as np

from node.kernels.arithmetic.formats import Array

MAX_IMUS: Final = 8  # of a cluster
MOUNT: Final = np.dtype(
    [
        ("method", "i8"),  # of the alignment in use: 0 none, 1 circle, 2 extremes
        ("aligning", "i8"),  # 1 while one is under way
        ("axis", "f8", (MAX_IMUS, 3)),  # unit vector, of the tube's axis, frame of each IMU
        ("std", "f8", (MAX_IMUS, 2)),  # rad, of pitch and roll
        ("rate_offset", "f8", (MAX_IMUS, 3)),  # rad/s, at rest, of each gyroscope against the mean of the cluster
        ("rate_samples", "i8"),  # cycles of which that is the mean
    ],
    align=True,
)


def new_mount() -> Array:
    """Mount of IMUs never aligned, one record of dtype ``MOUNT``: the axis of each is taken for the tube's."""
    made = np.zeros(1, MOUNT)
    made[0]["axis"][:, 2] = 1.0
    return made


SWEEP: Final = np.dtype(
    [
        ("samples", "i8"),  # cycles taken in
        ("sum", "f8", (3,)),  # sum of u, gravity's direction
        ("sum_products", "f8", (3, 3)),  # sum of u u^T
        ("sum_angle", "f8"),  # rad, sum of the angles turned
        ("sum_angle_squares", "f8"),  # rad^2, sum of their squares
        ("sum_spin", "f8", (2,)),  # sum of exp(i angle)
        ("sum_angle_spin", "f8", (2,)),  # sum of angle exp(i angle)
        ("sum_back", "f8", (3, 2)),  # sum of u exp(i angle)
        ("sum_angle_back", "f8", (3, 2)),  # sum of angle u exp(i angle)
        ("least", "f8", (2,)),  # least u_x and u_y
        ("largest", "f8", (2,)),  # largest u_x and u_y
        # work space
        ("u", "f8", (3,)),  # direction of gravity
        ("across", "f8", (3, 2)),  # row that gives what of a vector lies across the axis
    ],
    align=True,
)
OFFSET: Final = np.dtype(
    [
        ("axis", "f8", (3,)),  # unit vector, of the tube's axis in the IMU's frame
        ("pitch", "f8"),  # rad, of the offset
        ("roll", "f8"),  # rad, likewise
        ("pitch_std", "f8"),  # rad, standard error of the pitch
        ("roll_std", "f8"),  # rad, likewise of the roll
        ("lean", "f8"),  # rad, of the axis against the vertical
        ("lean_std", "f8"),  # rad, standard error of that
        ("noise", "f8"),  # rad, of one sample
    ],
    align=True,
)
STATIC: Final = np.dtype(
    [
        ("samples", "i8"),  # cycles taken in
        ("mean", "f8", (6,)),  # rad/s, then m/s^2
        ("scatter", "f8", (6, 6)),  # sum of the products of deviations from the mean
        ("last", "f8", (6,)),  # newest reading
        ("steps", "f8", (6,)),  # sum of the squared differences of neighbours
        ("temperature", "f8"),  # C, mean
        ("moved", "i8"),  # 1: it was not at rest all the time
        ("delta", "f8", (6,)),  # work space: what the newest differs from the mean by
    ],
    align=True,
)
TERMS: Final = 4  # of a polynomial in T - T_ref, the constant included
SENSOR: Final = [
    ("matrix", "f8", (TERMS, 3, 3)),  # 1, 1/K, 1/K^2, 1/K^3
    ("bias", "f8", (TERMS, 3)),  # rad/s or m/s^2, the same per K, K^2, K^3
    ("reference", "f8"),  # C
    ("m", "f8", (3, 3)),  # work space
]
PARAMETERS: Final = np.dtype(
    [("identity", "i8"), ("gyroscope", np.dtype(SENSOR, align=True)), ("accelerometer", np.dtype(SENSOR, align=True))],
    align=True,
)
