"""The tube's axis in an IMU's frame, from gravity's direction over slow turns of the tube, in constant memory.

Gravity's direction u = -f / |f| goes round the axis while the tube turns. Two estimators of the middle of that circle,
from the same pass: a circle fitted by least squares, its phase known from the gyroscope, and half the sum of the
extremes of each axis. Pitch p and roll r of the offset are those that a tube shows whose axis hangs plumb:
axis = (sin p, cos p sin r, cos p cos r).
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from node.kernels.jit import kernel
from node.kernels.layout import Array
from node.kernels.numbers import over, times
from node.kernels.quantity import ONE

MAX_IMUS: Final = 8  # of a cluster
CIRCLE, EXTREMES = 1, 2  # estimators; 0 is no alignment
FREEDOMS: Final = 6  # of the circle: middle, radius and phase, and their drift
LEAST_WEIGHT: Final = 0.2  # of that of as many samples without a turn: half a turn has less
FITS: Final = 3  # of the circle, each in the frame that the last one found
PHASES: Final = 4  # of the sampling against the extremes, over which their law is averaged
LIMIT, STEP = 8.0, 0.1  # sigmas, range and step of the integrals over the law of an extreme

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
SWEEP: Final = np.dtype(
    [
        ("samples", "i8"),  # cycles taken in
        ("sum", "f8", (3,)),  # sum of u, gravity's direction
        ("sum_products", "f8", (3, 3)),  # sum of u u^T
        ("sum_angle", "f8"),  # rad, sum of the angles turned
        ("sum_angle_squares", "f8"),  # rad^2, sum of their squares
        ("sum_spin", "c16"),  # sum of exp(i angle)
        ("sum_angle_spin", "c16"),  # sum of angle exp(i angle)
        ("sum_back", "c16", (3,)),  # sum of u exp(i angle)
        ("sum_angle_back", "c16", (3,)),  # sum of angle u exp(i angle)
        ("least", "f8", (2,)),  # least u_x and u_y
        ("largest", "f8", (2,)),  # largest u_x and u_y
        # work space
        ("u", "f8", (3,)),  # direction of gravity
        ("across", "c16", (3,)),  # row that gives what of a vector lies across the axis
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


def new_mount() -> Array:
    """Mount of IMUs never aligned, one record of dtype ``MOUNT``: the axis of each is taken for the tube's."""
    made = np.zeros(1, MOUNT)
    made[0]["axis"][:, 2] = 1.0
    return made


@kernel
def to_tube(axis: Array, vector: Array) -> None:
    """Turn ``vector`` (3) of the IMU's frame into the tube's, in place, by the smallest rotation of ``axis`` to z.

    A rotation without a part about the axis: the yaw keeps the zero of the tube's marks. No alignment touches no bit.
    """
    if axis[0] == 0 and axis[1] == 0:
        return
    across = times(vector[0], axis[0]) + times(vector[1], axis[1])
    pull = over(across, ONE + axis[2]) + vector[2]
    vector[0] -= times(pull, axis[0])
    vector[1] -= times(pull, axis[1])
    vector[2] = across + times(vector[2], axis[2])


@kernel
def clear_sweep(sweep: Any) -> None:
    """Begin anew; the extremes begin with the first sample."""
    sweep.samples = 0
    sweep.sum_angle, sweep.sum_angle_squares = 0.0, 0.0
    sweep.sum_spin, sweep.sum_angle_spin = 0.0j, 0.0j
    for i in range(3):
        sweep.sum[i] = 0.0
        sweep.sum_back[i], sweep.sum_angle_back[i] = 0.0j, 0.0j
        for j in range(3):
            sweep.sum_products[i, j] = 0.0


@kernel
def add_to_sweep(sweep: Any, force: Array, angle: float) -> None:
    """Take one mean specific force (3, m/s^2, IMU's frame), ``angle`` (rad) the turn so far in the middle of its cycle.

    With u = -f / |f|: sums of u, u u^T, and of the products of 1 and u with exp(i angle) and angle exp(i angle).
    """
    u = sweep.u
    size = math.sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2])
    spin = complex(math.cos(angle), math.sin(angle))
    first = sweep.samples == 0
    sweep.samples += 1
    sweep.sum_angle += angle
    sweep.sum_angle_squares += angle * angle
    sweep.sum_spin += spin
    sweep.sum_angle_spin += angle * spin
    for i in range(3):
        u[i] = -force[i] / size
        sweep.sum[i] += u[i]
        sweep.sum_back[i] += u[i] * spin
        sweep.sum_angle_back[i] += angle * u[i] * spin
    for i in range(3):
        for j in range(3):
            sweep.sum_products[i, j] += u[i] * u[j]
    for i in range(2):
        sweep.least[i] = u[i] if first else min(sweep.least[i], u[i])
        sweep.largest[i] = u[i] if first else max(sweep.largest[i], u[i])


@kernel
def fit_circle(sweep: Any, offset: Any) -> int:
    """Least squares of the circle over ``sweep``, into ``offset``; 0 when the sums determine none.

    Seen along the axis it is a circle and askew an ellipse, so the fit is repeated in the frame that it found: all sums
    turn with the frame.
    """
    offset.axis[0], offset.axis[1], offset.axis[2] = 0.0, 0.0, 1.0
    for _ in range(FITS):
        if fit_along(sweep, offset) == 0:
            return 0
    return 1


@kernel
def fit_along(sweep: Any, offset: Any) -> int:
    """Least squares of q = c + (r + k a) exp(-i a), q = x + i y across ``offset.axis``, a the angle; 0 without answer.

    k takes the gyroscope's drift and scale, which would pull c: a thousandth of scale at 2 deg of lean by 0.002 deg.
    With B = [[n, sum a], [sum a, sum a^2]], v = (sum exp(i a), sum a exp(i a)), w the same of q exp(i a), Q = sum q:
    c = (Q - v* B^-1 w) / (n - v* B^-1 v), (r, k) = B^-1 (w - v c), sigma^2 = (sum |q|^2 - Re(c* Q + r* w_1 + k* w_2))
    / (2 n - 6), and var(c) = sigma^2 / (n - v* B^-1 v) on each axis.
    """
    n = float(sweep.samples)
    determinant = n * sweep.sum_angle_squares - sweep.sum_angle**2
    if 2.0 * n <= FREEDOMS or determinant <= 0.0:
        return 0
    spin, angle_spin = sweep.sum_spin, sweep.sum_angle_spin
    first = (sweep.sum_angle_squares * spin - sweep.sum_angle * angle_spin) / determinant  # B^-1 v
    second = (n * angle_spin - sweep.sum_angle * spin) / determinant
    weight = n - (spin.conjugate() * first + angle_spin.conjugate() * second).real
    if weight <= LEAST_WEIGHT * n:
        return 0
    across, axis = sweep.across, offset.axis
    look_along(axis, across)
    total, back, angle_back, squares, along = 0.0j, 0.0j, 0.0j, 0.0, 0.0
    for i in range(3):
        total += across[i] * sweep.sum[i]
        back += across[i] * sweep.sum_back[i]
        angle_back += across[i] * sweep.sum_angle_back[i]
        along += axis[i] * sweep.sum[i] / n
        for j in range(3):
            squares += (across[i] * across[j].conjugate()).real * sweep.sum_products[i, j]
    middle = (total - first.conjugate() * back - second.conjugate() * angle_back) / weight
    left, angle_left = back - middle * spin, angle_back - middle * angle_spin
    radius = (sweep.sum_angle_squares * left - sweep.sum_angle * angle_left) / determinant
    drift = (n * angle_left - sweep.sum_angle * left) / determinant
    explained = middle.conjugate() * total + radius.conjugate() * back + drift.conjugate() * angle_back
    offset.noise = math.sqrt(max(squares - explained.real, 0.0) / (2.0 * n - FREEDOMS))
    offset.lean = math.atan2(abs(radius + drift * (sweep.sum_angle / n)), abs(along))
    offset.lean_std = offset.noise / math.sqrt(weight)
    for i in range(3):
        sweep.u[i] = along * axis[i] + (middle * across[i].conjugate()).real
    place_axis(offset, sweep.u[0], sweep.u[1], sweep.u[2], offset.lean_std)
    return 1


@kernel
def look_along(axis: Array, across: Array) -> None:
    """Leave the row of ``to_tube`` that gives x + i y, what of a vector lies across ``axis``, in ``across`` (3)."""
    pull = 1.0 / (1.0 + axis[2])
    both = complex(axis[0], axis[1])
    across[0] = 1.0 - pull * axis[0] * both
    across[1] = 1.0j - pull * axis[1] * both
    across[2] = -both


@kernel
def take_extremes(sweep: Any, offset: Any) -> int:
    """Half the sum of the extremes of each axis, into ``offset``; lean and noise are those of the circle.

    The standard error is that of the law of extremes (``extreme_var``), the two of an axis independent.
    """
    if fit_circle(sweep, offset) == 0:
        return 0
    x = 0.5 * (sweep.largest[0] + sweep.least[0])
    y = 0.5 * (sweep.largest[1] + sweep.least[1])
    ratio = math.sin(offset.lean) / max(offset.noise, 1e-12)
    std = offset.noise * math.sqrt(0.5 * extreme_var(ratio, sweep.samples))
    place_axis(offset, x, y, sweep.sum[2] / sweep.samples, std)
    return 1


@kernel
def place_axis(offset: Any, x: float, y: float, z: float, std: float) -> None:
    """Axis, pitch and roll of a middle (x, y, z) of gravity's directions; ``std`` of x and of y."""
    size = math.sqrt(x * x + y * y + z * z)
    offset.axis[0], offset.axis[1], offset.axis[2] = x / size, y / size, z / size
    offset.pitch = math.asin(min(max(offset.axis[0], -1.0), 1.0))
    offset.roll = math.atan2(offset.axis[1], offset.axis[2])
    offset.pitch_std = std / size
    offset.roll_std = std / size


@kernel
def extreme_var(ratio: float, samples: int) -> float:
    """Variance, in units of the noise's, of the largest of noisy samples spread evenly over turns of a circle.

    P(largest < R + z sigma) = prod_k Phi(z + R/sigma (1 - cos a_k)), averaged over the phase of the sampling.

    Parameters
    ----------
    ratio : radius R over the standard deviation sigma of the noise
    samples : of all turns together; their angles a_k are taken as spread evenly over one
    """
    first = second = 0.0
    count = int(2.0 * LIMIT / STEP)
    for phase in range(PHASES):
        below = 0.0
        for m in range(1, count + 1):
            z = -LIMIT + m * STEP
            law = 1.0
            for k in range(samples):
                angle = 2.0 * math.pi * (k + (phase + 0.5) / PHASES) / samples
                level = z + ratio * (1.0 - math.cos(angle))
                if level < LIMIT:
                    law *= 0.5 * math.erfc(-level / math.sqrt(2.0))
            middle = z - 0.5 * STEP
            first += (law - below) * middle
            second += (law - below) * middle * middle
            below = law
    first /= PHASES
    return second / PHASES - first * first
