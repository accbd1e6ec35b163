"""The tube's axis in an IMU's frame, from gravity's direction over slow turns of the tube, in constant memory.

Gravity's direction u = -f / |f| goes round the axis while the tube turns. Two estimators of the middle of that circle,
from the same pass: a circle fitted by least squares, its phase known from the gyroscope, and half the sum of the
extremes of each axis. Pitch p and roll r of the offset are those that a tube shows whose axis hangs plumb:
axis = (sin p, cos p sin r, cos p cos r).
"""

from __future__ import annotations

import math
from typing import Any, Final

from node.kernels.arithmetic.circular import arcsine, arctangent
from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import (
    bounded_ratio,
    by_type,
    half_of,
    mean_of_total,
    over_factor,
    taken_where,
    times_factor,
    vector_length,
)
from node.kernels.arithmetic.quantity import ONE
from node.kernels.sensors.integer_circle import fit_in_integers, holds_integer_sums
from node.kernels.sensors.integer_extremes import LIMIT, PHASES, STEP, std_in_integers
from node.kernels.sensors.sweep import FREEDOMS, LEAST_WEIGHT

CIRCLE, EXTREMES = 1, 2  # estimators; 0 is no alignment
FITS: Final = 3  # of the circle, each in the frame that the last one found


@kernel
def to_tube(axis: Array, vector: Array) -> None:
    """Turn ``vector`` (3) of the IMU's frame into the tube's, in place, by the smallest rotation of ``axis`` to z.

    A rotation without a part about the axis: the yaw keeps the zero of the tube's marks. No alignment touches no bit.
    """
    if axis[0] == 0 and axis[1] == 0:
        return
    across = times_factor(vector[0], axis[0]) + times_factor(vector[1], axis[1])
    pull = over_factor(across, ONE + axis[2]) + vector[2]
    vector[0] -= times_factor(pull, axis[0])
    vector[1] -= times_factor(pull, axis[1])
    vector[2] = across + times_factor(vector[2], axis[2])


@kernel
def fit_circle(sweep: Any, offset: Any) -> int:
    """Least squares of the circle over ``sweep``, into ``offset``; 0 when the sums determine none.

    Seen along the axis it is a circle and askew an ellipse, so the fit is repeated in the frame that it found: all sums
    turn with the frame.
    """
    offset.axis[0], offset.axis[1] = 0, 0
    offset.axis[2] = ONE
    for _ in range(FITS):
        if fit_along(sweep, offset) == 0:
            return 0
        place_axis(offset, sweep.u[0], sweep.u[1], sweep.u[2], offset.lean_std)
    return 1


@taken_where(holds_integer_sums, fit_in_integers)
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
    spin, angle_spin = complex_of(sweep.sum_spin), complex_of(sweep.sum_angle_spin)
    first = (sweep.sum_angle_squares * spin - sweep.sum_angle * angle_spin) / determinant  # B^-1 v
    second = (n * angle_spin - sweep.sum_angle * spin) / determinant
    weight = n - (spin.conjugate() * first + angle_spin.conjugate() * second).real
    if weight <= LEAST_WEIGHT * n:
        return 0
    across, axis = sweep.across, offset.axis
    look_along(axis, across)
    total, back, angle_back, squares, along = 0.0j, 0.0j, 0.0j, 0.0, 0.0
    for i in range(3):
        row = complex_of(across[i])
        total += row * sweep.sum[i]
        back += row * complex_of(sweep.sum_back[i])
        angle_back += row * complex_of(sweep.sum_angle_back[i])
        along += axis[i] * sweep.sum[i] / n
        for j in range(3):
            squares += (row * complex_of(across[j]).conjugate()).real * sweep.sum_products[i, j]
    middle = (total - first.conjugate() * back - second.conjugate() * angle_back) / weight
    left, angle_left = back - middle * spin, angle_back - middle * angle_spin
    radius = (sweep.sum_angle_squares * left - sweep.sum_angle * angle_left) / determinant
    drift = (n * angle_left - sweep.sum_angle * left) / determinant
    explained = middle.conjugate() * total + radius.conjugate() * back + drift.conjugate() * angle_back
    offset.noise = math.sqrt(max(squares - explained.real, 0.0) / (2.0 * n - FREEDOMS))
    offset.lean = math.atan2(abs(radius + drift * (sweep.sum_angle / n)), abs(along))
    offset.lean_std = offset.noise / math.sqrt(weight)
    for i in range(3):
        sweep.u[i] = along * axis[i] + (middle * complex_of(across[i]).conjugate()).real
    return 1


@kernel
def complex_of(pair: Array) -> complex:
    """The number of a real and an imaginary part (2)."""
    return complex(pair[0], pair[1])


@kernel
def look_along(axis: Array, across: Array) -> None:
    """Leave the row of ``to_tube`` that gives x + i y, what of a vector lies across ``axis``, in ``across`` (3, 2)."""
    pull = 1.0 / (1.0 + axis[2])
    for k in range(2):
        across[0, k] = -(pull * axis[0] * axis[k])
        across[1, k] = -(pull * axis[1] * axis[k])
        across[2, k] = -axis[k]
    across[0, 0] += 1.0
    across[1, 1] += 1.0


@kernel
def take_extremes(sweep: Any, offset: Any) -> int:
    """Half the sum of the extremes of each axis, into ``offset``; lean and noise are those of the circle.

    The standard error is that of the law of extremes (``extreme_var``), the two of an axis independent.
    """
    if fit_circle(sweep, offset) == 0:
        return 0
    x = half_of(sweep.largest[0] + sweep.least[0])
    y = half_of(sweep.largest[1] + sweep.least[1])
    std = extreme_std(offset.lean, offset.noise, sweep.samples)
    place_axis(offset, x, y, mean_of_total(sweep.sum[2], sweep.samples), std)
    return 1


@by_type(std_in_integers)
def extreme_std(lean: float, noise: float, samples: int) -> float:
    """Standard error (rad) of half the sum of the extremes of a circle of a ``lean``."""
    ratio = math.sin(lean) / max(noise, 1e-12)
    return noise * math.sqrt(0.5 * extreme_var(ratio, samples))


@kernel
def place_axis(offset: Any, x: float, y: float, z: float, std: float) -> None:
    """Axis, pitch and roll of a middle (x, y, z) of gravity's directions; ``std`` of x and of y."""
    size = vector_length(x, y, z)
    offset.axis[0], offset.axis[1], offset.axis[2] = (
        bounded_ratio(x, size),
        bounded_ratio(y, size),
        bounded_ratio(z, size),
    )
    offset.pitch = arcsine(offset.axis[0])
    offset.roll = arctangent(offset.axis[1], offset.axis[2])
    offset.pitch_std = over_factor(std, size)
    offset.roll_std = over_factor(std, size)


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
