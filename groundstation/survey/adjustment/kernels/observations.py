"""What a look should read, how that changes with every unknown, and how much it counts.

A tube that lies along the unit vector d and is turned by psi about it reads, at rest,

    f = g (m + t x m + t x (t x m) / 2) + b,    m = (R(-psi) (d_N, d_E), -d_D),    t = (tilt, 0),

and its yaw is psi plus the turn of its chain plus an error of its own, which is estimated look by look: a yaw that is
hardly known puts the lean on a circle, not on a straight line. What is left is linear. A tilt is taken to second order,
for a mount is half a degree off: to first order it would make the force longer by what a bias may be.
Source: thesis eqs. 1.1-1.3; Gauss and Newton's method.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.jit import allocating_kernel, kernel

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]


@kernel
def linearise_looks(
    station: Places, tube: Places, make_up: Places, force: Array, force_var: Array, yaw: Array, yaw_var: Array,
    tangents: Array, bases: Array, tubes: Array, make_ups: Array, gravity: float, play_var: float, jacobians: Array,
    weights: Array, residuals: Array, yaw_errors: Array,
) -> None:  # fmt: skip
    """Linearise every look where the unknowns stand.

    Parameters
    ----------
    station, tube, make_up, force, force_var, yaw, yaw_var : of the looks, see ``Looks``
    tangents, bases : (s + 1, 3) and (s + 1, 2, 3), directions and two unit vectors across each
    tubes, make_ups : (m, 6) and (u,), bias, tilt and turn of every tube, and turn of every make-up
    gravity, play_var : m/s^2, and rad^2 of each axis of the tilt of a tube in the hole
    jacobians : (n, 3, 9) set: change of the force by direction (2), bias (3), tilt (2), turn and gravity
    weights, residuals : (n, 3, 3) and (n, 3) set: inverse covariance, and what was read less what should be
    yaw_errors : (n,) rad, set: the error of each yaw that fits best
    """
    for k in range(len(station)):
        d, basis, own, f = tangents[station[k]], bases[station[k]], tubes[tube[k]], force[k]
        psi = yaw[k] - own[5] - make_ups[make_up[k]]
        c, s = math.cos(psi), math.sin(psi)
        mx, my, mz = c * d[0] + s * d[1], c * d[1] - s * d[0], -d[2]
        tx, ty = own[3], own[4]
        jacobian, weight, residual = jacobians[k], weights[k], residuals[k]
        jacobian[:] = 0.0
        # the yaw's error: that which turns the predicted lean to the measured, as far as the yaw may be wrong
        tilt_force(mx, my, mz, tx, ty, gravity, jacobian[:, 8])
        px, py = jacobian[0, 8] + own[0], jacobian[1, 8] + own[1]
        lean = px * px + py * py
        across = math.atan2(px * f[1] - py * f[0], px * f[0] + py * f[1])
        noise = force_var[k] + gravity * gravity * play_var * mz * mz
        e = across * yaw_var[k] / (yaw_var[k] + noise / max(lean, 1e-12))
        c, s = math.cos(psi - e), math.sin(psi - e)
        mx, my = c * d[0] + s * d[1], c * d[1] - s * d[0]
        for a in range(2):
            v = basis[a]
            tilt_force(c * v[0] + s * v[1], c * v[1] - s * v[0], -v[2], tx, ty, gravity, jacobian[:, a])
        for a in range(3):
            jacobian[a, 2 + a] = 1.0
        along = tx * mx + ty * my
        jacobian[0, 5] = 0.5 * gravity * (along - tx * mx)
        jacobian[1, 5] = gravity * (0.5 * ty * mx - tx * my - mz)
        jacobian[2, 5] = gravity * (my - tx * mz)
        jacobian[0, 6] = gravity * (0.5 * tx * my - ty * mx + mz)
        jacobian[1, 6] = 0.5 * gravity * (along - ty * my)
        jacobian[2, 6] = -gravity * (mx + ty * mz)
        tilt_force(-my, mx, 0.0, tx, ty, gravity, jacobian[:, 7])
        tilt_force(mx, my, mz, tx, ty, 1.0, jacobian[:, 8])
        for a in range(3):
            residual[a] = f[a] - gravity * jacobian[a, 8] - own[a] + jacobian[a, 7] * e
            for b in range(3):
                tilted = jacobian[a, 5] * jacobian[b, 5] + jacobian[a, 6] * jacobian[b, 6]
                weight[a, b] = play_var * tilted + yaw_var[k] * jacobian[a, 7] * jacobian[b, 7]
            weight[a, a] += force_var[k]
        invert_in_place(weight)
        yaw_errors[k] = e


@kernel
def weigh_down(residuals: Array, gross: float, weights: Array, squares: Array) -> None:
    """Let looks count less whose weighted square is more than ``gross``.

    Parameters
    ----------
    residuals, weights : (n, 3) and (n, 3, 3), of the looks; the latter are scaled
    squares : (n,) set: weighted squares as they were
    """
    for k in range(len(squares)):
        r, w, total = residuals[k], weights[k], 0.0
        for a in range(3):
            total += r[a] * (w[a, 0] * r[0] + w[a, 1] * r[1] + w[a, 2] * r[2])
        squares[k] = total
        if total > gross:
            scale = math.sqrt(gross / total)
            for a in range(3):
                for b in range(3):
                    w[a, b] *= scale


@kernel
def tilt_force(mx: float, my: float, mz: float, tx: float, ty: float, scale: float, out: Array) -> None:
    """Set a vector (3,) to scale times (mx, my, mz) as an IMU feels it that is tilted by tx and ty (rad)."""
    along, size = 0.5 * (tx * mx + ty * my), 1.0 - 0.5 * (tx * tx + ty * ty)
    out[0] = scale * (size * mx + ty * mz + along * tx)
    out[1] = scale * (size * my - tx * mz + along * ty)
    out[2] = scale * (size * mz + tx * my - ty * mx)


@kernel
def invert_in_place(m: Array) -> None:
    """Invert a symmetric positive definite matrix (3, 3)."""
    a, b, c, d, e, f = m[0, 0], m[0, 1], m[0, 2], m[1, 1], m[1, 2], m[2, 2]
    ca, cb, cc = d * f - e * e, c * e - b * f, b * e - c * d
    det = a * ca + b * cb + c * cc
    m[0, 0], m[0, 1], m[0, 2] = ca / det, cb / det, cc / det
    m[1, 1], m[1, 2], m[2, 2] = (a * f - c * c) / det, (b * c - a * e) / det, (a * d - b * b) / det
    m[1, 0], m[2, 0], m[2, 1] = m[0, 1], m[0, 2], m[1, 2]


@kernel
def gather_columns(jacobian: Array, extra: Array, residual: Array, rows: Array) -> None:
    """Columns (3, 9 + e) of one look: of its tube, of gravity, of its make-up, further effects, the right side."""
    for i in range(3):
        for a in range(6):
            rows[i, a] = jacobian[i, 2 + a]
        rows[i, 6], rows[i, 7] = jacobian[i, 8], jacobian[i, 7]
        for a in range(extra.shape[1]):
            rows[i, 8 + a] = extra[i, a]
        rows[i, 8 + extra.shape[1]] = residual[i]


@allocating_kernel
def add_looks(
    station: Places, tube: Places, make_up: Places, jacobians: Array, weights: Array, residuals: Array, extra: Array,
    places: Places, gravity_at: int, at_station: Array, coupled: Array, in_common: Array,
) -> None:  # fmt: skip
    """Add the looks to the normal equations.

    Parameters
    ----------
    station, tube, make_up, jacobians, weights, residuals : as they were linearised
    extra : (n, 3, e), columns of further effects
    places : (m, 6), columns of every tube among those of all stations; growing, and of unknowns whose jacobian is zero
        any of its own
    gravity_at : column of gravity; those of the make-ups follow it, and further effects are last
    at_station : (s + 1, 2, 2), information on every direction, added to
    coupled : (s + 1, 2 or more, p + 1), of direction and what stations have in common; the last column is the right
        side
    in_common : (p + 1, p + 1), of what they have in common, symmetric; the last column is the right side
    """
    count = extra.shape[2]
    width = 8 + count
    right = in_common.shape[1] - 1
    at = np.empty(width + 1, np.intp)
    rows = np.empty((3, width + 1))
    weighed = np.empty((3, width + 1))
    for k in range(len(station)):
        j, w = jacobians[k], weights[k]
        for a in range(6):
            at[a] = places[tube[k], a]
        at[6], at[7] = gravity_at, gravity_at + 1 + make_up[k]
        for a in range(count):
            at[8 + a] = right - count + a
        at[width] = right
        gather_columns(j, extra[k], residuals[k], rows)
        for a in range(3):
            for b in range(width + 1):
                weighed[a, b] = w[a, 0] * rows[0, b] + w[a, 1] * rows[1, b] + w[a, 2] * rows[2, b]
        own, common = at_station[station[k]], coupled[station[k]]
        for a in range(2):
            for b in range(2):
                for i in range(3):
                    own[a, b] += j[i, a] * (w[i, 0] * j[0, b] + w[i, 1] * j[1, b] + w[i, 2] * j[2, b])
            here, x, y, z = common[a], j[0, a], j[1, a], j[2, a]
            for b in range(width + 1):
                here[at[b]] += x * weighed[0, b] + y * weighed[1, b] + z * weighed[2, b]
        for a in range(width):
            here, x, y, z = in_common[at[a]], rows[0, a], rows[1, a], rows[2, a]
            for b in range(a, width + 1):
                here[at[b]] += x * weighed[0, b] + y * weighed[1, b] + z * weighed[2, b]
    mirror_upper(in_common, right)


@kernel
def mirror_upper(matrix: Array, count: int) -> None:
    """Put what is above the diagonal below it too, in the first rows and columns."""
    for a in range(1, count):
        for b in range(a):
            matrix[a, b] = matrix[b, a]


@allocating_kernel
def add_right_sides(
    station: Places, tube: Places, make_up: Places, jacobians: Array, weights: Array, residuals: Array, extra: Array,
    gravity_at: int, of_direction: Array, of_common: Array,
) -> None:  # fmt: skip
    """Add the looks to the right sides of the normal equations alone, see ``add_looks``.

    Parameters
    ----------
    of_direction, of_common : (s + 1, 2 or more) and (p,), added to
    """
    count, size = extra.shape[2], len(of_common)
    pulled = np.empty(3)
    for k in range(len(station)):
        j, w, r = jacobians[k], weights[k], residuals[k]
        for i in range(3):
            pulled[i] = w[i, 0] * r[0] + w[i, 1] * r[1] + w[i, 2] * r[2]
        for a in range(2):
            of_direction[station[k], a] += j[0, a] * pulled[0] + j[1, a] * pulled[1] + j[2, a] * pulled[2]
        for a in range(6):
            total = j[0, 2 + a] * pulled[0] + j[1, 2 + a] * pulled[1] + j[2, 2 + a] * pulled[2]
            of_common[6 * tube[k] + a] += total
            if a == 5:
                of_common[gravity_at + 1 + make_up[k]] += total
        of_common[gravity_at] += j[0, 8] * pulled[0] + j[1, 8] * pulled[1] + j[2, 8] * pulled[2]
        for a in range(count):
            of_common[size - count + a] += (
                extra[k, 0, a] * pulled[0] + extra[k, 1, a] * pulled[1] + extra[k, 2, a] * pulled[2]
            )


@kernel
def take_step(
    station: Places, tube: Places, make_up: Places, jacobians: Array, residuals: Array, extra: Array, places: Places,
    gravity_at: int, states: Array, common: Array, left: Array,
) -> None:  # fmt: skip
    """Set what looks leave (n, 3) once the unknowns have gone a step.

    Parameters
    ----------
    station, tube, make_up, jacobians, residuals, extra, places, gravity_at : see ``add_looks``
    states, common : (s + 1, 2 or more) and (p,), the step of directions, and of what stations have in common
    """
    count, size = extra.shape[2], len(common)
    for k in range(len(station)):
        of_direction, own, turn = states[station[k]], places[tube[k]], common[gravity_at + 1 + make_up[k]]
        for i in range(3):
            j = jacobians[k, i]
            moved = j[0] * of_direction[0] + j[1] * of_direction[1] + j[7] * turn + j[8] * common[gravity_at]
            for a in range(6):
                moved += j[2 + a] * common[own[a]]
            for a in range(count):
                moved += extra[k, i, a] * common[size - count + a]
            left[k, i] = residuals[k, i] - moved
